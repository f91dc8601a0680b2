"""Prints how fast moit is: `python benchmarks/speed.py [--pixels P] [--repeat R] [-t NAME]...`.

The time of `import moit`; million fragments a second of whole composites in float32, the best and
the median of repeated calls, for every technique at 16 fragments a pixel, by number of threads, and
for counts that vary; million samples a second of deep OpenEXR files. Prints, never judges: these
are one machine's figures, and ratios within one run are what they are good for.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import moit
from moit.environment import processors


def fragments(pixels: int, counts: np.ndarray) -> moit.Fragments:
    rng = np.random.default_rng(0)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    n = int(offsets[-1])
    depth = rng.uniform(1, 100, n).astype(np.float32)
    alpha = rng.uniform(0, 0.9, n).astype(np.float32)
    return moit.Fragments(offsets, depth, alpha, rng.random((n, 3), dtype=np.float32))


Rate = tuple[float, float]


def rate_of(call: Callable[[], object], count: int, repeat: int) -> Rate:
    """Millions of `count` a second: of the best call and of the median one."""
    seconds = []
    for _ in range(repeat):
        start = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - start)
    return count / min(seconds) / 1e6, count / statistics.median(seconds) / 1e6


def shown(rates: list[Rate]) -> str:
    return "".join(f"{best:9.1f} {median:8.1f}" for best, median in rates)


def rates(f: moit.Fragments, technique: moit.Technique, threads: int, repeat: int) -> Rate:
    return rate_of(lambda: moit.composite(f, technique, threads=threads), len(f), repeat)


def print_deep(shape: tuple[int, int], repeat: int) -> None:
    """A dense image of 20 samples a pixel, as ten million samples are at 1024 x 512."""
    height, width = shape
    f = fragments(height * width, np.full(height * width, 20))
    f = moit.Fragments(f.offsets, f.depth, f.alpha, f.color, shape=shape)
    print(f"\ndeep OpenEXR, {width} x {height} x 20 = {len(f):,} samples: million samples a second")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "dense.exr"
        for name, call in (
            ("write_deep", lambda: moit.write_deep(path, f)),
            ("read_deep", lambda: moit.read_deep(path)),
        ):
            print(f"{name:28}{shown([rate_of(call, len(f), repeat)])}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pixels", type=int, default=1 << 20)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("-t", dest="techniques", action="append", metavar="NAME")
    chosen = parser.parse_args()
    info = moit.info()
    print(f"{info['processor']}, {info['instruction set in use']}, {processors()} processors")

    command = "import time; t = time.perf_counter(); import moit; print(time.perf_counter() - t)"
    runs = [subprocess.check_output([sys.executable, "-c", command]) for _ in range(chosen.repeat)]
    print(f"import moit: {min(map(float, runs)):.3f} s")

    pixels = chosen.pixels
    rng = np.random.default_rng(1)
    even = fragments(pixels, np.full(pixels, 16))
    threads = sorted({1, processors()})
    print(f"\n{pixels:,} pixels x 16 fragments: million fragments a second, best and median")
    print(f"{'':28}" + "".join(f"{f'threads {n}':>18}" for n in threads))
    every = {}
    for technique in map(moit.technique, chosen.techniques or moit.techniques()):
        cells = [rates(even, technique, n, chosen.repeat) for n in threads]
        every[str(technique)] = cells[-1][0]
        print(f"{technique!s:28}{shown(cells)}", flush=True)
    slowest = min(every, key=every.__getitem__)
    print(f"slowest: {slowest}, {every[slowest]:.1f}")
    if chosen.techniques:
        return
    del even

    print(f"\npower4 and sorted, {threads[-1]} threads, by counts of fragments")
    layouts = {
        "1 a pixel": np.ones(pixels, np.int64),
        "4 a pixel": np.full(pixels, 4),
        "geometric, mean 4": rng.geometric(1 / 5, pixels) - 1,
        "geometric, mean 16": rng.geometric(1 / 17, pixels) - 1,
        "64 a pixel": np.full(pixels // 4, 64),
    }
    for name, counts in layouts.items():
        f = fragments(len(counts), counts)
        cells = [
            rates(f, moit.technique(t), threads[-1], chosen.repeat) for t in ("power4", "sorted")
        ]
        print(f"{name:28}{shown(cells)}")

    print_deep((max(pixels // 2048, 1), 1024), repeat=min(chosen.repeat, 3))


if __name__ == "__main__":
    main()
