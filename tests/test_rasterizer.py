"""Triangles become fragments where a slow and plain rasteriser says so."""

import math
from fractions import Fraction

import numpy as np
import pytest
from readings import c, glsl

import moit
from moit.geometry.rasterizer import screen_triangles

SUBPIXELS = 256


def random_mesh(rng, triangles=40, alpha=None, spread=1.5) -> moit.Mesh:
    count = 3 * triangles
    return moit.Mesh(
        rng.uniform(-spread, spread, (count, 3)),
        np.arange(count).reshape(-1, 3),
        rng.random((count, 3)),
        rng.uniform(0.1, 0.9, count) if alpha is None else alpha,
        rng.normal(size=(count, 3)),
    )


def on_screen(camera: moit.Camera, size, vertices):
    """(V, 3): x and y in 1/256 pixel as integers, and z."""
    right, up, forward = camera.axes
    scale = camera.scale(size)
    out = []
    for vertex in vertices.astype(np.float64):
        away = vertex - np.array(camera.eye)
        x, y, z = (float(np.dot(axis, away)) for axis in (right, up, forward))
        out.append(
            (
                round(size[0] * (0.5 + 0.5 * scale[0] * x / z) * SUBPIXELS),
                round(size[1] * (0.5 - 0.5 * scale[1] * y / z) * SUBPIXELS),
                z,
            )
        )
    return out


