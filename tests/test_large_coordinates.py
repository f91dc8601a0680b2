"""Far from 0 scenes look as they do there; integers are no radiance; other libraries' meshes."""

import types

import numpy as np
import pytest

import moit
from moit import Mesh, MeshError

FAR = np.array([5e5, 4.6e6, 120.0])
SIZE = (96, 72)


def sphere(center, alpha=0.5, radius=2.0):
    turn, round_ = np.meshgrid(np.linspace(0, np.pi, 17), np.linspace(0, 2 * np.pi, 33))
    unit = np.stack(
        [np.sin(turn) * np.cos(round_), np.cos(turn), np.sin(turn) * np.sin(round_)], -1
    )
    i, j = np.meshgrid(np.arange(32), np.arange(16), indexing="ij")
    first = (17 * i + j).reshape(-1)
    triangles = np.r_[np.c_[first, first + 1, first + 17], np.c_[first + 1, first + 18, first + 17]]
    unit = unit.reshape(-1, 3)
    return Mesh(unit * radius + center, triangles, (0.2, 0.5, 0.9), alpha, unit)


def camera(center, **options):
    return moit.Camera(
        tuple(np.add(center, (3, 4, 7))), tuple(center + 0.0), near=1, far=40, **options
    )


def same(f, g, digits=1e-6):
    np.testing.assert_array_equal(f.offsets, g.offsets)
    np.testing.assert_allclose(f.depth, g.depth, rtol=digits)
    np.testing.assert_allclose(f.color, g.color, atol=digits)
    np.testing.assert_allclose(f.depth_range, g.depth_range, rtol=digits)


@pytest.mark.parametrize("center", [FAR, -FAR, (6.4e6, 0, 0), (0, 1e9, 0)])
def test_a_sphere_far_away_is_round(center):
    ball = sphere(np.array(center))
    assert ball.vertices.dtype == np.float32 and ball.origin.any()
    distance = np.linalg.norm(ball.points - center, axis=1)
    np.testing.assert_allclose(distance, 2, rtol=2e-7)


def test_pictures_far_away_are_the_same():
    near, far = sphere(np.zeros(3)), sphere(FAR)
    same(*(moit.rasterize(m, camera(c), SIZE) for m, c in ((near, 0 * FAR), (far, FAR))))
    fitted = [
        moit.Camera(tuple(np.add(c, (3, 4, 7))), tuple(c + 0.0)).fit(m)
        for m, c in ((near, 0 * FAR), (far, FAR))
    ]
    np.testing.assert_allclose([one.near for one in fitted], fitted[0].near)


@pytest.mark.parametrize("from_camera", [False, True])
def test_shadows_far_away_are_the_same(from_camera):
    found = []
    for center in (0 * FAR, FAR):
        scene = [sphere(center, 0.6), sphere(np.add(center, (0, -5, 0)), 1.0)]
        shadows = "power6"
        if from_camera:
            light = moit.Camera(
                tuple(np.add(center, (0, 9, 0.1))), tuple(center + 0.0), near=1, far=30
            )
            shadows = moit.ShadowMap(scene, "power6", light=light)
        lights = [moit.Light((0.2, -1, 0.1), shadows=shadows)]
        found.append(moit.rasterize(scene, camera(center), SIZE, lights=lights))
    same(*found, digits=1e-4)


@pytest.mark.parametrize("order", ["given", "object", "triangle"])
def test_meshes_of_several_origins_are_drawn_together(order):
    scenes = [
        [
            sphere(np.add(c, (0, 0, -3))),
            sphere(np.add(c, (0.5, 0.2, 1)), 0.3, 1.0),
            sphere(np.add(c, (40, 0, 0)), 0.2, 0.1),
        ]
        for c in (0 * FAR, FAR)
    ]
    assert len({tuple(mesh.origin) for mesh in scenes[1]}) > 1
    images = [
        moit.render(scene, "sorted", SIZE, camera=camera(c), order=order)
        for scene, c in zip(scenes, (0 * FAR, FAR), strict=True)
    ]
    # vertices snap to 1/256 pixel, so that few pixels at rims may differ
    assert (np.abs(images[0] - images[1]).max(axis=2) > 1e-4).mean() < 2e-3


def test_small_scenes_keep_their_bits():
    rng = np.random.default_rng(0)
    for place in (rng.normal(size=(30, 3)), rng.normal(size=(30, 3)) + 10, np.zeros((3, 3))):
        mesh = Mesh(place, [[0, 1, 2]])
        assert not mesh.origin.any()
        np.testing.assert_array_equal(mesh.vertices, place.astype(np.float32))
        assert mesh.points is mesh.vertices


