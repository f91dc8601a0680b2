"""Derivatives through splats, held to formulas in complex numbers and to the pictures they move."""

import functools

import numpy as np
import pytest
from readings import splat_fragments as reading

import moit
from moit import gradients
from moit.geometry.splats import CONVENTIONS
from moit.gradients import scenes

SIZE = (33, 23)
WIDE = moit.Camera(eye=(0.1, 0.2, 0.5), fov_y=1.3)


@functools.cache
def some_splats(convention="3dgs", degree=3, count=60, antialiased=False):
    """Of all sizes: round the camera, in front of it and behind; some opaque, some flat, some whose
    colour is held at 0 from here."""
    rng = np.random.default_rng(4)
    scales = np.exp(rng.normal(-2, 0.8, (count, 3)))
    scales[::7, 2] = 0
    opacities = rng.uniform(0, 1, count)
    opacities[::3] = 1
    return moit.Splats(
        rng.normal(size=(count, 3)) * 0.6,
        scales,
        rng.normal(size=(count, 4)),
        opacities,
        sh=rng.normal(size=(count, (degree + 1) ** 2, 3)) * 0.4,
        convention=convention,
        antialiased=antialiased,
    )


def seeds_of(f, seed=5):
    rng = np.random.default_rng(seed)
    return [rng.normal(size=one.shape).astype(np.float32) for one in (f.depth, f.alpha, f.color)]


def places(f, splats, camera):
    """The pixel of each fragment, and its splat: that which has its colour from here."""
    pixel = np.repeat(np.arange(len(f.offsets) - 1), np.diff(f.offsets))
    shades = reading.color(splats.means.astype(complex) - camera.eye, splats.sh + 0j).real
    which = np.abs(f.color[:, None] - shades[None]).sum(axis=-1).argmin(axis=1)
    return pixel % SIZE[0], pixel // SIZE[0], which


@pytest.mark.parametrize("convention", [*CONVENTIONS, "3dgs, antialiased"])
def test_derivatives_are_those_of_the_formulas(convention):
    degree, antialiased = 3 if convention == "3dgs" else 0, convention.endswith(", antialiased")
    convention = convention.removesuffix(", antialiased")
    splats = some_splats(convention, degree, antialiased=antialiased)
    f, pullback = gradients.rasterize(splats, WIDE, SIZE)
    x, y, which = places(f, splats, WIDE)
    given = [getattr(splats, name)[which].astype(complex) for name in reading.ARRAYS]
    told = reading.fragments(given, WIDE, SIZE, convention, x, y, antialiased)
    for found, one in zip((f.depth, f.alpha, f.color), told, strict=True):
        np.testing.assert_allclose(found, one.real, rtol=1e-4, atol=1e-5)
    seeds = seeds_of(f)
    by = pullback(*seeds)
    wanted = reading.derivatives(splats, WIDE, SIZE, x, y, which, seeds)
    for name, (exact, parts) in zip(reading.ARRAYS, wanted, strict=True):
        found = getattr(by, name)
        assert found.shape == exact.shape
        assert np.abs(exact).max() > 1
        # alpha is a float's, and of thin ones along rays its distance loses digits
        most = parts.reshape(len(parts), -1).max(axis=1).reshape(-1, *[1] * (exact.ndim - 1))
        assert (np.abs(found - exact) <= 5e-5 * most).all(), name
        assert (np.abs(found - exact) <= 2e-6 * most).mean() > 0.95, name


def test_what_is_met_are_all_limits():
    """Of the scene of the test above."""
    splats = some_splats()
    f, _ = gradients.rasterize(splats, WIDE, SIZE)
    which = np.unique(places(f, splats, WIDE)[2])
    at = (splats.means[which] - WIDE.eye) @ WIDE.axes.T
    slopes = np.abs(at[:, :2] / at[:, 2:]) * WIDE.scale(SIZE)
    assert (slopes > 1.3).any()
    assert (slopes < 1).any()
    assert (f.alpha == np.float32(0.99)).any()
    assert (f.color == 0).any()


@pytest.mark.parametrize("convention", ["3dgs", "exact"])
def test_bits_are_those_of_any_number_of_threads(convention):
    splats, found = some_splats(convention), []
    for threads in (1, 3):
        f, pullback = gradients.rasterize(splats, WIDE, SIZE, threads=threads)
        by = pullback(*seeds_of(f))
        found.append([getattr(by, name).tobytes() for name in reading.ARRAYS])
    assert found[0] == found[1]


