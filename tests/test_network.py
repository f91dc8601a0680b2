"""Networks: what files hold, what is refused, and what a forward pass gives."""

import dataclasses
import itertools
import os
import pickle
import zipfile

import numpy as np
import pytest

import moit
from moit import Network, _core
from moit.catalog.network import KINDS, SIZES, NetworkError

kinds = pytest.mark.parametrize("kind", KINDS)


def random_network(kind: str = "neural-bounded", seed: int = 0, **told) -> Network:
    r = np.random.default_rng(seed)
    sizes = SIZES[kind]
    weights = [r.normal(0, 0.5, (o, i)) for i, o in itertools.pairwise(sizes)]
    biases = [r.normal(0, 0.5, o) for o in sizes[1:]]
    mean, scale = r.normal(0, 1, sizes[0]), r.uniform(0.1, 3, sizes[0])
    return Network(kind, weights, biases, mean, scale, **told)


def arrays_of(path) -> dict:
    with np.load(path) as file:
        return dict(file)


@kinds
def test_a_file_gives_back_all_of_a_network(kind, tmp_path):
    told = {"recipe": {"epochs": 3, "data": ["A", "B"]}, "data_hash": "ab", "scores": {"A": 0.25}}
    network = random_network(kind, **told)
    path = tmp_path / "n.npz"
    network.write(path)
    found = Network.read(path)
    assert found == network and hash(found) == hash(network)
    assert (found.recipe, found.data_hash, found.scores) == tuple(told.values())
    for ours, theirs in zip(network.weights, found.weights, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(network.packed(), found.packed())
    assert os.listdir(tmp_path) == ["n.npz"]


@kinds
def test_packed_weights_take_features_as_they_are(kind):
    network = random_network(kind, 1)
    x = np.random.default_rng(2).normal(0, 2, (50, network.sizes[0]))
    y, at, packed = x, 0, network.packed().astype(np.float64)
    layers = len(network.sizes) - 1
    for i, (inputs, outputs) in enumerate(itertools.pairwise(network.sizes)):
        layer = packed[at : at + outputs * (inputs + 1)].reshape(outputs, inputs + 1)
        at += layer.size
        y = y @ layer[:, :-1].T + layer[:, -1]
        y = y if i == layers - 1 else np.maximum(y, 0)
    assert at == packed.size == network.packed().size
    # weights of the first layer are rounded once more to float32, sums are of some ten terms
    np.testing.assert_allclose(y, network.forward(x), atol=2e-5)


def test_a_forward_pass_is_two_layers_of_relu():
    network = random_network(seed=3)
    x = np.random.default_rng(4).normal(0, 1, (7, 8))
    expected = np.empty((7, 1))
    for n in range(7):
        values = [(x[n, k] - network.mean[k]) / network.scale[k] for k in range(8)]
        for i in range(3):
            sums = [
                float(network.biases[i][j])
                + sum(float(network.weights[i][j, k]) * v for k, v in enumerate(values))
                for j in range(len(network.biases[i]))
            ]
            values = sums if i == 2 else [max(v, 0.0) for v in sums]
        expected[n] = values
    np.testing.assert_allclose(network.forward(x), expected, rtol=1e-12)
    with pytest.raises(ValueError, match=r"features: expected \(N, 8\), got \(7, 7\)"):
        network.forward(x[:, :7])


def test_equality_is_of_what_answers_hang_on():
    one = random_network(seed=5)
    assert dataclasses.replace(one, recipe={"a": 1}, scores={"b": 2}) == one
    assert dataclasses.replace(one, mean=one.mean + 1e-9) != one
    assert random_network(seed=6) != one
    assert pickle.loads(pickle.dumps(one)) == one
    assert len({one, dataclasses.replace(one), random_network(seed=6)}) == 2


def test_arrays_are_held_read_only():
    weights = [np.zeros((8, 8)), np.zeros((8, 8)), np.zeros((1, 8))]
    network = Network("neural-bounded", weights, [np.zeros(8), np.zeros(8), np.zeros(1)])
    weights[0][:] = 9
    assert (network.packed() == 0).all()
    for array in (*network.weights, *network.biases, network.mean, network.scale, network.packed()):
        with pytest.raises(ValueError):
            array[...] = 1


NAN = np.full((8, 8), np.nan)
EIGHTS = ([np.zeros((8, 8)), np.zeros((8, 8)), np.zeros((1, 8))], [np.zeros(8)] * 2 + [np.zeros(1)])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kind": "power4"}, "kind: expected 'neural'"),
        ({"kind": "neural"}, r"weights\[0\]: expected shape \(32, 7\), got \(8, 8\)"),
        ({"weights": EIGHTS[0][:2]}, "weights: neural-bounded needs a sequence of 3 arrays, got 2"),
        ({"weights": 3}, "weights: .* got int"),
        ({"biases": EIGHTS[1][::-1]}, r"biases\[0\]: expected shape \(8,\), got \(1,\)"),
        ({"weights": [EIGHTS[0][0], NAN, EIGHTS[0][2]]}, r"weights\[1\]\[0, 0\]: found nan"),
        ({"weights": [EIGHTS[0][0] + 1e39, *EIGHTS[0][1:]]}, r"weights\[0\]\[0, 0\]: found 1e\+39"),
        ({"weights": [EIGHTS[0][0] + 1j, *EIGHTS[0][1:]]}, "real numbers, got complex128"),
        ({"mean": np.zeros(7)}, r"mean: expected shape \(8,\)"),
        ({"scale": np.arange(8.0)}, r"scale\[0\]: found 0.0; needed a positive number"),
        ({"weights": [EIGHTS[0][0] + 1, *EIGHTS[0][1:]], "scale": np.full(8, 1e-40)}, "scale: so"),
        ({"recipe": {"a": np.zeros(3)}}, "recipe: needed a dict that JSON can hold"),
        ({"scores": 3}, "scores: needed a dict"),
        ({"data_hash": 3}, "data_hash: expected text, got int"),
    ],
)
def test_what_does_not_fit_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        Network(**{"kind": "neural-bounded", "weights": EIGHTS[0], "biases": EIGHTS[1], **changes})


