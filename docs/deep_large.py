"""Memory and seconds of verbs of moit.deep on an image of a hundred million samples.

    python docs/deep_large.py [FOLDER]

Writes some 3 GB into the folder (the system's for temporary files if none is named), prints a row
for each verb, and removes what it wrote.
"""

import os
import subprocess
import sys
import tempfile

import numpy as np

import moit

SIZE = (2048, 1556)
MEAN = 16  # samples a pixel
CLUMPS = 4  # depths round which the samples of an image lie


def write(path: str, seed: int) -> None:
    """Thin samples round some depths, of slowly changing colours, as smoke has them."""
    random = np.random.default_rng(seed)
    width, height = SIZE
    counts = random.integers(MEAN - 6, MEAN + 7, width * height)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    n = int(offsets[-1])
    depth = random.integers(1, CLUMPS + 1, n, dtype=np.int8).astype(np.float32)
    depth = 3 * depth + seed + random.random(n, dtype=np.float32)
    alpha = 0.15 * random.random(n, dtype=np.float32)
    pixel = np.repeat(np.arange(width * height, dtype=np.int32), counts)
    color = np.empty((n, 3), np.float32)
    for channel in range(3):
        color[:, channel] = 0.5 + 0.4 * np.sin(depth + channel + pixel % width / 300)
    moit.write_deep(path, moit.Fragments(offsets, depth, alpha, color, shape=(height, width)))


def measured(call: str, *arguments: str) -> tuple[float, float]:
    """MiB at most and seconds of processors of another Python that calls a function here."""
    code = f"import sys, moit; {call}"
    child = subprocess.Popen([sys.executable, "-c", code, *arguments])
    _, status, used = os.wait4(child.pid, 0)
    if status:
        raise SystemExit(f"failed: {call}")
    return used.ru_maxrss / 1024, used.ru_utime + used.ru_stime


def main() -> None:
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if sys.argv[1:] else None) as folder:
        a, b, both, out = (
            os.path.join(folder, f"{name}.exr") for name in ("a", "b", "both", "out")
        )
        here = os.path.dirname(os.path.abspath(__file__))
        for seed, path in enumerate((a, b)):
            make = f"sys.path.insert(0, {here!r}); import deep_large; deep_large.write"
            measured(f"{make}(sys.argv[1], {seed})", path)
        print("| verb | peak, MiB | seconds |\n|---|---|---|")
        for name, call, files in (
            ("merge of both", "moit.deep.merge(sys.argv[1:3], sys.argv[3])", (a, b, both)),
            ("holdout of the merge by one", "moit.deep.holdout(*sys.argv[1:])", (both, a, out)),
            ("simplify of the merge", "print(moit.deep.simplify(*sys.argv[1:]))", (both, out)),
        ):
            peak, seconds = measured(call, *files)
            print(f"| {name} | {peak:.0f} | {seconds:.0f} |", flush=True)
            print(f"  {os.path.getsize(files[-1]) / 1e6:.0f} MB written", file=sys.stderr)


if __name__ == "__main__":
    main()
