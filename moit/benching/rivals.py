"""What `moit bench` measures moit against, and what the machine can do at most.

Each rival answers one question in another way, in this process and on as many threads; where what
it needs is missing it raises `Missing`, which says what that is.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.fragments.fragments import Fragments

SOURCES = Path(__file__).resolve().parents[2] / "benchmarks" / "rivals"
MOST_IN_A_PIXEL = 4096  # power4_scalar.c's
BIAS, SAFE, BETA = 5e-7, 0.375, 0.25
PIECES = 8  # a thread's share of the work, so that a slow one does less

Array = NDArray[Any]


class Missing(Exception):
    """A rival that is not here, and what it needs."""


@cache
def library(name: str, *flags: str) -> ctypes.CDLL:
    """The C of benchmarks/rivals, compiled by the system's compiler at -O3; no fast math."""
    source = SOURCES / name
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    if not source.exists():
        raise Missing(f"{name} is in moit's source tree, from which this moit does not run")
    if compiler is None:
        raise Missing(f"{name} needs a C compiler")
    with tempfile.TemporaryDirectory() as folder:
        built = str(Path(folder) / "rival.so")
        options = ["-std=gnu11", "-O3", "-shared", "-fPIC", *flags, "-o", built, str(source), "-lm"]
        done = subprocess.run([compiler, *options], capture_output=True, text=True)
        if done.returncode:
            raise Missing(f"{name} does not compile: {done.stderr[:500]}")
        return ctypes.CDLL(built)


def _on_threads(threads: int, pixels: int, call: Callable[[int, int], object]) -> None:
    """`call` with parts of the pixels; C called by ctypes leaves Python to the other threads."""
    pieces = threads * PIECES
    ends = [pixels * k // pieces for k in range(pieces + 1)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(call, ends[:-1], ends[1:]))


def _pointer(array: Array) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def power4_scalar(f: Fragments, threads: int = 1) -> Array:
    """The composite of four power moments as published, by scalar C with libm; (P, 4), over black.

    Computes in the precision of `f`, which must have colour.
    """
    if len(f) and int(f.counts.max()) > MOST_IN_A_PIXEL:
        raise Missing(f"power4_scalar.c takes {MOST_IN_A_PIXEL} fragments of a pixel at most")
    double = f.dtype == np.float64
    call = library("power4_scalar.c", "-DNUMBER=double" if double else "-DNUMBER=float")
    number = ctypes.c_double if double else ctypes.c_float
    image = np.empty((len(f.counts), 4), f.dtype)
    assert f.color is not None
    arrays = [_pointer(one) for one in (f.offsets, f.depth, f.alpha, f.color)]
    near, far = map(number, f.depth_range)

    def part(first: int, end: int) -> None:
        call.power4_composite(
            ctypes.c_int64(first), ctypes.c_int64(end), *arrays, near, far, _pointer(image)
        )

    _on_threads(threads, len(f.counts), part)
    return image


def power4_numpy(f: Fragments) -> Array:
    """The same by whole arrays of NumPy, on one thread."""
    assert f.color is not None
    filled = np.flatnonzero(f.counts)
    counts, starts = f.counts[filled], f.offsets[:-1][filled]
    number = f.dtype.type
    near, far = (number(x) for x in f.depth_range)
    image = np.zeros((len(f.counts), 4), f.dtype)
    if not len(f):
        return image
    z = np.log(f.depth / near) * (number(2) / np.log(far / near)) - number(1)
    absorbance = -np.log1p(-f.alpha)
    powers = [absorbance]
    for _ in range(4):
        powers.append(powers[-1] * z)
    b0, *b = (np.add.reduceat(one, starts) for one in powers)
    some = np.where(b0 > 0, b0, number(1))
    b1, b2, b3, b4 = ((1 - number(BIAS)) * one / some for one in b)
    b2, b4 = b2 + number(BIAS * SAFE), b4 + number(BIAS * SAFE)
    d1 = b2 - b1 * b1
    l21 = (b3 - b1 * b2) / d1
    d2 = (b4 - b2 * b2) - l21 * (b3 - b1 * b2)
    b0_, b1_, b2_, l21, d1, d2 = (np.repeat(one, counts) for one in (b0, b1, b2, l21, d1, d2))
    with np.errstate(divide="ignore", invalid="ignore"):
        c2 = ((z * z - b2_) - l21 * (z - b1_)) / d2
        c1 = (z - b1_) / d1 - l21 * c2
        half = -c1 / c2 / 2
        root = np.sqrt(half * half - (1 - c1 * b1_ - c2 * b2_) / c2)
        x1, x2 = half - root, half + root
        f1, f2 = (x1 < z).astype(f.dtype), (x2 < z).astype(f.dtype)
        rise = (f1 - number(BETA)) / (x1 - z)
        turn = ((f2 - f1) / (x2 - x1) - rise) / (x2 - z)
        share = number(BETA) + rise * (b1_ - z) + turn * (b2_ - (z + x1) * b1_ + z * x1)
    weight = f.alpha * np.clip(np.exp(-b0_ * share), 0, 1)
    covered = 1 - np.exp(-b0)
    all_weights = np.add.reduceat(weight, starts)
    over = covered / np.where(all_weights > 0, all_weights, number(1))
    colours = np.add.reduceat(weight[:, None] * f.color, starts, axis=0)
    image[filled, :3] = colours * over[:, None]
    image[filled, 3] = covered
    return image


class DeepImage:
    """A deep image in OpenImageIO's memory, of what `f` holds."""

    def __init__(self, f: Fragments) -> None:
        try:
            from moit.system.image_library import complaint, image_library

            oiio = image_library()
        except ImportError:
            raise Missing("flatten needs OpenImageIO") from None
        from moit.formats.deep import write_deep

        self.oiio = oiio
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "deep.exr")
            write_deep(path, f)
            self.image = oiio.ImageBuf(path)
            if not self.image.read(force=True):
                raise Missing(f"OpenImageIO cannot read what write_deep wrote: {complaint(oiio)}")

    def flatten(self, threads: int = 1) -> Any:
        """Its composite, an ImageBuf of premultiplied R, G, B, A and Z."""
        return self.oiio.ImageBufAlgo.flatten(self.image, nthreads=threads)

    def flattened(self, threads: int = 1) -> Array:
        """The same as an array (H, W, channels), named by `channels`."""
        return np.asarray(self.flatten(threads).get_pixels(self.oiio.FLOAT))

    @property
    def channels(self) -> tuple[str, ...]:
        return tuple(self.image.spec().channelnames)


