"""python -m tests.oracle: errors of moit's moments against the oracle, by kind of ray.

    python -m tests.oracle [RAYS_OF_EACH_KIND [DEPTHS [SEED]]]

Prints |T - truth| at overestimation .25 for float32 and float64 arithmetic on the same float32
moments: 50, 99 and 99.9 % and the largest.
"""

import sys

import numpy as np

import moit

from . import power, trigonometric
from .problems import Problems, power_problems, trigonometric_problems

COLUMNS = ("50 %", "99 %", "99.9 %", "max")


def table(
    technique: moit.PowerMoments | moit.TrigonometricMoments, problems: Problems
) -> list[str]:
    errors = {}
    for dtype in ("float32", "float64"):
        wide = np.result_type(dtype, 1j) if np.iscomplexobj(problems.b) else dtype
        given = problems.b0.astype(dtype), problems.b.astype(wide), problems.z.astype(dtype)
        errors[dtype] = problems.error(moit.moments.transmittance(technique, *given), 0.25)
    refused = f"{problems.refused} rays without a measure"
    head = f"{technique.base_name}, {problems.z.size} evaluations, {refused}"
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
        found = power_problems(m, seed, of_each_kind, depths)
        lines = table(moit.PowerMoments(m, bias=power.PUBLISHED_BIAS[m]), found)
        print("\n".join(lines), end="\n\n", flush=True)
    for m in (2, 3, 4):
        found = trigonometric_problems(m, seed, of_each_kind, depths)
        lines = table(moit.TrigonometricMoments(m, bias=trigonometric.PUBLISHED_BIAS[m]), found)
        print("\n".join(lines), end="\n\n", flush=True)
