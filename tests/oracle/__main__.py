"""python -m tests.oracle: errors of moit's power moments against the oracle, by kind of ray.

    python -m tests.oracle [RAYS_OF_EACH_KIND [DEPTHS [SEED]]]

Prints |T - truth| at overestimation .25 for float32 and float64 arithmetic on the same float32
moments: 50, 99 and 99.9 % and the largest.
"""

import sys

import numpy as np

import moit

from .power import PUBLISHED_BIAS
from .problems import power_problems

COLUMNS = ("50 %", "99 %", "99.9 %", "max")


def table(m: int, of_each_kind: int, depths: int, seed: int) -> list[str]:
    problems = power_problems(m, seed, of_each_kind, depths)
    technique = moit.PowerMoments(m, bias=PUBLISHED_BIAS[m], overestimation=0.25)
    errors = {}
    for dtype in ("float32", "float64"):
        arrays = (a.astype(dtype) for a in (problems.b0, problems.b, problems.z))
        errors[dtype] = problems.error(moit.moments.transmittance(technique, *arrays), 0.25)
    head = f"power{m}, {problems.z.size} evaluations, {problems.refused} rays without a measure"
    lines = [head, " " * 22 + "".join(f"{f'{d} {c}':>16}" for d in errors for c in COLUMNS)]
    kinds = np.array([ray.kind for ray in problems.rays])
    for kind in [*dict.fromkeys(kinds), "all"]:
        rows = kinds == kind if kind != "all" else kinds != ""
        numbers = [np.quantile(e[rows], q) for e in errors.values() for q in (0.5, 0.99, 0.999, 1)]
        lines.append(f"{kind:22}" + "".join(f"{number:16.2e}" for number in numbers))
    return lines


if __name__ == "__main__":
    of_each_kind, depths, seed = [*map(int, sys.argv[1:4]), *(20, 8, 0)[len(sys.argv) - 1 :]]
    for m in (4, 6, 8):
        print("\n".join(table(m, of_each_kind, depths, seed)), end="\n\n", flush=True)
