"""Points and lines that a device draws: the core's fragments, whatever passes go over them."""

import gpu
import numpy as np
import pytest

import moit

CAMERA = moit.Camera(eye=(0.3, 0.2, 2.5), near=0.5, far=20)
SIZE = (40, 30)
LIGHTS = [((1, -1, -1), (0.9, 0.5, 0.3)), ((0, -1, 0.2), (0.1, 0.4, 0.8))]


def scattered():
    rng = np.random.default_rng(3)
    places = rng.uniform(-1, 1, (24, 3))
    places[0] = (0.32, 0.2, 2.1)  # the eye is in it
    alpha = np.where(np.arange(24) % 3, 0.5, 1.0)
    return {"positions": places, "color": rng.uniform(0, 1, (24, 3)), "alpha": alpha}


def winding():
    """Lines that meet themselves, some of parts that are smaller than a pixel; one is closed, and
    seen from its side; one goes through the eye's plane."""
    turn = np.linspace(0, 2 * np.pi, 25)
    ring = 0.7 * np.stack([np.cos(turn), 0.05 * np.sin(turn), np.sin(turn)], axis=1)
    ring[-1] = ring[0]
    tight = np.stack([0.2 * np.sin(9 * turn), 0.4 * np.cos(7 * turn), 0.1 * turn], axis=1)
    short = np.linspace([-0.8, -0.5, 0], [-0.7, -0.52, 0.1], 25)
    through = np.array([[-0.5, -0.3, 0], [0.4, 0.3, 4]])
    points = np.concatenate([ring, tight, short, through])
    rng = np.random.default_rng(4)
    return {
        "points": points,
        "offsets": [0, 25, 50, 75, 77],
        "color": rng.uniform(0, 1, (77, 3)),
        "alpha": np.where(np.arange(77) < 50, 0.6, rng.uniform(0.2, 1, 77)),
    }


KINDS = {
    "discs": lambda: moit.Points(**scattered(), radius=0.15),
    "spheres": lambda: moit.Points(**scattered(), radius=0.25, shape="sphere"),
    "spheres of pixels": lambda: moit.Points(**scattered(), pixels=5, shape="sphere", lit=False),
    "ribbons": lambda: moit.Lines(**winding(), pixels=1.5),
    "tubes": lambda: moit.Lines(**winding(), radius=0.04, shape="tube"),
}


def assert_same_fragments(found, expected):
    for name in ("offsets", "depth", "alpha", "color"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)
    np.testing.assert_allclose(found.depth_range, expected.depth_range, rtol=2e-6)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("antialias", [False, True])
def test_a_device_draws_the_same_fragments(kind, antialias):
    scene, device = KINDS[kind](), gpu.software_device()
    given = {"lights": LIGHTS if kind == "tubes" else (), "antialias": antialias}
    expected = moit.rasterize(scene, CAMERA, SIZE, **given)
    assert len(expected.depth) > 100
    assert_same_fragments(moit.rasterize(scene, CAMERA, SIZE, device=device, **given), expected)


def test_opaque_surfaces_and_points_among_others_are_in_one_picture():
    """A picture of all kinds, with walls in front and behind, drawn by passes as by the core."""
    rng = np.random.default_rng(2)

    def wall(z, left, right, color, alpha=1.0):
        corners = [[left, -1, z], [right, -1, z], [right, 1, z], [left, 1, z]]
        return moit.Mesh(corners, [[0, 1, 2], [0, 2, 3]], color=color, alpha=alpha)

    splats = moit.Splats(
        rng.normal(0, 0.35, (60, 3)),
        rng.uniform(0.02, 0.1, (60, 3)),
        rng.normal(size=(60, 4)),
        rng.uniform(0.2, 0.9, 60),
        colors=rng.uniform(0, 1, (60, 3)),
    )
    parts = [
        wall(-1.2, -1.4, 1.4, (0.4, 0.5, 0.4)),
        splats,
        KINDS["spheres"](),
        KINDS["tubes"](),
        KINDS["ribbons"](),
        wall(1.1, -0.3, 0.2, (0.8, 0.2, 0.6)),
        wall(0.5, 0.3, 0.9, (0.3, 0.3, 0.9), 0.4),
    ]
    how = {"camera": CAMERA, "background": (0.9, 0.9, 0.9), "target": "rgba32f"}
    device = gpu.software_device()
    for technique, tolerance in (("sorted", 1e-6), ("wboit", 1e-5)):
        expected = moit.render(parts, technique, SIZE, **how)
        found = moit.render(parts, technique, SIZE, device=device, report=True, **how)
        assert (found.device, found.reason) == ("gpu", "")
        np.testing.assert_allclose(found.image, expected, atol=tolerance)
    alone = moit.render(parts[5], "sorted", SIZE, **how)
    hidden = (alone[..., 3] == 1) & (np.abs(found.image[..., :3] - alone[..., :3]).max(-1) < 1e-6)
    assert hidden.sum() > 60  # the wall in front is seen as it is


def test_coverage_of_lines_is_drawn_by_passes_where_no_triangles_are():
    lines, device = KINDS["tubes"](), gpu.software_device()
    how = {"camera": CAMERA, "antialias": True, "target": "rgba32f"}
    expected = moit.render(lines, "sorted", SIZE, **how)
    found = moit.render(lines, "sorted", SIZE, device=device, report=True, **how)
    assert found.device == "gpu"
    np.testing.assert_allclose(found.image, expected, atol=1e-6)


def test_lines_are_refused_that_no_buffer_holds(monkeypatch):
    device = gpu.device()
    monkeypatch.setattr(type(device), "storage_bytes", property(lambda _: 12 * 40 * 30))
    with pytest.raises(moit.GpuError, match=r"\d+ parts of points and lines are seen, and a buf"):
        moit.rasterize(KINDS["tubes"](), CAMERA, SIZE, device=device)
