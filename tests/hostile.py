"""Fragments that nobody sends on purpose, put to every technique and every question.

`python tests/hostile.py --seconds 600` tries random cases in a process of its own, and says of each
that breaks a promise, or ends the process, its number, which is its seed: `--case NUMBER` tries
that one alone, and `--sanitized` takes the extension that .ci/sanitize has built.
"""

import argparse
import dataclasses
import math
import os
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mpmath import mpf
from test_bounds import truths
from variants import EVERY

import moit

Rng = np.random.Generator
Array = np.ndarray
FINITE = 1e300  # what curves may be asked for
AFTER_THE_CHECK = (np.nan, np.inf, -np.inf, 1e300, -1e300, 0.0, -1.0, 3e38, 1e-320)


class Case(NamedTuple):
    fragments: moit.Fragments
    technique: moit.Technique
    depths: Array  # of a curve
    cull_opaque: bool


# ---- What is tried -------------------------------------------------------------------------------


def _depths(rng: Rng, n: int, dtype: type) -> Array:
    kind = rng.integers(9)
    middle = 10.0 ** rng.uniform(-3, 3)
    ulp = float(np.finfo(dtype).eps) * middle
    if kind == 0:
        z = rng.uniform(0.5, 20, n)
    elif kind == 1:  # at one depth, or few
        z = rng.choice(rng.uniform(0.5, 20, rng.integers(1, 4)), n)
    elif kind == 2:  # a few last digits apart
        z = middle + ulp * rng.integers(0, rng.choice([2, 8, 1000]), n)
    elif kind == 3:  # all sizes that the type holds
        most = 300.0 if dtype is np.float64 else 37.0
        z = 10.0 ** rng.uniform(-most, most, n)
    elif kind == 4:
        z = rng.uniform(0, 1, n)  # what a warp of none takes
    elif kind == 5:
        z = np.exp(rng.normal(0, 0.01, n))
    elif kind == 6:
        z = middle * (1 + 10.0 ** rng.uniform(-16, -1) * rng.random(n))
    elif kind == 7:
        z = np.where(rng.random(n) < 0.5, 1.0, rng.choice([1.0, 1e30, 1e-30], n))
    else:  # not what a logarithm takes
        z = rng.normal(0, 10.0 ** rng.uniform(-5, 5), n)
    return np.asarray(z, dtype)


def _alphas(rng: Rng, n: int, dtype: type) -> Array:
    info = np.finfo(dtype)
    kind = rng.integers(9)
    if kind == 0:
        alpha = rng.random(n)
    elif kind == 1:
        alpha = rng.choice([0.0, 1.0, 0.5], n)
    elif kind == 2:
        alpha = rng.random(n) * rng.choice([1e-3, 1e-6, 1e-12])
    elif kind == 3:  # around the least normal number
        alpha = np.ldexp(rng.random(n), info.minexp + rng.integers(-info.nmant, 8, n))
    elif kind == 4:
        alpha = 1 - info.epsneg * rng.integers(0, rng.choice([2, 5, 1000]), n)
    elif kind == 5:
        alpha = np.full(n, rng.choice([1e-38, 1e-3, 0.99, float(info.tiny), 1 - 0.5 / 256]))
    elif kind == 6:
        alpha = 10.0 ** rng.uniform(-45, 0, n)
    elif kind == 7:
        alpha = rng.random(n) ** 20
    else:
        several = [0.0, 1e-45, 1e-38, 1e-20, 1e-7, 0.5, 0.998, 1.0, float(info.tiny)]
        alpha = rng.choice(several, n)
    return np.clip(np.asarray(alpha, dtype), 0, 1)


def _fragments(rng: Rng) -> moit.Fragments:
    dtype = rng.choice([np.float32, np.float64])
    most = rng.choice([0, 1, 2, 3, 5, 9, 17, 40, 49, 130])
    return fragments_of(rng, dtype, rng.integers(0, most + 1, rng.choice([1, 1, 2, 5, 17, 70])))


