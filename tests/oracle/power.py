"""Power moments at 80 digits: algorithm 1 and the canonical representation behind it.

Muenstermann, Krumpen, Klein, Peters, "Moment-Based Order-Independent Transparency", 2018,
section 4 and algorithm 1. Absorbance is a share of b0 throughout, as in the paper: moments are
divided by b0 first and the result is multiplied by it last.

Two roads lead to the same number, so that one can be held to the other: `algorithm1` solves the
Vandermonde system as the paper prints it; `Ray` has the nodes and weights of the only measure
with at most m/2 + 1 atoms, one of them at z, that has these moments.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from mpmath import mp, mpf

DIGITS = 80

# A pivot of the Hankel matrix below this share of b0 counts as zero: moments that were summed
# at 80 digits leave 1e-78 where there are no more atoms.
NO_MORE_ATOMS = mpf(10) ** -60

# The published bias for moments stored in float32: share, and the safe distribution's moments.
# The published code holds the latter in float32, and so they are here: with unrounded ones T of
# eight moments moves by up to 3e-7.
PUBLISHED_BIAS = {4: 5e-7, 6: 5e-6, 8: 5e-5}
BIAS_VECTOR = {
    4: (0.0, 0.375, 0.0, 0.375),
    6: tuple(map(float, np.float32([0, 0.48, 0, 0.451, 0, 0.45]))),
    8: tuple(
        map(float, np.float32([0, 0.75, 0, 0.67666666666666664, 0, 0.63, 0, 0.60030303030303034]))
    ),
}


def biased(b: Sequence, bias, vector: Sequence | None = None) -> "Ray":
    """The moments b1..bm mixed with a safe distribution's; bias 0 leaves them as they are."""
    with mp.workdps(DIGITS):
        bias = mpf(bias)
        safe = map(mpf, BIAS_VECTOR[len(b)] if vector is None else vector)
        mixed = [(1 - bias) * mpf(one) + bias * other for one, other in zip(b, safe, strict=True)]
        return Ray([mpf(1), *mixed])


class Representation(NamedTuple):
    """Atoms of the canonical representation at z; z itself comes first, sometimes weight 0."""

    nodes: list[mpf]
    weights: list[mpf]

    @property
    def lower(self) -> mpf:
        """Share of absorbance that every measure with these moments has in front of z."""
        z = self.nodes[0]
        pairs = zip(self.nodes[1:], self.weights[1:], strict=True)
        return mp.fsum(weight for node, weight in pairs if node < z)

    @property
    def weight(self) -> mpf:
        """The most that any measure with these moments has at z itself."""
        return self.weights[0]


@dataclass(frozen=True)
class Ray:
    """Normalised, already biased moments 1, b1, ..., bm of one ray."""

    b: Sequence[mpf]

    @property
    def half(self) -> int:
        return (len(self.b) - 1) // 2

    @cached_property
    def factors(self) -> tuple[list[list[mpf]], list[mpf]]:
        """Unit lower triangle and pivots of the Hankel matrix, as far as pivots are above 0.

        Raises ValueError where a pivot is below 0: no measure has these moments.
        """
        lower: list[list[mpf]] = []
        pivots: list[mpf] = []
        for i in range(self.half + 1):
            row: list[mpf] = []
            for j in range(i):
                known = mp.fsum(row[k] * lower[j][k] * pivots[k] for k in range(j))
                row.append((self.b[i + j] - known) / pivots[j])
            pivot = self.b[2 * i] - mp.fsum(row[k] ** 2 * pivots[k] for k in range(i))
            if abs(pivot) < NO_MORE_ATOMS:
                break
            if pivot < 0:
                raise ValueError(f"no measure has these moments: pivot {i} is {mp.nstr(pivot, 5)}")
            lower.append([*row, mpf(1)])
            pivots.append(pivot)
        return lower, pivots

    @property
    def is_determined(self) -> bool:
        """Whether only one measure has these moments: it has at most m/2 atoms."""
        return len(self.factors[1]) <= self.half

    def orthogonal(self, z: mpf) -> list[mpf]:
        """The orthogonal polynomials of the moments at z: L^-1 (1, z, z^2, ...)."""
        lower, _ = self.factors
        y: list[mpf] = []
        for i, row in enumerate(lower):
            y.append(z**i - mp.fsum(row[k] * y[k] for k in range(i)))
        return y

    def christoffel(self, z: mpf) -> mpf:
        """The most mass at z: 1 / sum of p_k(z)^2 / d_k over the orthogonal polynomials."""
        _, pivots = self.factors
        return 1 / mp.fsum(p * p / d for p, d in zip(self.orthogonal(z), pivots, strict=True))

    def kernel_polynomial(self, z: mpf) -> list[mpf]:
        """Coefficients q, lowest first, with H q = (1, z, z^2, ...)."""
        lower, pivots = self.factors
        scaled = [p / d for p, d in zip(self.orthogonal(z), pivots, strict=True)]
        return _solve_transposed(lower, scaled)

    @cached_property
    def atoms(self) -> list[mpf]:
        """Depths of the only measure there is, where the moments determine it."""
        rank = len(self.factors[1])
        rows = [[self.b[i + j] for j in range(rank)] for i in range(rank)]
        right = [-self.b[i + rank] for i in range(rank)]
        solution = mp.lu_solve(mp.matrix(rows), mp.matrix(right))
        return _real_roots([*solution, mpf(1)])

    def at(self, z) -> Representation:
        """The canonical representation at z: z and the roots of q, with their weights."""
        with mp.workdps(DIGITS):
            z = mpf(z)
            if self.is_determined:
                # The polynomial of algorithm 1 does not exist; the measure itself does.
                others = [x for x in self.atoms if abs(x - z) > mpf(10) ** -25]
                here = self.christoffel(z) if len(others) < len(self.atoms) else mpf(0)
                return Representation([z, *others], [here, *map(self.christoffel, others)])
            nodes = [z, *_real_roots(self.kernel_polynomial(z))]
            return Representation(nodes, [self.christoffel(x) for x in nodes])


