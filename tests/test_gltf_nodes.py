"""glTF 2.0 files: nodes, accessors, morph targets and skins."""

import json

import numpy as np
import pytest
from gltf_files import CORNERS, SQUARE, TYPES, UV, Building, png
from test_gltf import BYTES

import moit
from moit import MeshError


def placed(tmp_path, nodes, roots=(0,)):
    building = Building()
    building.root["nodes"] = nodes
    building.root["scenes"] = [{"nodes": list(roots)}]
    return moit.read_mesh(building.write(tmp_path)).points


def test_nodes_place_meshes_within_one_another(tmp_path):
    turn = [0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)]
    nodes = [
        {"children": [1], "translation": [10, 0, 0]},
        {"children": [2], "rotation": turn},
        {"mesh": 0, "scale": [2, 1, 1], "translation": [0, 0, 5]},
    ]
    found = placed(tmp_path, nodes)
    local = SQUARE[CORNERS] * (2, 1, 1)
    expected = np.c_[10 - local[:, 1], local[:, 0], np.full(6, 5)]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_matrices_are_written_column_by_column(tmp_path):
    matrix = [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 3, 4, 5, 1]
    found = placed(tmp_path, [{"mesh": 0, "matrix": matrix}])
    local = SQUARE[CORNERS]
    np.testing.assert_allclose(found, np.c_[3 - local[:, 1], 4 + local[:, 0], local[:, 2] + 5])


def test_several_nodes_show_one_mesh(tmp_path):
    nodes = [{"mesh": 0}, {"mesh": 0, "translation": [0, 0, -1]}, {"mesh": 0}]
    assert len(placed(tmp_path, nodes, (0, 1))) == 12  # what no scene has is not there


