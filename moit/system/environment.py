"""What moit runs on: versions, instruction sets, threads, and which extras are there."""

from __future__ import annotations

import os
import platform
import sys
from typing import Any

# Each extra of pyproject.toml that adds something for users, and what it installs.
EXTRAS = {
    "plot": ("matplotlib",),
    "mesh": ("trimesh", "pillow"),
    "notebook": ("matplotlib", "ipykernel"),
    "dask": ("distributed",),
    "gpu": ("moderngl",),
}


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
            raise ValueError(f"MOIT_THREADS: expected an integer of at least 1, got {text!r}")
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


class Info(dict[str, Any]):
    """What `info` found: a dict that prints as aligned lines."""

    def __str__(self) -> str:
        lines = []
        for key, value in self.items():
            if isinstance(value, dict):
                lines += [(f"{key} {name}", str(one)) for name, one in value.items()]
            else:
                lines.append((key, str(value)))
        width = max(len(key) for key, _ in lines)
        return "\n".join(f"{key:<{width}}  {value}" for key, value in lines)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(str(self))}</pre>"


def info() -> Info:
    """Versions, instruction sets, threads and extras, to read or to paste into a bug report.

    Returns a dict that prints as a table. "extra ..." says what an extra installs and finds, or
    the line that installs it. Imports none of them; "GPU" says what draws, or what is missing.
    """
    from moit import __version__

    return Info(
        {
            "moit": __version__,
            "python": f"{platform.python_implementation()} {platform.python_version()}",
            "platform": platform.platform(),
            "processor": processor(),
            "threads": thread_count(None),
            **_core(),
            "numpy": _version("numpy") or "missing",
            "OpenImageIO": _version("OpenImageIO") or "missing: pip install OpenImageIO",
            "OpenEXR": _version("OpenEXR") or "missing: pip install OpenEXR",
            "GPU": _gpu(),
            "tqdm": _version("tqdm") or "missing: pip install tqdm",
            "extra": {name: _extra(name) for name in EXTRAS},
        }
    )


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


def machine() -> str:
    """One line that says what times were measured on."""
    from moit import __version__

    python = ".".join(str(part) for part in sys.version_info[:3])
    sets = _core().get("instruction set in use")
    parts = [f"moit {__version__}", processor(), f"{thread_count(None)} threads"]
    return ", ".join([*parts, *([f"{sets}"] if sets else []), f"Python {python}"])


def _core() -> dict[str, Any]:
    try:
        from moit import _core
    except ImportError as error:  # info is what one calls when this happens
        return {"core": f"cannot be imported: {error}"}
    return dict(_core.build_info())


def _version(distribution: str) -> str | None:
    from importlib import metadata

    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def _extra(name: str) -> str:
    found = {one: _version(one) for one in EXTRAS[name]}
    missing = [one for one, version in found.items() if version is None]
    if missing:
        return f"missing {', '.join(missing)}: pip install 'moit[{name}]'"
    return ", ".join(f"{one} {version}" for one, version in found.items())


def _gpu() -> str:
    """What draws, or what is missing for that; opens a device and closes it."""
    from moit.checks.exceptions import GpuError

    try:
        from moit.gpu import Device

        device = Device()
    except (ImportError, GpuError) as error:
        return f"{error} (nothing but device='gpu' needs it)"
    found = f"{device.renderer}, OpenGL {device.info['version']}, {device.info['platform']}"
    device.close()
    return found