@pytest.mark.parametrize("technique", ["sorted", "power4", "wboit"])
def test_a_picture_is_that_of_render_and_its_pullback_the_chain(technique, monkeypatch):
    splats, rng = some_splats(), np.random.default_rng(2)
    behind = rng.uniform(size=(*SIZE[::-1], 3))
    image, pullback = gradients.render(splats, WIDE, SIZE, technique, background=behind)
    plain = moit.render(splats, technique, SIZE, camera=WIDE, background=behind)
    assert image.tobytes() == plain.tobytes()
    seed = rng.normal(size=image.shape).astype(np.float32)
    whole = pullback(seed)
    f, to_splats = gradients.rasterize(splats, WIDE, SIZE)
    _, to_fragments = gradients.composite(f, technique, background=behind)
    by = to_fragments(seed)
    chained = to_splats(by.depth, by.alpha, by.color)
    monkeypatch.setattr(scenes, "MOST_AT_ONCE", len(f) // 3)
    image, pullback = gradients.render(splats, WIDE, SIZE, technique, background=behind)
    assert image.tobytes() == plain.tobytes()
    in_bands = pullback(seed)
    for name in reading.ARRAYS:
        assert getattr(whole, name).any(), name
        for other in (chained, in_bands):
            assert getattr(whole, name).tobytes() == getattr(other, name).tobytes(), name
    for one in (whole, in_bands):
        assert one.background.tobytes() == by.background.tobytes()


def test_a_background_of_one_colour_has_the_sum_of_its_pixels():
    splats = some_splats()
    image, pullback = gradients.render(splats, WIDE, SIZE, "sorted", background=(0.1, 0.2, 0.3))
    by = pullback(np.ones_like(image))
    through = 1 - image[..., 3].astype(float)
    np.testing.assert_allclose(by.background, through.sum(axis=(0, 1)).repeat(3), rtol=1e-5)


def test_colours_from_all_sides_have_derivatives():
    colors = np.array([[0.3, 0.6, 0.9]])
    splats = moit.Splats([[0, 0, 0]], [0.3], [[1, 0, 0, 0]], [0.7], colors=colors)
    f, pullback = gradients.rasterize(splats, moit.Camera(), SIZE)
    by = pullback(np.zeros_like(f.depth), np.zeros_like(f.alpha), np.ones_like(f.color))
    np.testing.assert_allclose(by.colors, [[len(f)] * 3], rtol=1e-6)


def test_extremes_have_finite_derivatives():
    rng = np.random.default_rng(8)
    count = 40
    scales = 10.0 ** rng.uniform(-30, 30, (count, 3))
    scales[:4] = 0
    for convention in CONVENTIONS:
        splats = moit.Splats(
            10.0 ** rng.uniform(-20, 3, (count, 3)) * [1, 1, -1],
            scales,
            rng.normal(size=(count, 4)),
            rng.uniform(0.1, 1, count),
            sh=1e30 * rng.normal(size=(count, 4, 3)),
            convention=convention,
        )
        f, pullback = gradients.rasterize(splats, moit.Camera(eye=(0, 0, 0.5)), SIZE)
        assert len(f)
        by = pullback(*[one * np.float32(1e30) for one in seeds_of(f)])
        assert all(np.isfinite(getattr(by, name)).all() for name in reading.ARRAYS)


def test_nothing_has_no_derivatives():
    none = moit.Splats(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(0))
    image, pullback = gradients.render(none, WIDE, SIZE, "sorted")
    assert pullback(image).means.shape == (0, 3)
    away = moit.Camera(eye=(0, 0, 90), target=(0, 0, 91))
    image, pullback = gradients.render(some_splats(), away, SIZE, "sorted")
    assert not pullback(image).means.any()


def test_what_has_no_derivatives_is_refused():
    splats, camera = some_splats(), moit.Camera()
    with pytest.raises(TypeError, match=r"scene\[0\]: expected a Mesh, got Splats"):
        gradients.rasterize([splats], camera, SIZE)
    with pytest.raises(TypeError, match="camera: expected a Camera, got tuple"):
        gradients.rasterize(splats, (0, 0, 1), SIZE)
    with pytest.raises(moit.SplatsError, match="thick: there are derivatives of flat splats only"):
        gradients.rasterize(splats.seen_by("exact", thick=True), camera, SIZE)
    with pytest.raises(ValueError, match=r"technique: .* has no derivatives"):
        gradients.render(splats, camera, SIZE, "mlab4")
    f, pullback = gradients.rasterize(splats, camera, SIZE)
    with pytest.raises(ValueError, match="d_color: expected shape"):
        pullback(f.depth, f.alpha, f.depth)
    with pytest.raises(ValueError, match=r"d_alpha.*needed a finite number"):
        pullback(f.depth, np.full_like(f.alpha, np.nan), f.color)
    with pytest.raises(ValueError, match="d_image: expected shape"):
        gradients.render(splats, camera, SIZE, "sorted")[1](np.zeros(SIZE))
