"""What the core's elementary functions take, and those who ask them most.

    python benchmarks/elementary.py                      # ns a call, beside the C library's
    python benchmarks/elementary.py --users 0147a996     # deep files, volumes, at an older commit

0147a996 is the last commit whose deep files, Gaussians and grids asked the C library. Functions are
timed on 1,024 numbers again and again, each independent of the last (`apart`) or waiting for it
(`in turn`); users in processor time, in rounds over both trees, of which the best counts.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import since

ROOT = Path(__file__).resolve().parents[1]
ASKED = (
    *(("exp", -5, 0), ("exp2", -3, 3), ("expm1", -5, 0), ("expm1", -0.05, 0)),
    *(("log", 0.01, 1), ("log", 1, 1e3), ("log1p", -0.99, 0), ("erf", -3, 3), ("erfc", 0, 6)),
    *(("sin", -6, 6), ("cos", -6, 6), ("tan", 0, 1)),
)
TEXT = """
#include "core/elementary.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <time.h>
enum { COUNT = 1024, TURNS = 50, ROUNDS = 9 };
typedef double function(double);
static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static double ns_of(function *f, const double *x, double waits) {
    double best = HUGE_VAL;
    for (int round = 0; round < ROUNDS; ++round) {
        double sum = 0.0, last = 0.0, start = now();
        for (int turn = 0; turn < TURNS; ++turn)
            for (int i = 0; i < COUNT; ++i) sum += last = f(x[i] + (waits ? waits * last : 0.0));
        volatile double used = sum;
        (void)used;
        best = fmin(best, now() - start);
    }
    return 1e9 * best / (TURNS * COUNT);
}
static void row(const char *name, function *ours, function *theirs, double low, double high) {
    static uint64_t state = 1;
    double x[COUNT];
    for (int i = 0; i < COUNT; ++i) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        x[i] = low + (high - low) * (double)(state >> 11) * 0x1p-53;
    }
    printf("| %s, %g to %g |", name, low, high);
    for (int waits = 0; waits < 2; ++waits)
        printf(" %.1f | %.1f |", ns_of(ours, x, 1e-300 * waits), ns_of(theirs, x, 1e-300 * waits));
    printf("\\n");
}
int main(void) {
    printf("| function | ns apart | C library | ns in turn | C library |\\n");
    printf("|---|---|---|---|---|\\n");
"""


def functions() -> None:
    """Compiles and runs it, with the core's own flags."""
    rows = [f'    row("{f}", moit_{f}, {f}, {low}, {high});\n' for f, low, high in ASKED]
    core = ROOT / "csrc" / "core"
    files = [core / "elementary.c", core / "circle.c"]
    with tempfile.TemporaryDirectory() as folder:
        text, program = Path(folder, "asked.c"), Path(folder, "asked")
        text.write_text("".join([TEXT, *rows, "    return 0;\n}\n"]))
        flags = ["-std=gnu11", "-O3", "-ffp-contract=off", "-I", ROOT / "csrc"]
        subprocess.run(["gcc", *flags, "-o", program, text, *files, "-lm"], check=True)
        subprocess.run([program], check=True)


# ---- In each tree's own process ------------------------------------------------------------------


def _rays(pixels: int, mean: int, **arrays: str) -> Any:
    import numpy as np

    import moit

    rng = np.random.default_rng(1)
    count = pixels * mean
    depth = rng.uniform(1, 50, count)
    thick = {}
    if "back" in arrays:
        thick["back"] = depth + rng.uniform(0, 10, count)
    if "deviation" in arrays:
        thick["deviation"] = rng.uniform(0.5, 5, count)
    return moit.Fragments.from_pixels(
        np.repeat(np.arange(pixels), mean),
        depth,
        rng.uniform(0, 0.9, count),
        rng.random((count, 3)),
        shape=(pixels // 64, 64),
        **thick,
    )


def users(folder: Path) -> dict[str, Callable[[], Any]]:
    import numpy as np

    import moit

    volumes, others = (folder / f"{name}.exr" for name in "ab")
    moit.write_deep(volumes, _rays(4096, 8, back=""))
    moit.write_deep(others, _rays(4096, 6, back=""))
    gaussians = _rays(4096, 8, deviation="")
    place = np.linspace(-1, 1, 24)
    x, y, z = np.meshgrid(place, place, place, indexing="ij")
    values = np.exp(-2 * (x * x + y * y + z * z)) * (2 + np.sin(9 * x) * np.sin(7 * y))
    smoke = moit.Volume(values, np.full(3, 2 / 23), origin=(-1, -1, -1))
    camera = moit.Camera(eye=(0.3, 0.4, 3))
    out = folder / "out.exr"
    return {
        "holdout": lambda: moit.deep.holdout(volumes, others, out, compression="none"),
        "simplify": lambda: moit.deep.simplify(volumes, out, 0.01, compression="none"),
        "flatten": lambda: moit.composite(moit.read_deep(volumes), "sorted"),
        "Gaussians, sorted": lambda: moit.composite(gaussians, "sorted"),
        "Gaussians, power4": lambda: moit.composite(gaussians, "power4"),
        "Gaussians, slices": lambda: moit.composite(gaussians, "slices"),
        "grids": lambda: moit.rasterize(smoke, camera, (96, 72)),
    }


def serve() -> None:
    """Answers names, a line each: processor seconds; without one, which there are."""
    with tempfile.TemporaryDirectory() as folder:
        calls = users(Path(folder))
        print(*calls, sep="|", flush=True)
        for line in sys.stdin:
            start = time.process_time()
            calls[line.strip()]()
            print(time.process_time() - start, flush=True)


def compare(commit: str, rounds: int) -> None:
    trees = []
    for root in (ROOT, since.built(commit)):
        environment = since.environment(root) | {"MOIT_THREADS": "1"}
        command = [sys.executable, __file__, "--serve"]
        pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        trees.append(subprocess.Popen(command, cwd=root, env=environment, **pipes))
    names, _ = (tree.stdout.readline().strip().split("|") for tree in trees)
    print(f"| user | ms | at {commit} | ratio |\n|---|---|---|---|")
    for name in names:
        best = [float("inf")] * 2
        for _ in range(rounds):
            for k, tree in enumerate(trees):
                tree.stdin.write(f"{name}\n")
                tree.stdin.flush()
                best[k] = min(best[k], float(tree.stdout.readline()))
        new, old = best
        print(f"| {name} | {1e3 * new:.0f} | {1e3 * old:.0f} | {new / old:.2f} |", flush=True)
    for tree in trees:
        tree.stdin.close()
        tree.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--users", metavar="COMMIT")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.serve:
        serve()
    elif args.users:
        compare(args.users, args.rounds)
    else:
        functions()


if __name__ == "__main__":
    main()
