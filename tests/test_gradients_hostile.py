"""Derivatives of hostile pixels against differences of the answers themselves, in float64."""

import numpy as np
import pytest

import moit
from moit import gradients
from moit.gradients.moment_bounds import compute_moment_bounds, compute_moment_bounds_backward

STEP = 1e-6
SIZE = 4
COLOR = np.random.default_rng(0).uniform(0, 1, (SIZE, 3))


def fragments(depth, alpha, color=COLOR):
    return moit.Fragments([0, SIZE], depth, alpha, color, depth_range=(0.5, 10), dtype="float64")


def check_differences(technique, depth, alpha, cull_opaque=False):
    """Of the picture by all numbers but alpha 0 and 1, which are kinks."""
    seed = np.random.default_rng(1).normal(size=(1, 1, 4))

    def loss(**changed):
        f = fragments(**({"depth": depth, "alpha": alpha} | changed))
        return (seed * moit.composite(f, technique, cull_opaque=cull_opaque)).sum()

    f = fragments(depth, alpha)
    _, pullback = gradients.composite(f, technique, cull_opaque=cull_opaque)
    found = pullback(seed)
    for name, numbers in (("depth", depth), ("alpha", alpha), ("color", COLOR)):
        for at in np.ndindex(numbers.shape):
            if name == "alpha" and numbers[at] in (0, 1):
                continue
            step = np.zeros_like(numbers)
            step[at] = STEP
            more, less = (loss(**{name: numbers + one}) for one in (step, -step))
            wanted = (more - less) / (2 * STEP)
            assert getattr(found, name)[at] == pytest.approx(wanted, rel=2e-5, abs=1e-6), (name, at)


@pytest.mark.parametrize(
    "technique",
    (
        "power4(depth_range='pixel', bias=1e-3, warp='linear')",
        "fourier7(bits=32, depth_range='pixel')",
        "wavelet8(depth_range='pixel', normalize=False)",
        "transmittance-function-map(bits=32, depth_range='pixel', normalize=False)",
        "moment-transparency(passes=2, depth_range='pixel', bias=1e-3)",
        "neural-bounded(depth_range='pixel', bias=1e-3)",
    ),
)
@pytest.mark.parametrize("opaque", (1.5, 7.0))
def test_opaque_surfaces_beyond_a_pixel_s_range_stay_at_its_ends(technique, opaque):
    """The range is that of the others, of which one moves the end that they lie at."""
    depth = np.array([3.0, opaque, 2.0, 5.0])
    check_differences(technique, depth, np.array([0.3, 1, 0.6, 0.2]))


def test_lost_weights_are_equal_ones():
    """All that is known of fragments which nothing is seen of is that pictures show them."""
    technique = "transmittance-function-map(bits=32, depth_range='pixel')"
    depth, alpha = np.array([2.0, 7.7, 4.0, 5.0]), np.array([1, 0.45, 0.75, 0.5])
    f = fragments(depth, alpha)
    assert not moit.transmittance(f, technique, cull_opaque=False).any()
    _, pullback = gradients.composite(f, technique, cull_opaque=False)
    red = pullback([[[1, 0, 0, 0]]]).color
    np.testing.assert_allclose(red[:, 0], alpha / alpha.sum(), rtol=1e-14)
    check_differences(technique, depth, alpha)


@pytest.mark.parametrize("alpha", (None, 0.05, 0.6))
@pytest.mark.parametrize(
    "technique", ("power2(storage=None)", "power4", "power6", "moment-transparency(passes=1)")
)
def test_bounds_have_their_own_derivatives_where_they_are_wide(technique, alpha):
    """A node beyond [-2, 2] is kept within, and more may be said to lie at z than may."""
    rng = np.random.default_rng(6)
    offsets = np.arange(0, 65, 8)
    depth, opacity = rng.uniform(0.5, 10, 64), rng.uniform(0.1, 0.6, 64)
    f = moit.Fragments(offsets, depth, opacity, depth_range=(0.5, 10), dtype="float64")
    b0, b = (np.array(one) for one in moit.moments.gather(f, technique))
    b0, b = b0.reshape(8), b.reshape(8, -1)
    z = rng.uniform(*((0, 1) if technique.startswith("moment") else (-1, 1)), (8, 5))
    own = None if alpha is None else np.full(z.shape, alpha)
    seeds = rng.normal(size=(2, 8, 5))

    def losses(**changed):
        """Of each ray."""
        given = {"b0": b0, "b": b, "z": z, "alpha": own} | changed
        return (seeds * moit.moments.bounds(technique, **given)).sum(axis=(0, 2))

    _, pullback = gradients.moments_bounds(technique, b0, b, z, own)
    found = pullback(*seeds)
    for name, numbers in (("b0", b0), ("b", b), ("z", z), ("alpha", own)):
        for k in np.ndindex(numbers.shape[1:] if numbers is not None else (0,)):
            at = (slice(None), *k)
            more, less = numbers.copy(), numbers.copy()
            more[at] += STEP / 10
            less[at] -= STEP / 10
            wanted = (losses(**{name: more}) - losses(**{name: less})) / (STEP / 5)
            # moments of eight surfaces are near the edge of what are any
            np.testing.assert_allclose(getattr(found, name)[at], wanted, rtol=1e-3, atol=1e-5)


