"""Progress of calls that may last: tqdm, a plain line on stderr, or the caller's function."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

# Called with how many steps are done, how many there are, and what was done last.
Listener = Callable[[int, int, str], object]
Progress = bool | Listener

SECONDS_BETWEEN_LINES = 10.0


@contextmanager
def steps(progress: Progress, total: int, title: str) -> Iterator[Callable[[str], None]]:
    """Gives a function to call after each of `total` steps with what the step was.

    progress : False shows nothing. True shows tqdm's bar where tqdm is installed and stderr is
        a terminal; a line that overwrites itself on other terminals; and in a log one line
        every ten seconds, so that a short call leaves none. A callable is called with
        (done, total, label) instead, first with (0, total, "").

    Raises TypeError for anything else.
    """
    if callable(progress):
        show, close = _called(progress, total)
    elif not isinstance(progress, bool):
        raise TypeError(
            f"progress: expected True, False or a callable, got {type(progress).__name__}"
        )
    elif not progress or sys.stderr is None:
        show, close = (lambda label: None), (lambda: None)
    elif not sys.stderr.isatty():
        show, close = _logged(total, title)
    else:
        show, close = _tqdm(total, title) or _overwritten(total, title)
    try:
        yield show
    finally:
        close()


_Shown = tuple[Callable[[str], None], Callable[[], None]]


def _called(listener: Listener, total: int) -> _Shown:
    done = 0

    def show(label: str) -> None:
        nonlocal done
        done += 1
        listener(done, total, label)

    listener(0, total, "")
    return show, lambda: None


def _tqdm(total: int, title: str) -> _Shown | None:
    try:
        from tqdm import tqdm
    except ImportError:
        return None
    bar: Any = tqdm(total=total, desc=title, file=sys.stderr, dynamic_ncols=True)

    def show(label: str) -> None:
        bar.set_postfix_str(label, refresh=False)
        bar.update()

    return show, bar.close


def _overwritten(total: int, title: str) -> _Shown:
    done = 0

    def show(label: str) -> None:
        nonlocal done
        done += 1
        line = f"{title}: {done}/{total}  {label}"[:79]
        print(f"\r{line:<79}", end="", file=sys.stderr, flush=True)

    return show, lambda: print(file=sys.stderr) if done else None


def _logged(total: int, title: str) -> _Shown:
    done, start = 0, time.monotonic()
    last = start

    def show(label: str) -> None:
        nonlocal done, last
        done += 1
        now = time.monotonic()
        if now - last >= SECONDS_BETWEEN_LINES:
            last = now
            print(
                f"{title}: {done}/{total}  {now - start:.0f} s  {label}",
                file=sys.stderr,
                flush=True,
            )

    return show, lambda: None
