"""Derivatives of pixels that cover next to nothing, against 900 digits, and of too large ones."""

import mpmath
import numpy as np
import pytest

import moit
from moit import gradients

DEPTH = np.array([1.0, 4.0, 2.0, 3.0])
SHARES = np.array([1.0, 0.75, 0.5, 0.25])
SEED = np.array([1.0, -2.0, 3.0, 0.5])


def product(alpha):
    return mpmath.fprod(1 - a for a in alpha)


def exact_share(alpha):
    return (1 - product(alpha)) / mpmath.fsum(alpha)


def averaged_share(alpha):
    sum = mpmath.fsum(alpha)
    return (1 - (1 - sum / len(alpha)) ** len(alpha)) / sum


def same(share, alpha):
    return [share(alpha)] * 4


def behind_one(share, alpha):
    """The nearest is the first."""
    tail = (1 - alpha[0]) * share(alpha[1:])
    return [mpmath.mpf(1), tail, tail, tail]


SEEN = {
    "weighted-sum(normalize=True)": lambda alpha: same(exact_share, alpha),
    "weighted-average": lambda alpha: same(averaged_share, alpha),
    "hybrid1": lambda alpha: behind_one(averaged_share, alpha),
    "hybrid1(normalize=True)": lambda alpha: behind_one(exact_share, alpha),
}


def differences(seen, alpha):
    """Of the sum of seeds times T by each alpha."""
    with mpmath.workdps(900):
        held = [mpmath.mpf(float(a)) for a in alpha]
        found = []
        for i in range(4):
            sums = []
            for step in (mpmath.mpf("1e-20"), mpmath.mpf("-1e-20")):
                moved = [a * (1 + step * (k == i)) for k, a in enumerate(held)]
                sums.append(mpmath.fdot(map(float, SEED), seen(moved)))
            found.append(float((sums[0] - sums[1]) / (held[i] * 2e-20)))
        return found


@pytest.mark.parametrize("most", (0.9, 1e-3, 1e-9, 1e-20, 1e-200))
@pytest.mark.parametrize("technique", SEEN)
def test_thin_pixels_lose_no_digits(technique, most):
    alpha = most * SHARES
    f = moit.Fragments([0, 4], DEPTH, alpha, depth_range=(1, 4), dtype="float64")
    T, pullback = gradients.transmittance(f, technique)
    if most < 1e-9:
        np.testing.assert_array_equal(T, 1)
    wanted = differences(SEEN[technique], alpha)
    np.testing.assert_allclose(pullback(SEED).alpha, wanted, rtol=1e-11)


@pytest.mark.parametrize("dtype", ("float32", "float64"))
@pytest.mark.parametrize("technique", (*SEEN, "wboit", "wboit-eq10", "wboit-phenomenological"))
def test_next_to_nothing_has_finite_derivatives(technique, dtype):
    least = np.finfo(dtype).smallest_subnormal
    for alpha in (least * np.array([1, 5, 1, 2]), np.array([least, 1, least, 0])):
        for depth in (DEPTH, np.ldexp(1.0, [-100, 100, 0, 3]), np.full(4, 2.0)):
            f = moit.Fragments([0, 4], depth, alpha, np.ones((4, 3)), dtype=dtype)
            for ask in (gradients.composite, gradients.transmittance):
                answer, pullback = ask(f, technique, cull_opaque=False)
                found = pullback(np.full_like(answer, 0.75))
                assert all(np.isfinite(part).all() for part in (found.depth, found.alpha))


def test_what_no_float_holds_is_the_largest_that_it_has():
    """Weights of near and far are some 10^4 apart: shares of thin ones change by 1 / alpha."""
    alpha = np.array([1e-7, 1e-45, 3e-45], "f4")
    found = {}
    for dtype in ("float32", "float64"):
        f = moit.Fragments([0, 3], [1, 300, 400], alpha, depth_range=(1, 400), dtype=dtype)
        _, pullback = gradients.transmittance(f, "wboit-eq10")
        found[dtype] = pullback(np.array([1e35, 0, 0], dtype)).alpha
    assert abs(found["float64"][1:]).min() > 1e39
    most = np.finfo("f4").max
    np.testing.assert_array_equal(found["float32"][1:], np.copysign(most, found["float64"][1:]))
