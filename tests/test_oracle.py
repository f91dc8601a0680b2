"""The oracle itself: two roads agree, few surfaces come back whole, golden data is met."""

import numpy as np
import pytest
from golden import golden
from mpmath import mp, mpf
from oracle import power, rays
from oracle.hard_rays import KINDS, MAX_ALPHA, depths_to_ask, hard_rays

COUNTS = [4, 6, 8]


@pytest.fixture(autouse=True)
def eighty_digits():
    """Differences too are taken at the oracle's precision."""
    with mp.workdps(power.DIGITS):
        yield


@pytest.mark.parametrize("m", COUNTS)
def test_the_oracle_meets_the_golden_data(m):
    problems, data = golden("problems"), golden(f"power{m}")
    worst = 0.0
    for pixel in range(m // 2, len(data["b0"]), 23):
        ray = power.biased(data["b"][pixel].tolist(), float(data["bias"]))
        for k in (pixel % 8, (pixel + 3) % 8):
            found = ray.at(float(problems["eval_depth"][pixel, k]))
            lower, weight = data["truth_A_lower"][pixel, k], data["truth_w0"][pixel, k]
            worst = max(worst, abs(found.lower - lower), abs(found.weight - weight))
    assert worst < 1e-12


def test_the_oracle_meets_the_exact_transmittance_of_the_golden_problems():
    problems = golden("problems")
    offsets = problems["offsets"]
    for pixel in range(0, len(offsets) - 1, 7):
        of_pixel = slice(offsets[pixel], offsets[pixel + 1])
        at = problems["eval_depth"][pixel]
        found = rays.transmittance(problems["depth"][of_pixel], problems["alpha"][of_pixel], at)
        for one, known in zip(found, problems["T_exact_lt"][pixel], strict=True):
            assert abs(one - known) <= 1e-12 * known + 1e-300


@pytest.mark.parametrize("m", COUNTS)
@pytest.mark.parametrize("kind", KINDS)
def test_algorithm_1_and_the_canonical_representation_agree(m, kind):
    (hard,) = hard_rays(seed=m, of_each_kind=1, kinds=[kind])
    _, b = rays.moments(hard.depth, hard.alpha, m)
    ray = power.biased(b, power.PUBLISHED_BIAS[m])
    for z in depths_to_ask(hard, seed=m, count=2):
        found = ray.at(float(z))
        assert abs(power.algorithm1(ray, float(z), 0.25) - found.lower - found.weight / 4) < 1e-30


@pytest.mark.parametrize("m", COUNTS)
@pytest.mark.parametrize("kind", KINDS)
def test_the_canonical_representation_has_the_moments_it_was_made_from(m, kind):
    (hard,) = hard_rays(seed=10 + m, of_each_kind=1, kinds=[kind])
    ray = power.biased(rays.moments(hard.depth, hard.alpha, m)[1], power.PUBLISHED_BIAS[m])
    for z in depths_to_ask(hard, seed=m, count=2):
        found = ray.at(float(z))
        assert all(weight > 0 for weight in found.weights)
        for k, b in enumerate(ray.b):
            pairs = zip(found.weights, found.nodes, strict=True)
            assert abs(mp.fsum(w * x**k for w, x in pairs) - b) < 1e-30


@pytest.mark.parametrize("m", COUNTS)
def test_without_bias_as_many_surfaces_as_moments_can_hold_come_back_whole(m):
    rng = np.random.default_rng(m)
    for n in range(1, m // 2 + 2):
        depth = rng.choice(np.linspace(-1, 1, 41), n, replace=False).tolist()
        alpha = rng.uniform(0.1, MAX_ALPHA, n).tolist()
        b0, b = rays.moments(depth, alpha, m)
        ray = power.biased(b, 0)
        for z, one, exact in zip(
            depth, alpha, rays.transmittance(depth, alpha, depth), strict=True
        ):
            own = -mp.log1p(-mpf(one))
            for overestimation in (0, 0.25, 1):
                found = power.transmittance_but_self(ray, b0, z, own, overestimation)
                assert abs(found - exact) < 1e-12


@pytest.mark.parametrize("m", COUNTS)
def test_few_surfaces_are_known_between_them_too(m):
    depth, alpha = [-0.5, 0.3][: m // 2], [0.7, 0.4][: m // 2]
    b0, b = rays.moments(depth, alpha, m)
    at = [-1, -0.5, 0, 0.3, 0.5, 1]
    exact = rays.transmittance(depth, alpha, at)
    for z, known in zip(at, exact, strict=True):
        assert abs(power.transmittance(power.biased(b, 0), b0, z, 0) - known) < 1e-12


def test_moments_of_no_measure_are_refused():
    with pytest.raises(ValueError, match="no measure"):
        power.biased([0.5, 0.1, 0.0, 0.3], 0).at(0)


def test_the_log_warp_spans_minus_one_to_one():
    assert rays.warped(2.0, 2.0, 32.0) == -1
    assert rays.warped(32.0, 2.0, 32.0) == 1
    assert abs(rays.warped(8.0, 2.0, 32.0)) < 1e-70
    assert rays.warped(17.0, 2.0, 32.0, "linear") == 0
