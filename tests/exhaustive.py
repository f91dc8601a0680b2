"""Elementary functions and warps over all float32: python tests/exhaustive.py [NAME ...]

Each is asked at every float32 of its domain and held against the C library's in double, whose own
error is a billionth of what is measured; prints the largest error in units of the last place of
the result (of a warp: of half the range's extent, 2^-24), where it is, and the mean. A minute or
two each; `--every N` looks at each N-th number only. docs/accuracy.md has the table.

The core's functions of doubles, `moit_exp` and so on, are held against long doubles', of which an
x86 has 11 more digits: at each float32 or, as `moit_exp of doubles`, at a double that begins as it
does and goes on at random. Up to ten minutes each.
"""

import argparse
import ctypes
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
# Before what is found by it, so imports stand below a statement.
sys.path[:0] = [str(HERE.parent), str(HERE)]
from readings import c  # noqa: E402

NEAR, FAR = 1.0, 100.0  # what warps are asked about
TEXT = """
#define SCALAR float
#define LANES 8
#include <math.h>
#include "kernels/dialect.h"
#include "kernels/elementary.h"
#include "kernels/warp.h"
#include "core/elementary.h"
#define NEAR 1.0
#define FAR 100.0

static double last_place(double exact) {
    float size = (float)fabs(exact), next;
    uint32_t word;
    memcpy(&word, &size, sizeof word);
    ++word;
    memcpy(&next, &word, sizeof next);
    return (double)next - (double)size;
}

/* told: count, largest error, where, sum of errors; of bit patterns first, first + every .. last */
#define MEASURED(name, value, exact_value, unit) \\
    void name(uint32_t first, uint32_t last, uint32_t every, double *told) { \\
        uint64_t word = first; \\
        while (word <= last) { \\
            float in[LANES], out[LANES]; \\
            int count = 0; \\
            for (; count < LANES && word <= last; word += every) { \\
                uint32_t bits_of_it = (uint32_t)word; \\
                memcpy(&in[count++], &bits_of_it, sizeof(float)); \\
            } \\
            for (int i = count; i < LANES; ++i) in[i] = in[0]; \\
            real x; \\
            memcpy(&x, in, sizeof x); \\
            real y = value; \\
            memcpy(out, &y, sizeof y); \\
            for (int i = 0; i < count; ++i) { \\
                double at = (double)in[i], exact = exact_value; \\
                double error = fabs((double)out[i] - exact) / (unit); \\
                told[0] += 1.0; \\
                told[3] += error; \\
                if (!(error <= told[1])) told[1] = error, told[2] = at; \\
            } \\
        } \\
    }
/* The same of doubles, whose digits that are those of `rest` are a hash of the others. */
#define MEASURED_DOUBLES(name, function, exact_function, rest) \\
    void name(uint32_t first, uint32_t last, uint32_t every, double *told) { \\
        for (uint64_t word = first; word <= last; word += every) { \\
            uint32_t bits_of_it = (uint32_t)word; \\
            float begins; \\
            memcpy(&begins, &bits_of_it, sizeof begins); \\
            double at = (double)begins, unit; \\
            uint64_t digits; \\
            memcpy(&digits, &at, sizeof digits); \\
            digits |= ((word * 0x9e3779b97f4a7c15u) >> 32) & (rest); \\
            memcpy(&at, &digits, sizeof at); \\
            long double exact = exact_function((long double)at); \\
            double size = fabs((double)exact); \\
            memcpy(&digits, &size, sizeof digits); \\
            ++digits; \\
            memcpy(&unit, &digits, sizeof unit); \\
            double error = (double)(fabsl((long double)function(at) - exact) \\
                                    / (long double)(unit - size)); \\
            told[0] += 1.0; \\
            told[3] += error; \\
            if (!(error <= told[1])) told[1] = error, told[2] = at; \\
        } \\
    }
#define OF_DOUBLES(f) \\
    MEASURED_DOUBLES(moit_##f##_error, moit_##f, f##l, 0) \\
    MEASURED_DOUBLES(moit_##f##_of_doubles_error, moit_##f, f##l, 0x1fffffffu)
OF_DOUBLES(exp)
OF_DOUBLES(exp2)
OF_DOUBLES(expm1)
OF_DOUBLES(log)
OF_DOUBLES(log1p)
OF_DOUBLES(erf)
OF_DOUBLES(erfc)
#define SCALE_OF_LOG -2.0 / log(FAR / NEAR)
MEASURED(exponential_error, exponential(x), exp(at), last_place(exact))
MEASURED(logarithm_error, logarithm(x), log(at), last_place(exact))
MEASURED(absorbance_error, absorbance(x), -log1p(-at), last_place(exact))
MEASURED(linear_warp_error, linear_warp(x, K(NEAR), K(-1.0), K(1.0), K(2.0 / (FAR - NEAR))),
         -1.0 + 2.0 * (at - NEAR) / (FAR - NEAR), 0x1p-24)
MEASURED(log_warp_error,
         log_warp(x, K(NEAR), K(1.0 / NEAR), K(-1.0), K(1.0), K(SCALE_OF_LOG)),
         -1.0 + 2.0 * log(at / NEAR) / log(FAR / NEAR), 0x1p-24)
"""


