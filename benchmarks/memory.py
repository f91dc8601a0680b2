"""What calls take of memory beside what they read and give, at their most, in MiB.

    MALLOC_MMAP_THRESHOLD_=65536 python benchmarks/memory.py     # Linux, some minutes
    MALLOC_MMAP_THRESHOLD_=65536 python benchmarks/memory.py power4 avboit

Of an image of 65,536 pixels and of one of eight times as many, of four fragments a pixel: what
grows with the image is marked. The variable makes the C library give memory back at once.
"""

import gc
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import moit
from moit.benching.timing import fragments_of

SIZES = ((256, 256), (512, 1024))
GROWS = 4.0
QUESTIONS: dict[str, Callable[[moit.Fragments, str], Any]] = {
    "composite": lambda f, name: moit.composite(f, name, threads=2),
    "transmittance": lambda f, name: moit.transmittance(f, name, threads=2),
    "total": lambda f, name: moit.total_transmittance(f, name, threads=2),
    "bounds": lambda f, name: moit.bounds(f, name, threads=2),
}


def fragments(shape: tuple[int, int]) -> moit.Fragments:
    f = fragments_of("geometric, mean 4", 4 * shape[0] * shape[1])
    return moit.Fragments(f.offsets, f.depth, f.alpha, f.color, shape=shape)


def held(name: str) -> float:
    found = re.search(rf"{name}:\s+(\d+)", Path("/proc/self/status").read_text())
    assert found
    return int(found[1]) / 1024


def peak(ask: Callable[[moit.Fragments, str], Any], f: moit.Fragments, name: str) -> float:
    gc.collect()
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins again
    before = held("VmRSS")
    given = ask(f, name)
    most = held("VmHWM") - before
    arrays = given if isinstance(given, tuple) else (given,)
    return most - sum(a.nbytes for a in arrays if isinstance(a, np.ndarray)) / 2**20


def main() -> None:
    names = sys.argv[1:] or [str(t) for t in moit.techniques()]
    tiny, *images = (fragments(shape) for shape in ((8, 8), *SIZES))
    for name in names:
        said = []
        for question, ask in QUESTIONS.items():
            ask(tiny, name)
            few, many = (peak(ask, f, name) for f in images)
            said.append(f"{question} {few:.1f} {many:.1f}{' grows' * (many - few > GROWS)}")
        print(f"{name:28} {'; '.join(said)}", flush=True)


if __name__ == "__main__":
    main()
