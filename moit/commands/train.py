"""moit train."""

from __future__ import annotations

import argparse
import os

from moit.commands.values import INPUT, Command, add_choice


def add(command: Command) -> None:
    train = command("train", _train, "train the network of a neural technique on fragments")
    train.add_argument(
        "technique",
        metavar="NAME",
        help="such as neural-bounded",
    )
    train.add_argument("-o", "--output", required=True, metavar="FILE", help="the network, an .npz")
    train.add_argument(
        "--data",
        action="append",
        metavar="INPUT",
        help=f"a set of random rays such as layers or surfaces, or {INPUT}; may be repeated; "
        "default: the recipe's",
    )
    train.add_argument(
        "--recipe", default="quick", metavar="NAME", help="quick, paper or shipped; default: quick"
    )
    for name, kind, text in (
        ("fragments", int, "of each input at most"),
        ("epochs", int, "how often each is seen"),
        ("batch", int, "how many to a step"),
        ("rate", float, "Adam's learning rate"),
    ):
        train.add_argument(
            f"--{name}", type=kind, metavar="N", help=f"{text}; default: the recipe's"
        )
    add_choice(train)
    train.add_argument("--loss", metavar="NAME", help="transmittance, visible, color or picture")
    train.add_argument("--seed", type=int, default=0, metavar="N", help="default: 0")
    train.add_argument(
        "--checkpoint", metavar="FILE", help="kept while it lasts; default: FILE.checkpoint.npz"
    )
    train.add_argument("--resume", action="store_true", help="go on from the checkpoint")


def _train(options: argparse.Namespace) -> None:
    from moit.neural.training import train
    from moit.system.files import must_be_writable, remove

    must_be_writable(options.output)  # training may take hours
    checkpoint = options.checkpoint
    if checkpoint is None:
        checkpoint = f"{os.path.splitext(options.output)[0]}.checkpoint.npz"
    names = (
        "recipe",
        "fragments",
        "epochs",
        "batch",
        "rate",
        "loss",
        "seed",
        "resume",
        "part",
        "layer",
    )
    network = train(
        options.technique,
        options.data,
        checkpoint=checkpoint,
        **{name: getattr(options, name) for name in names},
    )
    network.write(options.output)
    remove(checkpoint)
    for name, score in network.scores.items():
        print(f"{name:32} {score:.4f}")
    print(options.output)
