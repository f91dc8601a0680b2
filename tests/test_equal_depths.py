"""The rule for fragments of one depth, `Technique.ties`, of every technique, on CPU and GPU."""

import gpu
import numpy as np
import pytest
from variants import EVERY, leaves_nothing

import moit
from moit.catalog.technique import FACTS

# Sums as they are, whatever the depths: these may be brighter than anything there is.
ADDING = [t for t in EVERY if t.kind != "adaptive" and not leaves_nothing(t)]
ADDING += [t for t in EVERY if t.kind == "weighted-sum" and not t.normalize]
# Of the published targets' sums each stops growing at another: tests/test_half_overflow.py.
HALF = [t for t in EVERY if t.kind == "wboit" and t.bits == 16]
BOUNDED = [t for t in EVERY if t not in [*ADDING, *HALF]]
CATALOG = [t for t in moit.techniques() if t in BOUNDED]
# Half floats round each colour by itself, and a byte what is let through.
ROUNDING = 3e-3

each = pytest.mark.parametrize("technique", BOUNDED, ids=str)


def clusters(at, alphas, colors, dtype=np.float32, depth_range=(1, 10)) -> moit.Fragments:
    """A pixel of fragments at the depths `at`, in this order."""
    n = len(at)
    return moit.Fragments(
        [0, n], at, np.broadcast_to(alphas, n), colors, depth_range=depth_range, dtype=dtype
    )


def tied(seed: int, n: int, alpha: float, depths: int, dtype=np.float32) -> moit.Fragments:
    rng = np.random.default_rng(seed)
    at = rng.choice(np.linspace(2, 9, depths), n)
    return clusters(at, alpha, rng.random((n, 3)), dtype)


def many() -> list[moit.Fragments]:
    found = []
    for seed, n in enumerate((1, 2, 3, 8, 40, 500)):
        for alpha in (0.01, 0.5, 0.999):
            for depths in (1, 2, 3):
                found.append(tied(seed, n, alpha, depths))
    rng = np.random.default_rng(99)
    for n in (4, 16):
        for _ in range(8):
            at, alpha = rng.choice([2.0, 3.0, 3.0001, 8.0], n), rng.random(n)
            found.append(clusters(at, alpha, rng.random((n, 3)) * [1, 5, 0.01]))
    one_color = np.tile([0.2, 0.8, 0.3], (5000, 1))
    found += [clusters(np.full(5000, 3.0), 0.01, one_color)]
    return found


def brightness(f: moit.Fragments, image) -> float:
    """How far the picture is beyond the brightest of its fragments, over what it covers."""
    covered, most = image[0, 0, 3], f.color.max(axis=0)
    return float((image[0, 0, :3] / np.maximum(most, 1e-6) - covered).max())


@each
def test_no_picture_is_brighter_than_the_brightest_of_its_fragments(technique):
    for f in many():
        image = moit.composite(f, technique)
        assert brightness(f, image) <= ROUNDING * max(image[0, 0, 3], 0.1)
        # over what is bright, too
        bright = moit.composite(f, technique, background=f.color.max(axis=0).astype(float))
        assert (bright[0, 0, :3] <= f.color.max(axis=0) * (1 + ROUNDING)).all()


@pytest.mark.parametrize("technique", CATALOG, ids=str)
def test_nor_on_a_gpu(technique):
    gpu.needs_passes(technique)
    device = gpu.software_device()
    for f in many()[::13]:
        image = moit.composite(f, technique, device=device, exact=True)
        assert brightness(f, image) <= ROUNDING * max(image[0, 0, 3], 0.1)
        np.testing.assert_allclose(image, moit.composite(f, technique), atol=1e-6, rtol=1e-6)


