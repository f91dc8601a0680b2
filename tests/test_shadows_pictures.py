"""Shadows in pictures: lights of the rasteriser, and the papers' cloud."""

from functools import cache

import gpu
import numpy as np
import pytest
from test_shadows import ADDING, DOWN, pane

import moit
from moit.gpu import shadows as shadows_of_a_device
from moit.gpu.shadows import Shadows
from moit.shadows import cloud
from moit.shadows.reaching import points_of_pixels, reached

GLASS = [
    pane(0.0, 1.0, size=4.0, color=(0.7, 0.7, 0.7)),
    pane(1.0, 0.6, color=(0.8, 0.3, 0.2)),
    pane(1.5, 0.4, size=0.5, color=(0.2, 0.3, 0.9)),
    pane(0.5, 1.0, size=0.2, color=(0.2, 0.9, 0.2)),
]
EYE = moit.Camera((2.5, 3.0, 4.0), (0, 0.3, 0), fov_y=0.9)


def picture(shadows, technique="sorted", lights=None, **options):
    lights = lights or [moit.Light((-0.3, -1.0, 0.2), shadows=shadows)]
    options = {"camera": EYE, "background": (0.1, 0.1, 0.1), **options}
    return moit.render(GLASS, technique, (64, 40), lights=lights, **options)


def small(name, light=(-0.3, -1.0, 0.2), scene=GLASS):
    return moit.ShadowMap(scene, name, light=light, resolution=128)


def test_a_light_without_shadows_is_a_pair():
    np.testing.assert_array_equal(
        picture(None), picture(None, lights=[((-0.3, -1.0, 0.2), (1, 1, 1))])
    )


def test_shadows_dim_what_a_light_adds_and_nothing_else():
    dark = picture(None, lights=[moit.Light((-0.3, -1.0, 0.2), (0, 0, 0))])
    lit, shadowed = picture(None), picture(small("power6"))
    assert (shadowed <= lit + 1e-7).all()
    assert (shadowed >= dark - 1e-7).all()
    assert (lit - shadowed).max() > 0.1
    np.testing.assert_array_equal(shadowed[..., 3], lit[..., 3])


def test_each_fragment_is_lit_by_what_reaches_its_point():
    light = moit.Light((-0.3, -1.0, 0.2), (1.0, 0.5, 0.25), small("power6"))
    f = moit.rasterize(GLASS, EYE, (32, 20), lights=[light])
    full = moit.rasterize(GLASS, EYE, (32, 20), lights=[(light.direction, light.color)])
    none = moit.rasterize(GLASS, EYE, (32, 20), lights=[(light.direction, (0, 0, 0))])
    pixel = np.repeat(np.arange(640), f.counts)
    scale_x, scale_y = EYE.scale((32, 20))
    away = full.depth.astype(float)
    seen = np.stack(
        [
            ((pixel % 32 + 0.5) / 16 - 1) / scale_x * away,
            (1 - (pixel // 32 + 0.5) / 10) / scale_y * away,
            away,
        ],
        axis=1,
    )
    reached = light.shadows.transmittance(np.array(EYE.eye) + seen @ EYE.axes)
    transparent = full.alpha < 1  # depths of opaque ones are held within the range
    expected = none.color + reached[:, None] * (full.color - none.color)
    np.testing.assert_allclose(f.color[transparent], expected[transparent], atol=1e-6)


def test_lights_throw_their_own_shadows():
    first = moit.Light((-0.3, -1.0, 0.2), (0.5, 0, 0), small("power6"))
    second = moit.Light((0.4, -1.0, 0.1), (0, 0.5, 0), small("power4", (0.4, -1.0, 0.1)))
    both = picture(None, lights=[first, second, ((0, -1, 0), (0, 0, 0.5))])
    for channel, one in enumerate((first, second)):
        alone = picture(None, lights=[one])
        np.testing.assert_allclose(both[..., channel], alone[..., channel], atol=1e-6)


def test_a_technique_named_by_a_light_makes_a_map_of_the_picture():
    named = picture("power6")
    given = picture(moit.ShadowMap(GLASS, "power6", light=(-0.3, -1.0, 0.2)))
    np.testing.assert_array_equal(named, given)


def test_with_exclude_self_surfaces_are_not_darkened_by_themselves():
    glass = [pane(1.0, 0.6, slope=0.6)]
    pictures = {}
    for name in (None, "power6", "power6(exclude_self=True)"):
        shadows = name and small(name, (0, -1.0, 0), glass)
        light = moit.Light((0, -1.0, 0), shadows=shadows)
        pictures[name] = moit.render(glass, "sorted", (48, 30), camera=EYE, lights=[light])
    lit = pictures[None]
    inside = np.abs(pictures["power6(exclude_self=True)"] - lit).max()
    assert inside < 1e-5
    assert np.abs(pictures["power6"] - lit).max() > 0.01


@pytest.mark.parametrize("name", ["power6", "trig3", "fourier7", "sorted", "stochastic8"])
def test_a_gpus_picture_has_the_same_shadows(name):
    device = gpu.device()
    shadows = small(name)
    for technique in ("sorted", "power6"):
        found = picture(shadows, technique, device=device, exact=True, target="rgba32f")
        # fragments are the same; positions and what reaches them the core finds
        np.testing.assert_allclose(found, picture(shadows, technique), atol=1e-6)
    light = moit.Light((-0.3, -1.0, 0.2), shadows=shadows)
    found = moit.rasterize(GLASS, EYE, (32, 20), lights=[light], device=device)
    expected = moit.rasterize(GLASS, EYE, (32, 20), lights=[light])
    np.testing.assert_array_equal(found.offsets, expected.offsets)
    np.testing.assert_allclose(found.color, expected.color, atol=1e-6)


@pytest.mark.parametrize("light", [(-0.3, -1.0, 0.2), moit.Camera((1.0, 6.0, 0.5), (0, 0, 0))])
@pytest.mark.parametrize(
    "name",
    # with the last but one, what lies before all casters would be in shadow if it were asked for
    [*ADDING, "power6(exclude_self=True)", "power4(overestimation=1.0)", "trig2(overestimation=1)"],
)
def test_techniques_own_passes_read_maps_as_the_core_does(name, light, monkeypatch):
    """In parts of at most so many points, of which the last is what is left."""
    monkeypatch.setattr(shadows_of_a_device, "MOST_POINTS", 200)
    parts, look_up = [], Shadows._look_up

    def noted(self, *asked):
        parts.append(asked[2:4])
        look_up(self, *asked)

    monkeypatch.setattr(Shadows, "_look_up", noted)
    device = gpu.device()
    shadows = small(name, light)
    lights = [((0, -1, 0), (1, 1, 1)), moit.Light((-0.3, -1.0, 0.2), shadows=shadows)]
    rng = np.random.default_rng(2)
    rays = rng.integers(0, 600, 500).astype(np.uint32)
    depth = rng.uniform(2, 8, 500).astype(np.float32)
    alpha = rng.choice([0.2, 0.6, 1.0], 500).astype(np.float32)
    points = points_of_pixels(rays.astype(int), depth, EYE, 30, 20)
    expected = reached(lights, points, alpha, None)
    assert 0.1 < np.ptp(expected[:, 1])
    scale_x, scale_y = EYE.scale((30, 20))
    view = (2 / (30 * scale_x), -1 / scale_x, -2 / (20 * scale_y), 1 / scale_y)
    with device:
        asked = Shadows(device, lights, EYE, (30, 20), view, None)
        assert list(asked.maps) == [1]
        buffers = [device.buffer(a.nbytes, a) for a in (depth, alpha, rays)]
        found = np.empty((500, 2))
        asked.reached(500, *buffers).read(found)
    assert parts[:3] == [(0, 200), (200, 200), (400, 100)]
    # both in double; where few casters make moments near degenerate, rounding of places shows
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert np.median(np.abs(found - expected)) < 1e-12


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"direction": (0, 0, 0)}, "direction"),
        ({"direction": 1}, "direction"),
        ({"direction": DOWN, "color": (1, -1, 0)}, "color"),
        ({"direction": DOWN, "shadows": "powr6"}, "technique"),
        ({"direction": DOWN, "shadows": 7}, "technique"),
    ],
)
def test_bad_lights_are_named(options, named):
    with pytest.raises((TypeError, ValueError), match=rf"^{named}"):
        moit.Light(**options)