def diffmoments_transmittance(b0: Array, b: Array, z: Array) -> Callable[[], Array]:
    """A call of diffmoments (Worchel and Alexa 2025) that gives the transmittance at z, (P, K).

    It takes moments for each evaluation, so they are laid out as it wants them here, ahead of the
    call, which computes the absorbance in front and its exponential.
    """
    try:
        from diffmoments.np import compute_moment_bounds  # type: ignore[import-not-found]
    except ImportError:
        raise Missing(
            "the bare reconstruction needs diffmoments: pip install diffmoments"
        ) from None
    rows = np.concatenate([b0[:, None], b * b0[:, None]], axis=1)
    moments = np.ascontiguousarray(np.repeat(rows, z.shape[1], axis=0).T)
    at = np.ascontiguousarray(z.ravel())

    def call() -> Array:
        absorbance = compute_moment_bounds(moments, at, BIAS, BETA)
        return np.asarray(np.exp(-absorbance)).reshape(z.shape)

    return call


def bytes_read(megabytes: int = 256, threads: int = 1) -> Callable[[], int]:
    """A call that reads memory once; it gives how many bytes."""
    call = library("machine.c").read_words
    call.restype = ctypes.c_uint64
    words = np.ones(megabytes << 17, np.uint64)
    start = words.ctypes.data

    def part(first: int, end: int) -> None:
        call(ctypes.c_void_p(start + 8 * first), ctypes.c_int64(end - first))

    def read() -> int:
        _on_threads(threads, len(words), part)
        return int(words.nbytes)

    return read


def clock_cycles(count: int = 20_000_000) -> Callable[[], int]:
    """A call that takes this many cycles of one processor's clock; it gives how many."""
    call = library("machine.c").count_cycles
    call.restype = ctypes.c_uint64

    def spin() -> int:
        call(ctypes.c_uint64(count))
        return count

    return spin
