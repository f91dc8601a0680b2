"""What one asks of fragments and a technique: pictures, transmittance, and what is certain."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit import _core
from moit.catalog import PerPixel, Technique, techniques
from moit.catalog import technique as technique_named
from moit.checks.arguments import gpu_of, truth
from moit.checks.arrays import as_array, finite
from moit.checks.exceptions import FragmentsError, GpuError
from moit.fragments.fragments import Fragments
from moit.inputs import as_fragments
from moit.system.environment import thread_count

if TYPE_CHECKING:
    from moit.gpu import Device
    from moit.gpu.questions import Question as GpuQuestion
    from moit.per_pixel.plan import Question as ByPixel

Image = NDArray[Any]
Input = Fragments | str | os.PathLike[str]


def composite(
    f: Input,
    technique: str | Technique,
    *,
    background: ArrayLike = (0, 0, 0),
    device: str | Device = "cpu",
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> Image:
    """The picture that a technique makes of fragments.

    f : Fragments with colour, a path or a scene's name.
    technique : a technique or its name.
    background : (3,) or (height, width, 3) linear radiance behind everything, finite.
    device : "cpu", "gpu" or a `moit.gpu.Device`, which computes by passes with the same kernels.
    threads : at least 1; None: MOIT_THREADS, or as many as this process has processors. The
        result is the same bits for any number.
    dtype : float32 or float64, in which all is computed; None: that of `f`.
    cull_opaque : take the nearest fragment of alpha 1 for the pixel's opaque surface: its colour
        is the background, and what is farther is culled. One with transmission is a coloured
        filter, and not opaque.

    Returns (height, width, 4): linear RGB, already over the background, and 1 - total
    transmittance. Moment techniques follow MBOIT equations 1 and 2.

    With transmission a fragment dims each channel c of what is behind it by its own
    1 - alpha (1 - transmission[c]), and adds alpha color. "sorted" and "unsorted" do just that.
    Other techniques have one curve for all channels, that of the net coverage `f.coverage`:
    fragments are seen through it, and its weights sum to what it covers; the background, or the
    opaque surface, is seen through each channel's own total (McGuire and Mara, "A Phenomenological
    Scattering Model for Order-Independent Transparency", 2016). Fourth is 1 - the mean of these.

    Raises FragmentsError where there is no colour or a depth that the technique's warp cannot
    take; ValueError and TypeError for other arguments that do not fit; GpuError where there is no
    such device or it cannot do what is asked.
    """
    q = _Question(f, technique, device, threads, dtype, cull_opaque)
    if q.fragments.color is None:
        raise FragmentsError("color: composite needs the fragments' colour; found None")
    behind = background_for(background, q.fragments)
    if q.by_pixel is not None:
        return q.by_pixel.composite(behind)
    if q.gpu is not None:
        return q.on_gpu().composite(behind)
    return _core.composite(*q.for_core(), behind)


def transmittance(
    f: Input,
    technique: str | Technique,
    depth: ArrayLike | None = None,
    *,
    device: str | Device = "cpu",
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> NDArray[Any]:
    """The share of light that a technique lets through from the eye to a depth.

    depth : None: to each fragment, before renormalisation; (N,). (K,) finite depths: the curve of
        every pixel, (height, width, K), counting fragments strictly nearer; exact outside the
        range that depth is warped from: the fragments' depth_range, or with depth_range="pixel"
        the pixel's own.

    Other arguments as `composite`; colour is not needed but where a weight looks at it. Behind an
    opaque surface the result is 0, at the surface itself the pixel's total. Weighted blending
    gives w_i (1 - prod(1 - alpha)) / sum(alpha w). With transmission this is, for "sorted" too, the
    transmittance of the net coverage `f.coverage`, which is what alpha means here.

    Raises TypeError where `depth` is given and the technique has no curve, else as `composite`.
    """
    q = _Question(f, technique, device, threads, dtype, cull_opaque)
    depths = q.depths(depth)
    if q.by_pixel is not None:
        return q.by_pixel.transmittance(depths)
    if q.gpu is not None:
        asked = q.on_gpu()
        return asked.transmittance() if depths is None else asked.curve(depths)
    return _core.transmittance(*q.for_core(), depths)


def bounds(
    f: Input,
    technique: str | Technique,
    depth: ArrayLike | None = None,
    *,
    device: str | Device = "cpu",
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """What a technique's state proves about the exact transmittance: (lower, upper).

    Shapes and arguments as `transmittance`. For moments these are the sharp bounds of the moment
    problem (MBOIT section 4.1) with the moments as they were before bias, widened outward for
    rounding; to a fragment they use its own alpha, which cannot occlude itself. Techniques that
    prove nothing give exp(-b0) and 1. They hold for the exact transmittance of strictly nearer
    fragments, and with `sorted` for that of earlier ones at equal depth, too. With transmission
    that is of the net coverage, as in `transmittance`. Colour is not needed. On the CPU only.
    """
    q = _Question(f, technique, device, threads, dtype, cull_opaque, blends=False)
    if q.gpu is not None:
        raise GpuError("device: bounds are computed on the CPU only; use device='cpu'")
    depths = None if depth is None else q.depths(depth, any_technique=True)
    if q.by_pixel is not None:
        return q.by_pixel.bounds(depths)
    return _core.bounds(*q.for_core(), depths)


def total_transmittance(
    f: Input,
    technique: str | Technique,
    *,
    device: str | Device = "cpu",
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
) -> NDArray[Any]:
    """What a technique lets through to the background: (height, width), or (height, width, 3) of
    fragments with transmission. Arguments as `composite`; colour is not needed.

    0 where an opaque surface hides the background. `weighted-sum` holds 1 - sum of alpha, which
    may be negative.
    """
    q = _Question(f, technique, device, threads, dtype, cull_opaque, blends=False)
    if q.by_pixel is not None:
        return q.by_pixel.total_transmittance()
    if q.gpu is not None:
        return q.on_gpu().total_transmittance()
    return _core.total_transmittance(*q.for_core())


class _Question:
    """The arguments that all questions share, checked."""

    def __init__(
        self,
        f: Input,
        technique: str | Technique,
        device: str | Device,
        threads: int | None,
        dtype: DTypeLike | None,
        cull_opaque: bool,
        blends: bool = True,
    ) -> None:
        self.gpu = gpu_of(device)
        self.threads = thread_count(threads)
        self.technique = technique_named(technique)
        self.fragments = in_precision(as_fragments(f), dtype)
        self.cull_opaque = truth("cull_opaque", cull_opaque)
        if self.fragments.transmission is not None and not self.technique.supports_transmission:
            able = dict.fromkeys(t.kind for t in techniques() if t.supports_transmission)
            raise ValueError(
                f"transmission: {self.technique} takes fragments without it only; with coloured "
                f"transmission there are {', '.join(able)}"
            )
        fields_for = self.technique.fields_for if blends else self.technique.fields_for_totals
        self.fields = fields_for(self.fragments)
        self.by_pixel: ByPixel | None = None
        if isinstance(self.technique, PerPixel):
            from moit.per_pixel.plan import Question as ByPixel

            self.by_pixel = ByPixel(
                self.fragments, self.technique, self.cull_opaque, self.threads, self.gpu or "cpu"
            )

    def on_gpu(self) -> GpuQuestion:
        from moit.gpu.questions import Question

        assert self.gpu is not None
        return Question(
            self.gpu, self.fragments, self.technique, self.fields, self.cull_opaque, self.threads
        )

    def for_core(self) -> tuple[Fragments, dict[str, Any], bool, int]:
        return self.fragments, self.fields, self.cull_opaque, self.threads

    def depths(
        self, depth: ArrayLike | None, any_technique: bool = False
    ) -> NDArray[np.float64] | None:
        if depth is None:
            return None
        if not (self.technique.has_curve or any_technique):
            raise TypeError(
                f"depth: {self.technique} has no transmittance but at fragments; leave depth out"
            )
        array = as_array(depth, "depth")
        if array.dtype.kind not in "fiu":
            raise TypeError(f"depth: expected real numbers, got {array.dtype}")
        if array.ndim != 1:
            raise ValueError(f"depth: expected shape (K,), got {array.shape}")
        return finite(array, "depth", np.float64)


def in_precision(f: Fragments, dtype: DTypeLike | None) -> Fragments:
    """`f` with numbers of `dtype`; f itself where that is so already."""
    if dtype is None:
        return f
    try:
        wanted = np.dtype(dtype)
    except TypeError:
        raise TypeError(f"dtype: expected float32, float64 or None, got {dtype!r}") from None
    if wanted not in (np.float32, np.float64):
        raise TypeError(f"dtype: expected float32, float64 or None, got {wanted}")
    if wanted == f.depth.dtype:
        return f
    return Fragments(
        f.offsets,
        f.depth,
        f.alpha,
        f.color,
        transmission=f.transmission,
        shape=f.shape,
        depth_range=f.depth_range,
        origin=f.origin,
        dtype=wanted,
    )


def background_for(background: ArrayLike, f: Fragments) -> NDArray[np.float64]:
    array = as_array(background, "background")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"background: expected real numbers, got {array.dtype}")
    if array.shape not in ((3,), (*f.shape, 3)):
        raise ValueError(f"background: expected (3,) or {(*f.shape, 3)}, got {array.shape}")
    finite(array, "background", f.depth.dtype)  # what the image can show
    return finite(array, "background", np.float64)
