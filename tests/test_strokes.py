"""Points and lines as fragments, held to families of discs and balls that rays meet one by one."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

import moit
from moit import PrimitiveError
from moit.geometry import rasterizer
from moit.geometry.drawing import Drawable
from moit.rendering import making

SIZE = (64, 48)
CAMERA = moit.Camera(eye=(0.2, 0.1, 3))
BEND = [[-0.9, -0.4, 0.3], [0.1, 0.5, -0.6], [0.9, -0.3, 0.4], [0.7, -0.6, 1.2]]
ARRAYS = ("offsets", "depth", "alpha", "color")
SHADES = [[0.9, 0.1, 0.1], [0.1, 0.8, 0.2], [0.2, 0.3, 0.9], [1, 1, 0]]


def some_lines(count=40, parts=30, seed=0, **options):
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, parts)[:, None]
    turn, phase = rng.normal(size=(count, 1, 3)) * 4, rng.uniform(0, 6, (count, 1, 3))
    points = np.sin(turn * t + phase).reshape(-1, 3)
    colors = rng.random((count * parts, 3))
    how = {"radius": 0.02, "alpha": rng.random(count * parts)} | options
    return moit.Lines(points, np.arange(count + 1) * parts, color=colors, **how)


def seen(points, camera=CAMERA):
    return (np.asarray(points, float) - camera.eye) @ camera.axes.T


def slopes(at, size=SIZE, camera=CAMERA):
    """(.., 2) of places (x, y) in pixels."""
    across, along = camera.scale(size)
    x, y = np.asarray(at, float).T
    return np.stack([(2 * x / size[0] - 1) / across, (1 - 2 * y / size[1]) / along], axis=-1)


MIDDLES = np.stack(np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5), -1).reshape(-1, 2)


def family(nodes, radii, steps=400):
    """Discs or balls on their way along a line: middles as the eye sees them, and radii."""
    t = np.linspace(0, 1, steps)[:, None]
    pairs = list(zip(range(len(nodes) - 1), range(1, len(nodes)), strict=True)) or [(0, 0)]
    at, radii = seen(nodes), np.asarray(radii, float)
    middles = np.concatenate([at[a] + t * (at[b] - at[a]) for a, b in pairs])
    return middles, np.concatenate([radii[a] + t[:, 0] * (radii[b] - radii[a]) for a, b in pairs])


def nearest_ball(slope, middles, radii):
    """How far away the ray meets the first of the balls; infinity where it meets none."""
    d = np.append(slope, 1.0)
    square, half = d @ d, middles @ d
    inside = half**2 - square * ((middles**2).sum(axis=1) - radii**2)
    met = inside >= 0
    return ((half[met] - np.sqrt(inside[met])) / square).min(initial=np.inf)


def test_they_are_drawable():
    assert isinstance(some_lines(2), Drawable)
    assert isinstance(moit.Points(BEND, 0.1), Drawable)


@pytest.mark.parametrize("radii", [[0.1] * 4, [0.3, 0.02, 0.15, 0.25]])
def test_a_ribbon_is_what_a_disc_leaves(radii):
    line = moit.Lines(BEND, radius=radii, alpha=0.5)
    f = moit.rasterize(line, CAMERA, SIZE)
    middles, wide = family(BEND, radii)
    away = np.linalg.norm(
        middles[:, None, :2] - slopes(MIDDLES)[None] * middles[:, None, 2:], axis=-1
    ) - wide[:, None]  # fmt: skip
    least = away.min(axis=0)
    counts = np.diff(f.offsets)
    sure = np.abs(least) > 1e-4
    np.testing.assert_array_equal(counts[sure] > 0, least[sure] < 0)
    assert (counts > 0).sum() > 150
    # the depth is that of some disc that covers the pixel
    for pixel in np.flatnonzero((counts == 1) & sure):
        there = middles[away[:, pixel] <= 1e-4, 2]
        assert there.min() - 1e-2 <= f.depth[f.offsets[pixel]] <= there.max() + 1e-2


@pytest.mark.parametrize("radii", [[0.1] * 4, [0.3, 0.02, 0.15, 0.25]])
def test_a_tube_is_what_rays_meet_of_balls(radii):
    line = moit.Lines(BEND, radius=radii, alpha=0.5, shape="tube")
    f = moit.rasterize(line, CAMERA, SIZE)
    middles, wide = family(BEND, radii)
    expected = np.array([nearest_ball(slope, middles, wide) for slope in slopes(MIDDLES)])
    counts = np.diff(f.offsets)
    wrong = (counts > 0) != np.isfinite(expected)
    assert wrong.sum() <= 3  # what a ray just touches
    there = np.flatnonzero(~wrong & (counts > 0))
    found = np.minimum.reduceat(f.depth, f.offsets[there])
    assert len(there) > 150
    np.testing.assert_allclose(found, expected[there], atol=5e-3)


def test_discs_and_spheres_are_what_rays_meet():
    places = [[0, 0, 0], [0.8, 0.5, -1], [-0.9, -0.6, 1.5]]
    for shape in ("disc", "sphere"):
        for place in places:
            f = moit.rasterize(moit.Points([place], 0.3, alpha=0.5, shape=shape), CAMERA, SIZE)
            (middle,), (wide,) = (one[:1] for one in family([place], [0.3]))
            depth = np.full(len(MIDDLES), np.inf)
            for i, slope in enumerate(slopes(MIDDLES)):
                if shape == "sphere":
                    depth[i] = nearest_ball(slope, middle[None], np.array([wide]))
                elif np.linalg.norm(middle[:2] - slope * middle[2]) <= wide:
                    depth[i] = middle[2]
            np.testing.assert_array_equal(np.diff(f.offsets), np.isfinite(depth))
            np.testing.assert_allclose(f.depth, depth[np.isfinite(depth)], rtol=1e-6)


def test_what_is_as_wide_as_pixels_is_so_at_every_distance():
    across = [[-9, 0, 0], [9, 0, -8]]
    for wide in (0.3, 1.0, 5.5):
        f = moit.rasterize(
            moit.Lines(across, pixels=wide), moit.Camera(), SIZE, antialias=True
        )  # of each column as much
        pixels = np.repeat(np.arange(64 * 48), np.diff(f.offsets))
        columns = np.bincount(pixels % 64, f.alpha, 64)
        np.testing.assert_allclose(columns, wide, atol=0.07)


@pytest.mark.parametrize("shape", ["disc", "sphere"])
def test_coverage_is_the_area(shape):
    camera = moit.Camera()
    for radius in (0.01, 0.04, 0.3):
        point = moit.Points([[0.011, 0.023, 0]], radius, shape=shape)
        f = moit.rasterize(point, camera, SIZE, antialias=True)
        wide = radius * camera.scale(SIZE)[1] * 24 / 3
        # a few pixels have an edge, which may take a sample more or less of each
        np.testing.assert_allclose(f.alpha.sum(), np.pi * wide**2, rtol=0.01, atol=5 / 64)
        assert np.diff(f.offsets).max() == 1


@pytest.mark.parametrize("shape", ["ribbon", "tube"])
@pytest.mark.parametrize("antialias", [False, True])
def test_joints_do_not_count_twice(shape, antialias):
    ends = np.array([[-0.9, -0.5, 0.8], [0.9, 0.6, -0.5]])
    how = {"radius": 0.03, "alpha": 0.5, "shape": shape}
    whole = moit.Lines(ends, **how)
    # some of the parts are shorter than a pixel, and one has no length
    t = np.concatenate([np.linspace(0, 0.4, 150), [0.4], np.linspace(0.5, 1, 5)])[:, None]
    parted = moit.Lines(ends[0] + t * (ends[1] - ends[0]), **how)
    a, b = (moit.rasterize(one, CAMERA, SIZE, antialias=antialias) for one in (whole, parted))
    assert np.diff(b.offsets).max() == 1
    np.testing.assert_array_equal(a.offsets, b.offsets)
    np.testing.assert_allclose(a.alpha, b.alpha, atol=1e-6 if not antialias else 0.5 / 60)
    np.testing.assert_allclose(a.depth, b.depth, atol=2e-3 if not antialias else 2e-2)


def test_a_bend_is_one_surface():
    corner = moit.Lines([[-0.8, -0.5, 0], [0, 0.6, 0], [0.3, -0.6, 0]], pixels=7, alpha=0.5)
    f = moit.rasterize(corner, moit.Camera(), SIZE, antialias=True)
    assert np.diff(f.offsets).max() == 1
    assert f.alpha.max() == 0.5


def test_what_comes_back_at_another_depth_is_another_layer():
    for depth, layers in ((0.01, 1), (1.0, 2)):
        back = moit.Lines([[-1, 0, 0], [0.5, 0, 0], [-1, 0.01, -depth]], radius=0.05, alpha=0.5)
        counts = np.diff(moit.rasterize(back, moit.Camera(), SIZE).offsets)
        assert counts.max() == layers
        # at the joint it is one
        middle = counts.reshape(48, 64)[23:25]
        last = np.flatnonzero(middle.max(axis=0))[-1]
        assert (middle[:, last - 1 : last + 1] == 1).all()


def test_a_line_that_crosses_itself_is_two_layers_there():
    cross = [[-1, -1, 0], [1, 1, 0], [1, -1, 0], [-1, 1, 0]]
    counts = np.diff(moit.rasterize(moit.Lines(cross, radius=0.1), moit.Camera(), SIZE).offsets)
    twice = np.flatnonzero(counts.reshape(48, 64) == 2)
    assert counts.max() == 2 and len(twice)
    assert np.abs(twice // 64 - 23.5).max() < 4 and np.abs(twice % 64 - 31.5).max() < 4


def test_a_closed_line_has_no_seam():
    turn = np.linspace(0, 2 * np.pi, 13)
    ring = 0.6 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    ring[-1] = ring[0]
    for radius in (0.01, 0.1):
        closed = moit.Lines(ring, radius=radius, alpha=0.5)
        f = moit.rasterize(closed, moit.Camera(), SIZE, antialias=True)
        assert np.diff(f.offsets).max() == 1
    # even where all of it is in a pixel
    small = moit.Lines(ring * 0.4, radius=0.1, alpha=0.5)
    f = moit.rasterize(small, moit.Camera(), (3, 3), antialias=True)
    assert np.diff(f.offsets).max() == 1
    # an open one that ends elsewhere meets itself as it does
    apart = moit.Lines(ring * [[1, 1, 1]] + turn[:, None] * [[0, 0, 0.03]], radius=0.05, alpha=0.5)
    assert np.diff(moit.rasterize(apart, moit.Camera(), SIZE).offsets).max() == 2


def test_a_closed_line_of_parts_shorter_than_pixels_has_no_seam():
    """A pixel's layer begins the line though later parts have joined it."""
    turn = np.linspace(0, 2 * np.pi, 1201)
    ring = 0.6 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    ring[-1] = ring[0]
    closed = moit.Lines(ring, radius=0.02, alpha=0.5)
    f = moit.rasterize(closed, moit.Camera(), SIZE, antialias=True)
    assert np.diff(f.offsets).max() == 1


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_layer_reaches_as_far_as_all_of_its_parts(sign):
    """A steep part, a level one, and one that comes back to the depth of the first."""
    end = sign * 0.2
    points = [[-0.06, 0, sign], [0, 0, 0], [0.5, 0, end], [-0.5 * (3 - end) / 3, 0, end]]
    line = moit.Lines(points, radius=0.01, alpha=0.5, shape="ribbon")
    f = moit.rasterize(line, moit.Camera(), SIZE, antialias=True)
    counts = np.diff(f.offsets).reshape(48, 64)[23:25]
    assert counts[:, 31].max() == 1  # where the first two meet
    assert counts[:, 33:40].max() == 2


