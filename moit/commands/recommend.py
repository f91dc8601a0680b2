"""moit recommend."""

from __future__ import annotations

import argparse

from moit.commands.values import (
    INPUT,
    Command,
    add_background,
    add_choice,
    add_gpu,
    add_techniques,
    background_from,
)


def add(command: Command) -> None:
    parser = command("recommend", _recommend, "the cheapest technique that keeps to an error")
    parser.add_argument("input", metavar="INPUT", help=INPUT)
    parser.add_argument(
        "--max-error", type=float, required=True, metavar="E", help="in the metric's own measure"
    )
    parser.add_argument("--metric", default="flip", metavar="NAME", help="default: flip")
    parser.add_argument(
        "--by", default="seconds", metavar="COST", help="or bits, gpu; default: seconds"
    )
    add_gpu(parser, "with --by gpu: ")
    add_techniques(parser, "default: all but what is random")
    parser.add_argument("--max-bits", type=float, metavar="N", help="that a pixel may keep")
    parser.add_argument(
        "--ordered",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="whether rasterizer-ordered access may be needed; default: it may",
    )
    parser.add_argument(
        "--max-passes", type=int, metavar="N", help="over transparent geometry, at most"
    )
    parser.add_argument(
        "--exact",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="whether what sorts all fragments may be the answer; default: it may",
    )
    add_background(parser)
    parser.add_argument("--threads", type=int, metavar="N", help="default: one a processor")
    add_choice(parser)


def _recommend(options: argparse.Namespace) -> None:
    from moit.comparing.recommendation import recommend

    answer = recommend(
        options.input,
        max_error=options.max_error,
        metric=options.metric,
        by=options.by,
        techniques=options.technique,
        max_bits=options.max_bits,
        ordered=options.ordered,
        max_passes=options.max_passes,
        exact=options.exact,
        background=background_from(options.background),
        threads=options.threads,
        part=options.part,
        layer=options.layer,
        gpu=options.gpu,
        resolution=options.resolution,
    )
    print(answer)
    if answer.technique is None:
        raise ValueError(answer.reason)
