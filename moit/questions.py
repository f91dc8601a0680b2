"""What one asks of fragments and a technique: pictures, transmittance, and what is certain."""

from __future__ import annotations

import dataclasses
import os
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit.catalog import Technique, techniques
from moit.catalog import technique as technique_named
from moit.checks.arguments import truth
from moit.checks.arrays import as_array, finite
from moit.checks.exceptions import FragmentsError, GpuError
from moit.core.engine import Engine, Question
from moit.core.pieces import put, surfaces
from moit.core.questions import CoreQuestion, background_for, in_precision, overflow_text
from moit.engines import engine_of, gpu_of
from moit.fragments.fragments import Fragments
from moit.inputs import as_fragments
from moit.system.environment import thread_count

if TYPE_CHECKING:
    from moit.gpu import Device
else:  # what `typing.get_type_hints` reads, without loading it
    Device = Any

Image = NDArray[Any]
Input = Fragments | str | os.PathLike[str]


def composite(
    f: Input,
    technique: str | Technique,
    *,
    background: ArrayLike = (0, 0, 0),
    device: str | Device = "cpu",
    exact: bool = False,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> Image:
    """The picture that a technique makes of fragments.

    f : Fragments with colour, a path or a scene's name.
    technique : a technique or its name.
    background : (3,) or (height, width, 3) linear radiance behind everything, finite.
    device : "cpu", "gpu" or a `moit.gpu.Device`, which computes by passes.
    exact : of a GPU. True: passes compute with the CPU's kernels, most of it in double: the same
        bits where the device rounds as a CPU does. False: techniques that have a text for engines
        take that, in floats alone, as fast as published shaders: transmittance to about 1e-4.
        The CPU is exact in any case, and so are fragments in float64.
    threads : at least 1; None: MOIT_THREADS, or as many as this process has processors. The
        result is the same bits for any number.
    dtype : float32 or float64, in which all is computed; None: that of `f`.
    cull_opaque : take the nearest fragment of alpha 1 for the pixel's opaque surface: its colour
        is the background, and what is farther is culled. One with transmission is a coloured
        filter, and not opaque.
    part, layer : which of a deep EXR, as `read_deep`; only where `f` is a path of one.

    Returns (height, width, 4): linear RGB, already over the background, and 1 - total
    transmittance. Moment techniques follow MBOIT equations 1 and 2.

    Techniques that keep half floats cannot hold more than 65504: where a pixel's sums reach that,
    its colours are not those of the technique, and a RuntimeWarning says in how many pixels.

    With transmission a fragment dims each channel c of what is behind it by its own
    1 - alpha (1 - transmission[c]), and adds alpha color. "sorted" and "unsorted" do just that.
    Other techniques have one curve for all channels, that of the net coverage `f.coverage`:
    fragments are seen through it, and its weights sum to what it covers; the background, or the
    opaque surface, is seen through each channel's own total (McGuire and Mara, "A Phenomenological
    Scattering Model for Order-Independent Transparency", 2016). Fourth is 1 - the mean of these.

    Raises FragmentsError where there is no colour or a depth that the technique's warp cannot
    take; ValueError and TypeError for other arguments that do not fit; GpuError where there is no
    such device or it cannot do what is asked.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], [[1, 0, 0], [0, 1, 0]])
    >>> moit.composite(f, "sorted").round(3).tolist()
    [[[0.5, 0.25, 0.0, 0.75]]]
    """
    asked = Asked.of(f, technique, threads, dtype, cull_opaque, device, part, layer, exact)
    image, overflows = composite_and_overflows(asked, background)
    if overflows:
        warnings.warn(overflow_text(overflows), RuntimeWarning, stacklevel=2)
    return image


def composite_and_overflows(asked: Asked, background: ArrayLike) -> tuple[Image, int]:
    """The picture, and of how many pixels more is kept than half floats hold, for those who warn of
    several pictures at once."""
    if asked.fragments.color is None:
        raise FragmentsError("color: composite needs the fragments' colour; found None")
    question = asked.question()
    image = question.composite(background_for(background, asked.fragments))
    return image, question.overflows


def transmittance(
    f: Input,
    technique: str | Technique,
    depth: ArrayLike | None = None,
    *,
    device: str | Device = "cpu",
    exact: bool = False,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> NDArray[Any]:
    """The share of light that a technique lets through from the eye to a depth.

    depth : None: to each fragment, before renormalisation; (N,). (K,) finite depths: the curve of
        every pixel, (height, width, K), counting fragments strictly nearer; exact outside the
        range that depth is warped from: the fragments' depth_range, or with depth_range="pixel"
        the pixel's own. Volumes are cut there, so what is nearer of them counts.

    Other arguments as `composite`; colour is not needed but where a weight looks at it. Behind an
    opaque surface the result is 0, at the surface itself the pixel's total. Weighted blending
    gives w_i (1 - prod(1 - alpha)) / sum(alpha w), and `dfa` what a colour counts with by its
    alpha: these may be more than 1. With transmission this is, for "sorted" too, the transmittance
    of the net coverage `f.coverage`, which is what alpha means here.

    Raises TypeError where `depth` is given and the technique has no curve, else as `composite`.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> moit.transmittance(f, "sorted").round(3).tolist()
    [1.0, 0.5]
    >>> moit.transmittance(f, "sorted", depth=[1.5, 3]).round(3).tolist()
    [[[0.5, 0.25]]]
    """
    asked = Asked.of(f, technique, threads, dtype, cull_opaque, device, part, layer, exact)
    return asked.question().transmittance(depths_for(depth, asked.technique))


def bounds(
    f: Input,
    technique: str | Technique,
    depth: ArrayLike | None = None,
    *,
    device: str | Device = "cpu",
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """What a technique's state proves about the exact transmittance: (lower, upper).

    Shapes and arguments as `transmittance`. For moments these are the sharp bounds of the moment
    problem (MBOIT section 4.1) with the moments as they were before bias, widened outward for
    rounding; to a fragment they use its own alpha, which cannot occlude itself. Techniques that
    prove nothing give exp(-b0) and 1. They hold for the exact transmittance of strictly nearer
    fragments, and with `sorted` for that of earlier ones at equal depth, too. With transmission
    that is of the net coverage, as in `transmittance`. Colour is not needed. On the CPU only.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> lower, upper = moit.bounds(f, "power4")
    >>> bool((lower <= upper).all())
    True
    """
    asked = Asked.of(f, technique, threads, dtype, cull_opaque, device, part, layer)
    if not asked.engine.proves:
        raise GpuError("device: bounds are computed on the CPU only; use device='cpu'")
    return asked.question(blends=False).bounds(_depths(depth))


def total_transmittance(
    f: Input,
    technique: str | Technique,
    *,
    device: str | Device = "cpu",
    exact: bool = False,
    threads: int | None = None,
    dtype: DTypeLike | None = None,
    cull_opaque: bool = True,
    part: int | str | None = None,
    layer: str | None = None,
) -> NDArray[Any]:
    """What a technique lets through to the background: (height, width), or (height, width, 3) of
    fragments with transmission. Arguments as `composite`; colour is not needed.

    0 where an opaque surface hides the background. `weighted-sum` holds 1 - sum of alpha, which
    may be negative.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> moit.total_transmittance(f, "sorted").round(3).tolist()
    [[0.25]]
    """
    asked = Asked.of(f, technique, threads, dtype, cull_opaque, device, part, layer, exact)
    return asked.question(blends=False).total_transmittance()


@dataclasses.dataclass(frozen=True)
class Asked:
    """What a question is about, checked once, and who answers."""

    fragments: Fragments
    technique: Technique
    engine: Engine
    cull_opaque: bool
    threads: int

    @classmethod
    def of(
        cls,
        f: Input,
        technique: str | Technique,
        threads: int | None,
        dtype: DTypeLike | None,
        cull_opaque: bool,
        device: str | Device = "cpu",
        part: int | str | None = None,
        layer: str | None = None,
        exact: bool = False,
    ) -> Asked:
        """Arguments as `composite`. Raises TypeError, ValueError, FragmentsError and GpuError."""
        gpu = gpu_of(device)
        workers = thread_count(threads)
        chosen = technique_named(technique)
        fragments = in_precision(as_fragments(f, part=part, layer=layer), dtype)
        culls = truth("cull_opaque", cull_opaque)
        engine = engine_of(chosen, gpu, truth("exact", exact))
        if fragments.transmission is not None and not chosen.supports_transmission:
            able = dict.fromkeys(t.kind for t in techniques() if t.supports_transmission)
            raise ValueError(
                f"transmission: {chosen} takes fragments without it only; with coloured "
                f"transmission there are {', '.join(able)}"
            )
        return cls(fragments, chosen, engine, culls, workers)

    def question(self, blends: bool = True) -> Question:
        """Put to the engine; see `moit.core.engine.Engine.question`."""
        return put(self.engine, self.fragments, self.technique, blends=blends, **self.how)

    def in_core(self, blends: bool = True) -> CoreQuestion:
        """Put to the core, for what it alone can be asked: of what the technique is given."""
        f, _ = surfaces(self.fragments, self.technique, self.threads)
        return CoreQuestion(f, self.technique, blends=blends, **self.how)

    @property
    def how(self) -> dict[str, Any]:
        return {"cull_opaque": self.cull_opaque, "threads": self.threads}


def depths_for(depth: ArrayLike | None, technique: Technique) -> NDArray[np.float64] | None:
    """Depths that a technique is asked at, or None: at fragments."""
    if depth is not None and not technique.has_curve:
        raise TypeError(
            f"depth: {technique} has no transmittance but at fragments; leave depth out"
        )
    return _depths(depth)


def _depths(depth: ArrayLike | None) -> NDArray[np.float64] | None:
    if depth is None:
        return None
    array = as_array(depth, "depth")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"depth: expected real numbers, got {array.dtype}")
    if array.ndim != 1:
        raise ValueError(f"depth: expected shape (K,), got {array.shape}")
    return finite(array, "depth", np.float64)


def _exact_picture(f: Fragments) -> tuple[Image, str]:
    """How fragments look over black; uncoloured, how much light they let through."""
    if f.color is not None:
        return composite(f, "sorted")[..., :3], "exact composite over black"
    total = total_transmittance(f, "sorted")
    grey = total if total.ndim == 3 else total[..., None]
    return np.broadcast_to(grey, (*f.shape, 3)), "total transmittance"


Fragments._shown_as = _exact_picture
