"""Coverage of pixels by triangles: areas, and no seams between neighbours."""

import gpu
import numpy as np
import pytest

import moit
from moit import _core
from moit.geometry.meshes import mesh_arrays, seen_in

SIZE = (40, 30)
CAMERA = moit.Camera()
ARRAYS = ("offsets", "depth", "alpha", "color")
# how many units a pixel spans at the distance of 3
PIXEL = 3 * 2 / CAMERA.scale(SIZE)[1] / SIZE[1]


def fan(count, radius, alpha=0.5, turns=False):
    """A polygon of triangles round its middle; turns: every other one the other way."""
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
    rim = radius * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    triangles = [(0, 1 + i, 1 + (i + 1) % count) for i in range(count)]
    if turns:
        triangles = [t if i % 2 else (t[0], t[2], t[1]) for i, t in enumerate(triangles)]
    middle = np.array([0.013, 0.021, 0])
    vertices = np.concatenate([middle[None], rim + middle])
    return moit.Mesh(vertices, triangles, alpha=alpha)


def drawn(scene, size=SIZE, camera=CAMERA, **options):
    return moit.rasterize(scene, camera, size, antialias=True, **options)


def test_a_triangle_has_its_area():
    for size in (0.02, 0.3, 1.5):
        corners = np.array([[-0.4, -0.3, 0], [0.5, -0.1, 0], [0.1, 0.6, 0]]) * size
        f = drawn(moit.Mesh(corners, [[0, 1, 2]]))
        a, b = corners[1] - corners[0], corners[2] - corners[0]
        area = abs(a[0] * b[1] - a[1] * b[0]) / 2 / PIXEL**2
        # corners move by up to half of 1/256 pixel
        assert f.alpha.sum() == pytest.approx(area, rel=0.02 if size < 0.1 else 2e-3)
        assert ((f.alpha == 1).sum() > 0) == (size >= 0.3)


def test_depths_are_those_of_the_middle_of_what_is_covered():
    corners = np.array([[-0.8, -0.7, 0.9], [0.9, -0.5, -0.8], [0.1, 0.8, 0.3]])
    f = drawn(moit.Mesh(corners, [[0, 1, 2]]), SIZE)
    side, (width, height) = 32, SIZE
    right, up, forward = CAMERA.axes
    across, along = CAMERA.scale(SIZE)
    y, x = (np.mgrid[: height * side, : width * side] + 0.5) / side

    def rays(x, y):
        places = (2 * x / width - 1) / across, (1 - 2 * y / height) / along
        return places[0][..., None] * right + places[1][..., None] * up + forward

    sides = [np.cross(corners[k] - CAMERA.eye, corners[k - 1] - CAMERA.eye) for k in range(3)]
    inside = np.stack([rays(x, y) @ one for one in sides])
    covered = (inside > 0).all(axis=0) | (inside < 0).all(axis=0)

    def sums(values):
        return values.reshape(height, side, width, side).sum(axis=(1, 3)).ravel()

    count = sums(covered * 1.0)
    pixel = np.repeat(np.arange(width * height), f.counts)
    some = count[pixel] > 0.1 * side**2
    middle = [sums(one * covered)[pixel] / np.maximum(count[pixel], 1) for one in (x, y)]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    plane = (corners[0] - CAMERA.eye) @ normal / (rays(*middle) @ normal)
    assert some.sum() > 100 and (count[pixel][some] < side**2).sum() > 30
    np.testing.assert_allclose(f.depth[some], plane[some], rtol=2e-3)


def test_pixels_of_an_edge_are_cut_by_it():
    slope = 0.37
    half = moit.Mesh([[-9, -9 * slope, 0], [9, 9 * slope, 0], [9, -40, 0]], [[0, 1, 2]], alpha=0.8)
    f = drawn(half)
    found = np.zeros(SIZE[0] * SIZE[1])
    found[np.repeat(np.arange(len(found)), np.diff(f.offsets))] = f.alpha / 0.8
    fine = (np.arange(100) + 0.5) / 100
    y, x = np.mgrid[:30, :40]
    points = (x[..., None, None] + fine - 20) * slope + (y[..., None, None] + fine[:, None] - 15)
    np.testing.assert_allclose(found.reshape(30, 40), (points > 0).mean(axis=(2, 3)), atol=6e-3)


