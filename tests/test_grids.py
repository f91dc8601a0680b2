"""Volumes on grids, held to integrals along rays."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

import moit
from moit import PrimitiveError
from moit.geometry import grids
from moit.geometry.drawing import Drawable
from moit.rendering import making

SIZE = (12, 9)
CAMERA = moit.Camera(eye=(0.3, 0.4, 3))
SIDES = (8, 6, 7)
SPACING = (0.2, 0.25, 0.15)
ORIGIN = (-0.7, -0.6, -0.5)


def places():
    steps = [np.arange(n) * s + o for n, s, o in zip(SIDES, SPACING, ORIGIN, strict=True)]
    return np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)


def rays(camera=CAMERA, size=SIZE):
    """(P, 3) where rays through middles of pixels go as depth grows by 1."""
    width, height = size
    across, along = camera.scale(size)
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    right, up, forward = camera.axes
    slopes = (2 * x / width - 1) / across, (1 - 2 * y / height) / along
    return (slopes[0][..., None] * right + slopes[1][..., None] * up + forward).reshape(-1, 3)


def span(camera=CAMERA, size=SIZE):
    """(P,) depths where rays enter and leave the box, enter beyond leave where they miss it."""
    last = np.array(ORIGIN) + (np.array(SIDES) - 1) * SPACING
    d = rays(camera, size)
    with np.errstate(divide="ignore"):
        ends = np.stack([(np.array(ORIGIN) - camera.eye) / d, (last - camera.eye) / d])
    return ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)


def total(f):
    return moit.total_transmittance(f, "sorted").ravel()


@pytest.mark.parametrize("step", [0.05, 0.06, 0.4, 50.0])
def test_a_homogeneous_box_is_exact(step):
    fog = moit.Volume(np.full(SIDES, 1.7), SPACING, origin=ORIGIN, step=step)
    f = moit.rasterize(fog, CAMERA, SIZE)
    near, far = span()
    length = np.maximum(far - near, 0) * np.linalg.norm(rays(), axis=1)
    np.testing.assert_allclose(total(f), np.exp(-1.7 * length), rtol=3e-6)
    np.testing.assert_array_equal(np.diff(f.offsets) > 0, far > near)
    there = np.flatnonzero(far > near)
    np.testing.assert_allclose(f.depth[f.offsets[there]], near[there], rtol=1e-6)
    np.testing.assert_allclose(f.back[f.offsets[there + 1] - 1], far[there], rtol=1e-6)
    # 44 * 0.06 / 0.06 is rounded to less than 44
    assert (f.back - f.depth).max() <= step + 1e-5
    np.testing.assert_allclose(f.color, 1, rtol=1e-5)
    if step == 50:
        assert np.diff(f.offsets).max() == 1
        # at the middle half of it is behind
        middle = moit.transmittance(f, "sorted", [(near + far)[there[0]] / 2])
        assert middle.ravel()[there[0]] == pytest.approx(
            np.exp(-1.7 * length[there[0]] / 2), rel=1e-4
        )


def test_what_is_linear_between_points_is_integrated_exactly():
    p = places()
    # a product of what is linear along each axis is what a cell holds: a cubic along a ray
    field = (1.1 + p[..., 0]) * (0.9 - p[..., 1]) * (1.3 + p[..., 2])
    f = moit.rasterize(moit.Volume(field, SPACING, origin=ORIGIN), CAMERA, SIZE)
    near, far = span()
    d = rays()
    found = -np.log(total(f))
    nodes, weights = np.polynomial.legendre.leggauss(4)
    for i in np.flatnonzero(far > near):
        z = near[i] + (far[i] - near[i]) * (nodes + 1) / 2
        x = CAMERA.eye + z[:, None] * d[i]
        value = (1.1 + x[:, 0]) * (0.9 - x[:, 1]) * (1.3 + x[:, 2])
        expected = value @ weights * (far[i] - near[i]) / 2 * np.linalg.norm(d[i])
        assert found[i] == pytest.approx(expected, rel=2e-6)


@pytest.mark.parametrize("absorbance", [0.1, 2.0, 8.0])
def test_colours_are_those_that_are_seen_from_the_front(absorbance):
    """Of one cell that changes from green to red, however dense."""
    grid = np.zeros((2, 2, 2, 4))
    grid[..., 0] = [0, 1]
    grid[..., 1] = [1, 0]
    grid[..., 3] = absorbance
    cell = moit.Volume(grid, origin=(-0.5, -0.5, -0.5), step=50)
    f = moit.rasterize(cell, moit.Camera(eye=(0, 0, 3)), (1, 1))
    # the mean place of what is seen, from the front
    place = 1 / absorbance - 1 / np.expm1(absorbance)
    np.testing.assert_allclose(f.color, [[1 - place, place, 0]], atol=1e-4)


def test_a_table_says_the_meaning_of_numbers():
    table = np.array([(1, 0, 0, 0), (1, 0, 0, 2), (0, 0, 1, 4)], float)
    field = np.zeros(SIDES) + np.linspace(0, 10, SIDES[0])[:, None, None]
    how = {"origin": ORIGIN, "limits": (2, 8)}
    by_table = moit.Volume(field, SPACING, table, **how)

    def by_function(values):
        share = np.clip((values - 2) / 6, 0, 1)
        columns = [np.interp(share, (0, 0.5, 1), column) for column in table.T]
        return np.stack(columns, axis=1)

    a = moit.rasterize(by_table, CAMERA, SIZE)
    b = moit.rasterize(moit.Volume(field, SPACING, by_function, **how), CAMERA, SIZE)
    np.testing.assert_allclose(total(a), total(b), rtol=1e-4)
    assert a.color[:, 0].max() > 0.99
    assert a.color[:, 2].max() > 0.95
    np.testing.assert_allclose(a.color.sum(axis=1), 1, atol=1e-5)
    # nothing is there below the lower limit
    near, far = span()
    middle = np.flatnonzero((far > near) & (np.arange(108) % 12 == 2))
    assert (np.diff(a.offsets)[middle] < np.ceil((far - near) / by_table.step)[middle] + 1).all()


def test_colours_and_absorbances_are_read_as_they_are():
    rng = np.random.default_rng(0)
    numbers = rng.random((*SIDES, 4))
    f = moit.rasterize(moit.Volume(numbers, SPACING, origin=ORIGIN, step=0.02), CAMERA, SIZE)
    near, far = span()
    image = moit.composite(f, "sorted")[..., :3].reshape(-1, 3)
    d = rays()
    for i in np.flatnonzero(far > near)[::17]:
        z = np.linspace(near[i], far[i], 4001)
        z = (z[1:] + z[:-1]) / 2
        at = (CAMERA.eye + z[:, None] * d[i] - ORIGIN) / SPACING
        cell = np.clip(at.astype(int), 0, np.array(SIDES) - 2)
        part = at - cell
        value = np.zeros((len(z), 4))
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(corner, part, 1 - part), axis=1)
            value += weight[:, None] * numbers[tuple((cell + corner).T)]
        deep = value[:, 3] * (far[i] - near[i]) / 4000 * np.linalg.norm(d[i])
        reach = np.exp(-np.concatenate([[0], np.cumsum(deep)[:-1]]))
        expected = ((reach * -np.expm1(-deep))[:, None] * value[:, :3]).sum(axis=0)
        np.testing.assert_allclose(image[i], expected, rtol=1e-3)


def test_the_eye_may_be_inside():
    camera = moit.Camera(eye=(0, 0, 0), target=(0, 0, -1), near=0.05)
    fog = moit.Volume(np.full(SIDES, 1.7), SPACING, origin=ORIGIN, step=9)
    f = moit.rasterize(fog, camera, SIZE)
    assert (f.depth == np.float32(0.05)).all()
    length = (span(camera)[1] - 0.05) * np.linalg.norm(rays(camera), axis=1)
    np.testing.assert_allclose(total(f), np.exp(-1.7 * length), rtol=3e-6)


def test_volumes_are_drawn_among_others():
    fog = moit.Volume(np.full(SIDES, 1.7), SPACING, origin=ORIGIN, step=0.1)
    cloud = moit.Volume(np.full(SIDES, 0.4), SPACING, origin=(-0.2, -0.5, -0.3), step=0.1)
    pane = moit.Mesh([[-9, -9, 0], [9, -9, 0], [0, 9, 0]], [[0, 1, 2]], (0.2, 0.6, 0.3), 0.5)
    line = moit.Lines([[-1, 0.1, 0.2], [1, 0.1, 0.1]], pixels=2)
    assert isinstance(fog, Drawable)
    scene = [pane, fog, cloud, line]
    f = moit.rasterize(scene, CAMERA, SIZE)
    whole = total(moit.rasterize(fog, CAMERA, SIZE)) * total(moit.rasterize(cloud, CAMERA, SIZE))
    whole = whole * total(moit.rasterize(pane, CAMERA, SIZE))
    clear = np.flatnonzero(total(moit.rasterize(line, CAMERA, SIZE)) == 1)
    np.testing.assert_allclose(total(f)[clear], whole[clear], rtol=1e-5)
    found = moit.render(scene, "sorted", SIZE, camera=CAMERA)
    np.testing.assert_array_equal(found, moit.composite(f, "sorted"))
    for name in ("power4", "wboit", "mlab4"):
        image = moit.render(scene, name, SIZE, camera=CAMERA)
        assert np.abs(image - found).max() < 0.5
        assert np.isfinite(image).all()


def test_every_technique_takes_points_lines_and_volumes():
    scene = [
        moit.Volume(np.full((2, 2, 2), 0.8), 0.6, origin=(-0.3, -0.3, -0.3)),
        moit.Lines([[-1, 0.1, 0.5], [1, 0.1, -0.5]], radius=0.1, alpha=0.6, shape="tube"),
        moit.Points([[-0.4, 0, 0.2], [0.5, -0.2, 0]], radius=0.3, alpha=0.7, shape="sphere"),
    ]
    exact = moit.render(scene, "sorted", (6, 5), camera=CAMERA, antialias=True)
    for technique in moit.techniques():
        image = moit.render(scene, technique, (6, 5), camera=CAMERA, antialias=True)
        assert np.isfinite(image).all(), technique
        # what a pixel covers is roughly known to all but those that draw lots or keep one layer
        assert np.abs(image - exact)[..., 3].mean() < 0.25, technique


def test_threads_change_no_bit():
    numbers = np.random.default_rng(1).random((*SIDES, 4))
    fog = moit.Volume(numbers, SPACING, origin=ORIGIN)
    one, other = (moit.rasterize(fog, CAMERA, SIZE, threads=t) for t in (1, 4))
    for name in ("offsets", "depth", "back", "alpha", "color"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_image_data_are_taken_as_they_are():
    rng = np.random.default_rng(3)
    field = rng.random((3, 4, 2))
    image = SimpleNamespace(
        dimensions=(3, 4, 2),
        spacing=(0.5, 0.25, 2.0),
        origin=(1.0, 2.0, 3.0),
        point_data=SimpleNamespace(active_scalars=field.ravel(order="F")),
    )
    fog = moit.Volume(image)
    np.testing.assert_array_equal(fog.grid[..., 0], field.astype(np.float32))
    assert (fog.spacing, fog.origin) == (image.spacing, image.origin)
    assert moit.Volume(image, 1, origin=(0, 0, 0)).points.max() == 3
    image.point_data.active_scalars = None
    with pytest.raises(moit.PrimitiveError, match="grid: found no active scalars of points"):
        moit.Volume(image)


def test_grids_of_one_number_have_the_first_row_of_a_table():
    grid, table = np.full((2, 2, 2), 7.0), [(0.1, 0.2, 0.3, 2), (1, 1, 1, 5)]
    with np.errstate(all="raise"):
        f = moit.rasterize(moit.Volume(grid, transfer=table, step=50), CAMERA, SIZE)
    g = moit.rasterize(moit.Volume(grid, transfer=table[:1], step=50), CAMERA, SIZE)
    assert len(f.depth) and np.allclose(f.alpha, g.alpha) and np.allclose(f.color, g.color)


BAD = [
    ({"grid": np.ones((1, 2, 2))}, PrimitiveError, "grid: expected (X, Y, Z) or (X, Y, Z, 4)"),
    ({"grid": -np.ones((2, 2, 2))}, PrimitiveError, "grid[0, 0, 0, 0]: found -1.0; needed an ab"),
    ({"grid": np.full((2, 2, 2), np.nan)}, PrimitiveError, "grid[0, 0, 0]: found nan"),
    ({"spacing": 0}, PrimitiveError, "spacing[0]: found 0.0; needed a positive number"),
    ({"spacing": (1, 2)}, PrimitiveError, "spacing: expected shape () or (3,), got (2,)"),
    ({"step": 0}, PrimitiveError, "step: expected a positive number, got 0"),
    ({"step": 1e-9}, PrimitiveError, "step: found 1e-09; needed at least 2.64e-05"),
    ({"transfer": np.ones((3, 3))}, PrimitiveError, "transfer: expected shape (R, 4), got (3, 3)"),
    ({"transfer": lambda v: np.ones((9, 4))}, PrimitiveError, "expected shape (256, 4), got (9,"),
    ({"transfer": -np.ones((3, 4))}, PrimitiveError, "transfer[0, 0]: found -1.0"),
    ({"transfer": np.ones((3, 4)), "limits": (1, 1)}, PrimitiveError, "limits: expected (lower,"),
    ({"grid": np.ones((2, 2, 2, 4)), "transfer": [(1, 1, 1, 1)]}, TypeError, "transfer, limits"),
    ({"origin": (1, 2)}, PrimitiveError, "origin: expected shape (3,)"),
    ({"limits": (0, 1)}, TypeError, "limits: needed None where transfer is None"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "error", "message"), BAD)
def test_bad_arguments_are_named(options, error, message):
    with pytest.raises(error, match=re.escape(message)):
        moit.Volume(**{"grid": np.ones((2, 2, 2)), **options})
    with pytest.raises(ValueError, match="coplanar: expected None for volumes"):
        moit.rasterize(moit.Volume(np.ones((2, 2, 2))), CAMERA, SIZE, coplanar=0.1)


@pytest.mark.parametrize("kept", [0, 1 << 22])
def test_bands_of_rows_change_no_bit(kept, monkeypatch):
    """Whether what was counted is kept, or marched again."""
    rng = np.random.default_rng(1)
    fog = moit.Volume(rng.random(SIDES), SPACING, origin=ORIGIN, step=0.1)
    dense = moit.Volume(40 * rng.random((3, 3, 3)), 0.3, origin=(-0.2, -0.3, -0.4))  # some opaque
    ball = moit.Points([[0.2, 0.1, 0.2]], 0.2, alpha=0.5)
    size = (31, 75)
    for scene in (fog, [fog, ball, dense]):
        f = moit.rasterize(scene, CAMERA, size)
        whole = moit.render(scene, "power4", size, camera=CAMERA)
        with monkeypatch.context() as few:
            few.setattr(grids, "MOST_KEPT", kept)
            few.setattr(making, "MOST_AT_ONCE", len(f) // 5)
            banded = moit.render(scene, "power4", size, camera=CAMERA)
        assert np.array_equal(banded, whole)


def test_a_volume_is_held_in_bands(monkeypatch):
    """No more than a band is marched at once, and none twice while counting."""
    fog = moit.Volume(np.full(SIDES, 1.7), SPACING, origin=ORIGIN, step=0.05)
    marched, march = [], grids._marched

    def noted(one, frame, top, bottom):
        marched.append((top, bottom))
        return march(one, frame, top, bottom)

    monkeypatch.setattr(grids, "_marched", noted)
    monkeypatch.setattr(making, "MOST_AT_ONCE", 1)
    moit.render(fog, "power4", (8, 70), camera=CAMERA)
    assert marched == [(0, 32), (32, 64), (64, 70)]  # few: all of it was kept
    marched.clear()
    monkeypatch.setattr(grids, "MOST_KEPT", 0)
    moit.render(fog, "power4", (8, 70), camera=CAMERA)
    assert max(bottom - top for top, bottom in marched[3:]) <= 16  # rows of tiles
    assert sum(bottom - top for top, bottom in marched[3:]) == 70


def test_bands_add_up_in_what_a_picture_took(monkeypatch):
    """Pixels that overflow are those of all bands, and memory is the greatest band's."""
    grid = np.full((2, 2, 2, 4), 1e6)
    grid[..., 3] = 0.7
    fog = moit.Volume(grid, 1.0, origin=(-0.5, -0.5, -0.5), step=0.1)  # not in the lowest rows
    made = []
    for most in (making.MOST_AT_ONCE, 1):
        monkeypatch.setattr(making, "MOST_AT_ONCE", most)
        with pytest.warns(RuntimeWarning, match="pixels keep sums beyond"):
            made.append(moit.render(fog, "wboit(bits=16)", (8, 96), camera=CAMERA, report=True))
    whole, banded = made
    assert banded.overflows == whole.overflows > 200
    counts = moit.rasterize(fog, CAMERA, (8, 96)).counts.reshape(96, 8)
    assert banded.memory["fragments"] == 8 * (8 + 1) + (4 + 4 + 12) * counts.sum(axis=1).max()
