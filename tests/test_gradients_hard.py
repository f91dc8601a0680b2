"""Derivatives on rays where reconstructions go wrong, opaque and clear fragments among them."""

import numpy as np
import pytest

import moit
from moit import gradients
from tests.oracle.hard_rays import flat, hard_rays

NAMES = (
    "trig2",
    "trig4(wrapping_zone=0, exclude_self=True)",
    "moment-transparency(passes=2)",
    "neural-bounded6",
    "fourier31(bits=32, exclude_self=True)",
    "wavelet32(exclude_self=True)",
    "transmittance-function-map32(bits=32, exclude_self=True)",
    "slices16",
    "neural-slices8",
    "hybrid2(normalize=True)",
    "depth-peeling2(normalize=True)",
)


@pytest.fixture(scope="module")
def rays():
    offsets, depth, alpha = flat(hard_rays(3, 4))
    chosen = np.random.default_rng(0).random(len(alpha))
    return offsets, depth + 2, np.select([chosen < 0.02, chosen > 0.98], [1, 0], alpha)


@pytest.mark.parametrize("name", NAMES)
def test_hard_rays_have_finite_derivatives(name, rays):
    offsets, depth, alpha = rays
    color = np.random.default_rng(1).uniform(size=(len(alpha), 3))
    for dtype, cull in (("float32", True), ("float64", False)):
        f = moit.Fragments(offsets, depth, alpha, color, depth_range=(1, 3), dtype=dtype)
        image, pullback = gradients.composite(f, name, cull_opaque=cull)
        found = pullback(np.ones_like(image))
        for part in (found.depth, found.alpha, found.color, found.background):
            assert np.isfinite(part).all()
        if found.network is not None:
            assert np.isfinite(found.network).all()


def test_slices_of_floats_are_those_of_doubles(rays):
    """Whose opaque surfaces hide most: what a tile was given is more than what it has."""
    offsets, depth, alpha = rays
    found = []
    for dtype in ("float32", "float64"):
        f = moit.Fragments(offsets, depth, alpha.astype("f4"), depth_range=(1, 3), dtype=dtype)
        T, pullback = gradients.transmittance(f, "slices16")
        found.append(pullback(np.ones_like(T)))
    # float32 answers of slices differ by steps; derivatives are computed in double of either
    np.testing.assert_allclose(found[0].alpha, found[1].alpha, rtol=1e-6)
    np.testing.assert_allclose(found[0].depth, found[1].depth, rtol=1e-6)


KINKS = ("power4(bias=1e-4)", "trig3(bias=1e-4)", "fourier15(bits=32)", "wavelet16")
KINKS += ("moment-transparency(passes=2, bias=1e-4)", "neural-bounded(bias=1e-4)")


@pytest.mark.parametrize("name", KINKS)
def test_alpha_at_its_most_is_on_the_side_of_less(name):
    most = moit.technique(name).max_alpha
    depth, color = np.array([1.5, 2.0, 3.5, 5.0]), np.eye(4, 3)
    seed = np.array([[[1, 2, 3, 4.0]]])

    def asked(alpha):
        alphas = np.array([0.3, alpha, 0.4, 0.2])
        f = moit.Fragments([0, 4], depth, alphas, color, depth_range=(1, 6), dtype="float64")
        image, pullback = gradients.composite(f, name, background=(0.3, 0.5, 0.2))
        return (image * seed).sum(), pullback(seed).alpha[1]

    scale = 1e-7
    slope = (asked(most)[0] - asked(most - scale)[0]) / scale
    assert asked(most)[1] == pytest.approx(slope, rel=1e-4, abs=1e-5)
    beyond = asked(most + 2 * scale)[0] - asked(most + scale)[0]
    assert asked(most + scale)[1] == pytest.approx(beyond / scale, rel=1e-4, abs=1e-5)


@pytest.mark.parametrize("name", KINKS)
def test_depths_that_meet_have_derivatives_of_one_side(name):
    """Finite, and those by alpha of a picture that two equal fragments make are equal, but of
    techniques that know an order."""
    depth, alpha = np.array([2.0, 3.0, 3.0, 5.0]), np.array([0.3, 0.5, 0.5, 0.2])
    color = np.array([[1, 0, 0], [0.2, 0.3, 0.4], [0.2, 0.3, 0.4], [0, 1, 0]])
    f = moit.Fragments([0, 4], depth, alpha, color, depth_range=(1, 6), dtype="float64")
    image, pullback = gradients.composite(f, name)
    found = pullback(np.ones_like(image))
    assert np.isfinite(found.depth).all()
    assert found.alpha[1] == pytest.approx(found.alpha[2], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "n"),
    (
        ("power4", 2),
        ("power8", 4),
        ("trig3", 3),
        ("neural-bounded", 2),
        ("neural-bounded6", 3),
        ("front2", 4),
        ("front1(tail='power6')", 4),
    ),
)
def test_pictures_of_as_many_fragments_as_nodes_hardly_hang_on_depth(name, n):
    """With the bias of double each is seen exactly, but for what that is over powers of gaps."""
    rng, pixels = np.random.default_rng(5), 50
    depth, alpha = rng.uniform(1, 9, pixels * n), rng.uniform(0.02, 0.98, pixels * n)
    color, offsets = rng.uniform(0, 1, (pixels * n, 3)), np.arange(pixels + 1) * n
    f = moit.Fragments(offsets, depth, alpha, color, depth_range=(0.5, 10), dtype="float64")
    image, pullback = gradients.composite(f, name)
    found = pullback(rng.normal(size=image.shape)).depth
    # networks see shapes, which say what is left of bias, too
    assert np.abs(found).max() < 1e-5
