"""Trigonometric moments at 50 digits: algorithm 2 and the canonical representation behind it.

Muenstermann, Krumpen, Klein, Peters, "Moment-Based Order-Independent Transparency", 2018, section
5, with the conjugated polynomial that its algorithm 2 needs. As in `power`, moments are divided by
b0 first and there are two roads: `algorithm2` solves the Vandermonde system, `representation` has
nodes and weights, the latter from the inverse Toeplitz matrix.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from mpmath import mp, mpc, mpf

DIGITS = 50

# The published bias for moments stored in float32; moments are multiplied by 1 - bias.
PUBLISHED_BIAS = {2: 4e-7, 3: 8e-7, 4: 1.5e-6}


class Representation(NamedTuple):
    """Points of the unit circle, that of z first, and their weights."""

    points: list[mpc]
    weights: list[mpf]


def point(z, theta) -> mpc:
    """Eq. 5."""
    return mp.expj((2 * mp.pi - theta) * (mpf(z) + 1) / 2)


def moments(depth: Sequence, alpha: Sequence, count: int, theta) -> tuple[mpf, list[mpc]]:
    """b0 and b1..bm divided by b0, for depths in [-1, 1]; (0, zeros) for clear rays."""
    with mp.workdps(DIGITS):
        absorbance = [-mp.log1p(-mpf(float(a))) for a in alpha]
        b0 = mp.fsum(absorbance)
        if b0 == 0:
            return mpf(0), [mpc(0)] * count
        x = [point(float(z), mpf(theta)) for z in depth]
        return b0, [
            mp.fsum(a * one**k for a, one in zip(absorbance, x, strict=True)) / b0
            for k in range(1, count + 1)
        ]


def _psi(x: mpc) -> mpf:
    if x.imag >= 0:
        return x.imag - x.real if x.real >= 0 else 2 - x.real - x.imag
    return 4 + x.real - x.imag if x.real < 0 else 6 + x.real + x.imag


def share(x: mpc, x0: mpc, theta) -> mpf:
    """Eq. 6, or 4 where there is no wrapping zone."""
    here, end = _psi(x), _psi(point(1, theta)) if theta else mpf(7)
    if here < _psi(x0):
        return mpf(1)
    return mpf(0) if here <= end else (here - end) / (7 - end)


def _roots(coefficients: list[mpc]) -> list[mpc]:
    """Of a polynomial (lowest coefficient first) with simple roots on the unit circle: the
    iteration of Durand and Kerner, at twice the digits."""
    with mp.workdps(2 * DIGITS):
        degree = len(coefficients) - 1
        roots = [mp.expj(1 + 2 * mp.pi * k / degree) for k in range(degree)]
        for _ in range(500):
            moved = mpf(0)
            for k, x in enumerate(roots):
                value = mp.fsum(c * x**i for i, c in enumerate(coefficients)) / coefficients[-1]
                others = mp.fprod(x - y for i, y in enumerate(roots) if i != k)
                roots[k] = x - value / others
                moved = max(moved, abs(roots[k] - x))
            if moved < mpf(10) ** -DIGITS:
                return roots
    raise ArithmeticError("the roots were not found")


@dataclass(frozen=True)
class Ray:
    """Normalised, already biased moments b1, ..., bm of one ray."""

    b: Sequence[mpc]
    theta: mpf

    @cached_property
    def inverse(self):
        """Of the Toeplitz matrix; its entry in row j and column k is b_(j-k)."""
        m = len(self.b)
        b = [mpc(1), *self.b]
        places = range(m + 1)
        entry = [[b[j - k] if j >= k else mp.conj(b[k - j]) for k in places] for j in places]
        return mp.matrix(entry) ** -1

    def _powers(self, x: mpc):
        return mp.matrix([x**k for k in range(len(self.b) + 1)])

    def weight(self, x: mpc) -> mpf:
        """The most mass at x, which a representation with a node there has."""
        powers = self._powers(x)
        return 1 / mp.re((powers.H * self.inverse * powers)[0])

    def roots(self, x0: mpc) -> list[mpc]:
        """Of the polynomial of algorithm 2, its coefficients conjugated."""
        q = self.inverse * self._powers(x0)
        return _roots([mp.conj(one) for one in q])

    def representation(self, z) -> Representation:
        roots = self.roots(point(z, self.theta))
        points = [point(z, self.theta), *(x / abs(x) for x in roots)]
        return Representation(points, [self.weight(x) for x in points])

    def in_front(self, z) -> tuple[mpf, mpf]:
        """Share of absorbance in front of z but for that at z, and the share at z."""
        with mp.workdps(DIGITS):
            z = mpf(float(z))
            found = self.representation(z)
            pairs = list(zip(found.points, found.weights, strict=True))
            x0, at = pairs[0]
            return mp.fsum(w * share(x, x0, self.theta) for x, w in pairs[1:]), at


def biased(b: Sequence, bias, theta) -> Ray:
    with mp.workdps(DIGITS):
        return Ray([(1 - mpf(bias)) * mpc(complex(one)) for one in b], mpf(theta))


def algorithm2(ray: Ray, z, overestimation) -> mpf:
    """Algorithm 2 as printed, with the conjugated polynomial: the share of absorbance before z."""
    with mp.workdps(DIGITS):
        x0 = point(mpf(float(z)), ray.theta)
        roots = ray.roots(x0)
        x = [x0, *roots]
        v = [mpf(overestimation), *(share(one / abs(one), x0, ray.theta) for one in roots)]
        u = mp.lu_solve(mp.matrix([[one**k for k in range(len(x))] for one in x]), mp.matrix(v))
        return mp.re(mp.fsum(b * one for b, one in zip([1, *ray.b], u, strict=True)))