def test_instances_of_a_node_are_drawn(tmp_path):
    building = Building()
    moves = building.accessor(np.array([[0, 0, 0], [5, 0, 0], [0, 7, 0]], "<f4"))
    sizes = building.accessor(np.array([[1, 1, 1], [2, 2, 2], [1, 1, 1]], "<f4"))
    instancing = {"attributes": {"TRANSLATION": moves, "SCALE": sizes}}
    building.root["nodes"] = [
        {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": instancing}},
    ]
    building.root["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    meshes = moit.read_meshes(building.write(tmp_path))
    np.testing.assert_allclose(meshes[1].points, SQUARE[CORNERS] * 2 + (5, 0, 0))
    np.testing.assert_allclose(meshes[2].points, SQUARE[CORNERS] + (0, 7, 0))


@pytest.mark.parametrize("scale", [(1, 2, 3), (-1, 1, 1), (1, 1, 0)])
def test_normals_stay_at_right_angles(tmp_path, scale):
    rng = np.random.default_rng(0)
    place = rng.normal(size=(3, 3)).astype("<f4")
    normal = np.cross(place[1] - place[0], place[2] - place[0])
    building = Building(POSITION=place, NORMAL=np.tile(normal, (3, 1)).astype("<f4"))
    building.primitive["indices"] = building.accessor(np.array([0, 1, 2], "<u1"))
    turn = rng.normal(size=4)
    building.root["nodes"] = [{"mesh": 0, "scale": scale, "rotation": (turn / 9).tolist()}]
    mesh = moit.read_mesh(building.write(tmp_path))
    sides = mesh.points[1:] - mesh.points[0]
    found = mesh.normals[0] / np.linalg.norm(mesh.normals[0])
    np.testing.assert_allclose(sides @ found, 0, atol=1e-5)
    if 0 not in scale:  # and on the same side of the triangle
        facing = np.linalg.det([*sides, found]) * np.prod(scale)
        assert facing > 0


def test_a_file_of_meshes_without_nodes_shows_them(tmp_path):
    building = Building()
    del building.root["nodes"], building.root["scenes"], building.root["scene"]
    assert len(moit.read_mesh(building.write(tmp_path)).triangles) == 2


@pytest.mark.parametrize(
    ("mode", "corners", "triangles"),
    [
        (4, [0, 1, 2, 2, 3, 0, 1], {(0, 1, 2), (0, 2, 3)}),
        (5, [0, 1, 3, 2], {(0, 1, 3), (1, 2, 3)}),
        (6, [1, 2, 3, 0], {(1, 2, 3), (0, 1, 3)}),
    ],
)
@pytest.mark.parametrize("indexed", [True, False])
def test_lists_strips_and_fans_are_triangles(tmp_path, mode, corners, triangles, indexed):
    building = Building() if indexed else Building(POSITION=SQUARE[corners])
    building.primitive["mode"] = mode
    building.primitive["indices"] = building.accessor(np.array(corners, "<u4"))
    if not indexed:
        del building.primitive["indices"]
    mesh = moit.read_mesh(building.write(tmp_path))
    places = np.abs(mesh.points[mesh.triangles][:, :, None] - SQUARE).sum(-1).argmin(-1)
    assert {tuple(sorted(t)) for t in places.tolist()} == triangles
    # all face one way
    assert len({n > 0 for n in mesh.normals[:, 2].tolist()}) == 1


def test_points_and_lines_are_named_and_left_out(tmp_path):
    building = Building()
    lines = dict(building.primitive, mode=1)
    building.root["meshes"][0]["primitives"].append(lines)
    with pytest.warns(UserWarning, match="not drawn: lines"):
        mesh = moit.read_mesh(building.write(tmp_path))
    assert len(mesh.triangles) == 2


def test_sparse_accessors_replace_some(tmp_path):
    building = Building()
    accessor = building.root["accessors"][building.primitive["attributes"]["POSITION"]]
    accessor["sparse"] = {
        "count": 2,
        "indices": {"bufferView": building.view(b"\x01\x03"), "componentType": 5121},
        "values": {"bufferView": building.view(np.float32([[9, 9, 9], [7, 7, 7]]).tobytes())},
    }
    expected = SQUARE.copy()
    expected[[1, 3]] = [[9], [7]]
    found = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_array_equal(found.points, expected[CORNERS])
    del accessor["bufferView"]  # zeros, but for some
    expected[[0, 2]] = 0
    found = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_array_equal(found.points, expected[CORNERS])


@pytest.mark.parametrize(
    ("kind", "normalized", "scale"),
    [("<i2", True, 32767), ("<i1", True, 127), ("<u2", False, 1), ("<i1", False, 1)],
)
def test_quantised_positions_are_read(tmp_path, kind, normalized, scale):
    building = Building()
    whole = (SQUARE * scale + (0 if "i" in kind else 1)).astype(kind)
    padded = np.zeros((4, 4), kind)
    padded[:, :3] = whole
    view = building.view(padded.tobytes(), byteStride=4 * padded.itemsize)
    accessor = building.root["accessors"][building.primitive["attributes"]["POSITION"]]
    accessor |= {"bufferView": view, "componentType": TYPES[kind[1:]], "normalized": normalized}
    building.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    expected = whole / scale if normalized else whole.astype(float)
    mesh = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_allclose(mesh.points, expected[CORNERS], atol=1e-6)


def test_interleaved_attributes_are_taken_apart(tmp_path):
    building = Building()
    rows = np.zeros(4, [("place", "<f4", 3), ("normal", "<f4", 3), ("uv", "<u2", 2)])
    rows["place"], rows["normal"] = SQUARE, (0, 0.6, 0.8)
    view = building.view(rows.tobytes(), byteStride=rows.itemsize)
    one = {"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3"}
    building.root["accessors"] += [one, one | {"byteOffset": 12}]
    building.primitive["attributes"] = {"POSITION": 2, "NORMAL": 3}
    mesh = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_array_equal(mesh.points, SQUARE)
    np.testing.assert_allclose(mesh.normals, [[0, 0.6, 0.8]] * 4)


def test_morph_targets_move_by_the_weights_of_the_file(tmp_path):
    building = Building()
    building.primitive["targets"] = [{"POSITION": building.accessor(SQUARE[::-1].copy())}] * 2
    building.root["meshes"][0]["weights"] = [0, 0.5]
    mesh = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_allclose(mesh.points, (SQUARE + 0.5 * SQUARE[::-1])[CORNERS])
    building.root["nodes"][0]["weights"] = [1, 0]
    mesh = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_allclose(mesh.points, (SQUARE + SQUARE[::-1])[CORNERS])


def skinned(joints=(1, 2), which=0):
    """A square whose left half follows one joint, whose right another, which is moved."""
    building = Building()
    weights = np.array([[1, 0, 0, 0], [0, 2, 0, 0], [0, 2, 0, 0], [1, 0, 0, 0]], "<f4")
    building.primitive["attributes"] |= {
        "JOINTS_0": building.accessor(np.array([[0, 1, 0, which]] * 4, "<u1")),
        "WEIGHTS_0": building.accessor(weights),
    }
    bound = np.tile(np.eye(4, dtype="<f4"), (2, 1, 1))
    bound[1, 3, :3] = -1, 0, 0  # column by column: the second joint began at (1, 0, 0)
    view = building.accessor(bound.reshape(2, 16))
    building.root["skins"] = [{"joints": list(joints), "inverseBindMatrices": view}]
    building.root["nodes"] = [
        {"mesh": 0, "skin": 0, "translation": [50, 0, 0]},  # which does not count
        {"children": [2]},
        {"translation": [1, 0, 3]},
    ]
    building.root["scenes"] = [{"nodes": [0, 1]}]
    return building


def test_skins_follow_their_joints(tmp_path):
    mesh = moit.read_mesh(skinned().write(tmp_path))
    expected = SQUARE + np.where(SQUARE[:, :1] > 0, [0, 0, 3], 0)
    np.testing.assert_allclose(mesh.points, expected[CORNERS], atol=1e-6)
    with pytest.raises(MeshError, match="JOINTS_0: needed integers below 2"):
        moit.read_mesh(skinned(which=2).write(tmp_path))
    with pytest.raises(MeshError, match=r"skins\[0\].joints\[1\]: found 9"):
        moit.read_mesh(skinned(joints=(1, 9)).write(tmp_path))


def test_binary_files_hold_the_same(tmp_path):
    building = Building(TEXCOORD_0=UV).material(png(BYTES), alphaMode="BLEND")
    one, other = (moit.read_mesh(w(tmp_path)) for w in (building.write, building.write_glb))
    for name in ("vertices", "triangles", "color", "alpha", "normals", "uv"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(one.texture.texels, other.texture.texels)


@pytest.mark.parametrize("kind", ["data, percent", "file"])
def test_buffers_may_lie_elsewhere(tmp_path, kind):
    building = Building()
    root = building.json()
    if kind == "file":
        (tmp_path / "num bers.bin").write_bytes(bytes(building.bytes) + b"more")
        root["buffers"][0]["uri"] = "num%20bers.bin"
    else:
        text = "".join(f"%{byte:02x}" for byte in building.bytes)
        root["buffers"][0]["uri"] = f"data:application/octet-stream,{text}"
    path = tmp_path / "file.gltf"
    path.write_text(json.dumps(root))
    np.testing.assert_array_equal(moit.read_mesh(path).points, SQUARE[CORNERS])
