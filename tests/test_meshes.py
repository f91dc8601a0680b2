"""Meshes and cameras: what they hold, what files give, and what bad input says."""

import math
import sys

import numpy as np
import pytest

import moit
from moit import Camera, Mesh, MeshError
from moit.geometry.light import light_numbers

PLACE = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 1, 2], [0, 2, 3]]


def test_one_colour_and_one_alpha_are_for_all_vertices():
    mesh = Mesh(PLACE, FACES, (0.1, 0.2, 0.3), 0.5)
    assert mesh.vertices.dtype == mesh.color.dtype == mesh.alpha.dtype == np.float32
    assert mesh.triangles.dtype == np.int32
    np.testing.assert_array_equal(mesh.color, np.tile(np.float32([0.1, 0.2, 0.3]), (4, 1)))
    np.testing.assert_array_equal(mesh.alpha, np.full(4, 0.5, np.float32))
    assert mesh.normals is None
    assert repr(mesh) == "Mesh(4 vertices, 2 triangles, alpha 0.5)"


def test_a_mesh_keeps_copies_and_does_not_change():
    place = np.array(PLACE, np.float32)
    mesh = Mesh(place, FACES)
    place[0] = 9
    assert mesh.vertices[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0] = 1
    with pytest.raises(AttributeError, match="does not change"):
        mesh.alpha = 1


def test_a_triangle_is_transparent_where_any_corner_is():
    assert Mesh(PLACE, FACES, alpha=[1, 0.9, 1, 1]).transparent.tolist() == [True, False]


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        (([[0, 0]], FACES), MeshError, r"vertices: expected shape \(V, 3\), got \(1, 2\)"),
        (([[0, 0, np.nan]], []), MeshError, r"vertices\[0, 2\]: found nan"),
        ((["x"], FACES), TypeError, "vertices: expected real numbers"),
        ((PLACE, [[0, 1]]), MeshError, r"triangles: expected shape \(T, 3\), got \(1, 2\)"),
        ((PLACE, [[0, 1, 4]]), MeshError, r"triangles\[0, 2\]: found 4; needed one of 4"),
        ((PLACE, [[0, 1, -1]]), MeshError, r"triangles\[0, 2\]: found -1"),
        ((PLACE, [[0, 1, 2.5]]), TypeError, "triangles: expected integers, got float64"),
        ((PLACE, FACES, [[1, 1, 1]]), MeshError, r"color: expected shape \(3,\) or \(4, 3\)"),
        ((PLACE, FACES, (1, -1, 1)), MeshError, r"color\[0, 1\]: found -1.0; needed a number that"),
        ((PLACE, FACES, (1, 1, 1), 1.5), MeshError, r"alpha\[0\]: found 1.5; needed a number in"),
        ((PLACE, FACES, (1, 1, 1), [1, 1]), MeshError, r"alpha: expected shape \(\) or \(4,\)"),
        ((PLACE, FACES, (1, 1, 1), 1, [[0, 0, 1]]), MeshError, r"normals: expected shape \(4, 3\)"),
    ],
)
def test_bad_meshes_say_what_was_needed(arguments, error, words):
    with pytest.raises(error, match=words):
        Mesh(*arguments)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"eye": (0, 0)}, ValueError, r"eye: expected shape \(3,\), got \(2,\)"),
        ({"eye": "abc"}, TypeError, "eye: expected three real numbers"),
        ({"target": (0, 0, np.inf)}, ValueError, r"target\[2\]: found inf"),
        ({"target": (0, 0, 3)}, ValueError, "target: expected another point than eye"),
        ({"up": (0, 0, 1)}, ValueError, "up: expected a direction that is not along the view"),
        ({"fov_y": 4.0}, ValueError, r"fov_y: expected radians in \(0, pi\), got 4.0"),
        ({"near": 0.0}, ValueError, "near, far: expected 0 < near < far"),
        ({"near": 5, "far": 5}, ValueError, "near, far: expected 0 < near < far"),
        ({"far": "x"}, TypeError, "far: expected a number"),
    ],
)
def test_bad_cameras_say_what_was_needed(options, error, words):
    with pytest.raises(error, match=words):
        Camera(**options)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        (
            ("teapot", Camera(), (4, 4)),
            TypeError,
            "scene: expected .* or a Volume or several, got str",
        ),
        (
            ([3], Camera(), (4, 4)),
            TypeError,
            r"scene\[0\]: expected a Mesh, Splats, Points, .*, got int",
        ),
        ((Mesh(PLACE, FACES), None, (4, 4)), TypeError, "camera: expected a Camera, got NoneType"),
        ((Mesh(PLACE, FACES), Camera(), (0, 4)), ValueError, "size: expected"),
        ((Mesh(PLACE, FACES), Camera(), (4, 20000)), ValueError, "each from 1 to 16384"),
        ((Mesh(PLACE, FACES), Camera(), 4), TypeError, "size: expected two integers"),
    ],
)
def test_bad_calls_of_rasterize_say_what_was_needed(arguments, error, words):
    with pytest.raises(error, match=words):
        moit.rasterize(*arguments)


