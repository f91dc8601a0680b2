"""The command line: moit demo, compare, composite, curve, bench, train, experiment, ..."""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from moit.checks.exceptions import MoitError, in_one_line
from moit.commands import (
    bench,
    compare,
    deep,
    experiment,
    export,
    lists,
    picture,
    recommend,
    stability,
    train,
)
from moit.system.version import VERSION

# What a user can put right; anything else is our mistake and shows where it happened.
USER_ERRORS = (
    *(MoitError, ValueError, IndexError, OSError, ImportError, MemoryError),
    FloatingPointError,  # a training that went astray
)
INTERRUPTED = 130  # as shells count a process that SIGINT ended

COMMANDS = (
    compare,
    recommend,
    picture,
    deep,
    bench,
    train,
    stability,
    experiment,
    export,
    lists,
)  # as help lists them


# What one does first, as help shows it.
FIRST = """what one does first:
  moit demo                                     all of it on built-in scenes, into demo/
  moit scenes                                   what there is to look at; or bring a deep .exr
  moit techniques                               what there is to look with, and its sources
  moit composite mixed -t mboit4 -o out.png     the picture that a technique makes
  moit compare mixed -t sorted,mboit4,wboit     errors, times and pictures, into report/
  moit recommend mixed --max-error 0.02         the cheapest technique that is good enough
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command line; the exit status: 0, 1 for a user's error, 130 after Ctrl-C.

    Wrong usage leaves by SystemExit(2), as argparse has it.
    """
    for stream in (sys.stdout, sys.stderr):  # a name that they cannot encode is shown anyway
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser = _parser()
    if not given:
        parser.print_help()
        return 0
    options = parser.parse_args(given)
    command: Callable[[argparse.Namespace], None] = options.command
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            command(options)
        _flush()
        return 0
    except KeyboardInterrupt:
        kept = getattr(options, "resume", None) is not None
        _complain("interrupted" + ("; --resume goes on from what was done" if kept else ""))
        return INTERRUPTED
    except BrokenPipeError:  # the reader has enough, as `head` has
        _flush_nothing_at_exit()
        return 0
    except USER_ERRORS as error:
        _complain(_one_line(error))
        try:
            _flush()
        except OSError:  # a full disk, which is said by now
            _flush_nothing_at_exit()
        return 1


def _flush() -> None:
    if sys.stdout is not None:  # as it is where the shell closed it
        sys.stdout.flush()


def _flush_nothing_at_exit() -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


# A word of a message that is longer is shown by its ends: nobody reads 5,000 letters.
LONGEST_WORD = 400


class _Parser(argparse.ArgumentParser):
    """Takes `--window -1,-1,3x3`: what begins as a negative number is a value."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def error(self, message: str) -> NoReturn:
        super().error(_shortened(message))


def _shortened(text: str) -> str:
    def ends(word: re.Match[str]) -> str:
        return f"{word[0][:100]}...{word[0][-100:]}"

    return re.sub(rf"\S{{{LONGEST_WORD},}}", ends, text)


def _complain(text: str) -> None:
    print(f"moit: {_shortened(text)}", file=sys.stderr)


def _one_line(error: BaseException) -> str:
    return in_one_line(error) or type(error).__name__


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    _complain(f"warning: {in_one_line(message)}")


class _Help(argparse.RawDescriptionHelpFormatter):
    """As argparse's, with the names of commands in a column that is wide enough for them."""

    def add_argument(self, action: argparse.Action) -> None:
        super().add_argument(action)
        for command in self._iter_indented_subactions(action):
            words = len(self._format_action_invocation(command)) + self._current_indent
            indent = 2 * self._indent_increment  # of commands below their heading
            self._action_max_length = max(self._action_max_length, words + indent)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="moit",
        description="Order-independent transparency: techniques, curves, images and errors.",
        epilog=FIRST,
        formatter_class=_Help,
    )
    parser.add_argument("--version", action="version", version=f"moit {VERSION}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, function: Callable[..., None], text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(command=function)
        return sub

    for one in COMMANDS:
        one.add(command)
    return parser


if __name__ == "__main__":
    sys.exit(main())