def fragments_of(rng: Rng, dtype: type, counts: Array) -> moit.Fragments:
    """As many in each pixel; depths and opacities are of one kind each."""
    n = int(counts.sum())
    depth, alpha = _depths(rng, n, dtype), _alphas(rng, n, dtype)
    color = rng.random((n, 3))
    if rng.random() < 0.1:
        color = np.zeros((n, 3))
    transmission = rng.choice([0.0, 0.25, 1.0], (n, 3)) if rng.random() < 0.15 else None
    given = None
    if n and rng.random() < 0.2:
        near, far = float(depth.min()), float(depth.max())
        given = (near / 2 if near > 0 else near * 2, far * 2 if far > 0 else far / 2)
    shape = (len(counts), 1) if rng.random() < 0.3 else None
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        depth,
        alpha,
        color.astype(dtype),
        transmission=None if transmission is None else transmission.astype(dtype),
        shape=shape,
        depth_range=given,
    )


def with_more(f: moit.Fragments, rng: Rng) -> moit.Fragments:
    """Some of them are volumes or Gaussians, or add light."""
    n, dtype = len(f), f.depth.dtype
    back = emission = deviation = None
    if rng.random() < 0.1:
        high = f.depth_range[1]
        share = rng.choice([0.0, 1e-7, 0.3, 1.0], n)
        back = np.clip(f.depth + share * (high / 2 - f.depth / 2) * 2, f.depth, None).astype(dtype)
        back = np.where(f.depth <= high, np.minimum(back, dtype.type(high)), f.depth)
        back = np.maximum(back, f.depth)
    if rng.random() < 0.1:
        emission = (rng.random((n, 3)) * rng.choice([0.0, 1.0], (n, 1))).astype(dtype)
    own = np.random.default_rng([n, len(f.counts), 11])  # all other cases stay what they are
    if own.random() < 0.1:
        most, scale = np.finfo(dtype).max, np.abs(f.depth.astype(np.longdouble))
        kinds = np.array([0.0, 1e-9, 0.1, 3.0, 1e30])
        deviation = np.minimum(own.choice(kinds, n) * scale, most).astype(dtype)
        if back is not None:
            deviation[back > f.depth] = 0
    if back is None and emission is None and deviation is None:
        return f
    return moit.Fragments(
        f.offsets,
        f.depth,
        f.alpha,
        f.color,
        transmission=f.transmission,
        back=back,
        emission=emission,
        deviation=deviation,
        shape=f.shape,
        depth_range=f.depth_range,
    )


def _warped(rng: Rng) -> dict:
    warp = str(rng.choice(["log", "log", "linear", "none"]))
    pixel = warp != "none" and rng.random() < 0.4
    most = float(rng.choice([1 - 0.5 / 256, 0.5, 1e-3, 1 - 1e-12]))
    return {"warp": warp, "depth_range": "pixel" if pixel else "image", "max_alpha": most}


def _moments(rng: Rng) -> dict:
    bias = (None, "published", 0.0, 1e-15, 1e-3, 1.0)[rng.integers(6)]
    return {
        **_warped(rng),
        "bias": bias,
        "exclude_self": bool(rng.integers(2)),
        "overestimation": float(rng.choice([0.0, 0.25, 1.0])),
        "normalize": bool(rng.integers(2)),
    }


def _blocks(rng: Rng, warped: dict) -> dict:
    if warped["depth_range"] == "pixel" or rng.random() < 0.6:
        return {}
    total = str(rng.choice(["block", "full"]))
    above = str(rng.choice(["bilinear", "bilinear", "depth-aware"]))
    return {"resolution": int(rng.choice([2, 3, 8, 500])), "total": total, "upsampling": above}


def _power(rng: Rng) -> moit.Technique:
    options = _moments(rng)
    return moit.PowerMoments(int(rng.choice([4, 6, 8])), **options, **_blocks(rng, options))


def _halves(rng: Rng) -> moit.Technique:
    if rng.random() < 0.5:
        return moit.TwoMoments(storage=(None, "half")[rng.integers(2)], **_moments(rng))
    if rng.random() < 0.2:
        moments = str(rng.choice(["power4", "power6"]))
        bias = (None, 0.0)[rng.integers(2)]
        return moit.BoundedNeural(moments, storage="half", bias=bias, **_warped(rng))
    return moit.PowerMoments(int(rng.choice([4, 6, 8])), storage="half", **_moments(rng))


def _trigonometric(rng: Rng) -> moit.Technique:
    zone = float(rng.choice([0.0, 1e-12, 0.3, 1.5]))
    count = int(rng.choice([2, 3, 4]))
    options = {"wrapping_zone": zone, **_moments(rng)}
    return moit.TrigonometricMoments(count, **options, **_blocks(rng, options))