def covers(a, b, p) -> bool:
    """Whether p lies to the right of the edge from a to b, or on it where it is top or left."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    side = dx * (p[1] - a[1]) - dy * (p[0] - a[0])
    return side > 0 or (side == 0 and (dy < 0 or (dy == 0 and dx > 0)))


def plainly(mesh: moit.Mesh, camera: moit.Camera, size) -> list[list[tuple[float, float]]]:
    """(z, alpha) of each pixel's fragments, by exact arithmetic; no triangle may need clipping."""
    corners = on_screen(camera, size, mesh.vertices)
    pixels = [[] for _ in range(size[0] * size[1])]
    for triangle in mesh.triangles:
        a, b, c = (corners[i] for i in triangle)
        alpha = [float(mesh.alpha[i]) for i in triangle]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        if area < 0:
            b, c, area = c, b, -area
            alpha[1:] = alpha[:0:-1]
        for y in range(size[1]):
            for x in range(size[0]):
                p = (SUBPIXELS * x + SUBPIXELS // 2, SUBPIXELS * y + SUBPIXELS // 2)
                if not (covers(a, b, p) and covers(b, c, p) and covers(c, a, p)):
                    continue
                parts = []
                for s, t in ((b, c), (c, a), (a, b)):
                    side = (t[0] - s[0]) * (p[1] - s[1]) - (t[1] - s[1]) * (p[0] - s[0])
                    parts.append(float(Fraction(side, area)))
                near = [part / corner[2] for part, corner in zip(parts, (a, b, c), strict=True)]
                z = 1 / sum(near)
                opacity = sum(n * one for n, one in zip(near, alpha, strict=True)) * z
                pixels[y * size[0] + x].append((z, opacity))
    return pixels


SIZE = (21, 37)  # no multiple of a tile
CAMERA = moit.Camera(eye=(0.3, 0.4, 5.0), up=(0.1, 1, 0), fov_y=0.6, near=0.5, far=50.0)


@pytest.mark.parametrize("seed", range(2))
def test_fragments_are_those_of_a_plain_rasterizer(seed):
    mesh = random_mesh(np.random.default_rng(seed))
    f = moit.rasterize(mesh, CAMERA, SIZE)
    expected = plainly(mesh, CAMERA, SIZE)
    assert f.shape == (37, 21)
    assert f.counts.tolist() == [len(pixel) for pixel in expected]
    z, alpha = np.array([one for pixel in expected for one in pixel]).T
    # float32's rounding of results that were computed in double
    np.testing.assert_allclose(f.depth, z, rtol=1e-7)
    np.testing.assert_allclose(f.alpha, alpha, rtol=1e-6)


def grid(rng, n: int, wobble: float) -> moit.Mesh:
    """A closed sheet of triangles round the origin, larger than the picture."""
    u, v = np.meshgrid(np.linspace(-4, 4, n), np.linspace(-4, 4, n))
    inner = (np.abs(u) < 4) & (np.abs(v) < 4)
    u, v = (one + wobble * inner * rng.uniform(-1, 1, one.shape) for one in (u, v))
    vertices = np.stack([u, v, np.zeros_like(u)], axis=-1).reshape(-1, 3)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate(
        [np.stack([i, i + 1, i + n], 1), np.stack([i + 1, i + n + 1, i + n], 1)]
    )
    return moit.Mesh(vertices, rng.permutation(triangles), alpha=0.5)


@pytest.mark.parametrize("wobble", [0.0, 0.15])
def test_a_sheet_covers_each_pixel_once(wobble):
    # without wobble many edges run through the middles of pixels
    sheet = grid(np.random.default_rng(7), 17, wobble)
    camera = moit.Camera(eye=(0, 0, 4), fov_y=math.pi / 2)
    f = moit.rasterize(sheet, camera, (64, 64))
    assert (f.counts == 1).all()
    np.testing.assert_allclose(f.depth, 4.0, rtol=1e-6)


def test_what_is_behind_the_eye_is_clipped():
    # a floor that runs from behind the eye to the horizon: z of a pixel follows from its row
    floor = moit.Mesh(
        [[-1e4, -1, 50], [1e4, -1, 50], [1e4, -1, -90], [-1e4, -1, -90]],
        [[0, 1, 2], [0, 2, 3]],
        alpha=0.5,
    )
    camera = moit.Camera(eye=(0, 0, 0), target=(0, 0, -1), fov_y=math.pi / 2, near=0.5, far=80.0)
    height = 32
    f = moit.rasterize(floor, camera, (8, height))
    down = (2 * np.arange(height) + 1) / height - 1  # y / z of a pixel's middle
    with np.errstate(divide="ignore"):
        z = np.where(down > 0, 1 / down, np.inf)
    seen = (z >= camera.near) & (z <= camera.far)
    assert f.counts.reshape(height, 8).tolist() == [[int(one)] * 8 for one in seen]
    # corners snap to 1/256 pixel, so the horizon moves by up to half of that
    half_step = 2 / height / SUBPIXELS / 2
    np.testing.assert_allclose(1 / f.depth, np.repeat(down[seen], 8), atol=1.01 * half_step)


def test_of_opaque_surfaces_the_nearest_is_kept_and_hides_the_rest():
    rng = np.random.default_rng(3)
    walls = [random_mesh(rng, 20, alpha=1.0) for _ in range(2)]
    glass = random_mesh(rng, 40)
    f = moit.rasterize([walls[0], glass, walls[1]], CAMERA, SIZE)
    opaque = [plainly(one, CAMERA, SIZE) for one in walls]
    clear = plainly(glass, CAMERA, SIZE)
    hidden = 0
    for p, (wall, through) in enumerate(zip(map(list.__add__, *opaque), clear, strict=True)):
        nearest = min((z for z, _ in wall), default=np.inf)
        own = slice(f.offsets[p], f.offsets[p + 1])
        expected = [z for z, _ in through if np.float32(z) <= np.float32(nearest)]
        hidden += len(through) - len(expected)
        if wall:
            expected = [nearest, *expected]
        # opaque depths beyond the range of what is transparent are held at its ends
        inside = np.clip(expected, *f.depth_range)
        np.testing.assert_allclose(f.depth[own], inside, rtol=1e-6)
        assert (f.alpha[own] == 1).sum() == bool(wall)
    assert hidden > 100


def test_screen_triangles_are_what_is_drawn():
    # among them some that the eye's plane and the guard band cut
    rng = np.random.default_rng(5)
    eye = moit.Camera(eye=(0.2, 0.1, 0.4), fov_y=1.0, near=0.01, far=50.0)
    mesh = random_mesh(rng, 60, rng.choice([0.5, 1.0], 60).repeat(3))
    found = screen_triangles([mesh], eye, *SIZE)
    assert found.itemsize == 224
    assert (np.diff(found["source"]) >= 0).all() and (np.diff(found["source"]) == 0).any()
    opaque = ~mesh.transparent[found["source"]]
    np.testing.assert_array_equal(found["opaque"], opaque)
    depths = [[] for _ in range(SIZE[0] * SIZE[1])]
    for t in found[~opaque]:
        corners = [(int(x), int(y)) for x, y in zip(t["x"], t["y"], strict=True)]
        a, b, c = corners
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        assert area > 0
        for y in range(SIZE[1]):
            for x in range(SIZE[0]):
                p = (SUBPIXELS * x + SUBPIXELS // 2, SUBPIXELS * y + SUBPIXELS // 2)
                if not (covers(a, b, p) and covers(b, c, p) and covers(c, a, p)):
                    continue
                near = 0.0
                for i, (s, e) in enumerate(((b, c), (c, a), (a, b))):
                    side = (e[0] - s[0]) * (p[1] - s[1]) - (e[1] - s[1]) * (p[0] - s[0])
                    near += side / area * t["inverse_z"][i]
                if eye.near * (1 - 1e-12) <= 1 / near <= eye.far:
                    depths[y * SIZE[0] + x].append(1 / near)
    glass = moit.Mesh(
        mesh.vertices, mesh.triangles[mesh.transparent], mesh.color, mesh.alpha, mesh.normals
    )
    f = moit.rasterize(glass, eye, SIZE)
    assert f.counts.tolist() == [len(pixel) for pixel in depths]
    np.testing.assert_allclose(f.depth, np.concatenate(depths), rtol=1e-6)


def test_light_falls_on_both_sides():
    square = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    camera = moit.Camera(eye=(0, 0, 3))
    pictures = [
        moit.rasterize(moit.Mesh(square, corners, (0.2, 0.4, 0.8), 0.5, normals), camera, (9, 9))
        for corners in ([[0, 1, 2], [0, 2, 3]], [[0, 2, 1], [0, 3, 2]])
        for normals in (None, [[0, 0, 1]] * 4, [[0, 0, -5]] * 4)
    ]
    for one in pictures:
        np.testing.assert_allclose(one.color, pictures[0].color, rtol=1e-6)
    light = pictures[0].color / np.array([0.2, 0.4, 0.8])
    assert (light > 0.25).all() and (light <= 1).all()
    np.testing.assert_allclose(light, np.broadcast_to(light[:, :1], light.shape), rtol=1e-6)


def test_without_lights_it_comes_from_the_upper_left_and_a_surface_that_faces_it_is_all_lit():
    """x to the right, y up and z toward the eye: light travels along (.48, -.64, -.6)."""
    colour, square = np.array([0.2, 0.4, 0.8]), [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    for toward, share in (
        ((-0.48, 0.64, 0.6), 1.0),
        ((0, 0, 1), 0.6),
        ((0.8, 0.6, 0), 0.0),  # along the light
        ((-0.6, 0.0, 0.8), 0.768),
    ):
        mesh = moit.Mesh(square, [[0, 1, 2], [0, 2, 3]], colour, 0.5, [toward] * 4)
        f = moit.rasterize(mesh, moit.Camera(eye=(0, 0, 3)), (1, 1))
        expected = np.broadcast_to(colour * (0.25 + 0.75 * share), f.color.shape)
        np.testing.assert_allclose(f.color, expected, rtol=2e-6)


def test_depth_range_follows_the_transparent_sphere_alone():
    ball = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    faces = [[a, b, c] for a in (0, 1) for b in (2, 3) for c in (4, 5)]
    glass = moit.Mesh(ball, faces, alpha=0.5)
    wall = moit.Mesh(ball * 30 - [0, 0, 40], faces)
    for eye in (4.0, 5.0, 6.5):
        camera = moit.Camera(eye=(0, 0, eye))
        with_wall = moit.rasterize([wall, glass], camera, (32, 32))
        np.testing.assert_allclose(with_wall.depth_range, (eye - 1, eye + 1), rtol=1e-6)
    assert moit.rasterize(wall, camera, (32, 32)).depth_range[1] > 15


def test_the_bits_do_not_depend_on_threads():
    mesh = random_mesh(np.random.default_rng(1), 300)
    one, *others = (
        moit.rasterize(mesh, CAMERA, (150, 130), threads=threads) for threads in (1, 2, 5)
    )
    for other in others:
        for name in ("offsets", "depth", "alpha", "color"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_meshes_are_drawn_in_their_order():
    mesh = random_mesh(np.random.default_rng(2), 10)
    backward = moit.Mesh(mesh.vertices, mesh.triangles[::-1], mesh.color, mesh.alpha, mesh.normals)
    one, other = (moit.rasterize(m, CAMERA, SIZE) for m in (mesh, backward))
    for p in range(len(one.counts)):
        own = slice(one.offsets[p], one.offsets[p + 1])
        np.testing.assert_array_equal(one.depth[own], other.depth[own][::-1])
    np.testing.assert_allclose(
        moit.composite(one, "sorted"), moit.composite(other, "sorted"), atol=1e-6
    )


def test_empty_meshes_and_slivers_give_no_fragments():
    nothing = moit.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert len(moit.rasterize(nothing, CAMERA, (5, 4))) == 0
    assert len(moit.rasterize([], CAMERA, (5, 4))) == 0
    line = moit.Mesh([[0, 0, 0], [1, 1, 0], [0.5, 0.5, 0]], [[0, 1, 2], [0, 0, 1]], alpha=0.5)
    assert len(moit.rasterize(line, CAMERA, (50, 40))) == 0
    behind = moit.Mesh([[0, 0, 9], [1, 0, 9], [0, 1, 9]], [[0, 1, 2]])
    assert len(moit.rasterize(behind, CAMERA, (50, 40))) == 0


def test_a_cropped_frustum_of_huge_triangles_is_filled():
    # corners a million pixels away: the guard band clips, and coverage stays whole
    far = 1e5
    huge = moit.Mesh([[-far, -far, 0], [far, -far, 0], [0, far, 0]], [[0, 1, 2]], alpha=0.25)
    f = moit.rasterize(huge, moit.Camera(eye=(0, 0, 2)), (40, 30))
    assert (f.counts == 1).all()
    np.testing.assert_allclose(f.alpha, 0.25, rtol=1e-6)
    np.testing.assert_allclose(f.depth, 2.0, rtol=1e-5)


@pytest.mark.parametrize("dtype", [np.float32, np.float64], ids=["float32", "float64"])
def test_points_of_surfaces_are_the_same_bits_in_glsl(dtype):
    rng = np.random.default_rng(0)
    n = 5000
    weights = rng.dirichlet([1, 1, 1], n)[:, 1:]
    asked = np.hstack(
        [weights, rng.uniform(0.01, 10, (n, 3)), rng.normal(size=(n, 12)), rng.normal(size=(n, 2))]
    ).astype(dtype)
    asked[0, 8:17] = 0  # no normal at all
    found = c.surface_points(asked)
    np.testing.assert_array_equal(glsl.surface_points(asked), found)
    assert (found[:, 2] >= dtype(0.25)).all() and (found[:, 2] <= 1 + 1e-6).all()