def test_what_is_float32_already_is_not_moved():
    place = (np.eye(3) + 5e6).astype(np.float32)
    mesh = Mesh(place, [[0, 1, 2]])
    assert not mesh.origin.any()
    np.testing.assert_array_equal(mesh.vertices, place)


def test_an_origin_that_is_said_is_kept():
    mesh = Mesh(np.eye(3), [[0, 1, 2]], origin=(5e5, 0, -3))
    np.testing.assert_array_equal(mesh.points, np.add(np.eye(3), (5e5, 0, -3)))
    assert "origin (500000.0, 0.0, -3.0)" in repr(mesh)
    with pytest.raises(MeshError, match="origin: expected three real numbers"):
        Mesh(np.eye(3), [[0, 1, 2]], origin=3)
    with pytest.raises(MeshError, match=r"origin\[1\]: found nan"):
        Mesh(np.eye(3), [[0, 1, 2]], origin=(0, np.nan, 0))


def test_parts_of_a_file_share_an_origin(tmp_path):
    rows = "".join(f"v {x + 500123.25} {y + 4649776.5} 0\n" for x in (0, 1) for y in (0, 1))
    path = tmp_path / "far.obj"
    path.write_text(rows + "f 1 2 3\nf 2 4 3\n")
    mesh = moit.read_mesh(path)
    assert mesh.origin.any()
    assert mesh.points.max(axis=0).tolist() == [500124.25, 4649777.5, 0]


# ---- Colours


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.int64])
def test_integers_are_no_radiance(kind):
    color = np.array([[255, 0, 9]] * 3, kind)
    with pytest.raises(TypeError, match=r"color: found \w+ up to 255; needed real numbers.*srgb"):
        Mesh(np.eye(3), [[0, 1, 2]], color)
    with pytest.raises(MeshError, match=r"color\[0\]: found -3; needed an integer in \[0, 255\]"):
        Mesh(np.eye(3), [[0, 1, 2]], (-3, 0, 0), color_space="srgb")


def test_bytes_of_0_and_1_are_none_either():
    with pytest.raises(TypeError, match="color: found uint8 up to 1"):
        Mesh(np.eye(3), [[0, 1, 2]], np.ones((3, 3), np.uint8))
    with pytest.raises(TypeError, match="alpha: found uint8"):
        Mesh(np.eye(3), [[0, 1, 2]], alpha=np.ones(3, np.uint8))
    Mesh(np.eye(3), [[0, 1, 2]], (1, 0, 1), 1)  # which are plain numbers


@pytest.mark.parametrize(
    ("color", "expected"),
    [
        (np.array([[255, 188, 0]] * 3, np.uint8), (1, 0.50289, 0, 1)),
        (np.array([[255, 188, 0, 51]] * 3, np.uint8), (1, 0.50289, 0, 0.2)),
        (np.array([[65535, 0, 48316]] * 3, np.uint16), (1, 0, 0.50289, 1)),
        ((255, 188, 0), (1, 0.50289, 0, 1)),
        ((1.0, 188 / 255, 0.0, 0.2), (1, 0.50289, 0, 0.2)),
    ],
)
def test_colours_of_a_screen_are_decoded_on_request(color, expected):
    mesh = Mesh(np.eye(3), [[0, 1, 2]], color, color_space="srgb")
    np.testing.assert_allclose([*mesh.color[0], mesh.alpha[0]], expected, atol=2e-5)


def test_a_fourth_number_of_a_colour_is_alpha():
    rows = [[0.1, 0.2, 0.3, 0.4]] * 3
    mesh = Mesh(np.eye(3), [[0, 1, 2]], rows, 0.5)
    assert mesh.color.shape == (3, 3)
    np.testing.assert_allclose(mesh.alpha, 0.2)
    np.testing.assert_allclose(Mesh(np.eye(3), [[0, 1, 2]], rows[0]).alpha, 0.4)
    with pytest.raises(MeshError, match=r"color\[0, 3\]: found 1.5; needed an alpha"):
        Mesh(np.eye(3), [[0, 1, 2]], (1, 1, 1, 1.5))
    with pytest.raises(MeshError, match=r"color\[0, 0\]: found 2.0; needed an sRGB number"):
        Mesh(np.eye(3), [[0, 1, 2]], (2.0, 0, 0), color_space="srgb")
    with pytest.raises(ValueError, match="color_space: expected 'linear', 'srgb'"):
        Mesh(np.eye(3), [[0, 1, 2]], color_space="gamma")


