"""What a GPU makes of triangles are the fragments that the CPU makes, bit by bit on llvmpipe."""

import math

import gpu
import numpy as np
import pytest

import moit
from moit.scenes.mesh_scenes import MESH_SCENES

ARRAYS = ("offsets", "depth", "alpha", "color")


@pytest.fixture
def device():
    return gpu.device()


def assert_equal(found: moit.Fragments, expected: moit.Fragments):
    assert found.shape == expected.shape
    assert found.depth_range == expected.depth_range
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)


def both(device, mesh, camera, size, **options):
    found = moit.rasterize(mesh, camera, size, device=device, **options)
    assert_equal(found, moit.rasterize(mesh, camera, size, **options))
    return found


def triangles(rng, count, alpha, spread=1.5) -> moit.Mesh:
    return moit.Mesh(
        rng.uniform(-spread, spread, (3 * count, 3)),
        np.arange(3 * count).reshape(-1, 3),
        rng.random((3 * count, 3)),
        alpha,
        rng.normal(size=(3 * count, 3)),
    )


@pytest.mark.parametrize("name", MESH_SCENES)
def test_scenes_have_the_fragments_of_the_cpu(device, name):
    scene = moit.scenes.meshes(name)
    found = both(device, scene.meshes, scene.camera, (131, 77))
    assert len(found) > 5000


def test_triangles_round_the_eye_are_clipped_alike(device):
    # in front of and behind the eye, across its plane, and far beyond the picture
    rng = np.random.default_rng(3)
    for fov in (0.5, 2.0):
        eye = moit.Camera(eye=(0.1, 0.2, 0.3), fov_y=fov, near=0.02, far=9.0)
        alpha = rng.choice([0.3, 0.7, 1.0], (80, 1)) * np.ones(3)
        found = both(device, triangles(rng, 80, alpha.ravel()), eye, (70, 45))
        assert len(found) > 5000


def test_slivers_and_specks_are_hit_alike(device):
    rng = np.random.default_rng(4)
    corner = rng.uniform(-1, 1, (400, 1, 3))
    thin = corner + rng.normal(size=(400, 3, 3)) * rng.choice([0.003, 0.03, 1], (400, 1, 3))
    mesh = moit.Mesh(thin.reshape(-1, 3), np.arange(1200).reshape(-1, 3), alpha=0.5)
    assert len(both(device, mesh, moit.Camera(), (90, 60))) > 1000


@pytest.mark.parametrize("size", [(64, 64), (50, 31)])
def test_edges_through_the_middles_of_pixels_belong_to_one_triangle(device, size):
    # a grid whose corners, and so level and upright edges and diagonals, lie on middles of pixels
    side = np.arange(-40, 41, 5)
    x, y = np.meshgrid(2 * (side + 0.5) / size[1], 2 * (side + 0.5) / size[1])
    place = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    n = len(side)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([i, i + 1, i + n], 1), np.stack([i + 1, i + n + 1, i + n], 1)])
    camera = moit.Camera(eye=(0, 0, 1), fov_y=math.pi / 2)
    for alpha in (0.5, 1.0):
        rng = np.random.default_rng(1)
        sheet = moit.Mesh(place, rng.permutation(faces), rng.random((n * n, 3)), alpha)
        assert (both(device, sheet, camera, size).counts == 1).all()


def test_of_opaque_surfaces_the_first_of_the_nearest_stays(device):
    # coplanar walls, glass at their depth, before and behind them
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    faces = [[0, 1, 2], [0, 2, 3]]
    meshes = [
        moit.Mesh(square + np.array([dx, 0, z]), faces, (paint, 0.5, 1 - paint), alpha)
        for dx, z, paint, alpha in (
            (0.2, 0, 0.1, 0.5), (0, 0, 0.2, 1), (0.5, 0, 0.3, 1), (0, -1, 0.4, 1),
            (0, 0.5, 0.5, 0.2), (0, -0.5, 0.6, 0.2), (0.1, 0, 0.7, 1),
        )
    ]  # fmt: skip
    found = both(device, meshes, moit.Camera(), (40, 30))
    assert (found.alpha == 1).sum() > 100


def test_lights_shine_alike(device):
    rng = np.random.default_rng(5)
    lights = [((1, -2, 0.5), (1, 0.5, 0)), ((0, 0, -3), (0.1, 0.4, 2.0))]
    mesh = triangles(rng, 30, 0.5)
    lit = both(device, mesh, moit.Camera(), (40, 30), lights=lights)
    assert not np.allclose(lit.color, moit.rasterize(mesh, moit.Camera(), (40, 30)).color)


