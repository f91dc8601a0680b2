"""The command line: moit demo, compare, composite, curve, bench, train, experiment, ..."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from moit import __version__
from moit.checks.exceptions import MoitError

if TYPE_CHECKING:
    from moit.fragments.fragments import Fragments

# What a user can put right; anything else is our mistake and shows where it happened.
USER_ERRORS = (MoitError, ValueError, IndexError, OSError, ImportError, MemoryError)
INTERRUPTED = 130  # as shells count a process that SIGINT ended

INPUT = "a deep .exr, an .npz of Fragments, or a scene's name"
DEVICES = ("cpu", "gpu")
DEMO_SIZE = (320, 180)  # most of the time goes into HDR-FLIP


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command line; the exit status: 0, 1 for a user's error, 130 after Ctrl-C.

    Wrong usage leaves by SystemExit(2), as argparse has it.
    """
    options = _parser().parse_args(arguments)
    command: Callable[[argparse.Namespace], None] = options.command
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            command(options)
        sys.stdout.flush()
        return 0
    except KeyboardInterrupt:
        kept = getattr(options, "resume", None) is not None
        _complain("interrupted" + ("; --resume goes on from what was done" if kept else ""))
        return INTERRUPTED
    except BrokenPipeError:
        # The reader has enough, as `head` has; nothing is to be flushed there at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except USER_ERRORS as error:
        _complain(_one_line(error))
        return 1


