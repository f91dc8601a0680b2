"""Layers whose absorbance is in the thousands: weights that underflow keep the layers' colours."""

import dataclasses

import gpu
import numpy as np
import pytest
from variants import EVERY, fills_coverage

import moit

COLOR = (0.2, 0.8, 0.3)
# Weights sum to what is covered, so that what is covered has the layers' colour.
NORMALIZED = [t for t in EVERY if fills_coverage(t) and t.engine == "core"]
# Half floats add thousands of thin layers up to too little, colours and weights each otherwise.
NORMALIZED = [t for t in NORMALIZED if t.kind != "wboit" or t.bits == 32]
# Those whose images are not those of all layers: a few of them, samples, or sums as they are.
OTHERS = ("weighted-sum", "depth-peeling", "adaptive", "dfa")
LAYERS = [(100, 0.5), (100, 0.999), (1000, 0.01), (1000, 0.99), (10_000, 0.01), (10_000, 0.999)]


def layers(n, alpha, colored=False, pixels=1, seed=3, **options) -> moit.Fragments:
    rng = np.random.default_rng(seed)
    many = n * pixels
    color = rng.random((many, 3)) if colored else np.tile(COLOR, (many, 1))
    return moit.Fragments(
        np.arange(pixels + 1) * n,
        rng.uniform(1, 100, many),
        np.full(many, alpha),
        color,
        **{"depth_range": (1, 100), "dtype": np.float32, **options},
    )


def of_all_layers(technique) -> bool:
    return technique.kind not in OTHERS