def _front(rng: Rng) -> moit.Technique:
    # a tail counts in coverage with its own colours: 'normalize' is the front's
    tail = (_power, _trigonometric, _bounded)[rng.integers(3)](rng)
    tail = dataclasses.replace(
        tail, resolution=1, total="block", upsampling="bilinear", normalize=True
    )
    layers = int(rng.choice([1, 2, 5, 32]))
    key_bits = 64 if tail.range_per_pixel else int(rng.choice([32, 64]))
    normalize = bool(rng.integers(2))
    return moit.FrontLayers(layers, tail, normalize=normalize, key_bits=key_bits)


def _kept(rng: Rng) -> moit.Technique:
    options = {**_warped(rng), "normalize": bool(rng.integers(2))}
    kept, gamma = int(rng.choice([1, 2, 5, 16])), float(rng.choice([0.0, 3.5, 32.0]))
    options["key_bits"] = 64 if kept in (2, 16) else 32  # all other cases stay what they are
    if rng.random() < 0.5:
        return moit.Strong(kept, gamma, **options | {"depth_range": "image"})
    return moit.Anchors(kept, int(rng.choice([1, 4, 16])), gamma, **options)


def _layers(rng: Rng) -> moit.Technique:
    count, quantized = int(rng.choice([2, 3, 8, 32])), bool(rng.integers(2))
    normalize = bool(rng.integers(2))
    kind = rng.integers(4)
    if kind == 0:
        return moit.DepthPeeling(count, normalize=normalize)
    if kind == 1:
        return moit.HybridTransparency(count, normalize=normalize)
    merge = (str(rng.choice(["last", "energy"])), str(rng.choice(["area", "energy"])))[kind - 2]
    plain = not quantized and merge != "energy"
    options = {"quantized": quantized, "merge": merge}
    options["warp"] = None if plain else str(rng.choice(["log", "linear", "none"]))
    if kind == 2:
        least = float(rng.choice([0.0, 0.001, 1.0]))
        return moit.MultiLayerAlphaBlending(count, min_alpha=least, **options)
    return moit.AdaptiveTransparency(count, normalize=normalize, **options)


def _wavelet(rng: Rng) -> moit.Technique:
    return moit.WaveletTransparency(
        int(rng.choice([4, 8, 16, 32])),
        bits=int(rng.choice([16, 32])),
        projected=str(rng.choice(["absorbance", "density"])),
        exclude_self=bool(rng.integers(2)),
        **_warped(rng),
    )


def _series(rng: Rng) -> moit.Technique:
    options = {"bits": int(rng.choice([16, 32])), "exclude_self": bool(rng.integers(2))}
    if rng.random() < 0.5:
        return moit.FourierOpacity(int(rng.choice([3, 7, 31])), **options, **_warped(rng))
    return moit.TransmittanceFunctionMap(int(rng.choice([1, 8, 32])), **options, **_warped(rng))


def _slices(rng: Rng) -> moit.Technique:
    warped = _warped(rng)
    side = 1 if warped["depth_range"] == "pixel" else int(rng.choice([1, 1, 2, 4, 8]))
    return moit.Slices(
        int(rng.choice([2, 3, 16, 64, 256])),
        int(rng.choice([2, 5, 8, 8, 16])),
        str(rng.choice(["image", "tile", "pixel"])),
        tile=side * int(rng.integers(1, 6)),
        cells=(None, 64, 8192)[rng.integers(3)],
        resolution=side,
        total=str(rng.choice(["full", "byte"])) if side > 1 and rng.random() < 0.5 else "block",
        inside=(None, None, "power4")[rng.integers(3)],
        **warped,
    )


def _voxels(rng: Rng) -> moit.Technique:
    warped = _warped(rng)
    side = 1 if warped["depth_range"] == "pixel" else int(rng.choice([1, 2, 4, 8]))
    return moit.AdaptiveVoxels(
        int(rng.choice([2, 16, 128, 256])),
        int(rng.choice([8, 16])),
        side,
        slice_bias=(None, 0.0, 1.0, 2.5)[rng.integers(4)],
        filter=str(rng.choice(["linear", "cubic"])),
        low_resolution=str(rng.choice(["raster", "average"])),
        cells=int(rng.choice([64, 8192])),
        **warped,
    )


