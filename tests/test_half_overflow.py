"""Sums beyond 65504, the largest half float: a warning says in how many pixels."""

import re
import warnings

import gpu
import numpy as np
import pytest

import moit

BRIGHT = 1e5
TECHNIQUES = [
    "wboit(bits=16)",
    "wboit-eq7(bits=16)",
    "mlab4",
    "mlab2",
    "dfa",
]
# Totals that are gathered as they are, and stored in half floats: more than 65504 / 6.24 layers.
# Sums that are rounded at every fragment stop growing before.
TOTALS = ["moment-transparency-nlqm", "moment-transparency(storage='unorm16')"]
ROUNDED = ["fourier7", "power4-16", "trig3-16", "wavelet8(bits=16)"]


def pixels(bright: float, at: int, count: int = 7, layers: int = 4) -> moit.Fragments:
    """Some pixels of which `at` have colours of that brightness."""
    rng = np.random.default_rng(0)
    n = count * layers
    color = rng.random((n, 3))
    color[: at * layers, 1] = bright
    return moit.Fragments(
        np.arange(count + 1) * layers,
        np.tile(rng.uniform(2, 9, layers), count),
        np.full(n, 0.8),
        color,
        depth_range=(1, 10),
        dtype=np.float32,
    )


def thick(layers: int) -> moit.Fragments:
    return moit.Fragments(
        [0, layers, layers + 2],
        np.linspace(1, 100, layers + 2),
        np.full(layers + 2, 0.9999),
        np.full((layers + 2, 3), 0.5),
        dtype=np.float32,
    )


def warned(call) -> list[int]:
    """The numbers of pixels that warnings of a call tell."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        call()
    texts = [str(w.message) for w in found if issubclass(w.category, RuntimeWarning)]
    return [int(re.match(r"technique: (\d+) pixels keep sums beyond", t)[1]) for t in texts]


@pytest.mark.parametrize("name", TECHNIQUES)
@pytest.mark.parametrize("on", ["cpu", "gpu"])
def test_each_call_says_once_in_how_many_pixels(name, on):
    device = gpu.software_device() if on == "gpu" else "cpu"
    for at in (0, 1, 5):
        f = pixels(BRIGHT * 100, at)
        for _ in range(2):
            assert warned(lambda f=f: moit.composite(f, name, device=device, exact=True)) == [
                at
            ] * bool(at)
    assert warned(lambda: moit.composite(pixels(1.0, 7), name, device=device, exact=True)) == []
    few = warned(
        lambda: moit.composite(pixels(BRIGHT * 100, 3), name, device=device, exact=True, threads=2)
    )
    assert few == [3]


@pytest.mark.parametrize("name", TOTALS)
def test_so_do_totals(name):
    assert warned(lambda: moit.composite(thick(12_000), name)) == [1]
    assert warned(lambda: moit.composite(thick(5_000), name)) == []


@pytest.mark.parametrize("name", ROUNDED)
def test_rounded_totals_stop_growing_before(name):
    assert warned(lambda: moit.composite(thick(12_000), name)) == []


@pytest.mark.parametrize("name", ["wboit", "power4", "mlab4(quantized=False)", "sorted"])
def test_what_stores_floats_says_nothing(name):
    assert warned(lambda: moit.composite(pixels(BRIGHT * 100, 5), name)) == []


def test_the_line_that_called_is_named():
    with pytest.warns(RuntimeWarning, match="1 pixels keep sums beyond 65504") as found:
        moit.composite(pixels(BRIGHT * 100, 1), "mlab4")
    assert found[0].filename == __file__


def test_answers_are_what_they_were_and_finite():
    f = pixels(BRIGHT * 100, 2)
    for name in TECHNIQUES:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image = moit.composite(f, name)
        assert np.isfinite(image).all() and image[..., 3].min() >= 0


def test_a_gpu_s_targets_say_so_too():
    """Published targets: near panes weigh up to 3000, and colours may be bright."""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    panes = [
        moit.Mesh(
            corners + np.array([0, 0, z]), [[0, 1, 2], [0, 2, 3]], color=(0.5, bright, 1), alpha=0.5
        )
        for z, bright in ((0.0, 1e4), (0.3, 1.0), (0.6, 1.0))
    ]
    device = gpu.software_device()
    size = (12, 9)
    for technique, target, says in (
        ("wboit", "rgba16f", True),
        ("wboit", "rgba32f", False),
        ("weighted-sum", "rgba16f", False),
    ):
        made = []
        found = warned(
            lambda t=technique, g=target, m=made: m.append(
                moit.render(panes, t, size, device=device, exact=True, target=g, report=True)
            )
        )
        assert bool(found) == says and np.isfinite(made[0].image).all()
        assert made[0].image[..., 3].min() >= 0
        if says:
            assert found == [made[0].overflows] and 0 < found[0] <= 12 * 9


def test_a_gpu_s_pictures_of_thick_fog_are_not_black():
    """Weights that half floats lose: the core composites, and says why."""
    corners = np.array([[-9.0, -9, 0], [9, -9, 0], [0, 18, 0]])
    count = 200
    fog = moit.Mesh(
        np.concatenate([corners + np.array([0, 0, 0.01 * i]) for i in range(count)]),
        np.arange(3 * count).reshape(-1, 3),
        color=(0.2, 0.8, 0.3),
        alpha=0.99,
    )
    device = gpu.software_device()
    technique = moit.PowerMoments(4, overestimation=1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        image = moit.render(fog, technique, (8, 6), device=device, exact=True)
        expected = moit.render(fog, technique, (8, 6))
    assert image[..., :3].max() > 0.05
    np.testing.assert_allclose(image, expected, atol=2e-2)
