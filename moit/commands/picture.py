"""moit composite, moit curve."""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from moit.commands.values import (
    DEVICES,
    INPUT,
    Command,
    add_background,
    add_channels,
    add_choice,
    add_techniques,
    background_from,
    byte_count,
    pixel,
)

if TYPE_CHECKING:
    from moit.fragments.fragments import Fragments


def add(command: Command) -> None:
    composite = command("composite", _composite, "write the image that a technique makes")
    composite.add_argument("input", nargs="+", metavar="INPUT", help=f"{INPUT}; several are merged")
    composite.add_argument("-t", "--technique", required=True, metavar="NAME")
    composite.add_argument("-o", "--output", required=True, metavar="FILE", help=".exr or .png")
    add_background(composite)
    composite.add_argument("--device", default="cpu", choices=DEVICES, help="default: cpu")
    composite.add_argument(
        "--memory",
        type=byte_count,
        metavar="SIZE",
        help="what reading a deep image may take, as 500M or 2G; a larger one goes through in "
        "bands; default: 1G",
    )
    add_choice(composite)
    add_channels(composite)

    curve = command("curve", _curve, "plot the transmittance along one ray")
    curve.epilog = "example: moit curve in.exr --pixel 320,240 -t sorted,power8 -o curve.svg"
    curve.add_argument("input", metavar="INPUT", help=INPUT)
    curve.add_argument(
        "--pixel",
        type=pixel,
        metavar="X,Y",
        help="counted from the upper left of the image; default: that with the most fragments",
    )
    add_techniques(curve, "default: six of different ideas")
    curve.add_argument(
        "-o",
        "--output",
        default="curve.png",
        metavar="FILE",
        help="default: curve.png; .svg needs no matplotlib",
    )
    add_choice(curve)
    add_channels(curve)


def _composite(options: argparse.Namespace) -> None:
    from moit.catalog import technique
    from moit.deep_composites import composite_deep
    from moit.formats.deep_bands import USUAL_MEMORY
    from moit.formats.images import write_image
    from moit.questions import composite
    from moit.system.files import must_be_writable
    from moit.system.progress import preparing

    must_be_writable(options.output)
    chosen = technique(options.technique)
    how: dict[str, Any] = {
        "background": background_from(options.background),
        "device": options.device,
    }
    with _as_one(options) as name:
        deep = _is_deep_file(name)
        if deep and chosen.local:
            memory = USUAL_MEMORY if options.memory is None else options.memory
            if name == options.input[0]:  # a merge has one part, and what was chosen
                how |= {"part": options.part, "channels": _channels(options)}
            how |= {"layer": options.layer, "memory": memory, "progress": True}
            composite_deep(name, options.output, chosen, **how)
        elif options.memory is not None:
            found = f"{chosen}" if deep else repr(options.input[0])
            raise ValueError(
                f"--memory: expected a deep .exr and a local technique, got {found:.200}"
            )
        else:
            with preparing(True, "composite") as doing:
                f = _all_fragments(options, name, doing)
                doing.now(str(chosen))
                image = composite(f, chosen, **how)
            write_image(options.output, image, technique=chosen, origin=f.origin, frame=f.frame)
    print(options.output)


def _is_deep_file(name: str) -> bool:
    return name.lower().endswith(".exr") and os.path.isfile(name)


@contextmanager
def _as_one(options: argparse.Namespace) -> Iterator[str]:
    """The input; of several deep files, which may be larger than memory, a file of all; of others
    the first."""
    if len(options.input) == 1 or not all(map(_is_deep_file, options.input)):
        yield options.input[0]
        return
    from moit.deep import merge

    if options.channel:
        raise ValueError("--channel: expected one deep .exr with it, got several")
    with tempfile.TemporaryDirectory(prefix="moit-") as folder:
        path = os.path.join(folder, "merged.exr")
        how: dict[str, Any] = {"part": options.part, "layer": options.layer, "progress": True}
        if options.memory is not None:
            how["memory"] = options.memory
        merge(options.input, path, **how)
        yield path


def _all_fragments(options: argparse.Namespace, merged: str, doing: Any) -> Fragments:
    from moit.formats.deep import read_deep
    from moit.fragments.merging import merge

    if merged != options.input[0]:
        return read_deep(merged, layer=options.layer)
    found = []
    for name in options.input:
        doing.now(f"reads {name}")
        found.append(_fragments(options, name))
    return merge(found) if len(found) > 1 else found[0]


def _channels(options: argparse.Namespace) -> dict[str, str] | None:
    return dict(options.channel) if options.channel else None


def _fragments(options: argparse.Namespace, name: str) -> Fragments:
    from moit.inputs import as_fragments

    channels = _channels(options)
    return as_fragments(name, "INPUT", options.part, options.layer, channels)


def _curve(options: argparse.Namespace) -> None:
    from moit.deep import curve

    how: dict[str, Any] = {"part": options.part, "layer": options.layer, "progress": True}
    how["channels"] = _channels(options)
    curve(options.input, options.output, options.technique, options.pixel, **how)
    print(options.output)
