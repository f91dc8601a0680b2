"""Writes docs/frontier.md and docs/frontier.png: `python docs/frontier.py [--draw check ...]`.

What was measured is kept in build/frontier, so that an interrupted run goes on; a core that was
built anew measures all anew. The page that is
committed is of the final draw at full size, which is looked at once for each release.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

import moit
from moit.judging.draws import KINDS
from moit.judging.fronts import AFFORDED, PASSES, WORDS, Means, known
from moit.judging.page import chart
from moit.judging.running import SIZES
from moit.judging.sentences import COUNTS
from moit.reports.blocks import Block, Markdown, Paragraph, Plot
from moit.reports.figures import draw, marker_of
from moit.system.files import replacing, write_text

DOCS = Path(__file__).resolve().parent
KEPT = DOCS.parent / "build" / "frontier"
MEASURES = {"flip": "mean FLIP over scenes", "mean_colour": "RMSE of colours, mean over rays' sets"}


def picture(found: moit.Frontier, path: Path) -> None:
    """Error over bytes: a column for each number of passes, a row for pictures and one for rays."""
    figure, axes = plt.subplots(
        len(MEASURES),
        len(PASSES),
        figsize=(16.5, 10.5),
        dpi=80,
        layout="constrained",
        sharey="row",
        sharex=True,
    )
    for row, (measure, title) in zip(axes, MEASURES.items(), strict=True):
        for ax, passes in zip(row, PASSES, strict=True):
            rows = [one for one in known(found.rows, measure) if Means(passes).allow(one)]
            shown = chart(rows, passes, measure)
            draw(shown, ax, named=())
            ax.margins(x=0.1, y=0.08)
            ax.set_title(f"up to {COUNTS[passes]}" if passes > 1 else COUNTS[1])
            ax.set(ylabel=title if passes == PASSES[0] else "", xlabel="")
            if measure == list(MEASURES)[-1]:
                ax.set_xlabel("bytes a pixel keeps")
    marks = [
        Line2D([], [], color="0.3", marker=marker_of(i), linestyle="", label=WORDS[access])
        for i, access in enumerate(AFFORDED)
    ]
    figure.legend(handles=marks, loc="outside lower center", ncols=len(marks), frameon=False)
    with replacing(path) as part:
        figure.savefig(part)


def with_picture(blocks: Iterator[Block]) -> Iterator[Block]:
    """The page's blocks, with one picture in place of its charts."""
    there = False
    for block in blocks:
        if not isinstance(block, Plot):
            yield block
        elif not there:
            there = True
            yield Paragraph("![Error over bytes by passes and access](frontier.png)")


def main() -> None:
    parser = argparse.ArgumentParser(description="Write docs/frontier.md and docs/frontier.png.")
    parser.add_argument("--draw", default="final", choices=tuple(KINDS))
    parser.add_argument("--size", default="full", choices=tuple(SIZES))
    parser.add_argument("-o", "--output", type=Path, default=DOCS, metavar="DIR")
    given = parser.parse_args()
    found = moit.frontier(draw=given.draw, size=given.size, out=KEPT)
    picture(found, given.output / "frontier.png")
    text = Markdown(str(given.output))(with_picture(found.blocks()))
    write_text(given.output / "frontier.md", text + "\n")


if __name__ == "__main__":
    main()