def picture_of(given):
    f = fragments(np.arange(1.0, 5), np.full(4, 0.5))
    image, pullback = gradients.composite(f, "power4", background=given)
    return lambda: pullback(np.ones_like(image)).alpha


def curve_of(given):
    f = fragments(np.arange(1.0, 5), np.full(4, 0.5))
    T, pullback = gradients.transmittance(f, "power4", given)
    return lambda: pullback(np.ones_like(T)).alpha


def moments_of(given):
    T, pullback = gradients.moments_transmittance(
        "power4", given[:1], given[None, 1:5], given[None]
    )
    return lambda: pullback(np.ones_like(T)).b


def bounds_of(given):
    (lower, upper), pullback = gradients.moments_bounds(
        "power4", given[:1], given[None, 1:5], given[None], given[None]
    )
    return lambda: pullback(lower, upper).b


def diffmoments_of(given):
    moments, at = given[:5, None], given[5:6]
    bounds, context = compute_moment_bounds(moments, at, 1e-3, 0.5, return_backward_context=True)
    return lambda: compute_moment_bounds_backward(context, np.ones_like(bounds))[0]


def splats_of(given):
    ball = moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.5])
    image, pullback = gradients.render(ball, moit.Camera(), (8, 6), "sorted", background=given)
    return lambda: pullback(np.ones_like(image)).opacities


@pytest.mark.parametrize(
    ("asks", "given"),
    (
        (picture_of, [1.0, 0.5, 0.25]),
        (picture_of, np.ones((1, 1, 3))),
        (curve_of, [1.5, 2.5]),
        (moments_of, [0.9, 0.1, 0.3, 0.05, 0.2, 0.15]),
        (bounds_of, [0.9, 0.1, 0.3, 0.05, 0.2, 0.15]),
        (diffmoments_of, [0.9, 0.1, 0.3, 0.05, 0.2, 0.15]),
        (splats_of, [1.0, 0.5, 0.25]),
    ),
)
def test_what_is_written_over_after_an_answer_changes_no_derivative(asks, given):
    own = np.array(given)
    pull = asks(own)
    before = pull()
    own[:] = 0
    np.testing.assert_array_equal(pull(), before)


@pytest.mark.parametrize("technique", ("sorted", "wboit", "power4(bias=1e-3)", "hybrid2"))
def test_what_an_opaque_surface_ends_is_opaque(technique):
    """Its pixel's alpha is 1 whatever lies in front of it."""
    alpha = np.array([0.3, 0.6, 1.0, 0.4])
    check_differences(technique, np.array([3.0, 2.0, 5.0, 7.0]), alpha, cull_opaque=True)


@pytest.mark.parametrize("normalize", (False, True))
def test_peeled_layers_may_cover_nothing(normalize):
    technique = f"depth-peeling2(normalize={normalize})"
    check_differences(technique, np.array([3.0, 2.0, 5.0, 7.0]), np.array([0, 0, 0.6, 0.4]))


def test_second_passes_of_thin_pixels():
    """Whose ratio is bounded where the second pass covers less than 1e-4."""
    technique = "moment-transparency(passes=2, bias=1e-3)"
    for scale in (1e-5, 6e-5, 1e-3):
        alpha = scale * np.array([0.3, 0.2, 0.4, 0.35])
        f = fragments(np.array([3.0, 2.0, 5.0, 7.0]), alpha)
        T, pullback = gradients.transmittance(f, technique)
        seed = np.random.default_rng(1).normal(size=T.shape)
        found = pullback(seed).alpha
        for i in range(SIZE):
            ends = []
            for sign in (1, -1):
                moved = alpha * (1 + 1e-3 * sign * (np.arange(SIZE) == i))
                other = fragments(np.array([3.0, 2.0, 5.0, 7.0]), moved)
                ends.append((seed * moit.transmittance(other, technique)).sum())
            wanted = (ends[0] - ends[1]) / (2e-3 * alpha[i])
            assert found[i] == pytest.approx(wanted, rel=1e-3)


