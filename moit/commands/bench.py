"""moit bench."""

from __future__ import annotations

import argparse
import os

from moit.commands.values import Command, add_techniques, size


def add(command: Command) -> None:
    bench = command("bench", _bench, "time techniques and their rivals, or passes on a GPU")
    bench.add_argument("--gpu", action="store_true", help="the passes of techniques on a GPU")
    bench.add_argument(
        "--gpu-cost",
        action="store_true",
        help="what passes cost on AMD's GPUs by a driver's compiler, without a GPU, and what that "
        "is predicted to come to in a frame",
    )
    bench.add_argument(
        "--family",
        action="append",
        metavar="NAME",
        help="with --gpu-cost: to compile for, may be repeated; default: navi21, gfx1100, vega10",
    )
    bench.add_argument(
        "--card", metavar="NAME", help="with --gpu-cost: of the predicted frame; default: rx6800"
    )
    bench.add_argument(
        "--stored",
        action="store_true",
        help="with --gpu-cost: the costs that come with moit, which need no driver",
    )
    add_techniques(bench, "default: all; on a GPU those of MBOIT's table 1 and some more")
    bench.add_argument(
        "--fragments",
        type=int,
        action="append",
        metavar="N",
        help="about how many; default: 4 million; on a GPU may be repeated: 10 and 20 million",
    )
    bench.add_argument(
        "--size",
        type=size,
        default=(1920, 1080),
        metavar="WxH",
        help="drawn on a GPU; default: 1920x1080",
    )
    bench.add_argument("--threads", type=int, metavar="N", help="default: one a processor")
    bench.add_argument("--repeat", type=int, metavar="N", help="default: 3; on a GPU 5")
    bench.add_argument(
        "--instructions", action="store_true", help="count them, too, with valgrind: slow"
    )
    bench.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="write Markdown there, too: ratios, between the marks that FILE has for it; with "
        "--gpu-cost all of it, or the rows as JSON where FILE ends so",
    )


def _bench(options: argparse.Namespace) -> None:
    from moit.system.files import must_be_writable, write_text

    if options.output:
        must_be_writable(options.output)  # what is measured takes minutes
    if options.gpu_cost:
        _gpu_cost(options)
        return
    if options.family or options.card or options.stored:
        raise ValueError("--family, --card and --stored: expected with --gpu-cost alone")
    if options.gpu:
        from moit.benching import passes
        from moit.gpu import default_device

        chosen = options.technique or passes.TECHNIQUES
        counts = options.fragments or [10_000_000, 20_000_000]
        repeat = 5 if options.repeat is None else options.repeat
        text = passes.report(default_device(), chosen, counts, options.size, repeat)
        print(text)
        if options.output:
            write_text(options.output, text)
        return
    from moit.benching.report import into_document
    from moit.benching.report import report as measured
    from moit.benching.timing import FRAGMENTS

    counts = options.fragments or [FRAGMENTS]
    if len(counts) > 1:
        raise ValueError("--fragments: expected once, but for --gpu")
    report = measured(
        options.technique,
        counts[0],
        options.threads,
        3 if options.repeat is None else options.repeat,
        options.instructions,
    )
    print(report.rates())
    if options.output:
        before = None
        if os.path.exists(options.output):
            with open(options.output, encoding="utf-8") as file:
                before = file.read()
        write_text(options.output, into_document(report.ratios(), before))


def _gpu_cost(options: argparse.Namespace) -> None:
    from moit.benching.cost_measuring import measured, texts
    from moit.benching.gpu_costs import report
    from moit.gpu_costs import stored
    from moit.gpu_costs.cards import DEFAULT, card
    from moit.gpu_costs.cost import FAMILIES
    from moit.gpu_costs.frames import Frame
    from moit.system.files import write_text

    if options.gpu:
        raise ValueError("--gpu-cost: expected without --gpu, which times passes on a GPU")
    if len(options.fragments or []) > 1:
        raise ValueError("--fragments: expected once, but for --gpu")
    if options.fragments and options.fragments[0] < 1:
        raise ValueError(f"--fragments: expected at least 1, got {options.fragments[0]}")
    width, height = options.size
    pixels = width * height
    frame = Frame(options.fragments[0] if options.fragments else 4.5 * pixels, pixels)
    chosen = card(options.card or DEFAULT, "--card")
    families = options.family or FAMILIES
    if options.stored:
        costs = stored.stored().only(options.technique, families)
    else:
        costs = measured(texts(options.technique), families)
    if options.output and options.output.endswith(".json"):
        stored.write(options.output, costs)
    text = report(costs, chosen, frame)
    print(text)
    if options.output and not options.output.endswith(".json"):
        write_text(options.output, text)
