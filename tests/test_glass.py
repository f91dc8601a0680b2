"""Meshes with transmission: what passes through them is tinted, wherever a picture is made."""

import gpu
import numpy as np
import pytest

import moit
from moit.geometry.glass import NOT_QUITE_ONE, as_shadows_see

CAMERA = moit.Camera(eye=(0, 0, 4))
CORNERS = [[0, 1, 2], [0, 2, 3]]
TINT = (0.2, 0.5, 0.9)


def square(z, side=1.0, **options):
    place = [[-side, -side, z], [side, -side, z], [side, side, z], [-side, side, z]]
    return moit.Mesh(place, CORNERS, **options)


def pixel(scene, **options):
    return moit.rasterize(scene, CAMERA, (9, 9), **options)[4, 4]


def test_what_is_opaque_is_seen_through_glass_of_alpha_one():
    pane = square(0.0, color=TINT, alpha=1, transmission=0.75)
    wall = square(-1.0, 3.0, color=(0.4, 0.4, 0.4), lit=False)
    for scene in ([pane, wall], [wall, pane]):
        f = pixel(scene)
        assert len(f) == 2 and sorted(f.alpha.tolist()) == [1, 1]
        front = int(np.argmin(f.depth))
        np.testing.assert_allclose(f.transmission[front], 0.75 * np.array(TINT), rtol=1e-6)
        assert (f.transmission[1 - front] == 0).all()
        seen = moit.composite(f, "sorted")[0, 0, :3]
        expected = f.color[front] + 0.75 * np.array(TINT) * 0.4
        np.testing.assert_allclose(seen, expected, rtol=1e-5)
        np.testing.assert_allclose(
            moit.render(scene, "sorted", (9, 9), camera=CAMERA)[4, 4, :3], expected, rtol=1e-5
        )


def test_what_is_behind_an_opaque_surface_does_not_show():
    wall = square(0.5, 3.0, color=(0.4, 0.4, 0.4), lit=False)
    seen = moit.composite(pixel([square(0.0, transmission=0.5), wall]), "power4")[0, 0, :3]
    np.testing.assert_allclose(seen, 0.4, rtol=1e-6)


def test_the_tint_is_that_of_texture_and_vertices_and_no_light_changes_it():
    image = np.array([[[0.5, 1.0, 0.25]]])
    mesh = square(
        0.0,
        color=TINT,
        uv=np.zeros((4, 2)),
        texture=moit.Texture(image, filter="nearest"),
        transmission=0.5,
    )
    lights = [((0, 0, -1), (3, 3, 3))]
    bright, plain = pixel(mesh, lights=lights), pixel(mesh)
    expected = 0.5 * np.array(TINT) * image[0, 0]
    np.testing.assert_allclose(bright.transmission[0], expected, rtol=1e-5)
    np.testing.assert_array_equal(bright.transmission, plain.transmission)
    assert (bright.color > plain.color).all()


@pytest.mark.parametrize("order", ["given", "object", "triangle"])
def test_any_order_of_drawing_keeps_the_glass(order):
    scene = [square(0.0, color=TINT, alpha=0.5, transmission=0.5), square(1.0, alpha=0.25)]
    scene.append(square(-1.0, alpha=0.5, transmission=1.0))
    expected = moit.render(scene, "sorted", (9, 9), camera=CAMERA)
    found = moit.render(scene, "sorted", (9, 9), camera=CAMERA, order=order)
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_shadows_of_glass_are_as_light_as_it_is():
    pane = square(0.0, color=(0.5, 0.5, 0.5), alpha=1, transmission=1.0)
    (seen,) = as_shadows_see([pane])
    assert seen.transmission == 0 and seen.alpha.tolist() == [0.5] * 4
    floor = square(-1.0, 0.5, color=(1, 1, 1))
    shown = [
        moit.render(
            [*scene, floor],
            "sorted",
            (9, 9),
            camera=moit.Camera(eye=(0, 0, -0.5), target=(0, 0, -1), near=0.05),  # between them
            lights=[moit.Light((0, 0, -1), (1, 1, 1), shadows="sorted")],
        )[4, 4, 0]
        for scene in ([], [pane], [square(0.0)])
    ]
    assert shown[2] < shown[1] < shown[0]


def test_a_gpu_composites_what_the_core_has_drawn():
    device = gpu.device()
    scene = [square(0.0, color=TINT, transmission=0.5), square(-1.0, alpha=0.5)]
    there = {"camera": CAMERA, "device": device, "exact": True, "target": "rgba32f"}
    found = moit.render(scene, "power4", (9, 9), **there, report=True)
    assert (found.device, found.way) == ("gpu", "arrays")
    assert found.reason == "a mesh with transmission has no passes"
    np.testing.assert_array_equal(found.image, moit.render(scene, "power4", (9, 9), camera=CAMERA))
    with pytest.raises(moit.GpuError, match="transmission"):
        moit.rasterize(scene, CAMERA, (9, 9), device=device)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"transmission": 1.5}, "transmission.*found 1.5; needed a number in .0, 1."),
        ({"transmission": -0.1}, "transmission"),
        ({"transmission": np.nan}, "transmission"),
        ({"transmission": [0.5, 0.5]}, "transmission"),
        ({"transmission": 0.5, "alpha_cutoff": 0.5}, "cut out by alpha_cutoff is opaque"),
    ],
)
def test_wrong_shares_are_named(options, words):
    with pytest.raises(moit.MeshError, match=words):
        square(0.0, **options)


def test_what_cannot_have_it_says_so():
    pane = square(0.0, transmission=0.5)
    with pytest.raises(ValueError, match="coplanar: expected None for meshes with transmission"):
        pixel(pane, coplanar=0.1)
    with pytest.raises(ValueError, match="resolution: expected 1 for scenes of meshes with trans"):
        moit.render(pane, "wboit", (9, 9), camera=CAMERA, resolution=2)


def test_alpha_just_below_one_is_the_greatest_that_is_not_opaque():
    assert np.nextafter(NOT_QUITE_ONE, np.float32(2)) == 1