@kinds
def test_weights_whose_sums_no_float_holds_are_refused(kind):
    small = random_network(kind)
    for layer, one in enumerate(small.weights):
        weights = list(small.weights)
        weights[layer] = np.full_like(one, 1e9)
        moit.Network(kind, weights, small.biases)
        weights[layer] = np.full_like(one, -3e38)
        with pytest.raises(NetworkError, match="weights: so large that sums"):
            moit.Network(kind, weights, small.biases)
    with pytest.raises(NetworkError, match="weights: so large that sums"):  # none alone is
        moit.Network(kind, [np.full_like(one, 1e20) for one in small.weights], small.biases)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"version": None}, "there is no 'version' in it"),
        ({"version": np.int64(2)}, "version: expected 1, got"),
        ({"version": np.ones(2, int)}, "version: expected 1, got"),
        ({"kind": np.array("power4")}, "kind: expected 'neural'"),
        ({"weights1": None}, "there is no 'weights1' in it"),
        ({"weights1": np.zeros((8, 7), np.float32)}, r"weights\[1\]: expected shape \(8, 8\)"),
        ({"bias2": np.full(1, np.inf, np.float32)}, r"biases\[2\]\[0\]: found inf"),
        ({"mean": np.array(["x"] * 8)}, "mean: expected real numbers"),
        ({"mean": np.array([{}] * 8, dtype=object)}, "not a readable network"),
        ({"told": None}, "there is no 'told'"),
        ({"told": np.array("[]")}, "told: needed recipe and scores"),
        ({"told": np.array("{")}, "n.npz"),
    ],
)
def test_a_file_that_holds_something_else_is_refused(changes, words, tmp_path):
    path = tmp_path / "n.npz"
    random_network().write(path)
    arrays = {k: v for k, v in {**arrays_of(path), **changes}.items() if v is not None}
    np.savez(path, **arrays)
    with pytest.raises(NetworkError, match=words):
        Network.read(path)
    with pytest.raises(NetworkError, match=f"network: .*{words}"):
        moit.BoundedNeural(network=path)