def test_between_points_all_is_interpolated_in_the_scene():
    ends = [[-0.5, 0, 1], [0.5, 0, -3]]
    line = moit.Lines(ends, pixels=1, color=[[1, 0, 0], [0, 1, 0]], alpha=[0.25, 0.75])
    f = moit.rasterize(line, moit.Camera(), (65, 65))
    share = (f.depth - 2) / 4  # from depth 2 to depth 6
    np.testing.assert_allclose(f.alpha, 0.25 + 0.5 * share, atol=1e-5)
    np.testing.assert_allclose(f.color[:, 1], share, atol=1e-5)
    assert np.ptp(share) > 0.9


def test_light_falls_on_spheres_as_on_triangles():
    lights = [((-1, -1, -2), (0.5, 0.6, 0.7)), ((0, -1, 0), (0.2, 0.1, 0.0))]
    for given in ((), lights):
        ball = moit.Points([[0, 0, 0]], 0.8, (0.5, 0.4, 0.3), shape="sphere")
        f = moit.rasterize(ball, moit.Camera(), (33, 33), lights=given)
        pixel = 16 * 33 + 16  # its normal is that of a facet to the eye
        facet = moit.Mesh([[-1, -1, 0.8], [1, -1, 0.8], [0, 1, 0.8]], [[0, 1, 2]], (0.5, 0.4, 0.3))
        g = moit.rasterize(facet, moit.Camera(), (33, 33), lights=given)
        found, expected = (one.color[one.offsets[pixel]] for one in (f, g))
        np.testing.assert_allclose(found, expected, rtol=1e-6)
        assert np.ptp(f.color[:, 0]) > 0.1
    unlit = moit.Points([[0, 0, 0]], 0.8, (0.5, 0.4, 0.3), shape="sphere", lit=False)
    assert np.ptp(moit.rasterize(unlit, moit.Camera(), (33, 33)).color, axis=0).max() == 0