@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("alpha", [0.5, 1.0])
def test_neighbours_leave_no_seam(alpha, turns):
    for count in (4, 7, 300):
        f = drawn(fan(count, 0.7, alpha, turns and count % 2 == 0))
        assert np.diff(f.offsets).max() == 1
        whole = moit.rasterize(fan(count, 0.7, alpha), CAMERA, SIZE)
        inside = np.repeat(np.arange(1200), np.diff(f.offsets))[f.alpha == np.float32(alpha)]
        assert len(inside) > 0.7 * len(whole)
        assert f.alpha.max() == np.float32(alpha)
        area = count / 2 * np.sin(2 * np.pi / count) * (0.7 / PIXEL) ** 2
        assert f.alpha.sum() == pytest.approx(alpha * area, rel=1e-3)


def test_meshes_side_by_side_leave_no_seam():
    left = moit.Mesh([[-1, -1, 0], [0.02, -1, 0], [0.02, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]],
                     (1, 0, 0), 0.25)  # fmt: skip
    right = moit.Mesh([[0.02, -1, 0], [1, -1, 0], [1, 1, 0], [0.02, 1, 0]], [[0, 1, 2], [0, 2, 3]],
                      (0, 0, 1), 0.75)  # fmt: skip
    f = drawn([left, right])
    assert np.diff(f.offsets).max() == 1
    mixed = (f.alpha > 0.26) & (f.alpha < 0.74) & (f.color.min(axis=1) == 0)
    between = np.unique(f.color[(f.color[:, 0] > 0.01) & (f.color[:, 2] > 0.01)], axis=0)
    assert mixed.sum() > 10
    assert len(between) > 0  # colours count by their alpha


def sheet(z, alpha, color=(0.7, 0.7, 0.7), size=1.0):
    corners = np.array([[-0.6, -0.5, z], [0.7, -0.5, z], [0.7, 0.6, z], [-0.6, 0.6, z]])
    return moit.Mesh(corners * (size, size, 1), [[0, 1, 2], [0, 2, 3]], color, alpha)


def test_both_sides_of_a_body_are_two_surfaces():
    f = drawn(ball(0.7, 0.5))
    counts = np.diff(f.offsets)
    assert counts.max() == 2
    middle = slice(f.offsets[15 * 40 + 20], f.offsets[15 * 40 + 21])
    np.testing.assert_allclose(np.sort(f.depth[middle]), [2.3, 3.7], atol=0.02)
    np.testing.assert_allclose(f.alpha[middle], 0.5, atol=1e-6)


