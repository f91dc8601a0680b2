"""moit experiment."""

from __future__ import annotations

import argparse
import os

from moit.commands.values import DEVICES, Command


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
    experiment.add_argument("--device", default="cpu", choices=DEVICES, help="default: cpu")
    experiment.add_argument(
        "--resume", action="store_true", help="keep what an interrupted run left in DIR"
    )


def _experiment(options: argparse.Namespace) -> None:
    from moit.commands.output import cleared_results
    from moit.experiments.catalog import EXPERIMENTS
    from moit.experiments.running import experiment, experiment_named

    if options.list:
        width = max(len(name) for name in EXPERIMENTS)
        for name, one in EXPERIMENTS.items():
            print(f"{name:<{width}}  {one.paper}, {one.figure}: {one.title}")
        return
    if options.name is None:
        raise ValueError(f"NAME: expected one of {', '.join(EXPERIMENTS)}")
    found = experiment_named(options.name)
    folder = options.output or os.path.join("experiments", found.name)
    kept = cleared_results(folder, options.resume)
    result = experiment(found, options.size, device=options.device, out=kept)
    print(result)
    print()
    for path in result.write(folder):
        print(path)
