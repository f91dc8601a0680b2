"""What more threads give and cost: one's time over two's by the clock, and processors' time of two
and of 256 over one's.

    python benchmarks/threads.py          # some seconds

The clock says something where two processors have nothing else to do; what two threads take more of
processors than one is lost on any machine. Best of rounds that ask everything.
"""

import time
from collections.abc import Callable

import numpy as np

import moit
from moit.benching.timing import fragments_of

PIXELS, ROUNDS = 1 << 17, 9
THREADS = (1, 2, 256)
TECHNIQUES = (
    *("sorted", "unsorted", "wboit", "power4", "power6", "trig3", "mlab4", "neural-bounded"),
    *("slices64", "stochastic8"),
)


def questions() -> dict[str, Callable[[int], object]]:
    f = fragments_of("geometric, mean 4", 4 * PIXELS)
    b0, b = moit.moments.gather(f, "power4")
    z = np.random.default_rng(0).uniform(-1, 1, (PIXELS, 1)).astype(np.float32)

    def composite(name: str) -> Callable[[int], object]:
        return lambda threads: moit.composite(f, name, threads=threads)

    asked = {f"composite {name}": composite(name) for name in TECHNIQUES}
    asked["transmittance power4"] = lambda k: moit.transmittance(f, "power4", threads=k)
    asked["bounds power4"] = lambda k: moit.bounds(f, "power4", threads=k)
    asked["bare power4"] = lambda k: moit.moments.transmittance("power4", b0, b, z, threads=k)
    return asked


def main() -> None:
    asked = questions()
    keys = [(name, k) for name in asked for k in THREADS]
    clock, processors = dict.fromkeys(keys, float("inf")), dict.fromkeys(keys, float("inf"))
    for _ in range(ROUNDS):
        for name, k in keys:
            begun, start = time.perf_counter(), time.process_time()
            asked[name](k)
            processors[name, k] = min(processors[name, k], time.process_time() - start)
            clock[name, k] = min(clock[name, k], time.perf_counter() - begun)
    for name in asked:
        faster = clock[name, 1] / clock[name, 2]
        two, many = (processors[name, k] / processors[name, 1] for k in THREADS[1:])
        print(f"{name:26} {faster:.2f} times as fast; of processors {two:.2f}, of 256 {many:.2f}")


if __name__ == "__main__":
    main()