def ball(radius, alpha):
    turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, 41), np.linspace(-np.pi / 2, np.pi / 2, 21))
    places = radius * np.stack(
        [np.cos(turn) * np.cos(rise), np.sin(rise), np.sin(turn) * np.cos(rise)], axis=-1
    )
    at = np.arange(21 * 41).reshape(21, 41)
    a, b, c, d = (one.ravel() for one in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    corners = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    # the seam of turns and the poles are corners of many names
    return moit.Mesh(np.round(places.reshape(-1, 3), 6), corners, alpha=alpha)


def test_the_same_triangles_twice_are_two_layers():
    one, two = sheet(0, 0.5), sheet(0, 0.25)
    f = drawn([one, two, one])
    whole = np.bincount(np.repeat(np.arange(1200), np.diff(f.offsets)), 1 - f.alpha, 1200)
    inside = moit.total_transmittance(f, "sorted")[15, 20]
    mean = (0.5 + 0.25 + 0.5) / 3
    assert whole.max() > 0
    assert inside == pytest.approx((1 - mean) ** 3, abs=1e-6)


def test_what_is_opaque_hides_what_is_behind_but_for_its_edges():
    f = drawn([sheet(-0.5, 1.0, size=2), sheet(0, 1.0, (1, 0, 0)), sheet(0.5, 0.5)])
    counts = np.diff(f.offsets).reshape(30, 40)
    some = slice(f.offsets[15 * 40 + 20], f.offsets[15 * 40 + 21])
    np.testing.assert_allclose(f.alpha[some], [1, 0.5])
    np.testing.assert_allclose(f.depth[some], [3, 2.5])
    assert counts.max() == 3
    assert f.depth_range[0] <= f.depth.min()
    assert f.depth_range[1] >= f.depth.max()


def test_threads_change_no_bit_and_none_is_asked_without():
    mesh = ball(0.7, np.linspace(0, 1, 861))
    one, other = (drawn(mesh, threads=t) for t in (1, 4))
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    seen = (mesh_arrays([mesh], np.zeros(3)), seen_in(CAMERA.frame(SIZE, 1), np.zeros(3)), *SIZE, 1)
    none = np.zeros((0, 6))
    for a, b in zip(_core.rasterize(*seen), _core.rasterize(*seen, none, None, False), strict=True):
        np.testing.assert_array_equal(a, b)


def test_shadows_textures_and_glass_are_covered_too():
    sun = moit.Light((0, 0, -1), shadows=moit.ShadowMap(sheet(1, 1.0), "sorted", light=(0, 0, -1)))
    f = drawn(sheet(0, 1.0, (1, 1, 1)), lights=[sun])
    lit = drawn(sheet(0, 1.0, (1, 1, 1)), lights=[moit.Light((0, 0, -1))])
    np.testing.assert_array_equal(f.offsets, lit.offsets)
    assert lit.color.min() > 0.99
    inner = f.color[f.alpha == 1]
    assert np.median(inner) == pytest.approx(0.25)
    image = moit.Texture(np.float32([[[1, 0, 0, 1], [0, 1, 0, 0]]]), filter="nearest")
    uv = [[0, 0], [1, 0], [1, 1], [0, 1]]
    base = sheet(0, 1.0, (1, 1, 1))
    holes = moit.Mesh(base.vertices, base.triangles, (1, 1, 1), uv=uv, texture=image,
                      alpha_cutoff=0.5, lit=False)  # fmt: skip
    g = drawn(holes)
    assert 0.4 * len(lit) < len(g) < 0.6 * len(lit)
    np.testing.assert_array_equal(g.color, np.broadcast_to([1, 0, 0], g.color.shape))
    glass = drawn(moit.Mesh(base.vertices, base.triangles, (0.2, 0.9, 0.4), transmission=0.5))
    np.testing.assert_array_equal(glass.offsets, lit.offsets)
    np.testing.assert_allclose(glass.transmission, np.broadcast_to([0.1, 0.45, 0.2], (len(lit), 3)),
                               atol=1e-6)  # fmt: skip


def test_smooth_edges_come_near_to_many_samples():
    mesh = [ball(0.7, 0.5), fan(5, 1.2)]
    fine = moit.render(mesh, "sorted", (320, 240), camera=CAMERA)
    expected = fine.reshape(30, 8, 40, 8, 4).mean(axis=(1, 3))
    smooth = moit.render(mesh, "sorted", SIZE, camera=CAMERA, antialias=True)
    rough = moit.render(mesh, "sorted", SIZE, camera=CAMERA)
    error = [np.sqrt(((image - expected) ** 2).mean()) for image in (smooth, rough)]
    assert error[0] < 0.2 * error[1]


def test_a_device_leaves_coverage_to_the_cpu():
    device = gpu.device()
    mesh = fan(5, 0.7)
    with pytest.raises(moit.GpuError, match="antialias: coverage of pixels is the CPU's"):
        moit.rasterize(mesh, CAMERA, SIZE, antialias=True, device=device)
    options = {"device": device, "exact": True, "report": True}
    made = moit.render(mesh, "power4", SIZE, camera=CAMERA, antialias=True, **options)
    assert (made.device, made.way) == ("gpu", "arrays")
    assert made.reason.startswith("coverage of pixels is the CPU's")
    expected = moit.render(mesh, "power4", SIZE, camera=CAMERA, antialias=True)
    np.testing.assert_allclose(made.image, expected, atol=0 if device.software else 1e-5)
    with pytest.raises(ValueError, match="resolution: expected 1 with antialias"):
        moit.render(mesh, "wboit", SIZE, camera=CAMERA, antialias=True, resolution=2)
