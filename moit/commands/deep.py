"""moit merge, flatten, holdout, recolor, crop, simplify, to-points, to-moments."""

from __future__ import annotations

import argparse
import math
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

    text = "write a window of a deep image, to the bit"
    crop = _verb(command, "crop", _crop, text, layers=False)
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

    points = command("to-points", _to_points, "write deep samples as a .ply of coloured points")
    points.epilog = "example: moit to-points in.exr -o points.ply --eye 0,1,5 --fov 45"
    points.add_argument("input", metavar="FILE", help=DEEP)
    points.add_argument("-o", "--output", required=True, metavar="FILE", help="a .ply")
    for name, text in (("eye", "where the camera is"), ("target", "what it looks at; 0,0,0")):
        points.add_argument(f"--{name}", type=point, metavar="X,Y,Z", help=text)
    points.add_argument("--up", type=point, metavar="X,Y,Z", help="what points up; default: 0,1,0")
    points.add_argument(
        "--fov",
        type=float,
        metavar="DEGREES",
        help="from bottom to top; default: 45. Without any of these the header's camera is taken",
    )
    points.add_argument("--least-alpha", type=float, default=0.0, metavar="A", help="default: 0")
    _add_memory(points)
    add_choice(points)

    moments = command("to-moments", _to_moments, "write deep opacity as moments in a flat .exr")
    moments.epilog = "example: moit to-moments in.exr -o moments.exr -t power8"
    moments.add_argument("input", metavar="FILE", help=DEEP)
    moments.add_argument("-o", "--output", required=True, metavar="FILE", help="a flat .exr")
    moments.add_argument(
        "-t", "--technique", default="power8", metavar="NAME", help="default: power8"
    )
    _add_memory(moments)
    add_choice(moments)


def _verb(
    command: Command, name: str, function: Any, text: str, *, layers: bool = True
) -> argparse.ArgumentParser:
    """A command that writes a deep file, with the options of all of these.

    layers : whether one of the file's layers is meant.
    """
    verb = command(name, function, text)
    verb.add_argument("-o", "--output", required=True, metavar="FILE", help="a deep .exr")
    verb.add_argument(
        "--compression",
        metavar="NAME",
        help="zstd, zips, rle or none; default: zstd where the OpenEXR at hand has it, else zips",
    )
    _add_memory(verb)
    add_choice(verb, layers=layers)
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


def point(text: str) -> tuple[float, ...]:
    try:
        x, y, z = map(float, text.split(","))
        return x, y, z
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected X,Y,Z, got {text!r:.80}") from None


def _how(options: argparse.Namespace) -> dict[str, Any]:
    """The arguments that all verbs have, after a look at whether the file can be written."""
    from moit.formats.deep_bands import USUAL_MEMORY
    from moit.system.files import must_be_writable

    must_be_writable(options.output)
    memory = USUAL_MEMORY if options.memory is None else options.memory
    how = {"part": options.part, "memory": memory, "progress": True}
    how |= {"layer": options.layer} if "layer" in options else {}
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

    crop(options.input, options.output, *options.window, **_how(options))
    print(options.output)


def _simplify(options: argparse.Namespace) -> None:
    from moit.deep import simplify
    from moit.deep.simplifying import USUAL_ERROR

    error = USUAL_ERROR if options.error is None else options.error
    how: dict[str, Any] = {"keep_ids": options.keep_ids, "volumes": options.volumes}
    how |= {"short_numbers": not options.long_numbers, "depth_error": options.depth_error}
    found = simplify(options.input, options.output, error, **how, **_how(options))
    print(f"{options.output}\n{found}")


def _to_points(options: argparse.Namespace) -> None:
    from moit.deep import to_points
    from moit.geometry.camera import Camera

    given = {name: getattr(options, name) for name in ("eye", "target", "up")}
    given |= {"fov_y": None if options.fov is None else math.radians(options.fov)}
    given = {name: value for name, value in given.items() if value is not None}
    camera = Camera(**given) if given else None
    how = {"least_alpha": options.least_alpha, **_how(options)}
    count = to_points(options.input, options.output, camera, **how)
    print(f"{options.output}: {count} points")


def _to_moments(options: argparse.Namespace) -> None:
    from moit.deep import to_moments

    to_moments(options.input, options.output, options.technique, **_how(options))
    print(options.output)
