"""Questions to techniques that are Python functions: what these are given, what they have to give,
and how colours are blended by it. All in float64, but for what functions make of their arrays."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog import PythonTechnique, Technique, WeightedAverage
from moit.checks.arrays import as_array, finite
from moit.checks.exceptions import FragmentsError, GpuError, TechniqueError, told
from moit.core.engine import Array, Depths, Engine
from moit.core.questions import CORE
from moit.fragments.fragments import Fragments

# Of a call: where an image has more, functions get some rows of it at a time.
MOST_FRAGMENTS = 1 << 22
MOST_NUMBERS = 1 << 22  # of a curve's depths in all pixels


@dataclasses.dataclass(frozen=True, eq=False)
class PythonQuestion:
    """A `moit.core.engine.Question`. `f` has neither volumes nor emission."""

    f: Fragments
    technique: PythonTechnique
    cull_opaque: bool
    threads: int
    overflows: ClassVar[int] = 0  # nobody but the function knows what it keeps

    def composite(self, background: NDArray[np.float64]) -> Array:
        height, width = self.f.shape
        behind = self._behind(background)
        seen, total = self.seen, self.totals
        if self.technique.composite is None:
            coefficients = self._blended()
            image = np.empty((len(behind), 4))
            image[:, :3] = total * behind + coefficients
            image[:, 3] = 1 - total.mean(axis=1)
        else:
            parts = []
            for rows, part in self._chunks(seen.given):
                answer = self._call("composite", part, behind[rows].copy())
                pixels = len(part.counts)
                flat = (*part.shape, 4) if np.ndim(answer) == 3 else (pixels, 4)
                parts.append(self._numbers("composite", answer, flat).reshape(pixels, 4))
            image = np.concatenate(parts)
        image[seen.occluder >= 0, 3] = 1
        return self._held(image).reshape(height, width, 4)

    def transmittance(self, depths: Depths) -> Array:
        height, width = self.f.shape
        if depths is None:
            return self._held(self._of_all(self.at_fragments))
        curve = self._curve(depths)
        curve[self._behind_opaque(depths)] = 0
        return self._held(curve).reshape(height, width, len(depths))

    def bounds(self, depths: Depths) -> tuple[Array, Array]:
        if self.technique.bounds is None:  # what the total proves, as the core has it
            proves = CORE.question(
                self.f, WeightedAverage(), cull_opaque=self.cull_opaque, threads=self.threads
            )
            return proves.bounds(depths)
        sides: tuple[list[Array], list[Array]] = ([], [])
        for part in self._parts(0 if depths is None else len(depths)):
            answer = self._call("bounds", part, None if depths is None else depths.copy())
            if not isinstance(answer, (tuple, list)) or len(answer) != 2:
                raise self._error("bounds", f"expected (lower, upper), got {_kind(answer)}")
            shape = (len(part),) if depths is None else (len(part.counts), len(depths))
            for side, one in zip(sides, answer, strict=True):
                side.append(self._numbers("bounds", one, shape))
        found = []
        for answers in sides:
            bound = np.concatenate(answers)
            if depths is None:
                found.append(self._held(self._of_all(bound)))
            else:
                bound[self._behind_opaque(depths)] = 0
                found.append(self._held(bound).reshape(*self.f.shape, len(depths)))
        return found[0], found[1]

    def total_transmittance(self) -> Array:
        totals = self.totals.copy()
        totals[self.seen.occluder >= 0] = 0
        channels = () if self.f.transmission is None else (3,)
        return self._held(totals).reshape(*self.f.shape, *channels)

    # ---- What is true of the fragments, and what functions say ----

    @cached_property
    def seen(self) -> _Seen:
        return _Seen.of(self.f, self.cull_opaque, self.threads)

    @cached_property
    def total(self) -> NDArray[np.float64]:
        """(P,) what each pixel lets through, by the net coverage."""
        return self._totals_of(self.seen.covering)

    @cached_property
    def totals(self) -> NDArray[np.float64]:
        """(P, 1), with transmission (P, 3)."""
        if self.seen.opacity is None:
            return self.total[:, None]
        channels = [
            self._totals_of(self.seen.with_alpha(np.ascontiguousarray(alpha)))
            for alpha in self.seen.opacity.T
        ]
        return np.stack(channels, axis=1)

    @cached_property
    def at_fragments(self) -> NDArray[np.float64]:
        """(n,) in front of each fragment that is seen."""
        t = self.technique
        answers = []
        for part in self._parts():
            if t.transmittance is not None:
                answer = self._call("transmittance", part)
                answers.append(self._numbers("transmittance", answer, (len(part),)))
            else:
                pixel = np.repeat(np.arange(len(part.counts)), part.counts)
                state = self._state(part)[pixel]
                answers.append(self._read(state, part.depth.copy(), part.alpha.copy()))
        return np.concatenate(answers)

    def _of_all(self, seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N,) of fragments that are seen (n,); of opaque surfaces what is let through in front of
        them, and 0 behind them."""
        answer = np.zeros(len(self.f))
        answer[self.seen.kept] = seen
        opaque = self.seen.occluder >= 0
        answer[self.seen.occluder[opaque]] = self.total[opaque]
        return answer

    def _curve(self, depths: NDArray[np.float64]) -> NDArray[np.float64]:
        """(P, K)."""
        t, count = self.technique, len(depths)
        answers = []
        for part in self._parts(count):
            pixels = len(part.counts)
            if t.curve is not None:
                given = depths.astype(self.f.dtype)
                answers.append(
                    self._numbers("curve", self._call("curve", part, given), (pixels, count))
                )
            else:
                state = np.repeat(self._state(part), count, axis=0)
                at = np.tile(depths.astype(self.f.dtype), pixels)
                answers.append(self._read(state, at, np.zeros_like(at)).reshape(pixels, count))
        return np.concatenate(answers)

    def _totals_of(self, f: Fragments) -> NDArray[np.float64]:
        if self.technique.total is None:
            return _products(f)
        answers = []
        for _, part in self._chunks(f):
            answer = self._call("total", part)
            answers.append(self._numbers("total", answer, (len(part.counts),)))
        return np.concatenate(answers)

    def _state(self, part: Fragments) -> Array:
        state = self._array("gather", self._call("gather", part))
        if state.ndim == 0 or len(state) != len(part.counts):
            raise self._error("gather", f"expected ({len(part.counts)}, ...), got {state.shape}")
        return state

    def _read(self, state: Array, depth: Array, alpha: Array) -> NDArray[np.float64]:
        count = len(depth)
        return self._numbers("read", self._call("read", state, depth, alpha), (count,))

    # ---- Blending ----

    def _blended(self) -> NDArray[np.float64]:
        """(P, 3) what fragments add."""
        seen = self.seen
        color = seen.covering.color
        if color is None:
            raise FragmentsError("color: composite needs the fragments' colour; found None")
        pixels = len(self.f.counts)
        pixel = np.repeat(np.arange(pixels), seen.covering.counts)
        alpha = seen.covering.alpha.astype(np.float64)
        weight = alpha * self.at_fragments
        sums = np.bincount(pixel, weight, minlength=pixels)
        covers = 1 - self.total
        if self.technique.normalize:
            lost = (sums == 0) & (covers > 0)  # all that is known is that they are nothing
            if lost.any():
                weight = np.where(lost[pixel], alpha, weight)
                sums = np.bincount(pixel, weight, minlength=pixels)
            scale = np.divide(covers, sums, out=np.ones(pixels), where=sums > 0)
            weight = weight * scale[pixel]
        if seen.opacity is not None:  # light is of alpha, what is weighed of the net coverage
            weight = np.divide(
                weight * seen.alpha, alpha, out=np.zeros_like(weight), where=alpha > 0
            )
        return np.stack(
            [np.bincount(pixel, weight * c, minlength=pixels) for c in color.T.astype(np.float64)],
            axis=1,
        )

    def _behind(self, background: NDArray[np.float64]) -> NDArray[np.float64]:
        """(P, 3) the background, or the opaque surface."""
        height, width = self.f.shape
        behind = np.broadcast_to(background, (height, width, 3)).reshape(-1, 3).copy()
        opaque = self.seen.occluder >= 0
        if self.f.color is not None:
            behind[opaque] = self.f.color[self.seen.occluder[opaque]]
        return behind

    def _behind_opaque(self, depths: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(P, K)."""
        occluder = self.seen.occluder
        wall = np.full(len(occluder), np.inf)
        wall[occluder >= 0] = self.f.depth[occluder[occluder >= 0]]
        return depths[None, :] > wall[:, None]

    # ---- Calls ----

    def _chunks(self, f: Fragments, depths: int = 0) -> Iterator[tuple[slice, Fragments]]:
        if self.technique.local:
            return _chunks(f, depths)
        return iter([(slice(None), _copied(f))])

    def _parts(self, depths: int = 0) -> Iterator[Fragments]:
        for _, part in self._chunks(self.seen.covering, depths):
            yield part

    def _call(self, name: str, *arguments: Any) -> Any:
        function: Callable[..., Any] = getattr(self.technique, name)
        try:
            return function(*arguments)
        except MemoryError:
            raise
        except Exception as error:  # it may raise anything
            raise self._error(name, f"raised {told(error)}") from error

    def _array(self, name: str, answer: Any) -> Array:
        try:
            found = as_array(answer, name)
        except Exception as error:
            raise self._error(name, f"expected an array, got {_kind(answer)}: {error}") from error
        return found

    def _numbers(self, name: str, answer: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
        found = self._array(name, answer)
        if found.dtype.kind not in "fiu":
            raise self._error(name, f"expected real numbers, got {found.dtype} ({_kind(answer)})")
        if found.shape != shape:
            raise self._error(name, f"expected shape {shape}, got {found.shape}")
        try:
            finite(found, "result", self.f.dtype)
        except ValueError as error:
            raise self._error(name, str(error)) from None
        return found.astype(np.float64)

    def _error(self, name: str, what: str) -> TechniqueError:
        return TechniqueError(f"{self.technique}: {name}: {what}")

    def _held(self, answer: NDArray[np.float64]) -> Array:
        with np.errstate(over="ignore"):
            return answer.astype(self.f.dtype)


@dataclasses.dataclass(frozen=True)
class _Seen:
    """What is in front of opaque surfaces.

    kept : (N,) which fragments. occluder : (P,) the opaque surface's index, or -1. opacity : (n, 3)
        of each channel, where there is transmission. given : the fragments that are kept as they
        are. covering : with the net coverage as alpha.
    """

    kept: NDArray[np.bool_]
    occluder: NDArray[np.int64]
    opacity: NDArray[np.float64] | None
    given: Fragments
    covering: Fragments

    @classmethod
    def of(cls, f: Fragments, cull_opaque: bool, threads: int) -> _Seen:
        kept, occluder, opacity, net = _core.surviving(f, cull_opaque, threads)
        offsets = np.concatenate([[0], np.cumsum(kept)])[f.offsets]
        taken = [None if one is None else one[kept] for one in f._arrays()[:4]]
        depth, alpha, color, transmission = taken
        assert depth is not None and alpha is not None
        given = f._with(depth, alpha, color, transmission, offsets=offsets)
        covers = alpha if net is None or opacity is None else np.asarray(net, f.dtype)[kept]
        covering = f._with(depth, covers, color, offsets=offsets)
        channels = None if opacity is None else np.asarray(opacity, np.float64)[kept]
        return cls(kept, occluder, channels, given, covering)

    @property
    def alpha(self) -> NDArray[np.float64]:
        return self.given.alpha.astype(np.float64)

    def with_alpha(self, alpha: Array) -> Fragments:
        f = self.covering
        return f._with(f.depth, alpha.astype(f.dtype), f.color)


@dataclasses.dataclass(frozen=True)
class PythonEngine:
    """Python on the CPU; `below` is who answers for others."""

    below: Engine
    proves: ClassVar[bool] = True

    def question(
        self,
        f: Fragments,
        technique: Technique,
        *,
        cull_opaque: bool,
        threads: int,
        blends: bool = True,
    ) -> PythonQuestion:
        assert isinstance(technique, PythonTechnique)
        if self.below is not CORE:
            raise GpuError(f"device: {technique} is Python, on the CPU only; use device='cpu'")
        return PythonQuestion(f, technique, cull_opaque, threads)


def _chunks(f: Fragments, depths: int = 0) -> Iterator[tuple[slice, Fragments]]:
    """Whole rows of an image, all of them where these are few fragments: which pixels, and copies
    that their reader may write to."""
    height, width = f.shape
    begin = 0
    while True:
        end = height
        if len(f) > MOST_FRAGMENTS or len(f.counts) * depths > MOST_NUMBERS:
            ends = f.offsets[begin * width :: width][1:] - f.offsets[begin * width]
            fits = (ends <= MOST_FRAGMENTS) & (
                np.arange(1, len(ends) + 1) * width * depths <= MOST_NUMBERS
            )
            end = begin + max(1, int(fits.sum()))
        end = min(end, height)
        part = f if (begin, end) == (0, height) else f[begin:end, :]
        yield slice(begin * width, end * width), _copied(part)
        begin = end
        if begin >= height:
            return


def _copied(f: Fragments) -> Fragments:
    """The same, of arrays that belong to who gets them: such can be shared by DLPack."""
    copy = f._with(*f._arrays())
    for name in ("offsets", "depth", "alpha", "color", "transmission"):
        held = getattr(f, name)
        object.__setattr__(copy, name, None if held is None else held.copy())
    return copy


def _products(f: Fragments) -> NDArray[np.float64]:
    """(P,) the product of 1 - alpha."""
    through = np.append(1 - f.alpha.astype(np.float64), 1.0)
    found = np.multiply.reduceat(through, f.offsets[:-1]) if len(f.counts) else np.ones(0)
    return np.where(f.counts > 0, found, 1.0)


def _kind(value: Any) -> str:
    return type(value).__name__
