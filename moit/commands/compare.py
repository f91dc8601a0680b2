"""moit demo, moit compare."""

from __future__ import annotations

import argparse
import os
from typing import Any

from moit.commands.values import (
    DEVICES,
    INPUT,
    Command,
    add_background,
    add_choice,
    add_gpu,
    add_techniques,
    background_from,
    near_and_far,
    size,
)

DEMO_SIZE = (320, 180)  # most of the time goes into HDR-FLIP
DEMO_SCENES = ("panes", "cloud", "hair", "spheres", "neural-training", "mixed")
# One of each idea; `moit compare` takes all.
DEMO_TECHNIQUES = (
    "sorted",
    "unsorted",
    "weighted-average",
    "wboit",
    "moment-transparency",
    "power4",
    "power6",
    "power6-16",
    "trig3",
    "fourier15",
    "adaptive4",
    "mlab4",
    "hybrid4",
    "wavelet16",
    "stochastic8",
)


def add(command: Command) -> None:
    demo = command("demo", _demo, "compare all techniques on the built-in scenes")
    demo.add_argument("-o", "--output", default="demo", metavar="DIR", help="default: demo")
    demo.add_argument(
        "--size", type=size, default=DEMO_SIZE, metavar="WxH", help="default: 320x180"
    )

    compare = command("compare", _compare, "compare techniques on inputs and write a report")
    compare.add_argument("input", nargs="+", metavar="INPUT", help=INPUT)
    compare.add_argument("--merge", action="store_true", help="all inputs as one scene")
    add_techniques(compare, "default: all")
    compare.add_argument("-o", "--output", default="report", metavar="DIR", help="default: report")
    compare.add_argument("--reference", default="sorted", metavar="NAME", help="default: sorted")
    compare.add_argument(
        "--repeat", type=int, default=5, metavar="N", help="timed composites each; default: 5"
    )
    compare.add_argument(
        "--device", action="append", choices=DEVICES, help="may be repeated; default: cpu"
    )
    add_background(compare)
    compare.add_argument("--threads", type=int, metavar="N", help="default: one a processor")
    compare.add_argument(
        "--depth-range",
        type=near_and_far,
        metavar="NEAR,FAR",
        help="of all inputs; default: each has its own",
    )
    compare.add_argument(
        "--cull-opaque",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="whether what is behind an opaque fragment is left out; default: it is",
    )
    add_choice(compare)
    add_gpu(compare, "a column more: ")
    compare.add_argument(
        "--resume", action="store_true", help="keep what an interrupted run left in DIR"
    )


def _demo(options: argparse.Namespace) -> None:
    from moit import scenes
    from moit.commands.output import cleared_results, write_curves, write_demo, write_images
    from moit.comparing.comparison import compare
    from moit.system.progress import preparing

    with preparing(True, "demo") as first:
        first.now("makes scenes")
        inputs = {name: scenes.load(name, size=options.size) for name in DEMO_SCENES}
    kept = cleared_results(options.output, resume=False)
    report = compare(inputs, DEMO_TECHNIQUES, repeat=3, out=kept)
    images, curves = write_images(report, options.output), write_curves(report, options.output)
    write_demo(report, options.output, images, curves, kept)


def _compare(options: argparse.Namespace) -> None:
    from moit.commands.output import cleared_results, write_images, write_report
    from moit.comparing.comparison import compare, named_scenes
    from moit.fragments.merging import merge
    from moit.inputs import as_fragments, choices

    choice: dict[str, Any] = {"part": options.part, "layer": options.layer}
    inputs: dict[str, Any] = dict(named_scenes(options.input))
    if options.merge:
        chosen = choices(inputs.values(), **choice)
        pairs = zip(inputs.values(), chosen, strict=True)
        inputs = {"merged": merge([as_fragments(one, "INPUT", **own) for one, own in pairs])}
        choice = {}
    report = compare(
        inputs,
        options.technique,
        devices=options.device or ("cpu",),
        reference=options.reference,
        repeat=options.repeat,
        background=background_from(options.background),
        threads=options.threads,
        depth_range=options.depth_range,
        cull_opaque=options.cull_opaque,
        out=cleared_results(options.output, options.resume),
        gpu=options.gpu,
        resolution=options.resolution,
        **choice,
    )
    title = f"moit compare: {', '.join(os.path.basename(one) for one in options.input)}"
    paths = write_images(report, options.output)
    write_report(report, options.output, title, paths)
