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


def check_differences(technique, depth, alpha):
    """Of the picture, where nothing is culled: of all numbers but alpha 1, which is a kink."""
    seed = np.random.default_rng(1).normal(size=(1, 1, 4))

    def loss(**changed):
        f = fragments(**({"depth": depth, "alpha": alpha} | changed))
        return (seed * moit.composite(f, technique, cull_opaque=False)).sum()

    _, pullback = gradients.composite(fragments(depth, alpha), technique, cull_opaque=False)
    found = pullback(seed)
    for name, numbers in (("depth", depth), ("alpha", alpha), ("color", COLOR)):
        for at in np.ndindex(numbers.shape):
            if name == "alpha" and numbers[at] == 1:
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
