"""moit export."""

from __future__ import annotations

import argparse

from moit.commands.values import Command, near_and_far


def add(command: Command) -> None:
    export = command("export", _export, "write a technique as shader text for an engine")
    export.add_argument("technique", metavar="TECHNIQUE", help="such as power4 or 'power4(bias=0)'")
    export.add_argument("-o", "--output", default="kit", metavar="DIR", help="default: kit")
    export.add_argument(
        "--language",
        default="glsl",
        metavar="NAME",
        help="glsl, hlsl, wgsl, metal or slang; default: glsl",
    )
    export.add_argument(
        "--depth-range",
        type=near_and_far,
        metavar="NEAR,FAR",
        help="of transparent geometry, in units of depth; default: 0.1,1000",
    )


def _export(options: argparse.Namespace) -> None:
    from moit.kit.exporting import export

    for path in export(
        options.technique, options.output, options.language, depth_range=options.depth_range
    ):
        print(path)
