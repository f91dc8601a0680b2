"""moit stability."""

from __future__ import annotations

import argparse
import os

from moit.commands.values import Command, add_techniques


def add(command: Command) -> None:
    stability = command("stability", _stability, "test techniques on rays that are hard on them")
    add_techniques(stability, "default: all")
    stability.add_argument(
        "-f",
        "--family",
        action="append",
        metavar="NAME",
        help="of rays, such as distance or layers; may be repeated; default: all",
    )
    stability.add_argument(
        "-p",
        "--precision",
        action="append",
        metavar="NAME",
        help="'16 bit', float32 or float64; may be repeated; default: all",
    )
    stability.add_argument(
        "--rays", type=int, default=256, metavar="N", help="at each setting; default: 256"
    )
    stability.add_argument(
        "-o", "--output", default="stability", metavar="DIR", help="default: stability"
    )
    stability.add_argument(
        "--resume", action="store_true", help="keep what an interrupted run left in DIR"
    )


def _stability(options: argparse.Namespace) -> None:
    from moit.commands.output import write_tables
    from moit.numerics.report import PRECISIONS
    from moit.numerics.stability import clear, stability

    kept = os.path.join(options.output, "results")
    if not options.resume:
        clear(kept)
    report = stability(
        options.technique,
        families=options.family,
        precisions=options.precision or PRECISIONS,
        rays=options.rays,
        out=kept,
    )
    write_tables(report, options.output, "stability", "moit stability")