def test_shadows_fall_on_tubes():
    roof = moit.Mesh([[-1, 1, 1], [0, 1, 1], [0, 1, -1], [-1, 1, -1]], [[0, 1, 2], [0, 2, 3]])
    pipe = moit.Lines([[-0.9, 0, 0], [0.9, 0, 0]], radius=0.2, shape="tube", color=(1, 1, 1))
    sun = moit.Light((0, -1, 0), shadows=moit.ShadowMap(roof, "sorted", light=(0, -1, 0)))
    f = moit.rasterize(pipe, CAMERA, SIZE, lights=[sun])
    pixels = np.repeat(np.arange(64 * 48) % 64, np.diff(f.offsets))
    left, right = f.color[(pixels > 11) & (pixels < 26)].max(), f.color[pixels > 38].max()
    assert left == pytest.approx(0.25, abs=1e-6)
    assert right > 0.9


def test_triangles_alone_throw_shadows_in_a_scene_of_all_kinds():
    roof = moit.Mesh([[-1, 1, 1], [0, 1, 1], [0, 1, -1], [-1, 1, -1]], [[0, 1, 2], [0, 2, 3]])
    pipe = moit.Lines([[-0.9, 0, 0], [0.9, 0, 0]], radius=0.2, shape="tube", alpha=0.5)
    fog = moit.Volume(np.ones((2, 2, 2)), origin=(-0.5, -0.5, -0.5))
    ball = moit.Splats([[0.5, 0.5, 0]], [0.2], [[1, 0, 0, 0]], [0.9])
    scene = [pipe, roof, fog, ball]
    found, expected = (
        moit.rasterize(scene, CAMERA, SIZE, lights=[moit.Light((0, -1, 0), shadows=shadows)])
        for shadows in ("sorted", moit.ShadowMap(roof, "sorted", light=(0, -1, 0)))
    )
    np.testing.assert_array_equal(found.color, expected.color)


