"""What arguments on the command line stand for."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from typing import Any

# Makes the parser of a command: its name, what runs it, a line of help.
Command = Callable[[str, Callable[[argparse.Namespace], None], str], argparse.ArgumentParser]

INPUT = "a deep .exr, an .npz of Fragments, or a scene's name"
DEVICES = ("cpu", "gpu")


def add_gpu(parser: argparse.ArgumentParser, when: str) -> None:
    parser.add_argument(
        "--gpu", metavar="NAME", help=f"{when}whose frames are predicted, such as rx6800"
    )
    parser.add_argument(
        "--resolution", type=size, metavar="WxH", help=f"{when}of them; default: 1920x1080"
    )


def add_techniques(parser: argparse._ActionsContainer, default: str) -> None:
    parser.add_argument(
        "-t",
        "--technique",
        action="append",
        metavar="NAME",
        help=f"such as power4 or 'power4(bias=0.0)'; several with commas or repeated; {default}",
    )


def add_choice(parser: argparse.ArgumentParser, *, layers: bool = True) -> None:
    """Which part and layer of deep images, where an argument is such a file."""
    parser.add_argument(
        "--part",
        type=part,
        metavar="PART",
        help="of a deep .exr of several: its index, name or view; default: the only deep one; "
        "moit inspect lists them",
    )
    if not layers:
        return
    parser.add_argument(
        "--layer",
        metavar="NAME",
        help="of a deep .exr: the prefix of its channels; default: none, or the only complete one",
    )


def add_channels(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--channel",
        action="append",
        type=channel,
        metavar="A=NAME",
        help="of a deep .exr: the name of R, G, B, A, Z or ZBack there; may be repeated",
    )


def part(text: str) -> int | str:
    return int(text) if text.isdecimal() else text


def channel(text: str) -> tuple[str, str]:
    role, equals, name = text.partition("=")
    if not (role and equals and name):
        raise argparse.ArgumentTypeError(f"expected such as A=alpha, got {text!r}")
    return role, name


def add_background(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--background",
        type=background,
        default=(0.0, 0.0, 0.0),
        metavar="R,G,B|FILE",
        help="linear radiance behind everything, or an image of the same size; default: black",
    )


def background(text: str) -> tuple[float, ...] | str:
    """A colour, or the path of an image, which `background_from` reads."""
    if os.path.isfile(text):
        return text
    return _numbers(text, ",", 3, float, "R,G,B or the path of an image")


def background_from(given: tuple[float, ...] | str) -> Any:
    """(3,), or (height, width, 3) of an image file, whose alpha is passed over."""
    if not isinstance(given, str):
        return given
    from moit.formats.images import read_image

    return read_image(given)[..., :3]


def _numbers(text: str, separator: str, count: int, kind: type, form: str) -> tuple[Any, ...]:
    try:
        found = tuple(kind(part) for part in text.split(separator))
        if len(found) != count:
            raise ValueError
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected {form}, got {text!r:.80}") from None
    return found


def byte_count(text: str) -> int:
    number, unit = (text[:-1], text[-1]) if text[-1:].isalpha() else (text, "")
    power = "KMGT".find(unit.upper()) + 1 if unit else 0
    try:
        count = int(float(number) * 1024**power) if power or not unit else 0
    except (ValueError, OverflowError):
        count = 0
    if count < 1:
        raise argparse.ArgumentTypeError(f"expected bytes as 500M or 2G, got {text!r:.80}")
    return count


def size(text: str) -> tuple[int, int]:
    width, height = _numbers(text.lower(), "x", 2, int, "WIDTHxHEIGHT")
    if min(width, height) < 1:
        raise argparse.ArgumentTypeError(f"expected at least 1x1, got {text!r:.80}")
    return width, height


def near_and_far(text: str) -> tuple[float, ...]:
    return _numbers(text, ",", 2, float, "NEAR,FAR")


def pixel(text: str) -> tuple[int, int]:
    x, y = _numbers(text, ",", 2, int, "X,Y")
    return y, x
