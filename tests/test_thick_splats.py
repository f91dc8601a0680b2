"""Splats that are thick along their rays."""

import re

import numpy as np
import pytest
from gpu import software_device

import moit

CAMERA = moit.Camera()
SIZE = (24, 18)


def cloud(seed=0, count=12, **options):
    rng = np.random.default_rng(seed)
    return moit.Splats(
        rng.uniform(-0.5, 0.5, (count, 3)),
        rng.uniform(0.05, 0.4, (count, 3)),
        rng.normal(size=(count, 4)),
        rng.uniform(0.3, 0.95, count),
        colors=rng.random((count, 3)),
        **({"convention": "exact", "thick": True} | options),
    )


def test_deviations_are_those_along_the_ray():
    """By what makes a splat a ball, in doubles: density along a ray of depth t is that of a normal
    distribution of deviation 1 / |A d|, where the ray's point is eye + t d."""
    f = moit.rasterize(cloud(count=1), CAMERA, SIZE)
    splat = cloud(count=1)
    w, x, y, z = splat.rotations[0].astype(float)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    ball = (turn / splat.scales[0].astype(float)).T  # to a ball of deviation 1
    right, up, forward = CAMERA.axes
    frame = CAMERA.frame(SIZE, 1)
    pixel = np.repeat(np.arange(SIZE[0] * SIZE[1]), f.counts)
    assert len(pixel) > 20
    for p, depth, deviation in zip(pixel, f.depth, f.deviation, strict=True):
        row, column = divmod(int(p), SIZE[0])
        slope = (2 * (column + 0.5) / SIZE[0] - 1) / frame.scale[0]
        rise = (1 - 2 * (row + 0.5) / SIZE[1]) / frame.scale[1]
        along = ball @ (forward + slope * right + rise * up)
        start = ball @ (np.array(CAMERA.eye) - splat.means[0])
        np.testing.assert_allclose(deviation, 1 / np.linalg.norm(along), rtol=1e-5)
        np.testing.assert_allclose(depth, -(start @ along) / (along @ along), rtol=1e-5)


def test_all_else_is_as_of_flat_ones():
    thick = moit.rasterize(cloud(), CAMERA, SIZE)
    flat = moit.rasterize(cloud(thick=False), CAMERA, SIZE)
    for name in ("offsets", "depth", "alpha", "color"):
        assert np.array_equal(getattr(thick, name), getattr(flat, name)), name
    assert flat.deviation is None and thick.back is None
    assert (thick.deviation > 0).all() and thick.depth_range == flat.depth_range
    reached = (thick.depth - 3.33 * thick.deviation >= thick.depth_range[0]) & (
        thick.depth + 3.33 * thick.deviation <= thick.depth_range[1]
    )
    assert reached.mean() > 0.5  # the range has room for what is thick


def test_pictures_of_overlapping_splats_do_not_pop():
    """One that moves through another changes the picture little by little; flat ones swap."""

    def shown(z, thick):
        balls = moit.Splats(
            [[0, 0, 0], [0, 0, z]],
            [0.3, 0.3],
            [[1, 0, 0, 0]] * 2,
            [0.8, 0.8],
            colors=[[1, 0, 0], [0, 0, 1]],
            convention="exact",
            thick=thick,
        )
        return moit.composite(moit.rasterize(balls, CAMERA, (9, 9)), "sorted")[4, 4, :3]

    jump = [np.abs(shown(1e-3, thick) - shown(-1e-3, thick)).max() for thick in (False, True)]
    assert jump[0] > 0.4 and jump[1] < 0.01


def test_thick_and_flat_splats_and_meshes_are_one_scene():
    mesh = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], (0.2, 0.8, 0.2), 0.5)
    scene = [cloud(1), mesh, cloud(2, thick=False), cloud(3)]
    f = moit.rasterize(scene, CAMERA, SIZE)
    counts = [moit.rasterize(one, CAMERA, SIZE).counts for one in scene]
    assert np.array_equal(f.counts, np.sum(counts, axis=0))
    thick = sum(len(moit.rasterize(one, CAMERA, SIZE)) for one in (scene[0], scene[3]))
    assert (f.deviation > 0).sum() == thick
    image = moit.render(scene, "sorted", SIZE, camera=CAMERA, target="rgba32f")
    np.testing.assert_allclose(image, moit.composite(f, "sorted"), atol=1e-6)


@pytest.mark.parametrize("technique", ["power4", "sorted"])
def test_a_device_composites_arrays_of_thick_splats(technique):
    options = {"camera": CAMERA, "device": software_device(), "exact": True, "report": True}
    made = moit.render(cloud(), technique, SIZE, **options)
    assert (made.device, made.way) == ("gpu", "arrays")
    expected = moit.render(cloud(), technique, SIZE, camera=CAMERA)
    np.testing.assert_array_equal(made.image, expected)


def test_what_is_thick_says_so_and_stays_so():
    assert repr(cloud()).endswith("convention 'exact', thick)")
    assert cloud()[:3].thick and not cloud().seen_by("3dgs").thick
    assert cloud(convention="3dgs", thick=False).seen_by("exact", thick=True).thick
    said = "thick: found True with convention '3dgs', whose splats are flat; needed 'exact'"
    with pytest.raises(ValueError, match=re.escape(said)):
        cloud(convention="3dgs")