def test_axes_are_right_handed():
    right, up, forward = Camera(eye=(1, 2, 3), target=(0, 0.5, -1)).axes
    np.testing.assert_allclose(np.cross(right, up), -forward, atol=1e-12)
    assert up[1] > 0


@pytest.mark.parametrize("shift", [(0, 0, 0), (1e3, -50, 20)])
@pytest.mark.parametrize("size", [1e-3, 1, 1e4])
def test_a_fitted_camera_has_all_of_the_scene(shift, size):
    rng = np.random.default_rng(0)
    cloud = rng.normal(size=(300, 3)) * size + shift
    mesh = Mesh(cloud, rng.integers(0, 300, (100, 3)), alpha=0.5)
    camera = Camera(eye=(1, 2, 3)).fit(mesh)
    np.testing.assert_allclose(camera.axes, Camera(eye=(1, 2, 3)).axes, atol=1e-9)
    seen = (mesh.points - np.array(camera.eye)) @ camera.axes.T
    assert (seen[:, 2] > camera.near).all() and (seen[:, 2] < camera.far).all()
    across = np.abs(seen[:, :2]) * camera.scale((1, 1)) / seen[:, 2:]
    assert across.max() < 1
    assert across.max() > 0.5  # and does not lose it in the distance
    assert camera.fov_y == math.pi / 4


class TestFiles:
    @pytest.fixture(autouse=True)
    def trimesh(self):
        return pytest.importorskip("trimesh", reason="no trimesh, so no mesh files")

    @pytest.mark.parametrize("ending", ["obj", "ply", "stl", "glb", "off"])
    def test_files_of_every_kind_give_their_triangles(self, trimesh, tmp_path, ending):
        path = tmp_path / f"ball.{ending}"
        trimesh.creation.icosphere(subdivisions=1, radius=2).export(path)
        mesh = moit.read_mesh(path)
        assert len(mesh.triangles) == 80
        assert mesh.normals is not None
        np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 2, rtol=1e-3)
        assert (mesh.alpha == 1).all()

    def test_colours_of_vertices_become_linear(self, trimesh, tmp_path):
        path = tmp_path / "colored.ply"
        colors = np.array([[255, 0, 0, 128], [188, 188, 188, 255], [0, 0, 255, 0]], np.uint8)
        trimesh.Trimesh(PLACE[:3], FACES[:1], vertex_colors=colors, process=False).export(path)
        mesh = moit.read_mesh(path)
        np.testing.assert_allclose(mesh.color[1], 0.5029, atol=1e-3)
        np.testing.assert_allclose(mesh.alpha, [128 / 255, 1, 0], atol=1e-6)

    def test_files_that_are_no_meshes_say_so(self, tmp_path):
        with pytest.raises(FileNotFoundError, match="there is no file"):
            moit.read_mesh(tmp_path / "none.obj")
        for name, content in {
            "empty.obj": b"",
            "noise.ply": b"ply\nformat nonsense\n",
            "text.stl": b"not a solid",
            "broken.glb": b"glTF\x02\x00\x00\x00",
            "unknown.xyz3": b"1 2 3",
        }.items():
            path = tmp_path / name
            path.write_bytes(content)
            with pytest.raises(MeshError, match=name):
                moit.read_mesh(path)


def test_reading_without_trimesh_names_the_extra(tmp_path, monkeypatch):
    path = tmp_path / "ball.3mf"
    path.write_text("solid")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(ImportError, match=r"moit\[mesh\]"):
        moit.read_mesh(path)


def test_a_texture_needs_to_know_where_it_lies():
    texture = moit.Texture(np.zeros((2, 2, 3)))
    with pytest.raises(MeshError, match="texture: needed uv"):
        moit.Mesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], texture=texture)


def test_lights_are_as_bright_however_long_their_direction_is_written():
    camera = moit.Camera((0, 0, 3), (1, 2, 0))
    (row,) = light_numbers([moit.Light((0, -3, 4), color=(1, 0.5, 2))], camera)
    np.testing.assert_allclose(row[:3], camera.axes @ (0, -0.6, 0.8), atol=1e-15)
    assert row[3:].tolist() == [1, 0.5, 2]


def test_what_lets_light_through_is_known_by_the_corners_of_its_triangles():
    vertices = np.arange(21.0).reshape(7, 3)  # the last is no triangle's
    mesh = moit.Mesh(vertices, [[2, 0, 1], [3, 4, 5]], alpha=[0.5] * 3 + [1.0] * 4)
    np.testing.assert_array_equal(mesh.transparent_points, vertices[:3])
