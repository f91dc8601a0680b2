"""What `moit.info` says: versions, instruction sets, threads, and which extras are there."""

from __future__ import annotations

import platform
from typing import Any

from moit.checks.exceptions import GpuError
from moit.system.environment import core_facts, processor, thread_count
from moit.system.version import VERSION

# Each extra of pyproject.toml that adds something for users, and what it installs.
EXTRAS = {
    "plot": ("matplotlib",),
    "mesh": ("trimesh", "pillow", "mapbox_earcut"),
    "notebook": ("matplotlib", "ipykernel"),
    "dask": ("distributed",),
    "tables": ("pandas", "xarray"),
    "gpu": ("moderngl",),
    "torch": ("torch",),
    "jax": ("jax",),
}


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

    >>> "moit" in str(moit.info())
    True
    """
    return Info(
        {
            "moit": VERSION,
            "python": f"{platform.python_implementation()} {platform.python_version()}",
            "platform": platform.platform(),
            "processor": processor(),
            "threads": thread_count(None),
            **core_facts(),
            "numpy": _version("numpy") or "missing",
            "OpenImageIO": _version("OpenImageIO") or "missing: pip install OpenImageIO",
            "OpenEXR": _version("OpenEXR") or "missing: pip install OpenEXR",
            "GPU": _gpu(),
            "tqdm": _version("tqdm") or "missing: pip install tqdm",
            "extra": {name: _extra(name) for name in EXTRAS},
        }
    )


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
    try:
        from moit.gpu import Device

        device = Device()
    except (ImportError, GpuError) as error:
        return f"{error} (nothing but device='gpu' needs it)"
    found = f"{device.renderer}, OpenGL {device.info['version']}, {device.info['platform']}"
    device.close()
    return found
