"""moit merge, flatten, holdout, recolor, crop, simplify: deep images from file to file."""

from __future__ import annotations

import argparse
from typing import Any

from moit.commands.values import Command, add_choice, byte_count, part, size

DEEP = "a deep .exr"


def add(command: Command) -> None:
    merge = _verb(command, "merge", _merge, "write the samples of several deep images as one")
    merge.epilog = "example: moit merge smoke.exr trees.exr -o both.exr"
    merge.add_argument("input", nargs="+", metavar="FILE", help=f"{DEEP}; the first says where")

    flatten = command("flatten", _flatten, "write a deep image as a flat picture, exactly")
    flatten.epilog = "example: moit flatten both.exr -o picture.exr"
    flatten.add_argument("input", metavar="FILE", help=DEEP)
    flatten.add_argument("-o", "--output", required=True, metavar="FILE", help=".exr or .png")
    _add_memory(flatten)
    add_choice(flatten)

    holdout = _verb(
        command, "holdout", _holdout, "write a deep image as it is seen through another"
    )
    holdout.epilog = "example: moit holdout smoke.exr trees.exr -o smoke_without_trees.exr"
    holdout.add_argument("input", metavar="FILE", help="the deep .exr that is seen")
    holdout.add_argument("by", metavar="BY", help="the deep .exr that holds it out")
    holdout.add_argument("--by-part", type=part, metavar="PART", help="which part of BY")
    holdout.add_argument("--by-layer", metavar="NAME", help="which layer of BY")

    recolor = _verb(command, "recolor", _recolor, "give a deep image the colours of a flat picture")
    recolor.epilog = "example: moit recolor alpha.exr beauty.exr -o deep_beauty.exr"
    recolor.add_argument("input", metavar="FILE", help=f"{DEEP} of alpha and depth")
    recolor.add_argument("picture", metavar="PICTURE", help="a flat picture, multiplied by alpha")
    recolor.add_argument(
        "--match-alpha", action="store_true", help="flattened its alpha is the picture's, too"
    )
    recolor.add_argument("--float", action="store_true", help="float colours; default: half")

    crop = _verb(command, "crop", _crop, "write a window of a deep image, to the bit")
    crop.epilog = "example: moit crop in.exr -o part.exr --window 100,50,640x480"
    crop.add_argument("input", metavar="FILE", help=DEEP)
    crop.add_argument(
        "--window",
        required=True,
        type=window,
        metavar="X,Y,WxH",
        help="its first pixel on the display, and its size",
    )

    simplify = _verb(command, "simplify", _simplify, "write fewer samples, and prove the error")
    simplify.epilog = "example: moit simplify in.exr -o out.exr --error 0.004"
    simplify.add_argument("input", metavar="FILE", help=DEEP)
    simplify.add_argument(
        "--error",
        type=float,
        metavar="E",
        help="the greatest error of transmittance and light at any depth; default: 1/255",
    )
    simplify.add_argument(
        "--depth-error",
        type=float,
        default=0.0,
        metavar="E",
        help="how far depths may move, relative to themselves; default: not at all",
    )
    simplify.add_argument(
        "--keep-ids", action="store_true", help="samples of different ids are never made one"
    )
    simplify.add_argument(
        "--volumes",
        action="store_true",
        default=None,
        help="volumes may stand for surfaces; default: where the file has volumes",
    )
    simplify.add_argument(
        "--long-numbers", action="store_true", help="numbers are as exact as the file holds them"
    )


def _verb(command: Command, name: str, function: Any, text: str) -> argparse.ArgumentParser:
    """A command that writes a deep file, with the options of all of these."""
    verb = command(name, function, text)
    verb.add_argument("-o", "--output", required=True, metavar="FILE", help="a deep .exr")
    verb.add_argument(
        "--compression",
        metavar="NAME",
        help="zstd, zips, rle or none; default: zstd where the OpenEXR at hand has it, else zips",
    )
    _add_memory(verb)
    add_choice(verb)
    return verb


def _add_memory(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--memory",
        type=byte_count,
        metavar="SIZE",
        help="what it may take, about, as 500M or 2G; larger images go through in bands; "
        "default: 1G",
    )


def window(text: str) -> tuple[tuple[int, int], tuple[int, int]]:
    """(height, width) and (y, x)."""
    try:
        x, y, rest = text.split(",")
        width, height = size(rest)
        return (height, width), (int(y), int(x))
    except (ValueError, argparse.ArgumentTypeError):
        raise argparse.ArgumentTypeError(f"expected X,Y,WIDTHxHEIGHT, got {text!r:.80}") from None


def _how(options: argparse.Namespace) -> dict[str, Any]:
    """The arguments that all verbs have, after a look at whether the file can be written."""
    from moit.formats.deep_bands import USUAL_MEMORY
    from moit.system.files import must_be_writable

    must_be_writable(options.output)
    memory = USUAL_MEMORY if options.memory is None else options.memory
    how = {"part": options.part, "layer": options.layer, "memory": memory, "progress": True}
    return how | ({"compression": options.compression} if "compression" in options else {})


def _merge(options: argparse.Namespace) -> None:
    from moit.deep import merge

    merge(options.input, options.output, **_how(options))
    print(options.output)


def _flatten(options: argparse.Namespace) -> None:
    from moit.deep import flatten

    flatten(options.input, options.output, **_how(options))
    print(options.output)


def _holdout(options: argparse.Namespace) -> None:
    from moit.deep import holdout

    by = {"by_part": options.by_part, "by_layer": options.by_layer}
    holdout(options.input, options.by, options.output, **by, **_how(options))
    print(options.output)


def _recolor(options: argparse.Namespace) -> None:
    from moit.deep import recolor

    how = _how(options) | {"match_alpha": options.match_alpha, "half": not options.float}
    recolor(options.input, options.picture, options.output, **how)
    print(options.output)


def _crop(options: argparse.Namespace) -> None:
    from moit.deep import crop

    how = _how(options)
    how.pop("layer")
    crop(options.input, options.output, *options.window, **how)
    print(options.output)


def _simplify(options: argparse.Namespace) -> None:
    from moit.deep import simplify
    from moit.deep.simplifying import USUAL_ERROR

    error = USUAL_ERROR if options.error is None else options.error
    how: dict[str, Any] = {"keep_ids": options.keep_ids, "volumes": options.volumes}
    how |= {"short_numbers": not options.long_numbers, "depth_error": options.depth_error}
    found = simplify(options.input, options.output, error, **how, **_how(options))
    print(f"{options.output}\n{found}")
