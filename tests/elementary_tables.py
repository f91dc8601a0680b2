"""Tables of csrc/core/elementary.c, to all digits: python tests/elementary_tables.py [FILE]

Writes csrc/core/elementary_tables.h by mpmath; with a FILE there instead. What each holds stands
beside it there. tests/test_c_core.py compares what is written with what is computed here.
"""

import sys
from collections.abc import Callable
from pathlib import Path

from mpmath import cos, erf, erfc, exp, log, mp, mpf, pi, sqrt

mp.dps = 60
FILE = Path(__file__).resolve().parents[1] / "csrc" / "core" / "elementary_tables.h"
INTERVALS = 128  # of an octave, and of it BELOW lie wholly below 1
BELOW = 80
NEAR_DEGREE, TAIL_DEGREE = 12, 10
TAIL_STEPS = 8  # of an octave, from 1/2 to 28
FIRST_TAIL, TAILS = -TAIL_STEPS, 6 * TAIL_STEPS - 2

HEAD = """\
/* Made by tests/elementary_tables.py: numbers to all their digits, for elementary.c alone. */

enum { INTERVALS = 128, INTERVALS_BELOW = 80 };

"""
OF_LOGARITHMS = """\
/* An octave of x: INTERVALS_BELOW whole intervals below that of 1, of steps of 1/256, those behind
 * of 1/128. `inverse`, a multiple of 2^-11, is 1 / x about the middle of one; high + low is
 * -ln(inverse), and `high` a multiple of 2^-42. */
static const struct {
    double inverse, high, low;
} logarithms[INTERVALS] = {
"""
OF_POWERS = """\
/* 2^(k / 128) is power (1 + rest). */
static const struct {
    double power, rest;
} powers[INTERVALS] = {
"""
OF_LN2 = """\
/* ln 2 / 128, and ln 2, by a part of few digits and what is left of it. */
"""
OF_ERF = """\
/* erf(x) = x + x (near[0] + near[1] x^2 + ..), for |x| <= 1. */
"""
OF_TAIL = """\
/* exp(x^2) erfc(x) = row[1] + row[2] h + .., h = x - row[0]; each octave of x from 1/2 to 28 has 8
 * intervals. */
static const double tails[][12] = {
"""


def rounded(x: mpf, digit: int) -> float:
    """x to a multiple of 2^-digit."""
    return float(mp.nint(x * mpf(2) ** digit) / mpf(2) ** digit)


def logarithms() -> list[tuple[float, ...]]:
    rows = []
    for k in range(INTERVALS):
        steps = mpf(k - BELOW)
        # that of 1 has half a step on either side, and is asked as 1
        middle = 1 + steps / (256 if steps < 0 else 128)
        inverse = rounded(1 / middle, 11)
        exact = -log(mpf(inverse))
        high = rounded(exact, 42)
        rows.append((inverse, high, float(exact - high)))
    return rows


def powers() -> list[tuple[float, ...]]:
    rows = []
    for k in range(INTERVALS):
        exact = mpf(2) ** (mpf(k) / INTERVALS)
        rows.append((float(exact), float(exact / float(exact) - 1)))
    return rows


def constants() -> list[tuple[str, float]]:
    ln2 = log(mpf(2))
    step = ln2 / INTERVALS
    high, step_high = rounded(ln2, 42), rounded(step, 42)
    return [
        ("ln2_high", high),
        ("ln2_low", float(ln2 - high)),
        ("step_high", step_high),
        ("step_low", float(step - step_high)),
        ("steps_of_1", float(1 / step)),
    ]


def polynomial(f: Callable[[mpf], mpf], degree: int) -> list[mpf]:
    """Of t in [-1, 1], by powers of t: through f at the zeros of a polynomial of Chebyshev's."""
    count = 2 * degree + 20
    angles = [pi * (j + mpf(1) / 2) / count for j in range(count)]
    values = [f(cos(angle)) for angle in angles]
    pairs = list(zip(values, angles, strict=True))
    series = [
        (2 if k else 1) / mpf(count) * mp.fsum(value * cos(k * angle) for value, angle in pairs)
        for k in range(degree + 1)
    ]
    one, two = [mpf(1)], [mpf(0), mpf(1)]
    sums = [mpf(0)] * (degree + 1)
    for k in range(degree + 1):
        for power, share in enumerate(one):
            sums[power] += series[k] * share
        following = [mpf(0), *(2 * share for share in two)]
        for power, share in enumerate(one):
            following[power] -= share
        one, two = two, following
    return sums


def near() -> list[float]:
    """erf(x) / x - 1 by powers of x^2, for |x| <= 1."""

    def of_square(t: mpf) -> mpf:
        x = sqrt((t + 1) / 2)
        return (erf(x) / x if x else 2 / sqrt(pi)) - 1

    by_t = polynomial(of_square, NEAR_DEGREE)
    sums = [mpf(0)] * len(by_t)
    for k, share in enumerate(by_t):  # t is 2 x^2 - 1
        for j in range(k + 1):
            sums[j] += share * mp.binomial(k, j) * mpf(2) ** j * (-1) ** (k - j)
    return [float(share) for share in sums]


def tails() -> list[tuple[float, ...]]:
    """exp(x^2) erfc(x) by powers of what x is beyond the middle of each interval."""
    rows = []
    for k in range(FIRST_TAIL, FIRST_TAIL + TAILS):
        size = mpf(2) ** (k // TAIL_STEPS)
        half = size / (2 * TAIL_STEPS)
        middle = size + (2 * (k % TAIL_STEPS) + 1) * half
        by_t = polynomial(lambda t, m=middle, h=half: scaled_tail(m + h * t), TAIL_DEGREE)
        rows.append((float(middle), *(float(share / half**j) for j, share in enumerate(by_t))))
    return rows


def scaled_tail(x: mpf) -> mpf:
    return exp(x * x) * erfc(x)


def tables() -> list[float]:
    """All numbers in the order in which they are written."""
    first = [number for row in [*logarithms(), *powers()] for number in row]
    last = [number for row in tails() for number in row]
    return [*first, *(value for _, value in constants()), *near(), *last]


def text() -> str:
    def listed(numbers: list[float]) -> str:
        return "{" + ", ".join(number.hex() for number in numbers) + "};\n"

    def row(numbers: tuple[float, ...]) -> str:
        return "    {" + ", ".join(number.hex() for number in numbers) + "},\n"

    parts = [HEAD, OF_LOGARITHMS, *map(row, logarithms()), "};\n\n"]
    parts += [OF_POWERS, *map(row, powers()), "};\n\n", OF_LN2]
    parts += [f"static const double {name} = {value.hex()};\n" for name, value in constants()]
    parts += ["\n", OF_ERF, "static const double near[] = ", listed(near()), "\n"]
    parts += [OF_TAIL, *map(row, tails()), "};\n"]
    return "".join(parts)


if __name__ == "__main__":
    Path(sys.argv[1] if len(sys.argv) > 1 else FILE).write_text(text(), encoding="utf-8")
