"""The engine that is always there: the C core."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit import _core
from moit.catalog.technique import Technique
from moit.checks.arrays import as_array, finite
from moit.core.engine import Array, Depths
from moit.fragments.fragments import Fragments
from moit.fragments.ranges import stated_range


class CoreQuestion:
    """A `moit.core.engine.Question` that the core answers, and what it alone can be asked."""

    def __init__(
        self,
        f: Fragments,
        technique: Technique,
        *,
        cull_opaque: bool,
        threads: int,
        blends: bool = True,
    ) -> None:
        self.fields = (technique.fields_for if blends else technique.fields_for_totals)(f)
        self.threads = threads
        self.overflows = 0
        self.given = f, self.fields, cull_opaque, threads

    def composite(self, background: NDArray[np.float64]) -> Array:
        image, self.overflows = _core.composite(*self.given, background)
        return image

    def transmittance(self, depths: Depths) -> Array:
        return _core.transmittance(*self.given, depths)

    def bounds(self, depths: Depths) -> tuple[Array, Array]:
        return _core.bounds(*self.given, depths)

    def total_transmittance(self) -> Array:
        return _core.total_transmittance(*self.given)

    def moments(self, words: bool) -> tuple[Array, Array]:
        """(b0, b) as `moit.moments.gather` has them, complex numbers as pairs."""
        return _core.gather(*self.given, words)

    def network_features(self) -> NDArray[np.float64]:
        """(N, columns): what the technique's network sees of each fragment."""
        return _core.network_features(*self.given)


class CoreEngine:
    """The C core as a `moit.core.engine.Engine`."""

    proves = True

    def question(
        self,
        f: Fragments,
        technique: Technique,
        *,
        cull_opaque: bool,
        threads: int,
        blends: bool = True,
    ) -> CoreQuestion:
        return CoreQuestion(f, technique, cull_opaque=cull_opaque, threads=threads, blends=blends)


CORE = CoreEngine()


def in_precision(f: Fragments, dtype: DTypeLike | None) -> Fragments:
    """`f` with numbers of `dtype`; f itself where that is so already, or dtype is None.

    Raises TypeError where dtype is neither float32 nor float64.
    """
    if dtype is None:
        return f
    try:
        wanted: Any = np.dtype(dtype)
    except TypeError:
        wanted = repr(dtype)
    if wanted not in (np.float32, np.float64):
        raise TypeError(f"dtype: expected float32, float64 or None, got {wanted}")
    if wanted == f.depth.dtype:
        return f
    near, far = f.depth_range
    (least, most), transparent = stated_range(f._arrays())
    # A float32 depth may lie beyond the range's end by that end's rounding.
    if transparent and math.isfinite(least) and math.isfinite(most):
        near, far = min(near, least), max(far, most)
    return _but(f, (near, far), wanted)


def in_range(f: Fragments, depth_range: tuple[float, float] | None) -> Fragments:
    """`f` with that range for its depth; f itself for None. FragmentsError as Fragments has it."""
    return f if depth_range is None else _but(f, depth_range, f.dtype)


def _but(f: Fragments, depth_range: tuple[float, float], dtype: Any) -> Fragments:
    return Fragments(
        f.offsets,
        f.depth,
        f.alpha,
        f.color,
        transmission=f.transmission,
        back=f.back,
        emission=f.emission,
        deviation=f.deviation,
        shape=f.shape,
        depth_range=depth_range,
        origin=f.origin,
        dtype=dtype,
        frame=f.frame,
    )


def overflow_text(pixels: int) -> str:
    """What a warning says of pixels whose half floats overflow."""
    return (
        f"technique: {pixels} pixels keep sums beyond 65504, the largest half float, and have "
        "other colours for it; use an option that stores floats (bits=32, quantized=False, "
        'target="rgba32f"), or lesser weights or colours'
    )


def background_for(background: ArrayLike, f: Fragments) -> NDArray[np.float64]:
    """`background` as engines take it, (3,) or (height, width, 3), finite."""
    return background_of(background, f.shape, f.depth.dtype)


def background_of(
    background: ArrayLike, shape: tuple[int, int], dtype: DTypeLike
) -> NDArray[np.float64]:
    """The same, behind a picture of that shape and dtype."""
    array = as_array(background, "background")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"background: expected real numbers, got {array.dtype}")
    if array.shape not in ((3,), (*shape, 3)):
        raise ValueError(f"background: expected (3,) or {(*shape, 3)}, got {array.shape}")
    finite(array, "background", dtype)  # what the image can show
    return finite(array, "background", np.float64)
