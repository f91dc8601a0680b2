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
    "transmittance-function-map(resolution=2, bits=32)",
    "transmittance-function-map5(resolution=2, total='full', bits=32, exclude_self=True)",
    "neural-bounded(resolution=2, bias=1e-6)",
    "neural-bounded6(resolution=2, total='full', bias=1e-6)",
)
# Beside where blocks lie shares go by how near their opaque surfaces are to the pixel's.
GUIDED = (
    "power4(resolution=2, upsampling='depth-aware', bias=1e-6)",
    "fourier7(resolution=2, upsampling='depth-aware', total='full', bits=32)",
)
OPAQUE = (0, 1, 3, 4, 5, 7, 10, 11)  # pixels with a surface behind all else, of whole blocks some


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


def with_surfaces(f):
    """With an opaque surface behind the fragments of some pixels, as far away as it is near, far or
    next to others."""
    ends, rng = f.offsets.ravel(), np.random.default_rng(8)
    parts = []
    for p in range(len(ends) - 1):
        own = slice(ends[p], ends[p + 1])
        numbers = np.column_stack([f.depth[own], f.alpha[own], f.color[own]])
        far = FAR + (0.02 * p if p % 3 else p)
        last = [[far, 1.0, *rng.uniform(size=3)]] if p in OPAQUE else np.empty((0, 5))
        parts.append(np.concatenate([numbers, last]))
    depth, alpha, *color = np.concatenate(parts).T
    offsets = np.concatenate([[0], np.cumsum([*map(len, parts)])])
    place = {"shape": f.shape, "depth_range": (NEAR, FAR), "dtype": "float64"}
    return moit.Fragments(offsets, depth, alpha, np.column_stack(color), **place)


def like(depth, other):
    apart = 64 * abs(depth - other) / max(depth, other)
    return 1 / (1 + apart**2) + mpf(1) / 256


def guided_by(f, part_of, block_of_pixel, surfaces):
    """Shares of blocks, weighted by how like a pixel's surface the farthest of theirs is."""
    members = {b: [p for p, one in enumerate(block_of_pixel) if one == b] for b in block_of_pixel}
    farthest = {
        b: max(surfaces[p] for p in of)
        for b, of in members.items()
        if all(p in surfaces for p in of)
    }
    none = 2 * max(farthest.values())
    found = []
    for p, part in enumerate(part_of):
        own = surfaces.get(p, none)
        weighed = {b: share * like(own, farthest.get(b, none)) for b, share in part.items()}
        found.append({b: one / mp.fsum(weighed.values()) for b, one in weighed.items()})
    return found


def read_of_map(technique, parts, whole):
    """What pixels read of maps: what these take of 1, (share, coefficients, total) of each map;
    whole: the pixel's own total, to which they are scaled, or None."""
    taken = [
        mp.fsum(share * ((1 - c[0]) if k == 0 else c[k]) for share, c, _ in parts)
        for k in range(technique.coefficients)
    ]
    all_of_it = mp.fsum(share * (1 - total) for share, _, total in parts)
    if whole is not None:
        scale = (1 - whole) / all_of_it
        taken, all_of_it = [scale * one for one in taken], 1 - whole
    c = [1 - taken[0], *taken[1:]]
    return states.read_function_map(technique, c, 1 - all_of_it)


