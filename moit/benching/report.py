"""All that `moit bench` measures, for a terminal and for a document."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

from moit.benching.races import Race, races, races_table
from moit.benching.rivals import Missing
from moit.benching.suite import Suite, rates_table, ratios_table, suite
from moit.benching.timing import BASE, FRAGMENTS, USUAL
from moit.benching.work import Besides, Work, besides, work, work_table
from moit.catalog import Technique, listed
from moit.system.environment import machine
from moit.system.progress import Progress, preparing


@dataclasses.dataclass(frozen=True)
class Report:
    """All that `moit bench` measures."""

    suite: Suite
    races: list[Race]
    work: list[Work] | str
    besides: Besides
    count: int
    repeat: int

    def rates(self) -> str:
        """What a terminal shows: this machine's rates."""
        return self._text(
            f"Million fragments a second on {self.suite.threads} threads with "
            f"{self.suite.sets[-1]}; best of {self.repeat} rounds.",
            rates_table(self.suite),
            races_table(self.races, rates=True),
        ) + (
            f"\nimport moit: {self.besides.imported:.3f} s; million samples a second of deep "
            f"OpenEXR written: {self.besides.written.rate:.2f}, "
            f"read: {self.besides.read.rate:.2f}\n"
        )

    def ratios(self) -> str:
        """What a document may say: ratios within this run."""
        return self._text(
            f"Rates with 16 fragments a pixel as shares of {BASE}'s; the other columns as shares "
            "of the technique's own with 16 a pixel, and what threads and wider instructions give.",
            ratios_table(self.suite),
            races_table(self.races, rates=False),
        )

    def _text(self, said: str, techniques_: str, races_: str) -> str:
        about = (
            f"{machine(self.suite.threads)}. Whole composites in float32 of about "
            f"{self.count:,} fragments, random in depth and opacity; ratios of the best of "
            f"{self.repeat} rounds."
        )
        bytes_ = self.suite.bytes_a_fragment[USUAL]
        parts = [
            about,
            "### Against others",
            races_,
            "### Techniques",
            said,
            techniques_,
            "### Bounds",
        ]
        if isinstance(self.work, str):
            parts.append(self.work)
        elif self.work:
            parts += [
                f"One thread, {self.work[0].instruction_set}, 16 a pixel, {bytes_:.1f} bytes a "
                "fragment; a fragment's instructions as callgrind counts them in moit_composite, "
                "and its cycles of a clock that a chain of additions measures.",
                work_table(self.work),
            ]
        return "\n\n".join(parts) + "\n"


WORKED = ("unsorted", "sorted", "wboit", "power4", "power6", "power8", "trig2", "trig3", "trig4")


def report(
    chosen: Iterable[Technique | str] | None = None,
    count: int = FRAGMENTS,
    threads: int | None = None,
    repeat: int = 3,
    counted: bool = False,
    progress: Progress = True,
) -> Report:
    """Measures everything.

    chosen : techniques; None: every one.
    count : fragments, about.
    threads : None: as many as this process has processors.
    counted : count instructions, too.

    Raises ValueError where there is nothing to time.
    """
    if repeat < 1 or count < 1 or (threads is not None and threads < 1):
        raise ValueError("repeat, fragments and threads: expected at least 1")
    names = [str(one) for one in listed(chosen)]
    found = suite(names, count, threads, repeat, progress)
    against = races(count, threads, repeat + 2, progress)
    spent: list[Work] | str
    try:
        with preparing(progress, "bench") as last:
            last.now("counts instructions" if counted else "times one thread")
            spent = work([n for n in names if n in WORKED] or names, count, repeat + 2, counted)
    except Missing as error:
        spent = f"Not measured: {error}."
    return Report(found, against, spent, besides(count, repeat), count, repeat)


BEGIN, END = "<!-- moit bench -->", "<!-- end of moit bench -->"


def into_document(text: str, document: str | None) -> str:
    """A document with `text` for what stood between its two marks, or one of `text` alone."""
    marked = f"{BEGIN}\n{text}{END}\n"
    if document is None or BEGIN not in document or END not in document:
        return f"# Speed\n\n{marked}"
    before, _, rest = document.partition(BEGIN)
    _, _, after = rest.partition(END)
    return before + marked + after.removeprefix("\n")
