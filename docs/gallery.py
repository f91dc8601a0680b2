"""Writes docs/gallery.md and docs/claims.md: `python docs/gallery.py [NAME ...]`.

Runs every experiment at small size; of those named alone, or all. What was measured is kept in
build/experiments, so that an interrupted run goes on, and other pages keep what they say of
experiments that are not run again.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import moit
from moit.experiments.catalog import EXPERIMENTS
from moit.experiments.claims import Judged
from moit.experiments.document import markdown_chart, markdown_gallery
from moit.experiments.result import ExperimentResult
from moit.system.files import write_text

DOCS = Path(__file__).resolve().parent
KEPT = DOCS.parent / "build" / "experiments"
WIDTH = 300

GALLERY = """# Gallery

Figures of papers, and scenes of their kinds, as moit draws them; below each is the command that
makes it, with tables, maps of errors and full-size pictures. What the papers say of them, and
whether it holds here, is in [claims.md](claims.md). Written by `python docs/gallery.py`.
"""

CLAIMS = """# What the papers say, and what holds here

Each claim is judged by numbers that one command measures, on scenes of the papers' kinds where
theirs are not public: it holds where all of its checks do, and partly where some do. Errors are
FLIP, RMSE of linear colour, and those of transmittance (T); times are of the processor named below,
and say little of a GPU (`--device gpu` draws on one). Written by `python docs/gallery.py`.
"""


def gallery_part(result: ExperimentResult) -> str:
    """Pictures and charts of an experiment; "" where it has none."""
    name = result.experiment.name
    folder, below = str(DOCS / "gallery" / name), f"gallery/{name}/"
    shown = []
    for section in result.sections:
        shown += [markdown_chart(chart, folder, below) for chart in section.charts]
        shown += [
            markdown_gallery(row, folder, WIDTH, below, ending="jpg")
            for row in section.gallery
            if row and row[0].image.ndim == 3
        ]
    if not shown:
        return ""
    described = result.experiment
    title = f"## {described.figure[0].upper()}{described.figure[1:]}: {described.title}"
    command = f"```sh\nmoit experiment {name}\n```"
    return "\n\n".join([title, f"*{described.paper}*. {described.about}", *shown, command])


def claims_part(result: ExperimentResult) -> str:
    """A table of an experiment's claims."""
    described = result.experiment
    lines = [
        f"## {described.paper}, {described.figure}: {described.title}",
        f"`moit experiment {described.name}` on {result.machine}.",
        "| claim | where | verdict | numbers |\n|---|---|---|---|",
    ]
    rows = [
        " | ".join(
            text.replace("|", "\\|")
            for text in (one.claim.text, one.claim.where, _verdict(one), one.short)
        )
        for one in result.claims
    ]
    lines[-1] += "".join(f"\n| {row} |" for row in rows)
    return "\n\n".join(lines)


def _verdict(one: Judged) -> str:
    return f"**{one.verdict}**{' on this processor' if one.claim.of_times else ''}"


def _counts(verdicts: list[str]) -> str:
    return ", ".join(
        f"{verdicts.count(verdict)} {words}"
        for verdict, words in (
            ("holds", "hold"),
            ("holds partly", "hold partly"),
            ("does not hold", "do not hold"),
        )
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Write docs/gallery.md and docs/claims.md.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="default: all")
    chosen = parser.parse_args().names or list(EXPERIMENTS)
    KEPT.mkdir(parents=True, exist_ok=True)
    for name in chosen:
        result = moit.experiment(name, "small", out=KEPT / name)
        parts = {
            "gallery": gallery_part(result),
            "claims": claims_part(result),
            "verdicts": [(one.verdict, one.claim.of_times) for one in result.claims],
        }
        write_text(KEPT / f"{name}.json", json.dumps(parts))
        print(f"{name}: {result.seconds:.0f} s")
    found = {}
    for name in EXPERIMENTS:
        path = KEPT / f"{name}.json"
        if path.exists():
            found[name] = json.loads(path.read_text(encoding="utf-8"))
    verdicts = [verdict for one in found.values() for verdict in one["verdicts"]]
    pictures = [verdict for verdict, of_times in verdicts if not of_times]
    times = [verdict for verdict, of_times in verdicts if of_times]
    pages = [one["gallery"] for one in found.values() if one["gallery"]]
    write_text(DOCS / "gallery.md", "\n\n".join([GALLERY.rstrip(), *pages]) + "\n")
    tables = [one["claims"] for one in found.values()]
    summary = (
        f"Of {len(pictures)} claims about quality, memory and order {_counts(pictures)}. Of "
        f"{len(times)} about times, which the papers measured on GPUs and this page on a "
        f"processor, {_counts(times)}."
    )
    write_text(DOCS / "claims.md", "\n\n".join([CLAIMS.rstrip(), summary, *tables]) + "\n")


if __name__ == "__main__":
    main()
