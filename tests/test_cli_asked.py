"""What commands ask of functions: every option of each, given and not."""

from pathlib import Path

import pytest

import moit
from moit.__main__ import main
from moit.benching.cost_measuring import texts
from moit.benching.timing import FRAGMENTS
from moit.commands.compare import DEMO_SCENES, DEMO_TECHNIQUES
from moit.experiments.catalog import EXPERIMENTS
from moit.formats.deep_bands import USUAL_MEMORY
from moit.gpu_costs.cards import CARDS
from moit.gpu_costs.frames import Frame
from moit.gpu_costs.stored import stored
from moit.numerics.columns import PRECISIONS

pytestmark = pytest.mark.usefixtures("trees_and_rocks")

DEEP = Path(__file__).parent / "data" / "deep"


class Asked(Exception):
    """What a command asked of a function, instead of an answer."""

    def __init__(self, *arguments, **options):
        self.arguments, self.options = arguments, options


def raises_what_it_is_asked(*arguments, **options):
    raise Asked(*arguments, **options)


# Every option of every command, given and not: the function that it calls, and with what.
UNCHOSEN = {"part": None, "layer": None}
ASKED = [
    (
        "compare trees.npz -t power4 -t wboit --reference power8 --repeat 9 --device gpu "
        "--device cpu -o d --part left --layer beauty --background 1,2,3 --threads 2 "
        "--depth-range 1,9 --no-cull-opaque --gpu rx6800 --resolution 64x32",
        "moit.comparing.comparison.compare",
        ({"trees": "trees.npz"}, ["power4", "wboit"]),
        {"devices": ["gpu", "cpu"], "reference": "power8", "repeat": 9, "out": "d/results"}
        | {"part": "left", "layer": "beauty", "background": (1, 2, 3), "threads": 2}
        | {"depth_range": (1, 9), "cull_opaque": False, "gpu": "rx6800", "resolution": (64, 32)},
    ),
    (
        "compare trees.npz",
        "moit.comparing.comparison.compare",
        ({"trees": "trees.npz"}, None),
        {"devices": ("cpu",), "reference": "sorted", "repeat": 5, "out": "report/results"}
        | {"background": (0, 0, 0), "threads": None, "depth_range": None, "cull_opaque": True}
        | {"gpu": None, "resolution": None}
        | UNCHOSEN,
    ),
    (
        "recommend trees.npz --max-error 0.5 -t power4,wboit --metric mse --by bits --max-bits 99 "
        "--no-ordered --max-passes 2 --no-exact --background 1,2,3 --threads 2 --gpu rx6800 "
        "--resolution 64x32",
        "moit.comparing.recommendation.recommend",
        ("trees.npz",),
        {
            "max_error": 0.5,
            "metric": "mse",
            "by": "bits",
            "techniques": ["power4,wboit"],
            "max_bits": 99,
            "ordered": False,
            "max_passes": 2,
            "exact": False,
            "background": (1, 2, 3),
            "threads": 2,
            "part": None,
            "layer": None,
            "gpu": "rx6800",
            "resolution": (64, 32),
        },
    ),
    (
        "recommend trees.npz --max-error 0.5",
        "moit.comparing.recommendation.recommend",
        ("trees.npz",),
        {
            "max_error": 0.5,
            "metric": "flip",
            "by": "seconds",
            "techniques": None,
            "max_bits": None,
            "ordered": True,
            "max_passes": None,
            "exact": True,
            "background": (0, 0, 0),
            "threads": None,
            "part": None,
            "layer": None,
            "gpu": None,
            "resolution": None,
        },
    ),
    (
        "composite trees.npz -t power4 -o o.exr --background 1,2,3 --device gpu",
        "moit.questions.composite",
        (None, moit.technique("power4")),
        {"background": (1, 2, 3), "device": "gpu"},
    ),
    (
        "composite trees.npz -t power4 -o o.exr",
        "moit.questions.composite",
        (None, moit.technique("power4")),
        {"background": (0, 0, 0), "device": "cpu"},
    ),
    (
        "composite DEEP -t power4 -o o.exr --background 1,2,3 --device gpu --memory 3M --part 2 "
        "--layer beauty --channel A=alpha --channel Z=depth",
        "moit.deep_composites.composite_deep",
        ("DEEP", "o.exr", moit.technique("power4")),
        {"background": (1, 2, 3), "device": "gpu", "memory": 3 << 20, "progress": True}
        | {"part": 2, "layer": "beauty", "channels": {"A": "alpha", "Z": "depth"}},
    ),
    (
        "composite DEEP -t power4 -o o.exr",
        "moit.deep_composites.composite_deep",
        ("DEEP", "o.exr", moit.technique("power4")),
        {"background": (0, 0, 0), "device": "cpu", "memory": USUAL_MEMORY, "progress": True}
        | UNCHOSEN
        | {"channels": None},
    ),
    (
        "curve trees.npz -t power4 --pixel 5,3 -o c.svg",
        "moit.deep.curve",
        ("trees.npz", "c.svg", ["power4"], (3, 5)),
        {"progress": True, "channels": None} | UNCHOSEN,
    ),
    (
        "curve trees.npz -o c.svg",
        "moit.deep.curve",
        ("trees.npz", "c.svg", None, None),
        {"progress": True, "channels": None} | UNCHOSEN,
    ),
    (
        "bench -t power4 --fragments 5 --threads 3 --repeat 4 --instructions",
        "moit.benching.report.report",
        (["power4"], 5, 3, 4, True),
        {},
    ),
    ("bench", "moit.benching.report.report", (None, FRAGMENTS, None, 3, False), {}),
    (
        "bench --gpu -t power4 --fragments 5 --fragments 6 --size 64x32 --repeat 4",
        "moit.benching.passes.report",
        (None, ["power4"], [5, 6], (64, 32), 4),
        {},
    ),
    (
        "bench --gpu",
        "moit.benching.passes.report",
        (None, None, [10_000_000, 20_000_000], (1920, 1080), 5),
        {},
    ),
    (
        "bench --gpu-cost -t power4 --family navi21 --family vega10",
        "moit.benching.cost_measuring.measured",
        (lambda: texts(["power4"]), ["navi21", "vega10"]),
        {},
    ),
    (
        "bench --gpu-cost",
        "moit.benching.cost_measuring.measured",
        (texts, ("navi21", "gfx1100", "vega10")),
        {},
    ),
    (
        "bench --gpu-cost --stored --card rx7600 --size 64x32 --fragments 9",
        "moit.benching.gpu_costs.report",
        (stored(), CARDS["rx7600"], Frame(9, 2048)),
        {},
    ),
    (
        "train neural -o m.npz --data layers --data puffs --recipe paper --fragments 5 --epochs 6 "
        "--batch 7 --rate .5 --loss color --seed 8 --checkpoint c.npz --resume --part 1 --layer b",
        "moit.neural.training.train",
        ("neural", ["layers", "puffs"]),
        {
            "checkpoint": "c.npz",
            "recipe": "paper",
            "fragments": 5,
            "epochs": 6,
            "batch": 7,
            "rate": 0.5,
            "loss": "color",
            "seed": 8,
            "resume": True,
            "part": 1,
            "layer": "b",
        },
    ),
    (
        "train dfa -o m.npz",
        "moit.neural.training.train",
        ("dfa", None),
        {"checkpoint": "m.checkpoint.npz", "recipe": "quick", "seed": 0, "resume": False}
        | dict.fromkeys(("fragments", "epochs", "batch", "rate", "loss"))
        | UNCHOSEN,
    ),
    (
        "stability -t power4 -t wboit -f ends -f clear -p float32 --rays 7 -o d",
        "moit.numerics.stability.stability",
        (["power4", "wboit"],),
        {"families": ["ends", "clear"], "precisions": ["float32"], "rays": 7, "out": "d/results"},
    ),
    (
        "stability",
        "moit.numerics.stability.stability",
        (None,),
        {"families": None, "precisions": PRECISIONS, "rays": 256, "out": "stability/results"},
    ),
    (
        "experiment mt-fig2 --size full --device gpu -o d",
        "moit.experiments.running.experiment",
        (EXPERIMENTS["mt-fig2"], "full"),
        {"device": "gpu", "out": "d/results"},
    ),
    (
        "experiment mt-fig2",
        "moit.experiments.running.experiment",
        (EXPERIMENTS["mt-fig2"], "small"),
        {"device": "cpu", "out": "experiments/mt-fig2/results"},
    ),
]


