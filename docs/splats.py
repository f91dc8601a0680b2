"""Writes splats.md: what pictures of Gaussian splats cost, technique by technique.

    python docs/splats.py [--count 1000000] [--width 1280] [--threads 2] [--rounds 9]

Seconds are those of processors, of all threads together: what else runs changes them little, and
still more than techniques differ; so techniques take turns, and the least of all rounds counts.
Memory is the greatest that the process held while the picture was made, less what it held before:
Linux tells it.
"""

import argparse
import math
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moit
from moit.system.files import write_text

HERE = Path(__file__).parent
SCENE = "pot-splats"
TECHNIQUES = ("sorted", "power4", "wboit", "mlab4", "hybrid4", "adaptive8(merge='energy')")
MEBIBYTE = 1 << 20


def held(name: str) -> int:
    """Bytes, by the system's account: VmRSS now, VmHWM at most."""
    status = Path("/proc/self/status").read_text()
    return 1024 * int(re.search(rf"{name}:\s+(\d+)", status)[1])


def cost(make: Callable[[], Any]) -> tuple[Any, float, float]:
    """What it makes, processor seconds, and MiB."""
    Path("/proc/self/clear_refs").write_text("5")  # forgets the most
    before, start = held("VmRSS"), time.process_time()
    made = make()
    return made, time.process_time() - start, (held("VmHWM") - before) / MEBIBYTE


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=9)
    given = parser.parse_args()
    size = (given.width, given.width * 9 // 16)
    scene = moit.scenes.splats(SCENE, given.count)
    how: dict[str, Any] = {"camera": scene.camera, "threads": given.threads, "progress": False}
    least = {technique: (math.inf, math.inf) for technique in TECHNIQUES}
    most = dict.fromkeys(TECHNIQUES, 0.0)
    for _ in range(given.rounds):
        for technique in TECHNIQUES:
            made, seconds, memory = cost(
                lambda t=technique: moit.render(scene.splats, t, size, report=True, **how)
            )
            own = made.timings["composite"]
            least[technique] = (min(least[technique][0], seconds), min(least[technique][1], own))
            most[technique] = max(most[technique], memory)
    rows = [
        f"| `{technique}` | {least[technique][0]:.2f} | {least[technique][1]:.3f} "
        f"| {most[technique]:.0f} |"
        for technique in TECHNIQUES
    ]
    f, alone, memory = cost(lambda: moit.rasterize(scene.splats, size=size, **how))
    _, _, more = cost(lambda: moit.composite(f, "sorted", threads=given.threads))
    lines = [
        "# Gaussian splats",
        "",
        f"Made by `python docs/splats.py`: {given.count:,} splats, "
        f"`moit.scenes.splats({SCENE!r}, {given.count:_})`, seen as the reference rasteriser has "
        f"it, at {size[0]} x {size[1]}: {len(f):,} fragments, on {given.threads} threads. Seconds "
        "are those of processors, of all threads together, the least of "
        f"{given.rounds} rounds in which techniques take turns; those of compositing are what "
        "passes meanwhile. They hang on the machine.",
        "",
        "`moit.render` draws and composites a band of rows at a time, for techniques whose pixels "
        "do not hang on one another. `moit.rasterize` makes all fragments at once: "
        f"{alone:.2f} seconds and {memory:.0f} MiB; compositing them by `sorted` takes another "
        f"{more:.0f} MiB.",
        "",
        "| technique | seconds | compositing | MiB |",
        "|---|---|---|---|",
        *rows,
    ]
    write_text(HERE / "splats.md", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