def answers(f, technique, depth, alpha):
    """Pictures, transmittances and totals, one after the other."""
    height, width = f.shape
    down, across = -(-height // SIDE), -(-width // SIDE)
    ends = f.offsets.ravel()
    last = {p: int(ends[p + 1]) - 1 for p in range(height * width)}
    surfaces = {p: depth[i] for p, i in last.items() if i >= ends[p] and alpha[i] == 1}
    opaque = {last[p] for p in surfaces}
    warped = states.warp_of(technique, depth, NEAR, FAR)
    z, a = [*map(warped, depth)], states.absorbances(technique, alpha)
    a = [mpf(0) if i in opaque else one for i, one in enumerate(a)]
    block_of, of_pixel, part_of, maps = [], [], [], []
    for p in range(height * width):
        of_pixel.append(p // width // SIDE * across + p % width // SIDE)
        block_of += of_pixel[-1:] * int(ends[p + 1] - ends[p])
        rows, columns = shares(p // width, down), shares(p % width, across)
        part_of.append({y * across + x: rows[y] * columns[x] for y in rows for x in columns})
    pixels = np.bincount(of_pixel)
    if technique.upsampling == "depth-aware":
        part_of = guided_by(f, part_of, of_pixel, surfaces)
    of_map = technique.kind == "transmittance-function-map"
    for p in range(height * width if of_map else 0):
        own = slice(ends[p], ends[p + 1])
        maps.append(states.function_map(technique, z[own], alpha[own], depth[own]))
    image, seen, totals = [], [], []
    for p in range(height * width):
        own, part = [i for i in range(ends[p], ends[p + 1]) if i not in opaque], part_of[p]
        mixed = [part.get(b, 0) / int(pixels[b]) * x for b, x in zip(block_of, a, strict=True)]
        total = states.product([alpha[i] for i in own])
        if technique.total == "full" and own:
            scale = mp.fsum(a[i] for i in own) / mp.fsum(mixed)
            mixed = [scale * one for one in mixed]
        some = [i for i, one in enumerate(mixed) if one]
        read = None
        if own and of_map:
            weights = [part.get(b, 0) / int(pixels[b]) for b in of_pixel]
            parts = [(w, *one) for w, one in zip(weights, maps, strict=True) if w]
            read = read_of_map(technique, parts, total if technique.total == "full" else None)
        elif own:
            read, _ = states.STATES[technique.kind](
                technique,
                [z[i] for i in some],
                [1 - mp.exp(-mixed[i]) for i in some],
                [depth[i] for i in some],
            )
        knows = states.excludes_self(technique)
        T = [read(z[i], alpha[i] if knows else mpf(0)) for i in own]
        scale = mpf(1)
        if technique.normalize and own:
            scale = (1 - total) / mp.fsum(alpha[i] * t for i, t in zip(own, T, strict=True))
        for c in range(3):
            light = [alpha[i] * t * exactly(f.color[i, c]) for i, t in zip(own, T, strict=True)]
            behind = exactly(f.color[last[p], c]) if p in surfaces else mpf(BEHIND[c])
            image.append(total * behind + scale * mp.fsum(light))
        image.append(mpf(1) if p in surfaces else 1 - total)
        seen += [*T, *[total] * (p in surfaces)]
        totals.append(mpf(0) if p in surfaces else total)
    return image, seen, totals


@pytest.mark.parametrize("name", NAMES + GUIDED)
def test_pullbacks_of_blocks_are_differences(name):
    technique, f = moit.technique(name), picture_of(SHAPE, 2)
    if name in GUIDED:
        f = with_surfaces(f)
    rng = np.random.default_rng(4)
    asked = (
        gradients.composite(f, technique, background=BEHIND),
        gradients.transmittance(f, technique),
        gradients.total_transmittance(f, technique),
    )
    seeds = [rng.normal(size=answer.shape) for answer, _ in asked]
    found = [pullback(seed) for (_, pullback), seed in zip(asked, seeds, strict=True)]
    ways = rng.normal(size=(2, len(f))) * (f.alpha < 1)  # surfaces stay, and where they are
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
        "power6(resolution=4, total='full', bias=1e-5)",
        "power4(resolution=2, upsampling='depth-aware', bias=1e-5)",
        "trig2(resolution=8, bias=1e-3)",
        "wavelet16(resolution=2)",
    ),
)
def test_any_place_and_number_of_threads(name):
    """Of a crop, whose first blocks are cut off, with opaque surfaces: as differences say, the same
    bits for any number of threads, and of float32 nearly."""
    f = picture_of((37, 23), 4)
    guided = "depth-aware" in name  # by blocks all of whose pixels have an opaque surface
    opaque = np.random.default_rng(1).random(len(f)) < (0.5 if guided else 0.05)
    arrays, place = (np.where(opaque, 1, f.alpha).astype("f4"), f.color.astype("f4")), {}
    place |= {"shape": f.shape, "origin": (3, 5), "depth_range": (NEAR, FAR), "dtype": "float64"}
    f = moit.Fragments(f.offsets, f.depth.astype("f4"), *arrays, **place)
    image, pullback = gradients.composite(f, name, threads=1)
    rng = np.random.default_rng(2)
    seed, way = rng.normal(size=image.shape).astype("f4"), rng.normal(size=len(f)) * ~opaque
    found = pullback(seed)
    again = gradients.composite(f, name, threads=3)[1](seed)
    for part in ("depth", "alpha", "color"):
        assert np.array_equal(getattr(found, part), getattr(again, part))
    floats = moit.Fragments(f.offsets, f.depth, *arrays, **{**place, "dtype": "float32"})
    of_floats = gradients.composite(floats, name)[1](seed)
    for part in ("depth", "alpha"):
        wanted = getattr(found, part)
        np.testing.assert_allclose(
            getattr(of_floats, part), wanted, rtol=1e-3, atol=1e-5 * np.abs(wanted).max()
        )
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