def _bounded(rng: Rng) -> moit.Technique:
    moments = str(rng.choice(["power4", "power6"]))
    return moit.BoundedNeural(moments, bias=(None, 0.0)[rng.integers(2)], **_warped(rng))


MAKERS: tuple[Callable[[Rng], moit.Technique], ...] = (
    _power,
    _trigonometric,
    _slices,
    _voxels,
    _wavelet,
    _series,
    _bounded,
    _halves,
    _front,
    _kept,
    _layers,
)


def case_of(number: int) -> Case:
    rng = np.random.default_rng([15, number])
    f = _fragments(rng)
    maker = rng.integers(2 * len(MAKERS))
    technique = MAKERS[maker](rng) if maker < len(MAKERS) else EVERY[rng.integers(len(EVERY))]
    depths = depths_of_interest(rng, f)
    culls = bool(rng.random() < 0.8)
    return Case(with_more(f, rng), technique, depths, culls)


def depths_of_interest(rng: Rng, f: moit.Fragments) -> Array:
    """Far away, at a few fragments, the very next numbers, and some others."""
    beyond = [-FINITE, -1e9, -1.0, 0.0, 1e-300, 1e9, 1e38, FINITE]
    some = f.depth[rng.integers(0, max(len(f), 1), 4)].astype(float) if len(f) else np.ones(1)
    beside = [*np.nextafter(some, math.inf), *np.nextafter(some, -math.inf)]
    return rng.permutation(np.concatenate([beyond, some, beside, rng.uniform(0, 20, 3)]))


# ---- What is asked -------------------------------------------------------------------------------


# What techniques ask of fragments, and what whoever looks once more says of changed ones.
NEEDS = ("warp", "positive depth for the weight", "with coloured transmission there are")
NEEDS += ("positive depth of opaque surfaces",)
CHANGED = (*NEEDS, "found")


def answers(
    case: Case, refusals: tuple[str, ...] = NEEDS
) -> Iterator[tuple[str, tuple[Array, ...]]]:
    """The name and the results of every question that the technique takes; nothing where it says
    that it takes none of these fragments."""
    f, t, how = case.fragments, case.technique, {"cull_opaque": case.cull_opaque, "threads": 1}
    asked: list[tuple[str, Callable[[], tuple[Array, ...]]]] = [
        ("composite", lambda: (moit.composite(f, t, background=(0.5, 0, 1), **how),)),
        ("transmittance", lambda: (moit.transmittance(f, t, **how),)),
        ("total", lambda: (moit.total_transmittance(f, t, **how),)),
        ("bounds", lambda: moit.bounds(f, t, **how)),
    ]
    if t.has_curve:
        asked += [
            ("curve", lambda: (moit.transmittance(f, t, depth=case.depths, **how),)),
            ("curve bounds", lambda: moit.bounds(f, t, depth=case.depths, **how)),
        ]
    if isinstance(t, moit.catalog.MomentTechnique) and t.moment_sets == 1:
        asked += [("moments", lambda: moit.moments.gather(f, t, **how))]
    for name, ask in asked:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                yield name, ask()
        except ValueError as refused:  # FragmentsError too
            if not refusals or not any(words in str(refused) for words in refusals):
                raise


def touched(case: Case, rng: Rng) -> Case:
    """The same with numbers changed after they were checked."""
    f = case.fragments
    if not len(f):
        return case
    held = [np.array(array) for array in (f.depth, f.alpha, f.color)]
    changed = moit.Fragments(
        f.offsets, *held, shape=f.shape, depth_range=f.depth_range, transmission=f.transmission
    )
    for _ in range(rng.integers(1, 4)):
        some = rng.random(len(f)) < rng.choice([0.1, 1.0])
        with np.errstate(over="ignore"):
            held[rng.integers(3)][some] = rng.choice(AFTER_THE_CHECK)
    return case._replace(fragments=changed)


# ---- What must hold ------------------------------------------------------------------------------


def range_of(name: str, technique: moit.Technique) -> tuple[float, float]:
    if isinstance(technique, moit.WeightedSum) and not name.endswith("bounds"):
        return (-math.inf, 1.0)
    weighs = (moit.WeightedBlended, moit.DeepFragments)
    if name == "transmittance" and isinstance(technique, moit.PerPixel):
        return (-math.inf, math.inf)  # one of its candidates is a weighted sum
    if name == "transmittance" and isinstance(technique, weighs):
        return (0.0, math.inf)  # a weight's share of what is covered
    if name == "total" and isinstance(technique, moit.PerPixel):
        return (-technique.max_error, 1.0)  # a weighted sum is good enough for some pixels
    return (0.0, 1.0)