def pattern(x: float) -> int:
    """The bits of a float32."""
    return int(np.float32(x).view(np.uint32))


_LEAST, _GREATEST = pattern(np.finfo(np.float32).tiny), pattern(np.finfo(np.float32).max)
_DEPTHS = ((pattern(NEAR), pattern(FAR)),)


def _both(least: float, most: float) -> tuple[tuple[int, int], ...]:
    """Of normal numbers on both sides of 0."""
    return (_LEAST, pattern(most)), (_LEAST | pattern(-0.0), pattern(least))


_OF_DOUBLES = {
    "moit_exp": _both(-708, 709),
    "moit_exp2": _both(-1022, 1023),
    "moit_expm1": _both(-708, 709),
    "moit_log": ((_LEAST, pattern(1.0) - 1), (pattern(1.0) + 1, _GREATEST)),
    "moit_log1p": ((_LEAST, _GREATEST), (_LEAST | pattern(-0.0), pattern(-1.0) - 1)),
    "moit_erf": _both(-6, 6),
    "moit_erfc": _both(-6, 26.5),
}
# Of bit patterns, with both ends; numbers below the least normal one are 0 to the kernels.
DOMAINS = {
    "exponential": ((pattern(-0.0), pattern(-87.0)), (0, pattern(80.0))),
    "logarithm": ((_LEAST, _GREATEST),),
    "absorbance": ((_LEAST, pattern(1.0) - 1),),
    "linear_warp": _DEPTHS,
    "log_warp": _DEPTHS,
    **_OF_DOUBLES,
    **{f"{name} of doubles": domain for name, domain in _OF_DOUBLES.items()},
}


@cache
def _library() -> ctypes.CDLL:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "errors.so")
        core = c.ROOT / "csrc" / "core" / "elementary.c"
        of_core, flags = Path(folder, "elementary.o"), ["-O2", "-fPIC", "-ffp-contract=off"]
        subprocess.run(
            ["gcc", *flags, f"-I{c.ROOT / 'csrc'}", "-c", core, "-o", of_core], check=True
        )
        shared = ["-x", "none", of_core, "-shared", "-o", path, "-lm"]
        done = c.compile_text(TEXT, "gcc", *flags, *shared)
        if done.returncode:
            raise RuntimeError(done.stderr)
        return ctypes.CDLL(str(path))


def measured(name: str, every: int = 1) -> tuple[int, float, float, float]:
    """(count, largest error, where, mean error) in the function's units."""
    told = np.zeros(4)
    function = getattr(_library(), f"{name.replace(' ', '_')}_error")
    function.restype = None
    for first, last in DOMAINS[name]:
        function(*map(ctypes.c_uint32, (first, last, every)), told.ctypes)
    return int(told[0]), told[1], told[2], told[3] / told[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", nargs="*", help=f"default: all, {', '.join(DOMAINS)}")
    parser.add_argument("--every", type=int, default=1, metavar="N")
    options = parser.parse_args()
    print("| function | float32 tried | largest error | where | mean |\n|---|---|---|---|---|")
    for name in options.name or DOMAINS:
        count, worst, where, mean = measured(name, options.every)
        print(f"| `{name}` | {count:,} | {worst:.3f} | {where:.9g} | {mean:.3f} |", flush=True)


if __name__ == "__main__":
    main()
