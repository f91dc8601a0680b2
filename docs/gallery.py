"""Writes docs/gallery.md and docs/claims.md: `python docs/gallery.py [NAME ...]`.

Runs experiments at small size, those named or all, and keeps what the pages say of the others. What
was measured is kept in build/experiments, so that an interrupted run goes on.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import moit
from moit.experiments.catalog import EXPERIMENTS
from moit.experiments.claims import Judged
from moit.experiments.result import ExperimentResult
from moit.reports.blocks import Gallery, Markdown
from moit.reports.tables import Table, markdown_table
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


def gallery_part(result: ExperimentResult, folder: Path) -> str:
    """Pictures and charts of an experiment, put into a folder; "" where it has none."""
    name = result.experiment.name
    blocks = [
        block
        for section in result.sections
        for block in (*section.charts, *map(Gallery, filter(None, section.gallery)))
        if not isinstance(block, Gallery) or block.pictures[0].image.ndim == 3
    ]
    if not blocks:
        return ""
    shown = Markdown(str(folder / "gallery" / name), f"gallery/{name}/", WIDTH, "jpg")(blocks)
    described = result.experiment
    title = f"## {described.figure[0].upper()}{described.figure[1:]}: {described.title}"
    command = f"```sh\nmoit experiment {name}\n```"
    return "\n\n".join([title, f"*{described.paper}*. {described.about}", shown, command])


def claims_part(result: ExperimentResult) -> str:
    """A table of an experiment's claims."""
    described = result.experiment
    rows = [[one.claim.text, one.claim.where, _verdict(one), one.short] for one in result.claims]
    lines = [
        f"## {described.paper}, {described.figure}: {described.title}",
        f"`moit experiment {described.name}` on {result.machine}.",
        markdown_table(Table(["claim", "where", "verdict", "numbers"], rows, [True] * 4)),
    ]
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


# What _verdict writes, of which `of_times` says the second half.
VERDICT = re.compile(r"\*\*(holds|holds partly|does not hold)\*\*( on this processor)? \|")


def standing(page: Path) -> dict[str, str]:
    """What a page says of each experiment: its parts, by the command that each has."""
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    parts = [part.strip() for part in re.split(r"^(?=## )", text, flags=re.MULTILINE)[1:]]
    return {part.split("moit experiment ", 1)[1].split()[0].strip("`"): part for part in parts}


def write_pages(folder: Path, results: dict[str, ExperimentResult]) -> None:
    """Both pages, with what they say already of experiments that are not among the results."""
    pages, tables = standing(folder / "gallery.md"), standing(folder / "claims.md")
    for name, result in results.items():
        pages[name], tables[name] = gallery_part(result, folder), claims_part(result)
    shown, judged = ([of[name] for name in EXPERIMENTS if of.get(name)] for of in (pages, tables))
    write_text(folder / "gallery.md", "\n\n".join([GALLERY.rstrip(), *shown]) + "\n")
    found = [VERDICT.findall(table) for table in judged]
    pictures = [verdict for table in found for verdict, of_times in table if not of_times]
    times = [verdict for table in found for verdict, of_times in table if of_times]
    summary = (
        f"Of {len(pictures)} claims about quality, memory and order {_counts(pictures)}. Of "
        f"{len(times)} about times, which the papers measured on GPUs and this page on a "
        f"processor, {_counts(times)}."
    )
    write_text(folder / "claims.md", "\n\n".join([CLAIMS.rstrip(), summary, *judged]) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description="Write docs/gallery.md and docs/claims.md.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="default: all")
    results = {}
    for name in parser.parse_args().names or list(EXPERIMENTS):
        results[name] = moit.experiment(name, "small", out=KEPT / name)
        print(f"{name}: {results[name].seconds:.0f} s")
    write_pages(DOCS, results)


if __name__ == "__main__":
    main()