@pytest.mark.parametrize("technique", ADDING, ids=str)
def test_what_adds_up_whatever_there_is_adds_equal_depths_as_others(technique):
    """No brighter than with all fragments where the nearest is, each hidden by none."""
    for f in many():
        image = moit.composite(f, technique)
        seen = (f.alpha[:, None] * f.color).sum(axis=0)
        assert np.isfinite(image).all()
        if technique.kind == "weighted-sum":
            np.testing.assert_allclose(image[0, 0, :3], seen, rtol=1e-4)
        elif not technique.random and getattr(technique, "bits", 32) != 16:
            assert (image[0, 0, :3] <= seen * 1.01 + 1e-6).all()


@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_the_rule_is_that_of_the_table(technique):
    if technique.engine != "core":
        assert technique.ties == "chosen"
        return
    assert technique.ties == FACTS[technique.kind]["ties"]


@pytest.mark.parametrize("technique", [t for t in CATALOG if t.ties == "together"], ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_together_they_count_by_their_alpha_in_any_order(technique, dtype):
    rng = np.random.default_rng(7)
    for n in (2, 3, 4, 9):
        alpha, color = rng.uniform(0.2, 0.7, n), rng.random((n, 3))
        images = []
        for _ in range(3):
            order = rng.permutation(n)
            f = clusters(np.full(n, 3.0), alpha[order], color[order], dtype)
            images.append(moit.composite(f, technique)[0, 0])
        for image in images:
            np.testing.assert_allclose(image, images[0], atol=4e-3)
            if technique.kind in ("neural-bounded", "wboit") or technique.excludes_self:
                continue  # each one's own opacity is known, and weights may hang on it
            mean = (alpha @ color) / alpha.sum()
            np.testing.assert_allclose(image[:3], mean * image[3], atol=4e-3)


@pytest.mark.parametrize("technique", [t for t in CATALOG if t.ties == "earlier"], ids=str)
def test_the_earlier_is_in_front(technique):
    """As if they lay one behind the other in the order of their arrival, as far as they are kept as
    they are: the rest is summed up."""
    rng = np.random.default_rng(8)
    for n in (2, 3, 4):
        kept = min(n, getattr(technique, "layers", n))
        alpha, color = rng.uniform(0.2, 0.7, n), rng.random((n, 3))
        one = clusters(np.full(n, 3.0), alpha, color)
        apart = clusters(3 + 1e-3 * np.minimum(np.arange(n), kept), alpha, color)
        if technique.random:  # the first to pass is what is seen
            image = moit.composite(one, technique)[0, 0]
            T = moit.transmittance(one, technique)
            assert image[3] in (0, 1) and T[0] == 1
            continue
        np.testing.assert_allclose(
            moit.composite(one, technique), moit.composite(apart, technique), atol=5e-3
        )
        T = [moit.transmittance(f, technique)[:kept] for f in (one, apart)]
        np.testing.assert_allclose(*T, atol=5e-3)


@pytest.mark.parametrize("technique", [t for t in CATALOG if t.ties == "later"], ids=str)
def test_the_later_is_in_front(technique):
    rng = np.random.default_rng(9)
    for n in (2, 3, 4):
        alpha, color = rng.uniform(0.2, 0.7, n), rng.random((n, 3))
        one = clusters(np.full(n, 3.0), alpha, color)
        apart = clusters(3 - 1e-3 * np.arange(n), alpha, color)
        np.testing.assert_allclose(
            moit.composite(one, technique), moit.composite(apart, technique), atol=5e-3
        )


def test_steps_of_distinct_depths_are_not_scaled():
    """Adaptive transparency is scaled for ties alone: up to its nodes it is exact."""
    rng = np.random.default_rng(10)
    for _ in range(200):
        n = rng.integers(1, 5)
        f = clusters(np.sort(rng.uniform(2, 9, n)), rng.random(n), rng.random((n, 3)))
        for name in ("adaptive4", "adaptive4(quantized=False)"):
            exact = moit.composite(f, "sorted")
            np.testing.assert_allclose(moit.composite(f, name), exact, atol=6e-5)