def test_floats_are_in_the_core_of_a_hybrid_as_floats_are_compared():
    alpha = np.float32([0.2, 0.7, 0.3, 0.7])  # the float of 0.7 is less than 0.7
    f = moit.Fragments([0, 4], np.float32([1, 2, 3, 4]), alpha, np.eye(4, 3, dtype="f4"))
    image, pullback = gradients.composite(f, "hybrid2(core_alpha=0.7)")
    by = pullback([[[1, 1, 1, 0]]]).color
    np.testing.assert_allclose(by.diagonal(), image[0, 0, :3], rtol=1e-6)


# of the next slice, too, a fragment has a share, as ends are rounded outwards, if of no whole step
@pytest.mark.parametrize(("name", "most"), [("slices64(bits=8)", 0), ("neural-slices8", 1e-3)])
def test_full_slices_stay_full(name, most):
    depth, alpha = np.full(60, 2.0), np.full(60, 0.99)
    depth[-1], alpha[-1] = 8, 0.5
    seed = np.zeros(60)
    seed[-1] = 1
    answers = []
    for less in (0, 0.05):
        near = np.where(np.arange(60) < 59, alpha - less, alpha)
        f = moit.Fragments([0, 60], depth, near, depth_range=(0.5, 10), dtype="float64")
        T, pullback = gradients.transmittance(f, name)
        answers.append(T[-1])
        assert np.abs(pullback(seed).alpha[:-1]).max() <= most
    assert answers[0] == answers[1]


def test_what_is_not_there_changes_no_derivative():
    """Of rays so thick that all weights would be lost beside one of 1."""
    rng = np.random.default_rng(2)
    depth, alpha = rng.uniform(3, 9, 300), rng.uniform(0.99, 0.998, 300)
    color = rng.uniform(0, 1, (300, 3))
    found = []
    for more in (0, 1):
        there = np.arange(300 + more) >= more
        f = moit.Fragments(
            [0, 300 + more],
            np.concatenate([[1.0] * more, depth]),
            np.concatenate([[0.0] * more, alpha]),
            np.concatenate([color[:more], color]),
            depth_range=(0.5, 10),
            dtype="float64",
        )
        technique = "power4(overestimation=1.0, exclude_self=False, bias=1e-3)"
        _, pullback = gradients.composite(f, technique)
        found.append(pullback([[[1, 0, 0, 0]]]).color[there, 0])
    assert found[0].sum() == pytest.approx(1)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)


@pytest.mark.parametrize("count", (2, 4, 6, 8))
def test_the_layout_of_diffmoments_at_each_count(count):
    rng = np.random.default_rng(4)
    place, mass = rng.uniform(-1, 1, (12, 3)), rng.uniform(0.1, 1, (12, 3))
    moments = np.stack([(mass * place**k).sum(axis=0) for k in range(count + 1)])
    at, seed = np.array([-0.4, 0.1, 0.6]), rng.normal(size=3)
    how = 1e-2, 0.4
    _, context = compute_moment_bounds(moments, at, *how, return_backward_context=True)
    by_moments, by_at = compute_moment_bounds_backward(context, seed)
    for k in range(count + 2):
        ends = []
        for step in (STEP, -STEP):
            changed, there = moments.copy(), at.copy()
            (changed[k] if k <= count else there)[:] += step
            ends.append(seed * compute_moment_bounds(changed, there, *how))
        wanted = (ends[0] - ends[1]) / (2 * STEP)
        np.testing.assert_allclose(np.vstack([by_moments, by_at])[k], wanted, rtol=1e-5, atol=1e-7)


def test_curves_at_the_ends_of_the_range():
    technique = "power4(overestimation=0.5, bias=1e-2)"
    depth, alpha = np.array([0.5, 2, 5, 10]), np.array([0.3, 0.5, 0.4, 0.6])
    asked = [0.5, 10.0]
    T, pullback = gradients.transmittance(fragments(depth, alpha), technique, asked)
    assert T[0, 0, 0] < 1
    seed = np.array([[[1.0, -2.0]]])
    found = pullback(seed).alpha
    for i in range(SIZE):
        step = STEP * (np.arange(SIZE) == i)
        more, less = (
            (seed * moit.transmittance(fragments(depth, alpha + one), technique, asked)).sum()
            for one in (step, -step)
        )
        assert found[i] == pytest.approx((more - less) / (2 * STEP), rel=1e-5)


def test_the_second_of_deep_fragments_is_seen_through_the_first():
    f = fragments(np.array([3.0, 2.0, 6.0, 5.0]), np.array([0.3, 0.4, 0.6, 0.2]))
    T, pullback = gradients.transmittance(f, "dfa")
    found = pullback([1.0, 0, 0, 0])
    assert T[0] == pytest.approx(0.6, rel=1e-6)
    np.testing.assert_allclose(found.alpha, [0, -1, 0, 0], atol=1e-12)
