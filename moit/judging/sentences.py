"""What to take for so many bytes, in words that are made of the numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator

from moit.comparing.rows import Row
from moit.judging.bootstrap import estimate
from moit.judging.findings import Findings
from moit.judging.fronts import AFFORDED, BUDGETS, PASSES, WORDS, Means, best
from moit.reports.columns import plain_number

COUNTS = ("no pass", "one pass", "two passes", "three passes")
ORDER_SHOWS = 1e-3  # spread of colours over orders of arrival, above which it is told
MOST_PEERS = 3  # that are named
JUMPS_SHOW = 0.01  # share of still pixels that jump in a frame
#: Options as charts have them, where names would be long.
BRIEF = (
    (r"normalize=True", "renormalised"),
    (r"normalize=False", "not renormalised"),
    (r"merge='energy'", "merged"),
    (r"exclude_self=True", "own share out"),
    (r"overestimation=0\.4,?", ""),
    (r"resolution=(\d)", r"1/\1"),
    (r"total='full'", "full b0"),
    (r"total='half'", "half b0"),
    (r"total='byte'", "byte b0"),
    (r"key_bits=(\d+)", r"keys of \1"),
    (r"tail='([\w-]+)'", r"tail \1"),
    (r"\bbits=(\d+)", r"\1 bits"),
    (r"\bcells=(\d+)", r"\1 cells"),
    (r"table='tile',tile=(\d+)", r"tiles of \1"),
    (r"table='(\w+)'", r"tables by \1"),
    (r"storage='half'", "halves"),
    (r"depth_range='pixel'", "own extent"),
    (r"inside='power4'", "in bounds"),
)


def brief(name: str) -> str:
    """A technique's name with its usual options in words: for charts.

    >>> from moit.judging.sentences import brief
    >>> brief("power4(exclude_self=True,overestimation=0.4)")
    'power4, own share out'
    """
    for pattern, words in BRIEF:
        name = re.sub(pattern, words, name)
    kind, bracket, options = name.partition("(")
    inner = [one for one in options.removesuffix(")").split(",") if one]
    return ", ".join([kind, *inner]) if bracket else name


def paragraphs(found: Findings) -> Iterator[str]:
    """One for each number of bytes."""
    before: Row | None = None
    for budget in BUDGETS:
        pick = best(found.rows, Means(bytes=budget))
        if pick is not None:
            yield " ".join([f"{budget} bytes.", *_of_budget(found, budget), *_gain(pick, before)])
            before = pick


def _of_budget(found: Findings, budget: int) -> Iterator[str]:
    """By access what is best in any number of passes, and in fewer; each is told once."""
    told: set[str] = set()
    for access in AFFORDED:
        leads = []
        for passes in sorted(PASSES, reverse=True):
            means = Means(passes, access, budget)
            row = best(found.rows, means)
            if row is not None and row["technique"] not in told:
                told.add(row["technique"])
                leads.append((row, means))
        if leads:
            yield f"{WORDS[access].capitalize()}: {'; '.join(_told(row) for row, _ in leads)}."
            yield from _peers(found, *leads[0])
            yield from _warnings(leads[0][0])
        elif not told:
            yield f"{WORDS[access].capitalize()}: nothing fits."


def _told(row: Row) -> str:
    interval = f"{_short(row['flip_low'])} to {_short(row['flip_high'])}"
    size = "1 byte" if row["bytes"] == 1 else f"{row['bytes']:.3g} bytes"
    return (
        f"`{row['technique']}`, {size}, {COUNTS[row['passes']]}, "
        f"FLIP {_short(row['flip'])} ({interval})"
    )


def _peers(found: Findings, pick: Row, means: Means) -> Iterator[str]:
    """Who may be better on other scenes: those of whose differences an interval holds 0."""
    names = []
    for row in found.rows:
        if row is pick or row["flip"] is None or not means.allow(row):
            continue
        off = estimate(found.flips(row["technique"]) - found.flips(pick["technique"]))
        if off.low <= 0:
            names.append((row["flip"], f"`{row['technique']}`"))
    if names:
        names.sort()
        listed = ", ".join(name for _, name in names[:MOST_PEERS])
        more = f" and {len(names) - MOST_PEERS} more" if len(names) > MOST_PEERS else ""
        yield f"As good by chance: {listed}{more}."


def _warnings(row: Row) -> Iterator[str]:
    order, jumps = row["mean_order"], row["mean_jumps"]
    if order is not None and order > ORDER_SHOWS:
        yield f"Its colours hang on the order of arrival, by {_short(order)}."
    if jumps is not None and jumps > JUMPS_SHOW:
        yield f"Of still pixels {jumps:.1%} jump from frame to frame."


def _gain(pick: Row, before: Row | None) -> Iterator[str]:
    if before is None:
        return
    if pick["technique"] == before["technique"]:
        yield "Nothing that keeps more is better."
    else:
        yield f"The best is {1 - pick['flip'] / before['flip']:.0%} below that of fewer bytes."


def _short(value: float) -> str:
    return plain_number(value, 3)