@pytest.mark.parametrize("technique", [t for t in NORMALIZED if of_all_layers(t)], ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_layers_of_one_colour_have_it(technique, dtype):
    for n, alpha in LAYERS:
        image = moit.composite(layers(n, alpha, dtype=dtype), technique)[0, 0]
        np.testing.assert_allclose(image[:3], np.array(COLOR) * image[3], rtol=2e-3, atol=1e-3)
        if not technique.random:
            covered = 1 - (1 - alpha) ** n
            assert image[3] == pytest.approx(covered, abs=0.02)


def words_of(technique, n, alpha) -> float:
    """What may become of the last bit of adaptive transparency's words: 50 of them, times .99, are
    halfway between two words, so that it hangs on the last digit of .99 at which one they stay; all
    layers behind are seen through it."""
    kept = isinstance(technique, moit.AdaptiveTransparency) and technique.quantized
    return n * alpha / 65535 if kept else 0.0


@pytest.mark.parametrize("technique", moit.techniques(), ids=str)
def test_single_precision_shows_what_double_does(technique):
    for n, alpha in LAYERS:
        for seed in range(3):
            f = layers(n, alpha, colored=True, seed=seed)
            single = moit.composite(f, technique, background=(0.5, 0.1, 0.9))
            double = moit.composite(f, technique, background=(0.5, 0.1, 0.9), dtype=np.float64)
            limit = max(1e-3, words_of(technique, n, alpha))
            np.testing.assert_allclose(single, double, atol=limit)


def test_weights_are_relative_to_the_greatest():
    """No weight is left even in double, and the nearest count most all the same."""
    for technique in (moit.PowerMoments(4, overestimation=1.0), moit.TrigonometricMoments(2)):
        for dtype in (np.float32, np.float64):
            f = layers(10_000, 0.999, dtype=dtype)
            red = np.where((f.depth < 10)[:, None], [1.0, 0, 0], [0, 0, 1.0])
            f = moit.Fragments(f.offsets, f.depth, f.alpha, red, depth_range=(1, 100), dtype=dtype)
            image = moit.composite(f, technique)[0, 0]
            assert image[0] > 0.9 and image[0] + image[2] == pytest.approx(1, abs=1e-5)


def test_pixels_beside_lost_ones_do_not_change():
    thick, thin = layers(3000, 0.99, colored=True), layers(12, 0.3, colored=True, pixels=40)
    both = moit.Fragments(
        np.concatenate([thin.offsets, [thin.offsets[-1] + 3000]]),
        *(np.concatenate([getattr(f, a) for f in (thin, thick)]) for a in ("depth", "alpha")),
        np.concatenate([thin.color, thick.color]),
        depth_range=(1, 100),
    )
    behind = np.random.default_rng(0).random((1, 41, 3))
    for technique in ("power4", "trig2", "fourier7", "wavelet8", "neural-bounded"):
        image = moit.composite(both, technique, background=behind)
        alone = moit.composite(thin, technique, background=behind[:, :40])
        np.testing.assert_array_equal(image[:, :40], alone)
        thicks = moit.composite(thick, technique, background=behind[:, 40:])
        np.testing.assert_array_equal(image[:, 40:], thicks)
        for threads in (1, 3):
            again = moit.composite(both, technique, background=behind, threads=threads)
            np.testing.assert_array_equal(again, image)


def test_opaque_surfaces_and_coloured_transmission_are_as_they_were():
    rng = np.random.default_rng(1)
    n = 2000
    depth = np.append(rng.uniform(1, 100, n), 50.0)
    alpha = np.append(np.full(n, 0.99), 1.0)
    color = np.append(np.tile(COLOR, (n, 1)), [[1, 0, 0]], axis=0)
    given = {"depth_range": (1, 100), "dtype": np.float32}
    f = moit.Fragments([0, n + 1], depth, alpha, color, **given)
    passed = np.append(rng.uniform(0, 0.5, (n, 3)), np.zeros((1, 3)), axis=0)
    tinted = moit.Fragments([0, n + 1], depth, alpha, color, transmission=passed, **given)
    for technique in ("power4", "trig2", "trig2-16", "fourier7", "fourier15", "neural-bounded"):
        image = moit.composite(f, technique)[0, 0]
        np.testing.assert_allclose(image, [*COLOR, 1], atol=1e-3)
        single, double = (moit.composite(tinted, technique, dtype=d) for d in ("f4", "f8"))
        np.testing.assert_allclose(single, double, atol=1e-3)
        assert single.min() > 0.05


def test_nothing_is_scaled_where_nothing_is_covered_or_nobody_asks():
    f = layers(5, 1e-30)
    image = moit.composite(f, "power4", background=(0.1, 0.2, 0.3))[0, 0]
    np.testing.assert_allclose(image, [0.1, 0.2, 0.3, 0], atol=1e-12)
    published = moit.composite(layers(1000, 0.999), "trig2(normalize=False)")[0, 0]
    assert published[:3].max() < 1e-6


@pytest.mark.parametrize("technique", [t for t in moit.techniques() if t.engine == "core"], ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_gpu_gives_the_core_s_bits(technique, dtype):
    gpu.needs_passes(technique)
    device = gpu.software_device()
    for n, alpha in ((400, 0.9), (1000, 0.999)):
        f = layers(n, alpha, colored=True, pixels=3, dtype=dtype)
        behind = np.random.default_rng(0).random((1, 3, 3))
        images = [
            moit.composite(f, technique, device=d, exact=True, background=behind)
            for d in ("cpu", device)
        ]
        np.testing.assert_allclose(*images, atol=1e-6)


OVERESTIMATED = [
    moit.PowerMoments(4, overestimation=1.0),
    moit.PowerMoments(8, overestimation=1.0, depth_range="pixel"),
    moit.TrigonometricMoments(2, overestimation=1.0, depth_range="pixel"),
    moit.TrigonometricMoments(4, overestimation=1.0, exclude_self=True),
    moit.MomentTransparency(storage="unorm16", interval="symmetric", overestimation=1.0),
    moit.MomentTransparency(storage="unorm16", resolution=2, overestimation=1.0),
]


@pytest.mark.parametrize("technique", OVERESTIMATED, ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_nor_does_it_where_double_underflows(technique, dtype):
    device = gpu.software_device()
    f = layers(1000, 1 - 1e-9, colored=True, pixels=3, dtype=dtype)
    thick = dataclasses.replace(technique, max_alpha=1 - 1e-7)
    images = [moit.composite(f, thick, device=d, exact=True) for d in ("cpu", device)]
    assert images[0][..., :3].min() > 0.01
    np.testing.assert_allclose(*images, atol=2e-6)