def test_damaged_files_are_refused_and_missing_ones_not_found(tmp_path):
    path = tmp_path / "n.npz"
    random_network().write(path)
    whole = path.read_bytes()
    for bytes_left in (0, 10, len(whole) // 2, len(whole) - 30):
        path.write_bytes(whole[:bytes_left])
        with pytest.raises(NetworkError, match="not a readable network"):
            Network.read(path)
    path.write_bytes(b"not a zip file")
    with pytest.raises(moit.MoitError, match="not a readable"):
        Network.read(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("weights0.npy", bytes(1 << 25))
    with pytest.raises(NetworkError, match="33554432 bytes"):
        Network.read(path)
    with pytest.raises(FileNotFoundError):
        Network.read(tmp_path / "none.npz")
    with pytest.raises(FileNotFoundError, match="network"):
        moit.BoundedNeural(network=tmp_path / "none.npz")
    with pytest.raises(TypeError, match="network: expected str"):
        moit.BoundedNeural(network=3)


def test_a_failed_write_leaves_the_file_there_was(tmp_path, monkeypatch):
    path = tmp_path / "n.npz"
    random_network().write(path)
    before = path.read_bytes()

    def broken(*args, **kwargs):
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez", broken)
    with pytest.raises(OSError, match="disk full"):
        random_network(seed=1).write(path)
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["n.npz"]


def test_a_technique_reads_its_file_again_when_that_has_changed(tmp_path):
    path = tmp_path / "n.npz"
    f = moit.scenes.load("cloud", size=(6, 5))
    random_network(seed=1).write(path)
    first = moit.transmittance(f, moit.BoundedNeural(network=path))
    random_network(seed=2).write(path)
    os.utime(path, ns=(1, 1))
    second = moit.transmittance(f, moit.BoundedNeural(network=path))
    assert (
        second == moit.transmittance(f, moit.BoundedNeural(network=random_network(seed=2)))
    ).all()
    assert (first != second).any()


def test_names_of_techniques_hold_paths_but_no_networks(tmp_path):
    path = tmp_path / "a 'b' (c).npz"
    random_network("neural-bounded6").write(path)
    technique = moit.BoundedNeural("power6", path, warp="linear")
    assert str(technique) == f"neural-bounded6(network={str(path)!r},warp='linear')"
    assert moit.technique(str(technique)) == technique
    held = moit.BoundedNeural(network=random_network())
    assert str(held).startswith("neural-bounded(network=Network('neural-bounded'")
    with pytest.raises(ValueError, match="network: one in memory cannot be read back"):
        moit.technique(str(held))
    assert moit.BoundedNeural(network=random_network()) == held
    assert moit.BoundedNeural(network=random_network(seed=1)) != held
    assert len({held, moit.BoundedNeural(network=random_network())}) == 1


def test_a_network_of_another_kind_is_refused():
    with pytest.raises(ValueError, match="expected one of kind 'neural-bounded6', got 'neural-b"):
        moit.BoundedNeural("power6", random_network())


@pytest.mark.parametrize("name", ["neural", "dfa", "neural-bounded", "neural-bounded6"])
@pytest.mark.parametrize("more", [-1, 1, 100])
def test_the_core_takes_as_many_weights_as_a_network_has(name, more):
    f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], np.ones((2, 3)))
    fields = moit.technique(name).fields_for(f)
    _core.composite(f, fields, True, 1, np.zeros(3))
    fields["network"] = np.resize(fields["network"], len(fields["network"]) + more)
    with pytest.raises(ValueError, match=r"network: .* needs \d+ weights, got \d+"):
        _core.composite(f, fields, True, 1, np.zeros(3))


@pytest.mark.parametrize("kind", ["neural-bounded", "neural-bounded6", "strong", "neural-slices"])
def test_networks_come_with_moit(kind):
    shipped = Network.shipped(kind)
    assert shipped.kind == kind and shipped.packed().size in (153, 169)
    assert Network.shipped(kind) is shipped


def test_only_known_kinds_come_with_moit():
    with pytest.raises(ValueError, match="kind: expected"):
        Network.shipped("power4")
