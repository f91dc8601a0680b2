"""The targets that techniques draw to: which format, and how fragments come together in each.

What passes over triangles (moit.gpu.drawn) bind is this, and what `Technique.targets` tells.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

CHANNELS = {"r": 1, "rg": 2, "rgba": 4}
BYTES = {"8": 1, "16": 2, "16f": 2, "32f": 4}


def channels(format: str) -> int:
    return CHANNELS[format.rstrip("0123456789f")]


def texel_bytes(format: str) -> int:
    """Of a texel of a colour format, or of depth."""
    if format == "depth32f":
        return 4
    name = format.rstrip("0123456789f")
    return CHANNELS[name] * BYTES[format[len(name) :]]


@dataclasses.dataclass(frozen=True)
class Target:
    """A texture that transparent geometry is drawn to.

    format : "r", "rg" or "rgba" and the kind of number: "8" and "16" for integers from 0 to 1,
        "16f" and "32f" for floats.
    blend : how a fragment's numbers s change those that are there, d: "add", d + s; "max", the
        greater; "multiply-complement", d (1 - s); "over", s + d (1 - alpha of s); "under",
        s (1 - alpha of d) + d; "replace", s; "ordered", read and written by the fragments of a
        pixel one after the other, which needs rasterizer-ordered access (a fragment shader
        interlock, or framebuffer fetch).
    clear : what is there at first in a target that is drawn to while fragments are shaded, and in
        one of which the greatest is kept.

    >>> moit.technique("wboit").targets[1]
    Target(format='r32f', blend='multiply-complement', clear=1.0)
    """

    format: str
    blend: str
    clear: float = 0.0


@dataclasses.dataclass(frozen=True)
class Targets:
    """Those of a technique.

    held : what captures a pixel's numbers, () for none: one pass shades all.
    shaded : that of colours, of the pass that shades fragments, and another that it writes; ()
        where `held` has their colours.
    second : what an engine captures in a pass of its own, which reads `held`; moit's own passes
        draw to the same targets again.
    tail : beside `held` what leaves it is blended to, in the same pass.
    rounds : how often geometry is drawn to a layer that is then blended to `shaded`; 0: it is not.
    samples : of a pixel, that have depth and `shaded` each; 0: pixels have one.
    """

    held: tuple[Target, ...] = ()
    shaded: tuple[Target, ...] = ()
    tail: tuple[Target, ...] = ()
    rounds: int = 0
    samples: int = 0
    second: tuple[Target, ...] = ()


def targets_of(technique: Any, colours: str = "16f") -> Targets | None:
    """Of a Technique, with colours in numbers of such a kind; None where it keeps lists."""
    make = _FAMILIES.get(technique.kind)
    return make(technique, colours) if make else None


def shipped_targets_of(technique: Any) -> Targets | None:
    """Those that an engine draws to (moit.export), also of techniques of which moit's own passes
    over triangles keep lists of fragments."""
    make = _SHIPPED.get(technique.kind)
    return make(technique, "16f") if make else targets_of(technique)


def formats_for(numbers: int, kind: str) -> tuple[str, ...]:
    """As few targets as hold so many numbers, without room to spare."""
    fours, rest = divmod(numbers, 4)
    few = {0: (), 1: (f"r{kind}",), 2: (f"rg{kind}",), 3: (f"rg{kind}", f"r{kind}")}
    return (f"rgba{kind}",) * fours + few[rest]


def _shaded(colours: str, second: Target | None = None) -> tuple[Target, ...]:
    return (Target(f"rgba{colours}", "add"), *([second] if second else []))


def _held(formats: tuple[str, ...], blend: str = "add") -> tuple[Target, ...]:
    return tuple(Target(format, blend) for format in formats)


def _moments(numbers: int, bits: int, b0_is_half: bool, colours: str) -> Targets:
    if bits == 32:
        return Targets(_held((*formats_for(numbers, "32f"), "r32f")), _shaded(colours))
    formats = (*formats_for(numbers, "16"), "r16f" if b0_is_half else "r32f")
    return Targets(_held(formats, "ordered"), _shaded(colours))


def _half_moments(t: Any, colours: str) -> Targets:
    held = _held((*formats_for(t.moment_count, "16f"), "r16f"))
    extent = (Target("rg16", "max"),) if t.range_per_pixel else ()
    return Targets((*held, *extent), _shaded(colours))


def _power(t: Any, colours: str) -> Targets:
    if t.in_halves:
        return _half_moments(t, colours)
    return _moments(t.count, t.bits, t.b0_is_half, colours)


def _trigonometric(t: Any, colours: str) -> Targets:
    return _moments(2 * t.count, t.bits, t.b0_is_half, colours)


def _bounded_neural(t: Any, colours: str) -> Targets:
    if t.in_halves:
        return _half_moments(t, colours)
    return _moments(t.moment_count, 32, False, colours)


def _fourier(t: Any, colours: str) -> Targets:
    kind = "16f" if t.bits == 16 else "32f"
    return Targets(_held(formats_for(t.coefficients, kind)), _shaded(colours))


def _moment_transparency(t: Any, colours: str) -> Targets:
    total = Target("r32f", "multiply-complement", 1.0)
    moments = _held(("rgba32f", "r32f"))
    if t.resolution > 1:
        return Targets(moments, _shaded(colours, total))
    return Targets((*moments, total), _shaded(colours))


def _neural(t: Any, colours: str) -> Targets:
    """The paper's; its half floats are words where a round before has to find extents."""
    # -z and z; words are of what is above -1
    extent = Target("rg16", "max") if t.range_per_pixel else Target("rg16f", "max", -1.0)
    return Targets((*_held(("rgba32f", "rg32f")), extent), _shaded(colours))


