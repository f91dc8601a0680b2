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