@pytest.mark.parametrize("shape", ["ribbon", "tube"])
def test_threads_and_bands_change_no_bit(shape, monkeypatch):
    lines = some_lines(shape=shape)
    roof = moit.Mesh([[-1, 1, 1], [0, 1, 1], [0, 1, -1], [-1, 1, -1]], [[0, 1, 2], [0, 2, 3]])
    sun = moit.Light((0, -1, 0), shadows=moit.ShadowMap(roof, "sorted", light=(0, -1, 0)))
    how = {"antialias": True, "lights": [sun]}
    one = moit.rasterize(lines, CAMERA, SIZE, threads=1, **how)
    other = moit.rasterize(lines, CAMERA, SIZE, threads=5, **how)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    expected = moit.composite(one, "sorted")
    monkeypatch.setattr(making, "MOST_AT_ONCE", 300)
    monkeypatch.setattr(rasterizer, "TILE", 5)
    bands = moit.render(lines, "sorted", SIZE, camera=CAMERA, report=True, **how)
    np.testing.assert_array_equal(bands.image, expected)
    assert bands.memory["fragments"] < 0.5 * (one.offsets.nbytes + 20 * len(one))


def test_they_are_drawn_among_others_in_their_order():
    wall = moit.Mesh([[-9, -9, -1], [9, -9, -1], [0, 9, -1]], [[0, 1, 2]], (0.2, 0.6, 0.3))
    pane = moit.Mesh([[-9, -9, 1], [9, -9, 1], [0, 9, 1]], [[0, 1, 2]], (0.2, 0.2, 0.9), 0.4)
    splat = moit.Splats([[0, 0, 0.5]], [0.3], [[1, 0, 0, 0]], [0.7])
    line = moit.Lines([[-1, 0, 0], [1, 0, 0]], radius=0.2, alpha=0.5)
    hidden = moit.Points([[0, 0, -2]], 0.5, (1, 0, 0))
    scene = [hidden, line, pane, splat, wall, moit.Points([[0, 0, 0.8]], pixels=4, alpha=0.3)]
    f = moit.rasterize(scene, moit.Camera(), (9, 9))
    some = slice(f.offsets[40], f.offsets[41])
    np.testing.assert_allclose(f.depth[some], [5, 3, 2, 2.5, 4, 2.2], rtol=1e-6)
    found = moit.render(scene, "sorted", (9, 9), camera=moit.Camera())
    np.testing.assert_array_equal(found, moit.composite(f, "sorted"))
    without = moit.render(scene[1:], "sorted", (9, 9), camera=moit.Camera())
    np.testing.assert_allclose(found, without, atol=1e-6)