def algorithm1(ray: Ray, z, overestimation) -> mpf:
    """Algorithm 1 as printed: the share of absorbance in front of z."""
    with mp.workdps(DIGITS):
        z = mpf(z)
        hankel = [[ray.b[i + j] for j in range(ray.half + 1)] for i in range(ray.half + 1)]
        right = [z**i for i in range(ray.half + 1)]
        q = mp.lu_solve(mp.matrix(hankel), mp.matrix(right))
        nodes = [z, *_real_roots(list(q))]
        v = [mpf(overestimation)] + [mpf(x < z) for x in nodes[1:]]
        u = _interpolating_polynomial(nodes, v)
        return mp.fsum(b * one for b, one in zip(ray.b, u, strict=False))


def transmittance(ray: Ray, b0, z, overestimation) -> mpf:
    """exp(-b0 (L + beta w)): what light reaches z."""
    with mp.workdps(DIGITS):
        found = ray.at(z)
        return mp.exp(-mpf(b0) * (found.lower + mpf(overestimation) * found.weight))


def transmittance_but_self(ray: Ray, b0, z, own, overestimation) -> mpf:
    """The same for a fragment at z that knows its own absorbance and does not count it.

    Every measure with these moments that holds `own` at z has between b0 L and b0 (L + w) - own
    in front of it, and never more than b0 - own.
    """
    with mp.workdps(DIGITS):
        b0, own = mpf(b0), mpf(own)
        found = ray.at(z)
        room = max(b0 * found.weight - own, mpf(0))
        absorbance = b0 * found.lower + mpf(overestimation) * room
        return mp.exp(-min(absorbance, max(b0 - own, mpf(0))))


def _solve_transposed(lower: list[list[mpf]], right: list[mpf]) -> list[mpf]:
    """x with L^T x = right, for a unit lower triangle."""
    x = list(right)
    for i in reversed(range(len(x))):
        x[i] -= mp.fsum(lower[k][i] * x[k] for k in range(i + 1, len(x)))
    return x


def _interpolating_polynomial(nodes: list[mpf], values: list[mpf]) -> list[mpf]:
    """Coefficients, lowest first, through the points, by divided differences.

    Fewer nodes than values of u mean that the rest of u is zero: a node at infinity weighs 0.
    """
    count = len(nodes)
    difference = list(values)
    for order in range(1, count):
        for i in reversed(range(order, count)):
            difference[i] = (difference[i] - difference[i - 1]) / (nodes[i] - nodes[i - order])
    u = [difference[-1]]
    for i in reversed(range(count - 1)):
        u = [mpf(0), *u]
        for k in range(len(u) - 1):
            u[k] -= nodes[i] * u[k + 1]
        u[0] += difference[i]
    return u


def _real_roots(coefficients: list[mpf]) -> list[mpf]:
    """Roots of a polynomial (lowest coefficient first) that has only real, simple ones.

    The derivative's roots lie between them, so each is alone in an interval where the sign
    changes. A leading coefficient that is nothing but rounding is a root at infinity: left out.
    """
    size = max(map(abs, coefficients))
    coefficients = list(coefficients)
    while len(coefficients) > 1 and abs(coefficients[-1]) < size * mpf(10) ** (10 - DIGITS):
        coefficients.pop()
    degree = len(coefficients) - 1
    if degree < 1:
        return []
    if degree == 1:
        return [-coefficients[0] / coefficients[1]]
    between = _real_roots([k * c for k, c in enumerate(coefficients)][1:])
    reach = 1 + max(abs(c / coefficients[-1]) for c in coefficients[:-1])  # Cauchy's bound
    ends = [-reach, *between, reach]
    return [_root_between(coefficients, left, right) for left, right in pairwise(ends)]


def _value_and_slope(coefficients: list[mpf], x: mpf) -> tuple[mpf, mpf]:
    value, slope = mpf(0), mpf(0)
    for c in reversed(coefficients):
        slope = slope * x + value
        value = value * x + c
    return value, slope


def _root_between(coefficients: list[mpf], left: mpf, right: mpf) -> mpf:
    """The one root in [left, right]: Newton's method, halving wherever it would leave."""
    rising = _value_and_slope(coefficients, right)[0] > _value_and_slope(coefficients, left)[0]
    x = (left + right) / 2
    close = mpf(10) ** (5 - DIGITS)
    for _ in range(2000):
        value, slope = _value_and_slope(coefficients, x)
        if value == 0:
            return x
        if (value > 0) == rising:
            right = x
        else:
            left = x
        before = x
        x = x - value / slope if slope else left
        if not left < x < right:
            x = (left + right) / 2
        if abs(x - before) <= close * max(abs(x), close):
            return x
    raise ArithmeticError("a root was not found; the polynomial has others than real, simple ones")
