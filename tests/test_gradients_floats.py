"""Pictures and transmittances of float32 go back through two and four power moments in floats:
derivatives are those of double, but for what floats round off."""

import dataclasses

import numpy as np
import pytest

import moit
from moit import gradients

NAMES = (
    "power2(warp='none')",
    "power4(warp='none')",
    "power4(warp='none', exclude_self=True)",
    "power4(warp='linear', normalize=False, overestimation=0.5)",
)


def rays(longest, warped):
    """Of no, few and many fragments, some next to one another, some behind an opaque surface; and
    one of so many that are not opaque, which may be more than a block of lanes holds."""
    rng = np.random.default_rng(5)
    counts = np.concatenate([rng.integers(0, 30, 60), rng.integers(0, 4, 90), [longest, 3, 0]])
    n = counts.sum()
    depth, alpha = rng.uniform(-1, 1, n), rng.uniform(0.02, 0.9, n)
    close = rng.uniform(size=n) < 0.2
    depth[1:][close[1:]] = np.clip(depth[:-1] + 3e-4, -1, 1)[close[1:]]
    alpha[: n - longest - 3][rng.uniform(size=n - longest - 3) < 0.02] = 1
    arrays = (3 + 2 * depth if warped else depth, alpha, rng.uniform(0, 1, (n, 3)))
    return np.concatenate([[0], np.cumsum(counts)]), [one.astype(np.float32) for one in arrays]


def both(name, question, longest=40, **given):
    """Offsets, and what float32 and float64 say."""
    warped = "none" not in name
    offsets, arrays = rays(longest, warped)
    technique = moit.technique(name)
    technique = dataclasses.replace(technique, bias=technique.bias_for(np.float32))
    found = []
    for dtype in ("float32", "float64"):
        extent = (1, 5) if warped else (-1, 1)
        f = moit.Fragments(offsets, *arrays, depth_range=extent, dtype=dtype)
        answer, pullback = getattr(gradients, question)(f, technique, **given)
        seed = np.random.default_rng(6).normal(size=answer.shape).astype(np.float32)
        found.append(pullback(seed))
    return offsets, *found


def by_pixel(offsets, numbers, together):
    starts = offsets[:-1][np.diff(offsets) > 0]
    return together.reduceat(np.abs(numbers, dtype=float).reshape(offsets[-1], -1).sum(1), starts)


@pytest.mark.parametrize("longest", (40, 1500))
@pytest.mark.parametrize("name", NAMES)
def test_floats_lose_few_digits(name, longest):
    behind = np.random.default_rng(9).uniform(size=(1, 153, 3)).astype(np.float32)
    for question, given in (("composite", {"background": behind}), ("transmittance", {})):
        offsets, got, wanted = both(name, question, longest, **given)
        # what hardly hangs on depth is measured by what hangs on alpha, and by a thousandth
        least = 0.03 * by_pixel(offsets, wanted.alpha, np.maximum)
        for part in ("depth", "alpha", "color"):
            by, exact = (np.asarray(getattr(one, part)) for one in (got, wanted))
            assert by.dtype == np.float32
            wrong = by_pixel(offsets, by - exact, np.maximum)
            size = np.maximum(np.maximum(by_pixel(offsets, exact, np.add), least), 1e-3)
            assert (wrong <= 1e-4 * size).all(), part
            assert np.quantile(wrong / size, 0.9) < 2e-6, part
        if question == "composite":
            np.testing.assert_allclose(got.background, wanted.background, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("name", ("power4", "sorted"))
def test_one_background_is_moved_by_all_pixels(name):
    """Of several runs of pixels, many of them empty, some with an opaque surface."""
    rng = np.random.default_rng(4)
    counts = rng.integers(0, 3, 5000)
    n = counts.sum()
    depth, alpha, color = rng.uniform(1, 5, n), rng.uniform(0.1, 0.9, n), rng.uniform(size=(n, 3))
    alpha[rng.uniform(size=n) < 0.1] = 1
    offsets = np.concatenate([[0], np.cumsum(counts)])
    f = moit.Fragments(offsets, depth, alpha, color, depth_range=(1, 5), dtype="float32")
    image, pullback = gradients.composite(f, name, background=(0.1, 0.2, 0.3))
    seed = rng.uniform(size=image.shape).astype(np.float32)
    total = moit.total_transmittance(f, name)[..., None].astype(float)
    np.testing.assert_allclose(
        pullback(seed).background, (seed[..., :3] * total).sum(axis=(0, 1)), rtol=1e-6
    )


def test_threads_give_the_same_bits():
    offsets, arrays = rays(2500, True)
    f = moit.Fragments(offsets, *arrays, depth_range=(1, 5))
    found = []
    for threads in (1, 3):
        image, pullback = gradients.composite(f, "power4", threads=threads)
        found.append(pullback(image))
    for part in ("depth", "alpha", "color", "background"):
        assert np.array_equal(getattr(found[0], part), getattr(found[1], part))


def test_what_floats_cannot_hold_goes_back_in_double():
    """Sums beyond the largest float are none: such tiles are answered in double."""
    color = np.outer([3e38, 1e38, 2e38], np.ones(3))  # of one colour depths would change nothing
    f = moit.Fragments(
        [0, 3], [1, 2, 3], [0.3, 0.5, 0.4], color, depth_range=(1, 5), dtype="float32"
    )
    seed = np.full((1, 1, 4), 3e-3, np.float32)
    by_float = gradients.composite(f, "power4")[1](seed)
    wide = moit.Fragments([0, 3], f.depth, f.alpha, f.color, depth_range=(1, 5), dtype="float64")
    technique = moit.PowerMoments(4, bias=moit.technique("power4").bias_for(np.float32))
    by_double = gradients.composite(wide, technique)[1](seed)
    for part in ("depth", "alpha", "color"):
        got, wanted = getattr(by_float, part), getattr(by_double, part)
        np.testing.assert_allclose(got, wanted, rtol=1e-3, atol=1e-4 * np.abs(wanted).max())
