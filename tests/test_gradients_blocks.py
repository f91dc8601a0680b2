"""Derivatives through states of blocks of pixels, against differences of the whole image in 60
digits: what a pixel reads is the state of a ray that has all fragments of the blocks around it,
each of as much absorbance as its block's share."""

import numpy as np
import pytest
from mpmath import mp, mpf
from test_gradients import BEHIND, FAR, NEAR, exactly

import moit
from moit import gradients
from tests.oracle import states

STEP = mpf(10) ** -25
SIDE = 2
SHAPE = (3, 4)
NAMES = (
    "power4(resolution=2, bias=1e-6)",
    "power4(resolution=2, total='full', exclude_self=True, overestimation=0.5, bias=1e-6)",
    "power8(resolution=2, bias=1e-6, normalize=False)",
    "trig2(resolution=2, bias=1e-6)",
    "trig3(resolution=2, total='full', bias=1e-4, exclude_self=True)",
    "fourier7(resolution=2, bits=32)",
    "fourier7(resolution=2, total='full', bits=32, exclude_self=True, normalize=False)",
    "wavelet8(resolution=2, total='full')",
    "wavelet8(resolution=2, exclude_self=True, projected='density')",
)


def picture_of(shape, most, seed=3, **options):
    rng = np.random.default_rng(seed)
    offsets = np.concatenate([[0], np.cumsum(rng.integers(0, most + 1, shape[0] * shape[1]))])
    n = offsets[-1]
    numbers = rng.uniform(NEAR, FAR, n), rng.uniform(0.05, 0.8, n), rng.uniform(0, 1, (n, 3))
    options = {"depth_range": (NEAR, FAR), "dtype": "float64", **options}
    return moit.Fragments(offsets, *numbers, shape=shape, **options)


def shares(place, there):
    """Blocks between whose middles a pixel lies along an axis, and how much of each it reads."""
    at = mpf(2 * place + 1) / (2 * SIDE) - mpf(1) / 2
    low = int(mp.floor(at)) if at > 0 else 0
    part = at - low if at > 0 else mpf(0)
    return {min(low, there - 1): 1 - part} | (
        {min(low + 1, there - 1): part + (low + 1 > there - 1) * (1 - part)} if part else {}
    )


