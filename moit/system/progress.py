"""Progress of calls that may last: tqdm, a plain line on stderr, or the caller's function."""

from __future__ import annotations

import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

# Called with how many steps are done, how many there are, and what was done last.
Listener = Callable[[int, int, str], object]
Progress = bool | Listener

LOGGER = logging.getLogger("moit")

SECONDS_BETWEEN_LINES = 10.0
SECONDS_BEFORE_A_LINE = 0.5  # on a terminal, where nothing is done by then
WIDTH = 79
SIZE = {"ncols": WIDTH, "nrows": 24}  # tqdm asks the terminal for what is not said


class Steps:
    """Called after each step with what it was. This one shows nothing."""

    def __call__(self, label: str) -> None:
        pass

    def now(self, label: str) -> None:
        """Says what is being done, which may last."""

    def close(self) -> None:
        """No step comes any more."""


@contextmanager
def steps(progress: Progress, total: int, title: str, *, patient: bool = False) -> Iterator[Steps]:
    """Gives a function to call after each of `total` steps with what the step was, and whose `now`
    says what is being done.

    progress : False shows nothing. True shows tqdm's bar where tqdm is installed and stderr is
        a terminal; a line that overwrites itself on other terminals, after half a second though
        nothing is done yet; and in a log one line every ten seconds, so that a short call leaves
        none: INFO of the logger "moit" where the program takes such records, else on stderr.
        A callable is called with (done, total, label) instead, first with (0, total, "").
    patient : for calls that mostly are short: on a terminal nothing is shown before half a second
        has passed, the line is gone when they end, and there is none where another call that they
        are part of shows its own.

    Raises TypeError for anything else.
    """
    shown = _shown(progress, total, title, patient)
    try:
        yield shown
    finally:
        shown.close()


@contextmanager
def preparing(progress: Progress, title: str) -> Iterator[Steps]:
    """The same, patient, for what comes before a call's steps: a callable is not told of it."""
    with steps(progress is True, 0, title, patient=True) as shown:
        yield shown


def _shown(progress: Progress, total: int, title: str, patient: bool) -> Steps:
    if callable(progress):
        return _Called(progress, total)
    if not isinstance(progress, bool):
        raise TypeError(
            f"progress: expected True, False or a callable, got {type(progress).__name__}"
        )
    if not progress or sys.stderr is None:
        return Steps()
    if not sys.stderr.isatty():
        return _Log(total, title)
    if patient:
        return Steps() if _Terminal.open else _Line(total, title, patient)
    return _bar(total, title) or _Line(total, title, patient)


class _Called(Steps):
    def __init__(self, listener: Listener, total: int) -> None:
        self.listener, self.total, self.done = listener, total, 0
        listener(0, total, "")

    def __call__(self, label: str) -> None:
        self.done += 1
        self.listener(self.done, self.total, label)


class _Terminal(Steps):
    """What is on a terminal, where lines of several calls would be mixed up."""

    open = 0
    counting = threading.Lock()

    def __init__(self) -> None:
        with self.counting:
            _Terminal.open += 1

    def close(self) -> None:
        with self.counting:
            _Terminal.open -= 1


class _Bar(_Terminal):
    """tqdm's."""

    def __init__(self, bar: Any) -> None:
        super().__init__()
        self.bar = bar

    def __call__(self, label: str) -> None:
        self.bar.set_postfix_str(label, refresh=False)
        self.bar.update()

    def now(self, label: str) -> None:
        self.bar.set_postfix_str(label)

    def close(self) -> None:
        super().close()
        self.bar.close()


def _bar(total: int, title: str) -> Steps | None:
    try:
        from tqdm import tqdm
    except ImportError:
        return None
    # On a terminal without a width tqdm shows nothing of its own accord.
    width: dict[str, Any] = {"dynamic_ncols": True} if _has_width() else SIZE
    return _Bar(tqdm(total=total, desc=title, file=sys.stderr, **width))


def _has_width() -> bool:
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns > 0
    except (OSError, ValueError):  # such as one that is no file
        return False


class _Line(_Terminal):
    """A line that overwrites itself; a patient one waits, and goes when all is done."""

    def __init__(self, total: int, title: str, patient: bool) -> None:
        super().__init__()
        self.total, self.title, self.patient = total, title, patient
        self.done, self.label, self.written = 0, "", False
        self.stream = sys.stderr
        self.writing = threading.Lock()
        self.end = later(SECONDS_BEFORE_A_LINE, self._write)

    def __call__(self, label: str) -> None:
        self.done += 1
        self.label = label
        if self.written or not self.patient:
            self._write()

    def now(self, label: str) -> None:
        self.label = label
        if self.written:
            self._write()

    def close(self) -> None:
        super().close()
        self.end()
        with self.writing:
            if self.written and self.patient:
                print(f"\r{'':<{WIDTH}}\r", end="", file=self.stream, flush=True)
            elif self.written:
                print(file=self.stream)

    def _write(self) -> None:
        count = f": {self.done}/{self.total}" if self.total else ":"
        line = f"{self.title}{count}  {self.label}"[:WIDTH]
        with self.writing:
            self.written = True
            print(f"\r{line:<{WIDTH}}", end="", file=self.stream, flush=True)


def later(seconds: float, function: Callable[[], None]) -> Callable[[], None]:
    """Calls a function in a thread of its own after so many seconds, unless what this gives is
    called before; that waits until it is sure."""
    timer = threading.Timer(seconds, function)
    timer.daemon = True
    timer.start()

    def end() -> None:
        timer.cancel()
        timer.join()

    return end


class _Log(Steps):
    """A line now and then."""

    def __init__(self, total: int, title: str) -> None:
        self.total, self.title, self.done = total, title, 0
        self.start = self.last = time.monotonic()

    def __call__(self, label: str) -> None:
        self.done += 1
        now = time.monotonic()
        if now - self.last >= SECONDS_BETWEEN_LINES:
            self.last = now
            _report(f"{self.title}: {self.done}/{self.total}  {now - self.start:.0f} s  {label}")


def _report(line: str) -> None:
    if LOGGER.isEnabledFor(logging.INFO) and LOGGER.hasHandlers():
        LOGGER.info("%s", line)
    else:  # it was asked for, and would be lost
        print(line, file=sys.stderr, flush=True)