@pytest.mark.parametrize(("line", "asks", "arguments", "options"), ASKED)
def test_commands_pass_on_every_option(line, asks, arguments, options, monkeypatch):
    """Of arguments None stands for whatever was made of a file or a device, a function for what it
    gives: what takes seconds is not made where tests are collected."""
    deep = str(min(DEEP.glob("*.exr")))
    monkeypatch.setattr("moit.gpu.default_device", lambda: "a device")
    monkeypatch.setattr(asks, raises_what_it_is_asked)
    with pytest.raises(Asked) as asked:
        main([deep if word == "DEEP" else word for word in line.split()])
    assert asked.value.options == options
    assert len(asked.value.arguments) == len(arguments)
    for found, needed in zip(asked.value.arguments, arguments, strict=True):
        needed = needed() if callable(needed) else deep if needed == "DEEP" else needed
        assert needed is None or found == needed


def test_the_demo_compares_one_technique_of_each_idea_at_the_size_asked_for(monkeypatch):
    monkeypatch.setattr("moit.comparing.comparison.compare", raises_what_it_is_asked)
    with pytest.raises(Asked) as asked:
        main(["demo", "-o", "d", "--size", "24x16"])
    inputs, techniques = asked.value.arguments
    assert {name: f.shape for name, f in inputs.items()} == dict.fromkeys(DEMO_SCENES, (16, 24))
    assert techniques == DEMO_TECHNIQUES
    assert asked.value.options == {"repeat": 3, "out": "d/results"}
