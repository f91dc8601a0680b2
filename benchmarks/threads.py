"""What more threads cost: processors' time of two and of 256, over one's.

    python benchmarks/threads.py          # some seconds

Two threads that take no more of processors than one does are twice as fast where two processors
have nothing else to do; what they take more is what is lost. Best of rounds that ask everything.
"""

import time
from collections.abc import Callable

import numpy as np

import moit

PIXELS, MEAN, ROUNDS = 1 << 17, 4, 9
THREADS = (1, 2, 256)
TECHNIQUES = (
    *("sorted", "unsorted", "wboit", "power4", "power6", "trig3", "mlab4", "neural-bounded"),
    *("slices64", "stochastic8"),
)


def questions() -> dict[str, Callable[[int], object]]:
    rng = np.random.default_rng(0)
    counts = rng.geometric(1 / (MEAN + 1), PIXELS) - 1
    offsets = np.concatenate([[0], np.cumsum(counts)])
    n = int(offsets[-1])
    depth, alpha = rng.uniform(1, 100, n), rng.uniform(0, 0.9, n)
    color = rng.random((n, 3), np.float32)
    f = moit.Fragments(offsets, depth.astype(np.float32), alpha.astype(np.float32), color)
    b0, b = moit.moments.gather(f, "power4")
    z = rng.uniform(-1, 1, (PIXELS, 1)).astype(np.float32)

    def composite(name: str) -> Callable[[int], object]:
        return lambda threads: moit.composite(f, name, threads=threads)

    asked = {f"composite {name}": composite(name) for name in TECHNIQUES}
    asked["transmittance power4"] = lambda k: moit.transmittance(f, "power4", threads=k)
    asked["bounds power4"] = lambda k: moit.bounds(f, "power4", threads=k)
    asked["bare power4"] = lambda k: moit.moments.transmittance("power4", b0, b, z, threads=k)
    return asked


def main() -> None:
    asked = questions()
    best = {(name, k): float("inf") for name in asked for k in THREADS}
    for _ in range(ROUNDS):
        for name, k in best:
            start = time.process_time()
            asked[name](k)
            best[name, k] = min(best[name, k], time.process_time() - start)
    for name in asked:
        one, two, many = (best[name, k] for k in THREADS)
        print(f"{name:26} of two threads {two / one:.2f}, of 256 {many / one:.2f}")


if __name__ == "__main__":
    main()
