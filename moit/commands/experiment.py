"""moit experiment: figures of papers, and the frontier."""

from __future__ import annotations

import argparse
import os

from moit.commands.values import DEVICES, Command, add_techniques

FRONTIER = "frontier"
ITS_TITLE = "moit's techniques by bytes, passes and access, on draws that none was tuned on"


def add(command: Command) -> None:
    experiment = command("experiment", _experiment, "a figure or table of a paper, measured here")
    experiment.add_argument("name", nargs="?", metavar="NAME", help="of those that --list shows")
    experiment.add_argument(
        "--list", action="store_true", help="the experiments and what they show"
    )
    experiment.add_argument(
        "-o", "--output", metavar="DIR", help="default: experiments/NAME, from where one is"
    )
    experiment.add_argument(
        "--size",
        default="small",
        choices=("tiny", "small", "full"),
        help="seconds, up to two minutes, or the paper's resolution; default: small",
    )
    experiment.add_argument(
        "--quick", action="store_const", const="tiny", dest="size", help="the same as --size tiny"
    )
    experiment.add_argument("--device", default="cpu", choices=DEVICES, help="default: cpu")
    experiment.add_argument(
        "--resume", action="store_true", help="keep what an interrupted run left in DIR"
    )
    only = experiment.add_argument_group(f"{FRONTIER} alone")
    add_techniques(only, "default: those of the catalog")
    only.add_argument(
        "--draw",
        choices=("tune", "check", "final"),
        help="what rays and scenes are for: tuning, checking (default), or the page of a release",
    )
    only.add_argument("--seed", type=int, help="of that draw; default: 0")


def _experiment(options: argparse.Namespace) -> None:
    from moit.commands.output import cleared_results
    from moit.experiments.catalog import EXPERIMENTS
    from moit.experiments.running import experiment, experiment_named

    if options.list:
        width = max(len(name) for name in EXPERIMENTS)
        print(f"{FRONTIER:<{width}}  {ITS_TITLE}")
        for name, one in EXPERIMENTS.items():
            print(f"{name:<{width}}  {one.paper}, {one.figure}: {one.title}")
        return
    if options.name is None:
        raise ValueError(f"NAME: expected one of {', '.join((FRONTIER, *EXPERIMENTS))}")
    if options.name == FRONTIER:
        _frontier(options)
        return
    for name in ("technique", "draw", "seed"):
        if getattr(options, name) is not None:
            raise ValueError(
                f"--{name}: expected with {FRONTIER} alone, got it with {options.name}"
            )
    found = experiment_named(options.name)
    folder = options.output or os.path.join("experiments", found.name)
    kept = cleared_results(folder, options.resume)
    result = experiment(found, options.size, device=options.device, out=kept)
    print(result)
    print()
    for path in result.write(folder):
        print(path)


def _frontier(options: argparse.Namespace) -> None:
    from moit.judging.running import KeptMeasures, frontier

    if options.device != "cpu":
        raise ValueError(f"--device: {FRONTIER} is judged on the CPU, got {options.device!r}")
    folder = options.output or os.path.join("experiments", FRONTIER)
    kept = os.path.join(folder, "results")
    if not options.resume:
        KeptMeasures(kept).clear()
    draw, seed = options.draw or "check", options.seed or 0
    found = frontier(options.technique, draw, options.size, seed=seed, out=kept)
    print(found)
    print()
    for path in found.write(folder):
        print(path)