def _unsorted(t: Any, colours: str) -> Targets:
    return Targets(shaded=(Target(f"rgba{colours}", "over"),))


def _weighted_sum(t: Any, colours: str) -> Targets:
    if getattr(t, "normalize", False):
        return Targets(shaded=_shaded(colours, Target("r32f", "multiply-complement", 1.0)))
    return Targets(shaded=_shaded(colours, Target(f"r{colours}", "add")))


def _weighted_blended(t: Any, colours: str) -> Targets:
    total = Target("r8" if t.bits == 16 else "r32f", "multiply-complement", 1.0)
    return Targets(shaded=_shaded(colours, total))


def _adaptive(t: Any, colours: str) -> Targets:
    return Targets(_held(formats_for(2 * t.nodes, "32f"), "ordered"), _shaded(colours))


def _mlab(t: Any, colours: str) -> Targets:
    # where buckets end: words of how far before the farthest depth
    ends = (Target("rg16", "max"),) if t.buckets else ()
    return Targets((*_held(formats_for(5 * t.layers, "32f"), "ordered"), *ends))


_FAMILIES: dict[str, Callable[[Any, str], Targets]] = {
    "power": _power,
    "neural": _neural,
    "neural-bounded": _bounded_neural,
    "trig": _trigonometric,
    "fourier": _fourier,
    "moment-transparency": _moment_transparency,
    "unsorted": _unsorted,
    "weighted-sum": _weighted_sum,
    "weighted-average": _weighted_sum,
    "wboit": _weighted_blended,
    "adaptive": _adaptive,
    "mlab": _mlab,
}


def _wavelet(t: Any, colours: str) -> Targets:
    return Targets(
        _held(formats_for(t.coefficients, "16f" if t.bits == 16 else "32f")), _shaded(colours)
    )


def _layers(t: Any, *tail: Target) -> Targets:
    return Targets(_held(formats_for(5 * t.layers, "32f"), "ordered"), tail=tail)


def _kbuffer(t: Any, colours: str) -> Targets:
    return _layers(t, Target(f"rgba{colours}", "over"))


def _hybrid(t: Any, colours: str) -> Targets:
    exact = Target("r32f", "multiply-complement", 1.0)
    return _layers(
        t, Target(f"rgba{colours}", "add"), exact if t.normalize else Target("r16f", "add")
    )


def _depth_peeling(t: Any, colours: str) -> Targets:
    return Targets(shaded=(Target(f"rgba{colours}", "under"),), rounds=t.layers)


def _stochastic(t: Any, colours: str) -> Targets:
    total = Target("r32f", "multiply-complement", 1.0)
    return Targets((total,), _shaded(colours), samples=t.samples)


def _gathered_twice(t: Any, colours: str) -> Targets:
    found = _moment_transparency(t, colours)
    return dataclasses.replace(found, second=found.held[:2] if t.passes == 2 else ())


def _hashed_alpha(t: Any, colours: str) -> Targets:
    return Targets(shaded=(Target(f"rgba{colours}", "replace"),))


def _voxels(t: Any, colours: str) -> Targets:
    return Targets(shaded=_shaded(colours, Target("r8", "multiply-complement", 1.0)))


def _slices(t: Any, colours: str) -> Targets:
    if t.total != "block":
        return Targets(_held(("r32f" if t.total == "full" else "r16f",)), _shaded(colours))
    return Targets(shaded=_shaded(colours, Target("r32f", "multiply-complement", 1.0)))


def _anchors(t: Any, colours: str) -> Targets:
    return Targets(shaded=_shaded(colours, Target("r32f", "multiply-complement", 1.0)))


def _front(t: Any, colours: str) -> Targets:
    tail = targets_of(t.behind, colours)
    assert tail
    return Targets(tail.held, _shaded(colours, Target(f"rgba{colours}", "add")))


def _strong(t: Any, colours: str) -> Targets:
    return Targets(
        _held((*formats_for(6, "16f"), "r16f")),
        _shaded(colours, Target("r32f", "multiply-complement", 1.0)),
    )


_SHIPPED: dict[str, Callable[[Any, str], Targets]] = {
    "moment-transparency": _gathered_twice,
    "wavelet": _wavelet,
    "kbuffer": _kbuffer,
    "hybrid": _hybrid,
    "depth-peeling": _depth_peeling,
    "stochastic": _stochastic,
    "hashed-alpha": _hashed_alpha,
    "avboit": _voxels,
    "slices": _slices,
    "anchors": _anchors,
    "strong": _strong,
    "front": _front,
}