class Holder:
    """What has __array__ alone."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self.array, dtype)


class Capsule:
    """What has DLPack alone."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


@pytest.mark.parametrize("wrapped", [Holder, Capsule, memoryview])
def test_whatever_holds_arrays_is_taken(wrapped):
    given = [np.eye(3), np.array([[0, 1, 2]]), np.full((3, 4), 0.5), np.full(3, 0.5), np.eye(3)]
    mesh = Mesh(*(wrapped(array) for array in given))
    np.testing.assert_array_equal(mesh.points, np.eye(3))
    assert mesh.alpha.tolist() == [0.25] * 3


# ---- Other libraries' meshes


def test_trimesh_is_taken_as_it_is():
    trimesh = pytest.importorskip("trimesh", reason="no trimesh")
    box = trimesh.creation.box()
    f = moit.rasterize(box, moit.Camera(eye=(1, 2, 3)), SIZE)
    same(f, moit.rasterize([Mesh(box)], moit.Camera(eye=(1, 2, 3)), SIZE))
    assert moit.Camera(eye=(1, 2, 3)).fit(box).far < 9
    colored = trimesh.Trimesh(
        np.eye(3), [[0, 1, 2]], vertex_colors=[[255, 188, 0, 51]] * 3, process=False
    )
    mesh = Mesh(colored)
    np.testing.assert_allclose([*mesh.color[0], mesh.alpha[0]], (1, 0.50289, 0, 0.2), atol=1e-5)
    faces = trimesh.Trimesh(
        PLACES, [[0, 1, 2], [0, 2, 3]], face_colors=[[255, 0, 0], [0, 0, 255]], process=False
    )
    mesh = Mesh(faces)
    np.testing.assert_array_equal(mesh.color[mesh.triangles[:, 0]], [[1, 0, 0], [0, 0, 1]])
    scene = trimesh.Scene([box, box.copy().apply_translation((3, 0, 0))])
    with pytest.raises(MeshError, match="Scene holds 2 meshes"):
        Mesh(scene)
    g = moit.rasterize(scene, moit.Camera(eye=(1, 2, 9)), SIZE)
    assert len(g) > len(moit.rasterize(box, moit.Camera(eye=(1, 2, 9)), SIZE))


PLACES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])


def polydata(faces, **data):
    held = types.SimpleNamespace(**{"active_scalars": None, "__getitem__": None} | data)
    return types.SimpleNamespace(points=PLACES, faces=np.array(faces), point_data=held)


def test_polydata_is_taken_as_it_is():
    assert Mesh(polydata([3, 0, 1, 2, 3, 0, 2, 3])).triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert Mesh(polydata([4, 0, 1, 2, 3])).triangles.shape == (2, 3)
    assert Mesh(polydata([3, 0, 1, 2, 4, 0, 1, 2, 3])).triangles.shape == (3, 3)
    shades = np.array([[255, 188, 0]] * 4, np.uint8)
    mesh = Mesh(polydata([3, 0, 1, 2], active_scalars=shades))
    np.testing.assert_allclose(mesh.color[0], (1, 0.50289, 0), atol=1e-5)
    scalars = np.arange(4.0)  # which are no colours
    assert Mesh(polydata([3, 0, 1, 2], active_scalars=scalars)).color[0, 0] < 1
    with pytest.raises(MeshError, match="indices beyond the 4 points"):
        Mesh(polydata([3, 0, 1, 9]))
    with pytest.raises(MeshError, match="a face of 9 corners"):
        Mesh(polydata([3, 0, 1, 2, 9, 0]))


@pytest.mark.parametrize("value", [PLACES, "mesh.obj", None, 3, types.SimpleNamespace(vertices=1)])
def test_what_is_no_mesh_needs_triangles(value):
    with pytest.raises(TypeError, match=r"triangles: needed \(T, 3\) integers"):
        Mesh(value)


def test_arguments_take_the_place_of_what_a_foreign_mesh_has():
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    plain = moit.Mesh(box)
    mesh = moit.Mesh(box, color=(1, 0, 0), alpha=0.5, lit=False, transmission=0.25)
    np.testing.assert_array_equal(mesh.triangles, plain.triangles)
    np.testing.assert_array_equal(mesh.normals, plain.normals)
    assert (mesh.color == [1, 0, 0]).all() and (mesh.alpha == 0.5).all()
    assert (mesh.lit, mesh.transmission) == (False, 0.25)
    assert (plain.alpha == 1).all() and plain.lit and not plain.transmission
    with pytest.raises(moit.MeshError, match="alpha"):
        moit.Mesh(box, alpha=2)