# ---- The papers' cloud ---------------------------------------------------------------------------


@cache
def casters():
    return cloud.meshes(cloud.SUN)


@cache
def onset():
    """Points on rays through the disk, how far behind it they are, and what reaches them."""
    exact = moit.ShadowMap(casters(), "sorted", light=cloud.SUN, resolution=512, depth_bias=0.0)
    points, behind = cloud.through_disk(8000, 0.4)
    clear = np.abs(behind) > 0.01  # of the disk itself, which is flat between corners only
    return points[clear], behind[clear], exact.transmittance(points[clear])


@cache
def error(name):
    points, _, exact = onset()
    return (
        moit.ShadowMap(casters(), name, light=cloud.SUN, resolution=256).transmittance(points)
        - exact
    )


def rmse(found):
    return float(np.sqrt((found**2).mean()))


def test_the_cloud_is_that_of_the_scene():
    f = moit.scenes.load("cloud", (96, 54))
    drawn = moit.rasterize(cloud.meshes((0, 0, -1)), cloud.camera(), (96, 54))
    total = moit.total_transmittance(f, "sorted")
    # discs of twelve corners, alpha linear between rings, and those beside the axis face it less
    assert np.abs(moit.total_transmittance(drawn, "sorted") - total).mean() < 0.03


def test_six_moments_have_a_harder_onset_than_fifteen_coefficients():
    _, behind, _ = onset()
    assert rmse(error("power6(overestimation=0.25)")) < 0.85 * rmse(error("fourier15"))
    # the darkening above the disk that MBOIT 7.2 sees; behind it, light leaks without any
    # overestimation
    above = behind < 0
    assert rmse(error("power6")[above]) < 0.75 * rmse(error("fourier15")[above])


def test_six_moments_leak_less_light_than_four():
    _, behind, _ = onset()
    four, six, eight = (error(f"power{n}")[behind > 0].mean() for n in (4, 6, 8))
    # .18, .10 and .07 of the light
    assert 0.04 < eight < six < 0.65 * four
    assert four < 0.25


def test_more_overestimation_leaks_less_and_darkens_more_above():
    _, behind, _ = onset()
    errors = [error(f"power6(overestimation={beta})") for beta in (0.0, 0.25, 0.5)]
    leaks = [e[behind > 0].mean() for e in errors]
    above = [e[behind < 0].mean() for e in errors]
    assert leaks == sorted(leaks, reverse=True)
    assert above == sorted(above, reverse=True)
