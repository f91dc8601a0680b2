"""Light without opacity: what fragments emit beside alpha color."""

import deep_model
import numpy as np
import pytest
from gpu import needs_passes, software_device
from test_volumes import assert_close, expected_image, random_volumes
from variants import EVERY

import moit
from moit.catalog.technique import FACTS

CORE = [t for t in EVERY if t.engine == "core"]
# The phenomenological weight of what is opaque is at its limit, 3000, wherever it is.
WITH_DISTANCE = [str(t) for t in CORE if t.kind == "wboit" and t.weight != "phenomenological"]
BY_CHANNEL = [str(t) for t in moit.techniques() if FACTS.get(t.kind, {}).get("knows_channels")]


def glowing(seed, dtype=np.float32, opaque=0.1, transmission=False, pixels=60, most=6):
    """Surfaces at depths of their own, of which a third emit; some of those have alpha 0."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, pixels)
    n = int(counts.sum())
    alpha = rng.uniform(0.05, 0.95, n)
    emission = rng.uniform(0, 3, (n, 3)) * (rng.random(n) < 0.35)[:, None]
    alpha[rng.random(n) < opaque] = 1
    alpha[emission.any(axis=1) & (rng.random(n) < 0.5)] = 0
    passed = rng.random((n, 3)) * (alpha < 1)[:, None]
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        rng.permutation(n) / 7 + 1.0,
        alpha,
        rng.uniform(0, 1, (n, 3)),
        emission=emission,
        transmission=passed if transmission else None,
        dtype=dtype,
        shape=(pixels // 10, 10),
    )


def unlit(f):
    return moit.Fragments(
        f.offsets, f.depth, f.alpha, f.color, transmission=f.transmission, shape=f.shape
    )


@pytest.mark.parametrize("technique", CORE, ids=str)
def test_every_technique_adds_it_with_its_transmittance_in_front(technique):
    if technique.kind == "wboit":
        pytest.skip("has a rule of its own: see below")
    f = glowing(0, np.float64, opaque=0.0)
    T = np.clip(moit.transmittance(f, technique), 0, 1)
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    added = np.zeros((len(f.counts), 3))
    np.add.at(added, pixel, T[:, None] * f.emission)
    image, dark = moit.composite(f, technique), moit.composite(unlit(f), technique)
    np.testing.assert_allclose(
        image[..., :3], dark[..., :3] + added.reshape(*f.shape, 3), rtol=1e-13, atol=1e-13
    )
    assert np.array_equal(image[..., 3], dark[..., 3])
    assert added.max() > 1


@pytest.mark.parametrize("transmission", [False, True])
@pytest.mark.parametrize("cull", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_the_exact_picture_is_the_documents(seed, cull, transmission):
    f = glowing(seed, np.float64, transmission=transmission)
    image = moit.composite(f, "sorted", cull_opaque=cull)
    assert_close(image, expected_image(f), 1e-13)
    single = moit.composite(f, "sorted", dtype=np.float32, cull_opaque=cull)
    assert_close(single, expected_image(f), 2e-6)


@pytest.mark.parametrize("name", BY_CHANNEL)
def test_channels_dim_it_as_the_technique_has_them(name):
    """One channel alone, its opacities in place of alpha, gives that channel's picture."""
    f = glowing(4, np.float64, transmission=True, opaque=0.1)
    image = moit.composite(f, name, cull_opaque=False)
    for c in range(3):
        opacity = f.alpha * (1 - f.transmission[:, c])
        light = f.emission + f.alpha[:, None] * f.color  # whatever dims
        alone = moit.Fragments(
            f.offsets, f.depth, opacity, np.zeros_like(f.color), emission=light, shape=f.shape
        )
        expected = moit.composite(alone, name, cull_opaque=False)[..., c]
        if name == "depth-peeling4":  # what no pass draws is not seen of colour
            few = (f.counts <= 4).reshape(f.shape)
            np.testing.assert_allclose(image[..., c][few], expected[few], atol=1e-13)
        else:
            np.testing.assert_allclose(image[..., c], expected, atol=1e-13)


@pytest.mark.parametrize("technique", moit.techniques(), ids=str)
def test_a_gpu_adds_the_same_bits(technique):
    needs_passes(technique)
    if technique.engine != "core":
        pytest.skip("chooses anew")
    f = glowing(5)
    image = moit.composite(f, technique, device=software_device(), exact=True)
    assert np.array_equal(image, moit.composite(f, technique))
    if technique.supports_transmission:
        f = glowing(6, transmission=True)
        image = moit.composite(f, technique, device=software_device(), exact=True)
        assert np.array_equal(image, moit.composite(f, technique))


@pytest.mark.parametrize("cull", [True, False])
@pytest.mark.parametrize("technique", CORE, ids=str)
def test_what_opaque_surfaces_emit_is_a_part_of_their_colour(technique, cull):
    f = glowing(7, opaque=0.4)
    emission = f.emission * (f.alpha == 1)[:, None]
    f = moit.Fragments(f.offsets, f.depth, f.alpha, f.color, emission=emission, shape=f.shape)
    g = moit.Fragments(f.offsets, f.depth, f.alpha, f.color + emission, shape=f.shape)
    assert np.array_equal(
        moit.composite(f, technique, cull_opaque=cull),
        moit.composite(g, technique, cull_opaque=cull),
    )
    assert emission.any()


def test_what_is_behind_opaque_surfaces_is_not_seen():
    f = moit.Fragments(
        [0, 2], [1.0, 2.0], [1.0, 0.0], np.zeros((2, 3)), emission=[[0, 0, 0], [5, 5, 5]]
    )
    for technique in CORE:
        assert moit.composite(f, technique)[0, 0].tolist() == [0, 0, 0, 1], str(technique)