def _fast_truths(f: moit.Fragments, depths: Array) -> Array:
    """The transmittance in front of depths, a row a pixel, but for the last digits."""
    rows = []
    for start, end in pairwise(f.offsets):
        order = np.argsort(f.depth[start:end], kind="stable")
        passes = 1 - f.alpha[start:end][order].astype(np.longdouble)
        T = np.concatenate([[np.longdouble(1)], np.cumprod(passes)])
        rows.append(T[np.searchsorted(f.depth[start:end][order], depths)])
    return np.array(rows)


def _outside(case: Case, name: str, lower: Array, upper: Array) -> Iterator[str]:
    """Where bounds leave the truth out. Sorted's hold for the earlier of equal depths only."""
    f, t = case.fragments, case.technique
    thick = f.back is not None or f.deviation is not None
    if f.transmission is not None or thick or not case.cull_opaque or not len(f):
        return
    if isinstance(t, moit.Sorted | moit.PerPixel):
        return
    asked = case.depths if name == "curve bounds" else None
    if asked is not None:
        T, doubt = _fast_truths(f, asked), 1e-15
        low, high = lower.reshape(T.shape), upper.reshape(T.shape)
        if ((low <= T * (1 - doubt)) & (T * (1 + doubt) <= high)).all():
            return
    found = [T for row in truths(f, asked) for T in row]
    for k, (T, low, high) in enumerate(zip(found, lower.flat, upper.flat, strict=True)):
        if not mpf(float(low)) <= T <= mpf(float(high)):
            yield f"{name}[{k}]: {float(T)!r} not in [{low!r}, {high!r}]"


def rounds_each(technique: moit.Technique) -> bool:
    """Whether half floats, words or bytes round after every fragment."""
    if getattr(technique, "in_halves", False) or technique.kind == "dfa":
        return True
    # these round what is summed up in full, or sum up whole numbers
    at_the_end = (moit.MomentTransparency, moit.Slices, moit.AdaptiveVoxels)
    return getattr(technique, "bits", 32) == 16 and not isinstance(technique, at_the_end)


def told_apart(f: moit.Fragments, technique: moit.Technique) -> bool:
    """Whether what a technique sees of fragments is the same in every order: not where keys of 32
    bits may coincide, which have 20 of warped depth, nor where random numbers hang on bits that
    pieces of volumes get by rounding."""
    if isinstance(technique, moit.Stochastic | moit.HashedAlpha):
        return f.back is None and f.deviation is None
    if not isinstance(technique, moit.FrontLayers) or technique.key_bits > 32:
        return True
    near, far = map(float, f.depth_range)
    depth = np.clip(f.depth.astype(float), near, far)
    with np.errstate(all="ignore"):
        u = {
            "log": lambda: np.log(depth / near) / np.log(far / near),
            "linear": lambda: (depth - near) / (far - near),
            "none": lambda: (np.clip(f.depth, -1, 1) + 1) / 2,
        }[str(technique.depth_warp)]()
        gaps = [np.diff(np.sort(u[start:end])) for start, end in pairwise(f.offsets)]
    return all((gap > 2 / 2**20).all() for gap in gaps)


def moved_by_order(case: Case, seed: int) -> Iterator[str]:
    """Where another order of arrival moves the picture by more than sums of doubles do."""
    f, t = case.fragments, case.technique
    if not t.order_independent or rounds_each(t) or f.depth.dtype != np.float64:
        return
    if not told_apart(f, t):
        return
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    if t.ties_in_order and len(np.unique(np.stack([pixel, f.depth]), axis=1)[0]) < len(f):
        return
    # which of several opaque surfaces at one depth is the background is their order
    how = {"background": (0.5, 0, 1), "cull_opaque": False, "threads": 1}
    moved = [moit.composite(g, t, **how) for g in (f, f.shuffled(seed))]
    pictures = [one.reshape(len(f.counts), -1).astype(float) for one in moved]
    move, light = np.abs(pictures[0] - pictures[1]).max(1), np.abs(pictures[0]).max(1)
    # What is covered is known to a last digit of 1 for each factor, and light may be much more.
    doubt = f.counts * np.finfo(float).eps * light / np.maximum(pictures[0][:, -1], 1e-15)
    # Front layers take the nearest out of sums over all: where one falls on the edge between two
    # doubles a last digit shows, the more the less is left.
    most = 1e-10 if isinstance(t, moit.FrontLayers) else 1e-12
    beyond = move > most * max(1, light.max(initial=0)) + doubt
    if beyond.any():
        yield f"order of arrival: the picture moves by {move[beyond].max():.2g}"


