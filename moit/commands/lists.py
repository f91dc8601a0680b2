"""moit info, moit inspect, moit scenes, moit techniques, moit cite."""

from __future__ import annotations

import argparse

from moit.commands.values import Command


def add(command: Command) -> None:
    command("info", _info, "versions, instruction sets, threads, extras")
    inspect = command("inspect", _inspect, "what an OpenEXR file holds: parts, layers, samples")
    inspect.epilog = "example: moit inspect in.exr"
    inspect.add_argument("file", nargs="+", metavar="FILE", help="deep or flat .exr")
    inspect.add_argument("--headers", action="store_true", help="do not count samples")
    command("scenes", _scenes, "the built-in scenes and what each shows")
    command("techniques", _techniques, "the techniques and their sources")
    cite = command("cite", _cite, "BibTeX of the papers that techniques are from, and of moit")
    cite.epilog = "example: moit cite power4 wboit > papers.bib"
    cite.add_argument("technique", nargs="*", metavar="NAME", help="none: moit alone")


def _info(_: argparse.Namespace) -> None:
    from moit.about import info

    print(info())


def _inspect(options: argparse.Namespace) -> None:
    from moit.formats.inspection import inspect

    for path in options.file:
        print(inspect(path, samples=not options.headers))


def _scenes(_: argparse.Namespace) -> None:
    from moit import scenes

    found = scenes.descriptions()
    width = max(map(len, found))
    for name, text in found.items():
        print(f"{name:<{width}}  {text}")


def _cite(options: argparse.Namespace) -> None:
    from moit.catalog import listed
    from moit.catalog.papers import cite

    print(cite(*(listed(options.technique) if options.technique else [])))


def _techniques(_: argparse.Namespace) -> None:
    from moit.catalog import techniques

    lines = [("name", "bits", "passes", "access", "any order", "source")]
    for one in techniques():
        bits = "grows" if one.bits_per_pixel is None else f"{one.bits_per_pixel:g}"
        passes = "varies" if one.geometry_passes is None else f"{one.geometry_passes}"
        order = "yes" if one.order_independent else "no"
        lines.append((str(one), bits, passes, one.access, order, one.source))
    widths = [max(len(line[i]) for line in lines) for i in range(5)]
    for line in lines:
        sides = zip(line, widths, "<>><<", strict=False)
        print("  ".join([*(f"{text:{side}{width}}" for text, width, side in sides), line[-1]]))
