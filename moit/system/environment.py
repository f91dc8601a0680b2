"""What moit runs on: processor, instruction sets, threads."""

from __future__ import annotations

import functools
import os
import platform
import sys
from typing import Any

from moit.system.version import VERSION


def thread_count(threads: int | None) -> int:
    """How many threads a call uses.

    threads : at least 1; None: the environment variable MOIT_THREADS, and where that is unset
        or empty the number of processors this process may use.

    Raises TypeError where `threads` is not an integer, ValueError where it or MOIT_THREADS is
    not at least 1.
    """
    if threads is None:
        text = os.environ.get("MOIT_THREADS", "").strip()
        if not text:
            return processors()
        if not (text.isascii() and text.isdigit() and int(text) >= 1):
            raise ValueError(f"MOIT_THREADS: expected an integer of at least 1, got {text!r:.80}")
        return _within_c_int(int(text))
    try:
        if isinstance(threads, bool):
            raise TypeError
        count = threads.__index__()
    except (AttributeError, TypeError):
        raise TypeError(
            f"threads: expected an integer or None, got {type(threads).__name__}"
        ) from None
    if count < 1:
        raise ValueError(f"threads: expected at least 1, got {count}")
    return _within_c_int(count)


def _within_c_int(count: int) -> int:
    return min(count, 2**31 - 1)


def processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processor() -> str:
    """The processor's model name, or the architecture where the system does not tell."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            for line in lines:
                if line.startswith("model name"):
                    return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def machine(threads: int | None = None) -> str:
    """One line that says what times were measured on. threads : as `thread_count`."""
    python = ".".join(str(part) for part in sys.version_info[:3])
    sets = core_facts().get("instruction set in use")
    count = thread_count(threads)
    parts = [f"moit {VERSION}", processor(), f"{count} thread{'s' * (count != 1)}"]
    return ", ".join([*parts, *([f"{sets}"] if sets else []), f"Python {python}"])


def core_facts() -> dict[str, Any]:
    """What the core was built for and chose."""
    try:
        from moit import _core
    except ImportError as error:  # info is what one calls when this happens
        return {"core": f"cannot be imported: {error}"}
    return dict(_core.build_info())


@functools.cache
def core_digest() -> str:
    """The same for the same built core, and another for any other: what is kept of one that was
    built of other code, or otherwise, is not taken for this one's."""
    import hashlib  # late: `import moit` stays quick

    from moit import _core

    with open(_core.__file__, "rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
