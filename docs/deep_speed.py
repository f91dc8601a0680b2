"""Seconds in which ten million samples are written to a deep OpenEXR file and read back.

    python docs/deep_speed.py [FOLDER]

Of some rounds the least, on two threads: of the clock and of processors. Beside them is what zlib
takes, on one processor, for the same numbers line by line at the level that OpenEXR has by default:
less than that no writer of ZIPS takes.
"""

import os
import sys
import tempfile
import time
import zlib
from collections.abc import Callable

# Before moit, which looks at it.
os.environ["MOIT_THREADS"] = "2"

import numpy as np

import moit

SIDE, EACH = 1000, 10
ROUNDS = 4
LEVEL = 4


def image() -> moit.Fragments:
    """Thin samples at any depth, colours that change slowly: 1000 x 1000 pixels, 10 each."""
    random = np.random.default_rng(20)
    n = SIDE * SIDE * EACH
    depth = 1 + 9 * random.random(n, dtype=np.float32)
    alpha = 0.15 * random.random(n, dtype=np.float32)
    color = np.stack([0.5 + 0.4 * np.sin(depth + channel) for channel in range(3)], axis=1)
    offsets = np.arange(SIDE * SIDE + 1) * EACH
    return moit.Fragments(offsets, depth, alpha, color, shape=(SIDE, SIDE))


def compressed(f: moit.Fragments) -> int:
    """Bytes of each line's numbers, by byte planes of differences, as ZIPS has them."""
    size, line = 0, SIDE * EACH
    assert f.color is not None
    rows = np.column_stack([f.alpha, f.color * f.alpha[:, None], f.depth]).astype(np.float32)
    for first in range(0, len(f), line):
        numbers = rows[first : first + line].T.tobytes()
        halves = numbers[::2] + numbers[1::2]
        planes = np.frombuffer(halves, np.uint8)
        differences = np.diff(planes, prepend=planes[:1]).astype(np.uint8)
        size += len(zlib.compress(differences.tobytes(), LEVEL))
    return size


def least(call: Callable[[], object]) -> tuple[float, float]:
    """Of the clock, and of processors."""
    found = []
    for _ in range(ROUNDS):
        clock, processors = time.perf_counter(), time.process_time()
        call()
        found.append((time.perf_counter() - clock, time.process_time() - processors))
    return min(clock for clock, _ in found), min(processors for _, processors in found)


def main() -> None:
    f = image()
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if sys.argv[1:] else None) as folder:
        path = os.path.join(folder, "ten_million.exr")
        print("| what | seconds | of processors |\n|---|---|---|")
        for name, call in (
            ("zlib of the same lines", lambda: compressed(f)),
            ("write_deep", lambda: moit.write_deep(path, f)),
            ("read_deep", lambda: moit.read_deep(path)),
        ):
            clock, processors = least(call)
            print(f"| {name} | {clock:.2f} | {processors:.2f} |", flush=True)


if __name__ == "__main__":
    main()