def test_nothing_gives_no_fragments(device):
    nothing = moit.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    for scene in (nothing, [], triangles(np.random.default_rng(0), 4, 1.0)):
        both(device, scene, moit.Camera(eye=(0, 0, 30), near=1, far=2), (9, 7))


def test_pictures_of_a_million_pixels_are_summed_up_in_three_rounds(device):
    mesh = triangles(np.random.default_rng(6), 3, 0.5)
    both(device, mesh, moit.Camera(), (1100, 1000))


def test_two_runs_give_the_same_bits(device):
    scene = moit.scenes.meshes("smoke")
    one, other = (
        moit.rasterize(scene.meshes, scene.camera, (96, 54), device=device) for _ in range(2)
    )
    assert_equal(one, other)


class LittleRoom(moit.gpu.Device):
    """A device whose buffers hold little."""

    room = 1 << 27

    @property
    def storage_bytes(self) -> int:
        return self.room


@pytest.fixture
def little():
    gpu.device()
    device = LittleRoom()
    yield device
    device.close()


def test_triangles_that_fill_several_buffers_are_drawn_in_order(little):
    rng = np.random.default_rng(7)
    mesh = triangles(rng, 60, rng.choice([0.4, 1.0], 60).repeat(3))
    little.room = 224 * 11
    expected = moit.rasterize(mesh, moit.Camera(), (12, 9))
    little.room = max(little.room, 12 * len(expected))
    assert little.room < 224 * 50
    both(little, mesh, moit.Camera(), (12, 9))


def test_more_fragments_than_a_buffer_holds_are_listed_in_bands_of_rows(little):
    rng = np.random.default_rng(8)
    mesh = triangles(rng, 60, rng.choice([0.5, 0.7, 1.0], 60, p=[0.5, 0.4, 0.1]).repeat(3))
    camera, size = moit.Camera(), (24, 20)
    expected = moit.rasterize(mesh, camera, size)
    assert (expected.alpha == 1).any()
    little.room = 12 * (len(expected) // 3)
    both(little, mesh, camera, size)
    little.room = 12 * int(expected.counts.reshape(20, 24).sum(axis=1).max() - 1)
    with pytest.raises(moit.GpuError, match=r"size: row \d+ of 24 x 20 pixels has \d+ fragments"):
        moit.rasterize(mesh, camera, size, device=little)


def test_more_fragments_than_loops_reach_are_an_error(device):
    if not device.software:
        pytest.skip(f"{device.renderer} does not leave loops early")
    corner = np.array([[-9, -9, 0], [9, -9, 0], [0, 9, 0.0]])
    mesh = moit.Mesh(np.tile(corner, (70_000, 1)), np.arange(210_000).reshape(-1, 3), alpha=0.5)
    with pytest.raises(moit.GpuError, match="a pixel has 70000 fragments, and loops of"):
        moit.rasterize(mesh, moit.Camera(), (2, 1), device=device)


def test_bad_devices_and_lights_say_what_was_needed():
    mesh, camera = triangles(np.random.default_rng(0), 1, 0.5), moit.Camera()
    with pytest.raises(ValueError, match="device: expected 'cpu', 'gpu'"):
        moit.rasterize(mesh, camera, (4, 4), device="gpus")
    for lights, error, words in (
        ("up", TypeError, "lights: expected a sequence"),
        ([((0, 0, 0), (1, 1, 1))], ValueError, r"lights\[0\]\[0\]: .* not 0"),
        ([((0, 0, 1), (1, -1, 1))], ValueError, r"lights\[0\]\[1\]: .* not negative"),
        ([(0, 0, 1)], TypeError, r"lights\[0\]: expected a direction and a colour"),
        ([((0, 0, 1), (1, 1, 1))] * 9, ValueError, "lights: expected at most 8, got 9"),
    ):
        with pytest.raises(error, match=words):
            moit.rasterize(mesh, camera, (4, 4), lights=lights)


def test_devices_that_are_none_say_so():
    mesh = triangles(np.random.default_rng(0), 1, 0.5)
    gpu.device()
    with pytest.raises(ValueError, match="device: expected 'cpu', 'gpu'"):
        moit.rasterize(mesh, moit.Camera(), (4, 4), device=3)


def test_the_default_light_may_be_named():
    mesh = triangles(np.random.default_rng(9), 20, 0.5)
    camera = moit.Camera()
    as_it_is = moit.rasterize(mesh, camera, (30, 20))
    named = moit.rasterize(
        mesh, camera, (30, 20), lights=[(camera.axes.T @ [0.48, -0.64, 0.6], (1, 1, 1))]
    )
    np.testing.assert_allclose(named.color, as_it_is.color, rtol=1e-6)