def broken(case: Case) -> Iterator[str]:
    """The promises that this case breaks, in words."""
    composited = False
    for name, results in answers(case):
        composited = composited or name == "composite"
        for result in results:
            if not np.isfinite(result).all():
                yield f"{name}: not finite"
        if name in ("composite", "moments"):
            continue
        low, high = range_of(name, case.technique)
        for result in results:
            if result.size and not (low <= result.min() and result.max() <= high):
                yield f"{name}: {result.min()!r} to {result.max()!r} is not in [{low}, {high}]"
        if name.endswith("bounds"):
            yield from _outside(case, name, *results)
    if composited:
        yield from moved_by_order(case, seed=1)


def tried(number: int) -> list[str]:
    """What one case breaks; then the same is asked once more of changed arrays, only to return."""
    case = case_of(number)
    found = list(broken(case))
    for _ in answers(touched(case, np.random.default_rng([16, number])), CHANGED):
        pass
    return found


# ---- Long runs -----------------------------------------------------------------------------------


def _run(first: int, seconds: float, progress: Path) -> None:
    """Tries cases from `first` on until the time is over; the file always names the present one."""
    end = time.monotonic() + seconds
    with progress.open("r+") as file:
        while time.monotonic() < end:
            file.seek(0)
            file.write(f"{first:020d}")
            file.flush()
            try:
                found = tried(first)
            except Exception as error:
                found = [repr(error)]
            for what in found[:3]:
                print(f"case {first}: {case_of(first).technique}: {what}", flush=True)
            first += 1


def _sanitized() -> dict[str, str]:
    """What makes a process use the extension of .ci/sanitize."""
    built = list(
        (Path(__file__).parents[1] / "build/sanitize/extension").glob("lib.*/moit/_core.*")
    )
    if not built:
        raise SystemExit("there is no build/sanitize/extension: run .ci/sanitize first")
    names = ("libasan.so", "libstdc++.so.6")  # ASan must find what C++ throws with
    found = [
        subprocess.run(["gcc", f"-print-file-name={name}"], capture_output=True, text=True).stdout
        for name in names
    ]
    return {
        "PYTHONPATH": str(built[0].parents[1]),
        "PYTHONMALLOC": "malloc",
        "LD_PRELOAD": " ".join(path.strip() for path in found),
        "ASAN_OPTIONS": "detect_leaks=0",
        "UBSAN_OPTIONS": "print_stacktrace=1",
    }


def _watch(first: int, seconds: float, environment: dict[str, str]) -> None:
    """Runs cases in processes of their own, each from where the one before it died."""
    end, begun = time.monotonic() + seconds, first
    with tempfile.TemporaryDirectory() as folder:
        progress = Path(folder) / "case"
        while (left := end - time.monotonic()) > 0:
            progress.write_text(f"{first:020d}")
            command = [sys.executable, __file__, "--first", str(first), "--seconds", str(left)]
            command += ["--progress", str(progress)]
            died = subprocess.run(command, env={**os.environ, **environment}).returncode
            first = int(progress.read_text()) + 1
            if died:
                print(f"case {first - 1}: the process ended with {died}", flush=True)
    print(f"{first - begun} cases", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description="Puts hostile fragments to every technique.")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--case", type=int)
    parser.add_argument("--sanitized", action="store_true")
    parser.add_argument("--progress", type=Path, help="for the process that tries them")
    asked = parser.parse_args()
    if asked.case is not None:
        case = case_of(asked.case)
        print(case.technique, *(f"{n}={getattr(case.fragments, n)!r}" for n in ("depth", "alpha")))
        print(*tried(asked.case), sep="\n")
    elif asked.progress:
        _run(asked.first, asked.seconds, asked.progress)
    else:
        _watch(asked.first, asked.seconds, _sanitized() if asked.sanitized else {})


if __name__ == "__main__":
    main()
