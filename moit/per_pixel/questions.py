"""The engine of techniques that give every pixel one of its own."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from moit.catalog import PerPixel, Technique
from moit.core.engine import Array, Depths, Engine, Question
from moit.core.questions import CORE
from moit.fragments.fragments import Fragments
from moit.per_pixel.plan import Plan, plan_of
from moit.per_pixel.selection import Selection, brightness, fragments_of


@dataclasses.dataclass(frozen=True)
class PerPixelQuestion:
    """A `moit.core.engine.Question` that is put to each pixel's own technique.

    engine : who answers for these; whoever that is, the core chooses.
    """

    seen: Selection
    technique: PerPixel
    engine: Engine = CORE
    overflows: ClassVar[int] = 0  # nobody chooses what does

    def composite(self, background: Array) -> Array:
        return self.image(plan_of(self.seen, self.technique, brightness(background)), background)

    def image(self, plan: Plan, background: Array) -> Array:
        """(height, width, 4)."""
        answer = np.empty((len(plan.of_pixel), 4), self.seen.f.dtype)
        for one, pixels in plan.groups():
            answer[pixels] = self.seen.colors(pixels, one, background, self.engine)
        return answer.reshape(*self.seen.f.shape, 4)

    def total_transmittance(self) -> Array:
        f, plan = self.seen.f, plan_of(self.seen, self.technique)
        channels = () if f.transmission is None else (3,)
        answer = np.empty((len(plan.of_pixel), *channels), f.dtype)
        for one, pixels in plan.groups():
            part = self.seen.part(pixels)
            question = self.seen.ask(part, one, self.engine, blends=False)
            answer[pixels] = question.total_transmittance().reshape(-1, *channels)
        return answer.reshape(*f.shape, *channels)

    def transmittance(self, depths: Depths) -> Array:
        return self._each(lambda asked: [asked.transmittance(depths)], depths, blends=True)[0]

    def bounds(self, depths: Depths) -> tuple[Array, Array]:
        lower, upper = self._each(lambda asked: asked.bounds(depths), depths, blends=False)
        return lower, upper

    def _each(self, ask: Callable[[Question], Any], depths: Depths, blends: bool) -> list[Array]:
        """Up to two answers, (N,) or (height, width, K), put together."""
        f = self.seen.f
        plan = plan_of(self.seen, self.technique, curve=depths is not None)
        size = len(f) if depths is None else len(plan.of_pixel)
        shape = (size,) if depths is None else (size, len(depths))
        answers = [np.empty(shape, f.dtype) for _ in range(2)]
        for one, pixels in plan.groups():
            place = fragments_of(f, pixels) if depths is None else pixels
            asked = self.seen.ask(self.seen.part(pixels), one, self.engine, blends)
            for answer, part in zip(answers, ask(asked), strict=False):
                answer[place] = part.reshape(len(place), *shape[1:])
        if depths is None:
            return answers
        return [answer.reshape(*f.shape, len(depths)) for answer in answers]


@dataclasses.dataclass(frozen=True)
class PerPixelEngine:
    """`below` answers for the techniques that pixels get."""

    below: Engine

    @property
    def proves(self) -> bool:
        return self.below.proves

    def question(
        self,
        f: Fragments,
        technique: Technique,
        *,
        cull_opaque: bool,
        threads: int,
        blends: bool = True,
    ) -> PerPixelQuestion:
        assert isinstance(technique, PerPixel)
        (technique.fields_for if blends else technique.fields_for_totals)(f)
        return PerPixelQuestion(Selection(f, cull_opaque, threads), technique, self.below)