def _complain(text: str) -> None:
    print(f"moit: {text}", file=sys.stderr)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    _complain(f"warning: {' '.join(str(message).split())}")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="moit",
        description="Order-independent transparency: techniques, curves, images and errors.",
    )
    parser.add_argument("--version", action="version", version=f"moit {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, function: Callable[..., None], text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(command=function)
        return sub

    demo = command("demo", _demo, "compare all techniques on the built-in scenes")
    demo.add_argument("-o", "--output", default="demo", metavar="DIR", help="default: demo")
    demo.add_argument(
        "--size", type=_size, default=DEMO_SIZE, metavar="WxH", help="default: 320x180"
    )

    compare = command("compare", _compare, "compare techniques on inputs and write a report")
    compare.add_argument("input", nargs="+", metavar="INPUT", help=INPUT)
    compare.add_argument("--merge", action="store_true", help="all inputs as one scene")
    _add_techniques(compare, "default: all")
    compare.add_argument("-o", "--output", default="report", metavar="DIR", help="default: report")
    compare.add_argument("--reference", default="sorted", metavar="NAME", help="default: sorted")
    compare.add_argument(
        "--repeat", type=int, default=5, metavar="N", help="timed composites each; default: 5"
    )
    compare.add_argument(
        "--device", action="append", choices=DEVICES, help="may be repeated; default: cpu"
    )
    compare.add_argument(
        "--resume", action="store_true", help="keep what an interrupted run left in DIR"
    )

    composite = command("composite", _composite, "write the image that a technique makes")
    composite.add_argument("input", metavar="INPUT", help=INPUT)
    composite.add_argument("-t", "--technique", required=True, metavar="NAME")
    composite.add_argument("-o", "--output", required=True, metavar="FILE", help=".exr or .png")
    composite.add_argument(
        "--background", type=_colour, default=(0.0, 0.0, 0.0), metavar="R,G,B", help="linear"
    )
    composite.add_argument("--device", default="cpu", choices=DEVICES, help="default: cpu")
    composite.add_argument(
        "--memory",
        type=_bytes,
        metavar="SIZE",
        help="what reading a deep image may take, as 500M or 2G; a larger one goes through in "
        "bands; default: 1G",
    )

    curve = command("curve", _curve, "plot the transmittance along one ray")
    curve.add_argument("input", metavar="INPUT", help=INPUT)
    curve.add_argument(
        "--pixel",
        type=_pixel,
        metavar="X,Y",
        help="counted from the upper left of the image; default: that with the most fragments",
    )
    _add_techniques(curve, "default: all that have a curve")
    curve.add_argument(
        "-o",
        "--output",
        default="curve.png",
        metavar="FILE",
        help="default: curve.png; .svg needs no matplotlib",
    )

    bench = command("bench", _bench, "time techniques and their rivals, or passes on a GPU")
    bench.add_argument("--gpu", action="store_true", help="the passes of techniques on a GPU")
    _add_techniques(bench, "default: all; on a GPU those of MBOIT's table 1 and some more")
    bench.add_argument(
        "--fragments",
        type=int,
        action="append",
        metavar="N",
        help="about how many; default: 4 million; on a GPU may be repeated: 10 and 20 million",
    )
    bench.add_argument(
        "--size",
        type=_size,
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
        help="write Markdown there, too: ratios, between the marks that FILE has for it",
    )

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
    train.add_argument("--loss", metavar="NAME", help="transmittance, visible, color or picture")
    train.add_argument("--seed", type=int, default=0, metavar="N", help="default: 0")
    train.add_argument(
        "--checkpoint", metavar="FILE", help="kept while it lasts; default: FILE.checkpoint.npz"
    )
    train.add_argument("--resume", action="store_true", help="go on from the checkpoint")

    stability = command("stability", _stability, "test techniques on rays that are hard on them")
    _add_techniques(stability, "default: all")
    stability.add_argument(
        "-f",
        "--family",
        action="append",
        metavar="NAME",
        help="of rays, such as distance or layers; may be repeated; default: all",
    )
    stability.add_argument(
        "-p",
        "--precision",
        action="append",
        metavar="NAME",
        help="'16 bit', float32 or float64; may be repeated; default: all",
    )
    stability.add_argument(
        "--rays", type=int, default=256, metavar="N", help="at each setting; default: 256"
    )
    stability.add_argument(
        "-o", "--output", default="stability", metavar="DIR", help="default: stability"
    )
    stability.add_argument(
        "--resume", action="store_true", help="keep what an interrupted run left in DIR"
    )

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

    command("info", _info, "versions, instruction sets, threads, extras")
    command("scenes", _scenes, "the built-in scenes")
    command("techniques", _techniques, "the techniques and their sources")
    return parser


def _add_techniques(parser: argparse.ArgumentParser, default: str) -> None:
    parser.add_argument(
        "-t",
        "--technique",
        action="append",
        metavar="NAME",
        help=f"such as power4 or 'power4(bias=0.0)'; may be repeated; {default}",
    )


def _numbers(text: str, separator: str, count: int, kind: type, form: str) -> tuple[Any, ...]:
    try:
        found = tuple(kind(part) for part in text.split(separator))
        if len(found) != count:
            raise ValueError
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected {form}, got {text!r}") from None
    return found


def _bytes(text: str) -> int:
    number, unit = (text[:-1], text[-1]) if text[-1:].isalpha() else (text, "")
    power = "KMGT".find(unit.upper()) + 1
    try:
        count = int(float(number) * 1024**power) if power or not unit else 0
    except (ValueError, OverflowError):
        count = 0
    if count < 1:
        raise argparse.ArgumentTypeError(f"expected bytes as 500M or 2G, got {text!r}")
    return count


def _size(text: str) -> tuple[int, int]:
    width, height = _numbers(text.lower(), "x", 2, int, "WIDTHxHEIGHT")
    if min(width, height) < 1:
        raise argparse.ArgumentTypeError(f"expected at least 1x1, got {text!r}")
    return width, height


def _pixel(text: str) -> tuple[int, int]:
    x, y = _numbers(text, ",", 2, int, "X,Y")
    return y, x


def _colour(text: str) -> tuple[float, ...]:
    return _numbers(text, ",", 3, float, "R,G,B")


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


def _demo(options: argparse.Namespace) -> None:
    from moit import scenes
    from moit.commands.output import cleared_results, write_curves, write_images, write_report
    from moit.comparing.comparison import compare

    inputs = {name: scenes.load(name, size=options.size) for name in DEMO_SCENES}
    report = compare(
        inputs, DEMO_TECHNIQUES, repeat=3, out=cleared_results(options.output, resume=False)
    )
    paths = [*write_images(report, options.output), *write_curves(report, options.output)]
    write_report(report, options.output, "moit demo", paths)


def _compare(options: argparse.Namespace) -> None:
    from moit.commands.output import cleared_results, write_images, write_report
    from moit.comparing.comparison import compare, named_scenes
    from moit.fragments.fragments import merge
    from moit.inputs import as_fragments

    inputs: dict[str, Any] = dict(named_scenes(options.input))
    if options.merge:
        inputs = {"merged": merge([as_fragments(one, "INPUT") for one in inputs.values()])}
    report = compare(
        inputs,
        options.technique,
        devices=options.device or ("cpu",),
        reference=options.reference,
        repeat=options.repeat,
        out=cleared_results(options.output, options.resume),
    )
    title = f"moit compare: {', '.join(os.path.basename(one) for one in options.input)}"
    paths = write_images(report, options.output)
    write_report(report, options.output, title, paths)


def _composite(options: argparse.Namespace) -> None:
    from moit.catalog import technique
    from moit.formats.deep_bands import USUAL_MEMORY, composite_deep
    from moit.formats.images import write_image
    from moit.inputs import as_fragments
    from moit.questions import composite

    chosen = technique(options.technique)
    how = {"background": options.background, "device": options.device}
    deep = options.input.lower().endswith(".exr") and os.path.isfile(options.input)
    if deep and chosen.local:
        memory = USUAL_MEMORY if options.memory is None else options.memory
        composite_deep(options.input, options.output, chosen, **how, memory=memory, progress=True)
    elif options.memory is not None:
        found = f"{chosen}" if deep else repr(options.input)
        raise ValueError(f"--memory: expected a deep .exr and a local technique, got {found}")
    else:
        image = composite(as_fragments(options.input, "INPUT"), chosen, **how)
        write_image(options.output, image, technique=chosen)
    print(options.output)


def _curve(options: argparse.Namespace) -> None:
    from moit.catalog import technique, techniques
    from moit.inputs import as_fragments
    from moit.plot import checked_pixel

    fragments = as_fragments(options.input, "INPUT")
    if options.technique:
        chosen = [technique(name) for name in options.technique]
        for one in chosen:
            if not one.has_curve:
                raise ValueError(f"{one} has no transmittance but at fragments, so no curve")
    else:
        chosen = [one for one in techniques() if one.has_curve and str(one) != "sorted"]
    pixel = checked_pixel(fragments, options.pixel)
    if options.output.lower().endswith(".svg"):
        _curve_as_svg(fragments, chosen, pixel, options.output)
    else:
        from moit.plot import curves
        from moit.system.files import replacing

        figure: Any = curves(fragments, chosen, pixel).figure
        with replacing(options.output) as part:
            figure.savefig(part, dpi=150)
    print(options.output)


def _curve_as_svg(f: Fragments, chosen: Sequence[Any], pixel: tuple[int, int], path: str) -> None:
    from moit.commands.output import STANDALONE
    from moit.comparing.charts import curves_chart
    from moit.comparing.measurement import curve, curve_depths
    from moit.reports.svg import standalone, svg
    from moit.system.files import write_text

    depth = curve_depths(f, pixel)
    held = [(str(one), curve(f, one, pixel, depth)) for one in chosen]
    chart = curves_chart(depth, curve(f, "sorted", pixel, depth), held)
    write_text(path, standalone(svg(chart, STANDALONE, legend=True)))


def _bench(options: argparse.Namespace) -> None:
    from moit.system.files import write_text

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


def _stability(options: argparse.Namespace) -> None:
    from moit.commands.output import write_tables
    from moit.numerics.columns import PRECISIONS
    from moit.numerics.stability import clear, stability

    kept = os.path.join(options.output, "results")
    if not options.resume:
        clear(kept)
    report = stability(
        options.technique,
        families=options.family,
        precisions=options.precision or PRECISIONS,
        rays=options.rays,
        out=kept,
    )
    write_tables(report, options.output, "stability", "moit stability")


def _train(options: argparse.Namespace) -> None:
    from moit.neural.training import train

    checkpoint = options.checkpoint
    if checkpoint is None:
        checkpoint = f"{os.path.splitext(options.output)[0]}.checkpoint.npz"
    names = ("recipe", "fragments", "epochs", "batch", "rate", "loss", "seed", "resume")
    network = train(
        options.technique,
        options.data,
        checkpoint=checkpoint,
        **{name: getattr(options, name) for name in names},
    )
    network.write(options.output)
    os.unlink(checkpoint)
    for name, score in network.scores.items():
        print(f"{name:32} {score:.4f}")
    print(options.output)


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


def _info(_: argparse.Namespace) -> None:
    from moit.system.environment import info

    print(info())


def _scenes(_: argparse.Namespace) -> None:
    from moit import scenes

    print("\n".join(scenes.names()))


def _techniques(_: argparse.Namespace) -> None:
    from moit.catalog import techniques

    lines = [("name", "bits", "any order", "source")]
    for one in techniques():
        bits = "grows" if one.bits_per_pixel is None else f"{one.bits_per_pixel:g}"
        lines.append((str(one), bits, "yes" if one.order_independent else "no", one.source))
    widths = [max(len(line[i]) for line in lines) for i in range(3)]
    for name, bits, order, source in lines:
        print(f"{name:<{widths[0]}}  {bits:>{widths[1]}}  {order:<{widths[2]}}  {source}")


if __name__ == "__main__":
    sys.exit(main())
