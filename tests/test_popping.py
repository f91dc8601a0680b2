"""What jumps when a camera turns: of splats the order of middles, and of rays nothing."""

import math

import numpy as np
import pytest

import moit
from moit.rendering import popping as text

CAMERA = moit.Camera(eye=(0, 0, 3), fov_y=0.7, near=0.3, far=20)


def balls():
    rng = np.random.default_rng(3)
    n = 400
    return moit.Splats(
        rng.normal(size=(n, 3)) * (1.2, 0.7, 1.2) - (0, 0, 1),
        np.exp(rng.normal(-2.2, 0.4, (n, 3))),
        rng.normal(size=(n, 4)),
        rng.uniform(0.3, 0.95, n),
        colors=rng.uniform(0, 1, (n, 3)),
    )


def test_pictures_are_moved_as_rays_are():
    """A picture that hangs on directions alone is what the other camera sees."""
    size = (96, 64)

    def sky(camera):
        row, column = np.mgrid[:64, :96]
        across, along = camera.scale(size)
        x, y = (2 * (column + 0.5) / 96 - 1) / across, (1 - 2 * (row + 0.5) / 64) / along
        ray = np.stack([x, y, np.ones_like(x)], axis=2) @ camera.axes
        ray /= np.linalg.norm(ray, axis=2, keepdims=True)
        return 0.5 + 0.5 * np.sin(ray * (9, 7, 5) + (0, 1, 2))

    for angle in (0.02, -0.05):
        turned = text._turned(CAMERA, angle)
        moved, there = text._as_seen_by(turned, sky(CAMERA), CAMERA)
        assert 0.7 < there.mean() < 0.98
        np.testing.assert_allclose(moved[there], sky(turned)[there], atol=1e-5)
        assert np.abs(sky(CAMERA) - sky(turned)).max() > 0.05


def test_the_order_of_splats_jumps_and_that_of_rays_does_not():
    splats = balls()
    options = {"camera": CAMERA, "frames": 9}
    of_middles = moit.popping(splats, "sorted", (96, 64), **options)
    of_rays = moit.popping(splats.seen_by("exact"), "sorted", (96, 64), **options)
    assert of_middles.share > 5 * of_rays.share
    assert of_middles.largest > 3 * of_rays.largest
    assert of_rays.largest > of_rays.rms > 0
    assert len(of_middles.each) == 8
    assert max(of_middles.each) == of_middles.largest


@pytest.mark.parametrize("technique", ["wboit", "power4"])
def test_sums_do_not_jump_whatever_the_order(technique):
    found = moit.popping(balls(), technique, (96, 64), camera=CAMERA, frames=9)
    assert found.share == 0
    assert found.largest < 1 / 255


def test_what_draws_lots_jumps_everywhere():
    still = balls().seen_by("exact")
    assert moit.popping(still, "stochastic8", (64, 48), camera=CAMERA, frames=3).share > 0.2


def test_nothing_that_is_alike_in_all_frames_jumps():
    """The background, and a mesh that fills the picture, in a light that does not turn."""
    light = ((-1, -1, -1), (1, 1, 1))
    wall = moit.Mesh([[-99, -99, -9], [99, -99, -9], [0, 99, -9]], [[0, 1, 2]], alpha=0.5)
    for scene in (balls()[:0], wall):
        found = moit.popping(
            scene,
            "sorted",
            (48, 32),
            camera=CAMERA,
            frames=3,
            background=(0.2, 0.4, 0.6),
            lights=[light],
        )
        assert found.share == 0
        assert found.largest < 1e-6


def test_arguments_are_checked():
    def asked(**options):
        return moit.popping(balls(), "sorted", **{"size": (48, 32), "camera": CAMERA, **options})

    with pytest.raises(ValueError, match=r"size: expected at least 32 pixels a side, got \(31, 40"):
        asked(size=(31, 40))
    with pytest.raises(ValueError, match=r"turn: expected radians up to 0.501, not 0; got 0"):
        asked(turn=0)
    with pytest.raises(ValueError, match="turn: expected radians"):
        asked(turn=math.pi)
    with pytest.raises(TypeError, match="turn: expected a number, got 'fast'"):
        asked(turn="fast")
    with pytest.raises(ValueError, match="frames: expected at least 2, got 1"):
        asked(frames=1)
    with pytest.raises(ValueError, match=r"background: expected shape \(3,\), got \(32, 48, 3\)"):
        asked(background=np.zeros((32, 48, 3)))


def test_cameras_turn_about_the_one_given_and_see_all_that_is_asked_for(monkeypatch):
    seen = []

    def render(parts, technique, size, **options):
        seen.append(options)
        return np.zeros((size[1], size[0], 4))

    monkeypatch.setattr(text, "render", render)
    behind, light = (0.1, 0.2, 0.3), moit.Light((0, 1, 2))
    how = {"background": behind, "lights": light, "threads": 2, "device": "cpu"}
    moit.popping(balls(), "sorted", (32, 32), camera=CAMERA, turn=0.02, frames=3, **how)
    forward = [one["camera"].axes[2] for one in seen]
    assert np.allclose(forward[1], CAMERA.axes[2]) and np.allclose(forward[0][0], -forward[2][0])
    assert math.isclose(math.acos(forward[0] @ forward[1]), 0.02, rel_tol=1e-6)
    for one in seen:
        assert np.allclose(one["background"], behind) and one["threads"] == 2
        assert one["lights"] == light and one["camera"].eye == CAMERA.eye
    rolled = moit.Camera(CAMERA.eye, up=(1, 2, 0))
    moit.popping(balls(), "sorted", (32, 32), camera=rolled, turn=0.02, frames=2)
    assert all(np.allclose(one["camera"].axes[1], rolled.axes[1]) for one in seen[3:])