def test_what_is_behind_or_beside_the_eye_is_cut_off():
    through = moit.Lines([[0, -0.2, 9], [0, -0.2, -3]], radius=0.1, alpha=0.5, shape="tube")
    f = moit.rasterize(through, moit.Camera(), SIZE, antialias=True)
    assert len(f)
    assert f.depth.min() >= 0.1
    inside = moit.Points([[0, 0, 3]], 0.5, shape="sphere")
    assert not len(moit.rasterize(inside, moit.Camera(), SIZE))
    for shape in ("ribbon", "tube"):
        far = moit.Lines([[1e38, 0, -1e38], [-1e38, 1e30, 0]], radius=1e38, shape=shape)
        moit.rasterize(far, moit.Camera(), SIZE, antialias=True)
        far = moit.Lines([[0, 0, -50], [0, 0, -5000]], pixels=3, shape=shape)
        assert moit.rasterize(far, moit.Camera(), SIZE).depth.max() <= 100


def test_none_give_none():
    nothing = np.zeros((0, 3))
    for one in (moit.Points(nothing, 1.0), moit.Lines(nothing, pixels=2)):
        assert len(one) == 0
        assert not len(moit.rasterize(one, CAMERA, SIZE))
    lines = moit.Lines(BEND[:2], [0, 0, 1, 1, 2], pixels=9)
    assert len(moit.rasterize(lines, CAMERA, SIZE)) > 20  # two dots


def test_opaque_ones_are_transparent_at_their_edges_only():
    line = moit.Lines(BEND, radius=0.2)
    f = moit.rasterize(line, CAMERA, SIZE, antialias=True)
    assert (f.alpha == 1).sum() > 100
    assert ((f.alpha > 0) & (f.alpha < 1)).sum() > 50
    assert f.depth_range[0] <= f.depth.min()
    assert f.depth_range[1] >= f.depth.max()
    assert np.ptp(f.depth) > 1.0


CLOUD = SimpleNamespace(
    points=np.array(BEND),
    verts=np.array([1, 2, 1, 0]),
    lines=np.array([3, 0, 1, 2, 2, 3, 1]),
    faces=np.zeros(0, np.int64),
    point_data=SimpleNamespace(active_scalars=(255 * np.array(SHADES)).round().astype(np.uint8)),
)