def answers(f, technique, depth, alpha):
    """Pictures, transmittances and totals, one after the other."""
    height, width = f.shape
    down, across = -(-height // SIDE), -(-width // SIDE)
    ends = f.offsets.ravel()
    warped = states.warp_of(technique, depth, NEAR, FAR)
    z, a = [*map(warped, depth)], states.absorbances(technique, alpha)
    block_of, pixels = [], np.zeros(down * across, int)
    for p in range(height * width):
        block = p // width // SIDE * across + p % width // SIDE
        pixels[block] += 1
        block_of += [block] * int(ends[p + 1] - ends[p])
    image, seen, totals = [], [], []
    for p in range(height * width):
        own = range(ends[p], ends[p + 1])
        rows, columns = shares(p // width, down), shares(p % width, across)
        part = {y * across + x: rows[y] * columns[x] for y in rows for x in columns}
        mixed = [part.get(b, 0) / int(pixels[b]) * x for b, x in zip(block_of, a, strict=True)]
        total = states.product([alpha[i] for i in own])
        if technique.total == "full":
            scale = mp.fsum(a[i] for i in own) / mp.fsum(mixed)
            mixed = [scale * one for one in mixed]
        some = [i for i, one in enumerate(mixed) if one]
        read = None
        if own:
            read, _ = states.STATES[technique.kind](
                technique,
                [z[i] for i in some],
                [1 - mp.exp(-mixed[i]) for i in some],
                [depth[i] for i in some],
            )
        T = [read(z[i], alpha[i] if technique.excludes_self else mpf(0)) for i in own]
        scale = mpf(1)
        if technique.normalize and own:
            scale = (1 - total) / mp.fsum(alpha[i] * t for i, t in zip(own, T, strict=True))
        for c in range(3):
            light = [alpha[i] * t * exactly(f.color[i, c]) for i, t in zip(own, T, strict=True)]
            image.append(total * mpf(BEHIND[c]) + scale * mp.fsum(light))
        image.append(1 - total)
        seen += T
        totals.append(total)
    return image, seen, totals


@pytest.mark.parametrize("name", NAMES)
def test_pullbacks_of_blocks_are_differences(name):
    technique, f = moit.technique(name), picture_of(SHAPE, 2)
    rng = np.random.default_rng(4)
    asked = (
        gradients.composite(f, technique, background=BEHIND),
        gradients.transmittance(f, technique),
        gradients.total_transmittance(f, technique),
    )
    seeds = [rng.normal(size=answer.shape) for answer, _ in asked]
    found = [pullback(seed) for (_, pullback), seed in zip(asked, seeds, strict=True)]
    ways = rng.normal(size=(2, len(f)))
    with mp.workdps(60):
        depth, alpha = ([*map(exactly, one)] for one in (f.depth, f.alpha))
        for part, way in zip(("depth", "alpha"), ways, strict=True):
            moved = []
            for step in (STEP, -STEP):
                numbers = {"depth": depth, "alpha": alpha}
                numbers[part] = [
                    x + step * exactly(w) for x, w in zip(numbers[part], way, strict=True)
                ]
                moved.append(answers(f, technique, **numbers))
            for k, seed in enumerate(seeds):
                wanted = mp.fsum(
                    exactly(s) * (more - less)
                    for s, more, less in zip(seed.ravel(), moved[0][k], moved[1][k], strict=True)
                )
                got = (getattr(found[k], part) * way).sum()
                size = np.abs(getattr(found[k], part) * way).sum()
                assert abs(got - float(wanted / (2 * STEP))) <= 1e-8 * max(size, 1e-6), (k, part)
                if part == "alpha":
                    assert size > 0.1
                known = (asked[k][0] * seed).sum()
                middle = mp.fsum(
                    exactly(s) * x for s, x in zip(seed.ravel(), moved[0][k], strict=True)
                )
                assert known == pytest.approx(float(middle), abs=1e-6)


@pytest.mark.parametrize(
    "name",
    (
        "power4(resolution=3, bias=1e-5)",
        "power6(resolution=4, total='full')",
        "trig2(resolution=8, bias=1e-3)",
        "wavelet16(resolution=2)",
    ),
)
def test_any_place_and_number_of_threads(name):
    """Of a crop, whose first blocks are cut off, with opaque surfaces: as differences say, the same
    bits for any number of threads, and of float32 nearly."""
    f = picture_of((37, 23), 4)
    alpha = np.where(np.random.default_rng(1).random(len(f)) < 0.05, 1, f.alpha)
    arrays, place = (alpha, f.color), {"shape": f.shape, "origin": (3, 5)}
    place |= {"depth_range": (NEAR, FAR), "dtype": "float64"}
    f = moit.Fragments(f.offsets, f.depth, *arrays, **place)
    image, pullback = gradients.composite(f, name, threads=1)
    rng = np.random.default_rng(2)
    seed, way = rng.normal(size=image.shape), rng.normal(size=len(f))
    found = pullback(seed)
    again = gradients.composite(f, name, threads=3)[1](seed)
    for part in ("depth", "alpha", "color"):
        assert np.array_equal(getattr(found, part), getattr(again, part))
    ends = []
    for step in (1e-6, -1e-6):
        moved = moit.Fragments(f.offsets, f.depth + step * way, *arrays, **place)
        ends.append((gradients.composite(moved, name)[0] * seed).sum())
    size = np.abs(found.depth * way).sum()
    assert abs((found.depth * way).sum() - (ends[0] - ends[1]) / 2e-6) < 1e-5 * size


def test_motions_of_blocks_are_refused():
    """Four pullbacks tell how pixels move that hang on their own fragments alone."""
    with pytest.raises(ValueError, match="neighbours"):
        gradients.composite_jvp(picture_of(SHAPE, 2), "power4(resolution=2)")