def test_light_alone_is_added_whole():
    f = moit.Fragments(
        [0, 2], [1.0, 2.0], [0.0, 0.0], np.zeros((2, 3)), emission=[[1, 2, 3], [0.5, 0, -1]]
    )
    for technique in CORE:
        np.testing.assert_allclose(
            moit.composite(f, technique, background=(1, 1, 1))[0, 0],
            [2.5, 3, 3, 0],
            rtol=1e-6,
            atol=1e-6,
            err_msg=str(technique),
        )


def test_weighted_blending_weighs_light_as_opaque_surfaces():
    f = glowing(8, np.float64, opaque=0.0)
    technique = moit.technique("wboit-eq8")
    image, dark = moit.composite(f, technique), moit.composite(unlit(f), technique)
    far = (f.depth / 200) ** 6
    weight = np.clip(10 / (1e-5 + (f.depth / 10) ** 3 + far), 1e-2, 3e3)  # alpha is 1
    for pixel in range(len(f.counts)):
        own = slice(f.offsets[pixel], f.offsets[pixel + 1])
        alpha, w = f.alpha[own], weight[own]
        covered = 1 - np.prod(1 - alpha)
        T = w * covered / (alpha @ w) if covered > 0 else np.ones(len(w))
        light = np.minimum(T, 1) @ f.emission[own]
        y, x = divmod(pixel, f.shape[1])
        np.testing.assert_allclose(image[y, x, :3] - dark[y, x, :3], light, atol=1e-12)


@pytest.mark.parametrize("name", WITH_DISTANCE)
def test_weighted_blending_shows_light_in_front_whole_and_dims_it_behind(name):
    seen = []
    for depth in (1.0, 30.0):
        f = moit.Fragments(
            [0, 2],
            [depth, 5.0],
            [0.0, 0.5],
            np.zeros((2, 3)),
            emission=[[1, 1, 1], [0, 0, 0]],
            depth_range=(1, 40),
        )
        seen.append(moit.composite(f, moit.technique(name))[0, 0, 0])
    assert seen[0] > 0.99 and seen[1] < 0.6 and seen[0] > seen[1]


def test_no_weight_makes_light_brighter_than_it_is():
    """Weighted blending gives near fragments weights above 1, and scales their colours back."""
    f = moit.Fragments(
        [0, 3],
        [1.0, 50.0, 90.0],
        [0.0, 0.5, 0.5],
        np.zeros((3, 3)),
        emission=[[1, 1, 1], [0, 0, 0], [0, 0, 0]],
    )
    assert moit.transmittance(f, "wboit").max() > 1
    for technique in CORE:
        assert moit.composite(f, technique)[0, 0, 0] <= 1, str(technique)


def test_glowing_volumes_are_dimmed_by_themselves():
    """A medium that emits evenly is seen through its own half: the document's w."""
    f = moit.Fragments(
        [0, 2],
        [1.0, 1.0],
        [0.0, 0.75],
        np.zeros((2, 3)),
        back=[3.0, 3.0],
        emission=[[1, 0, 0], [0, 0, 0]],
    )
    expected = 0.75 / -np.log(0.25)
    assert abs(moit.composite(f, "sorted")[0, 0, 0] - expected) < 1e-6
    halves = moit.Fragments(
        [0, 2], [1.0, 2.0], [0.0, 0.0], np.zeros((2, 3)), emission=f.emission, back=[2.0, 5.0]
    )
    assert moit.composite(halves, "sorted")[0, 0].tolist() == [1, 0, 0, 0]


@pytest.mark.parametrize("seed", range(3))
def test_glowing_media_are_the_documents(seed):
    f = random_volumes(seed, dtype=np.float64, emission=True)
    assert_close(moit.composite(f.tidy(), "sorted"), expected_image(f), 1e-12)
    light = deep_model.flattened(deep_model.samples_of(f, 3))[0]
    assert np.isfinite(light).all()


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"emission": [[1, 1, 1]], "color": None}, "emission: without color"),
        ({"emission": [1, 1, 1]}, r"emission must be \(1, 3\); got \(3,\)"),
        ({"emission": [[1, np.nan, 1]]}, r"emission\[0, 1\]: found nan; needed a finite"),
        ({"emission": [[1, np.inf, 1]]}, r"emission\[0, 1\]: found inf; needed a finite"),
        ({"back": [1.5]}, r"back\[0\]: found 1.5; needed at least depth, 2.0"),
        ({"back": [np.inf]}, r"back\[0\]: found inf; needed a finite"),
        ({"back": [np.nan]}, r"back\[0\]: found nan; needed a finite"),
        ({"back": [3.0], "depth_range": (1, 2.5)}, r"back\[0\]: found 3.0; needed a depth within"),
        ({"back": [[3.0]]}, r"back must be \(1,\); got \(1, 1\)"),
    ],
)
def test_what_cannot_be_is_refused(arguments, message):
    arguments = {"color": [[1, 1, 1]]} | arguments
    color = arguments.pop("color")
    with pytest.raises(moit.FragmentsError, match=message):
        moit.Fragments([0, 1], [2.0], [0.5], color, **arguments)


@pytest.mark.parametrize("name", WITH_DISTANCE)
def test_where_nothing_is_nothing_is_lit(name):
    none = np.zeros((0, 3))
    f = moit.Fragments([0, 0], [], [], none, emission=none, depth_range=(1, 2))
    image = moit.composite(f, name, background=(0.5, 0.25, 1))
    assert (image == np.float32([0.5, 0.25, 1, 0])).all()