def test_polydata_are_taken_as_they_are():
    points = moit.Points(CLOUD, pixels=[1, 2, 3, 4])
    np.testing.assert_array_equal(points.positions, np.array(BEND)[[2, 0]])
    np.testing.assert_array_equal(points.sizes, [1.5, 0.5])
    lines = moit.Lines(CLOUD, radius=0.1, alpha=[0.1, 0.2, 0.3, 0.4])
    np.testing.assert_array_equal(lines.first, [0, 3, 5])
    np.testing.assert_array_equal(lines.positions, np.array(BEND)[[0, 1, 2, 3, 1]])
    np.testing.assert_allclose(lines.alpha, [0.1, 0.2, 0.3, 0.4, 0.2])
    assert lines.color[3, 0] == 1
    assert lines.color[3, 2] == 0
    assert moit.Lines(CLOUD, radius=0.1, color=(0, 0, 1)).color[3, 2] == 1
    with pytest.raises(moit.MeshError, match=r"needed moit.Lines\(mesh"):
        moit.rasterize(CLOUD, CAMERA, SIZE)
    with pytest.raises(TypeError, match="offsets: needed None"):
        moit.Lines(CLOUD, [0, 5], radius=1)
    broken = SimpleNamespace(points=np.array(BEND), lines=np.array([2, 0, 4]))
    with pytest.raises(moit.PrimitiveError, match="lines: found indices beyond the 4 points"):
        moit.Lines(broken, radius=1)


BAD = [
    ({}, TypeError, "radius, pixels: needed one of the two, found neither"),
    ({"radius": 1, "pixels": 1}, TypeError, "found both"),
    (
        {"radius": -1},
        PrimitiveError,
        r"radius[0]: found -1.0; needed a number that is not negative",
    ),
    ({"radius": [1, 2]}, PrimitiveError, "radius: expected shape () or (4,), got (2,)"),
    ({"radius": 1, "alpha": 1.5}, PrimitiveError, "alpha[0]: found 1.5; needed a number in [0, 1]"),
    ({"radius": 1, "color": (1.0, 0.5)}, PrimitiveError, "color: expected shape (3,) or (4, 3)"),
    ({"radius": 1, "points": np.nan * np.ones((4, 3))}, PrimitiveError, "points[0, 0]: found nan"),
    ({"radius": 1, "points": BEND[0]}, PrimitiveError, "points: expected shape (N, 3), got (3,)"),
    (
        {"radius": 1, "shape": "disc"},
        PrimitiveError,
        "shape: expected 'ribbon', 'tube', got 'disc'",
    ),
    ({"radius": 1, "lit": 1}, TypeError, "lit: expected True or False"),
    ({"radius": 1, "offsets": [0, 3]}, PrimitiveError, "offsets: found 0 to 3; needed 0 to 4"),
    ({"radius": 1, "offsets": [0, 3, 2, 4]}, PrimitiveError, "offsets[2]: found 2 after 3"),
    ({"radius": 1, "offsets": [0.0, 4]}, TypeError, "offsets: expected integers"),
    ({"radius": 1, "offsets": [[0, 4]]}, PrimitiveError, "offsets: expected shape (L + 1,)"),
    ({"radius": 1, "color_space": "lab"}, PrimitiveError, "color_space: expected 'linear'"),
]


@pytest.mark.parametrize(("options", "error", "message"), BAD)
def test_bad_arguments_are_named(options, error, message):
    with pytest.raises(error, match=re.escape(message)):
        moit.Lines(**{"points": BEND, **options})


def test_they_do_not_change():
    line = moit.Lines(BEND, radius=0.1)
    with pytest.raises(AttributeError, match="Lines do not change"):
        line.lit = False
    assert not line.positions.flags.writeable
    assert repr(line) == "Lines(1, of 4 points, 'ribbon')"


def test_coverage_asks_for_the_cpu_and_for_no_coplanar_surfaces():
    line = moit.Lines(BEND, radius=0.1)
    with pytest.raises(ValueError, match="coplanar: expected None with antialias"):
        moit.rasterize(line, CAMERA, SIZE, antialias=True, coplanar=0.1)
    with pytest.raises(TypeError, match="antialias: expected True or False"):
        moit.rasterize(line, CAMERA, SIZE, antialias=1)
