"""glTF 2.0 files: colours, textures, nodes, accessors, and what damaged ones say."""

import base64
import io
import json
import struct
import warnings

import numpy as np
import pytest

import moit
from moit import MeshError

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "<f4")
CORNERS = np.array([0, 1, 2, 0, 2, 3], "<u2")
UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "<f4")
TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Building:
    """A glTF file in the making: one mesh of one primitive at one node, to be changed."""

    def __init__(self, **attributes):
        self.bytes = bytearray()
        self.root = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "accessors": [],
            "bufferViews": [],
        }
        attributes = {"POSITION": SQUARE} | attributes
        held = {name: self.accessor(one) for name, one in attributes.items()}
        self.primitive = {"attributes": held, "indices": self.accessor(CORNERS)}
        self.root["meshes"] = [{"primitives": [self.primitive]}]

    def view(self, content, **options):
        self.bytes += bytes(-len(self.bytes) % 4)
        place = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(content)}
        self.root["bufferViews"].append(place | options)
        self.bytes += content
        return len(self.root["bufferViews"]) - 1

    def accessor(self, array, **options):
        array = np.asarray(array)
        width = 1 if array.ndim == 1 else array.shape[1]
        one = {
            "bufferView": self.view(array.tobytes()),
            "componentType": TYPES[array.dtype.str[1:]],
            "count": len(array),
            "type": SHAPES[width],
        }
        self.root["accessors"].append(one | options)
        return len(self.root["accessors"]) - 1

    def material(self, texture=None, sampler=None, info=None, **material):
        material.setdefault("pbrMetallicRoughness", {})
        self.root["materials"] = [*self.root.get("materials", []), material]
        self.primitive["material"] = len(self.root["materials"]) - 1
        if texture is not None:
            self.root["images"] = [{"bufferView": self.view(texture), "mimeType": "image/png"}]
            self.root["textures"] = [{"source": 0} | ({"sampler": 0} if sampler else {})]
            if sampler:
                self.root["samplers"] = [sampler]
            material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0} | (info or {})
        return self

    def json(self):
        data = base64.b64encode(self.bytes).decode()
        uri = f"data:application/octet-stream;base64,{data}"
        return self.root | {"buffers": [{"byteLength": len(self.bytes), "uri": uri}]}

    def write(self, folder, name="file.gltf"):
        path = folder / name
        path.write_text(json.dumps(self.json()))
        return path

    def write_glb(self, folder):
        root = self.root | {"buffers": [{"byteLength": len(self.bytes)}]}
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.bytes) + bytes(-len(self.bytes) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
        path = folder / "file.glb"
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path


def png(pixels):
    image = pytest.importorskip("PIL.Image", reason="no Pillow, so no textures")
    held = io.BytesIO()
    image.fromarray(np.asarray(pixels, np.uint8)).save(held, "png")
    return held.getvalue()


def colors(mesh):
    return np.c_[mesh.color, mesh.alpha]


# ---- Colour


@pytest.mark.parametrize("mode", ["OPAQUE", "MASK", "BLEND", None])
def test_base_colour_is_factor_times_colour_of_vertices_and_linear(tmp_path, mode):
    own = np.array([[1, 0.5, 0.25, 0.5]] * 4, "<f4")
    material = {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.5, 0.8, 0.8]}}
    if mode:
        material["alphaMode"] = mode
    mesh = moit.read_mesh(Building(COLOR_0=own).material(**material).write(tmp_path))
    alpha = 1.0 if mode in ("OPAQUE", None) else 0.4
    np.testing.assert_allclose(colors(mesh), [[0.2, 0.25, 0.2, alpha]] * 6, rtol=1e-6)
    assert mesh.alpha_cutoff == (0.5 if mode == "MASK" else None)
    assert mesh.lit


def test_colours_without_a_material_are_linear_and_opaque(tmp_path):
    own = np.array([[0.2, 0.5, 0.9, 0.3]] * 4, "<f4")
    mesh = moit.read_mesh(Building(COLOR_0=own).write(tmp_path))
    np.testing.assert_allclose(colors(mesh), [[0.2, 0.5, 0.9, 1]] * 6, rtol=1e-6)


def test_what_has_no_material_is_white(tmp_path):
    np.testing.assert_array_equal(colors(moit.read_mesh(Building().write(tmp_path))), 1)


@pytest.mark.parametrize(("kind", "most"), [("<u1", 255), ("<u2", 65535)])
def test_colours_of_whole_numbers_are_shares(tmp_path, kind, most):
    building = Building().material(alphaMode="BLEND")
    own = np.array([[most, 0, most // 5, most // 3]] * 4, kind)
    building.primitive["attributes"]["COLOR_0"] = building.accessor(own, normalized=True)
    mesh = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_allclose(colors(mesh)[0], [1, 0, (most // 5) / most, (most // 3) / most])


def test_colours_beyond_1_are_held_there(tmp_path):
    own = np.array([[2, -1, 0.5]] * 4, "<f4")
    mesh = moit.read_mesh(Building(COLOR_0=own).write(tmp_path))
    np.testing.assert_array_equal(mesh.color[0], [1, 0, 0.5])


def test_unlit_materials_are_not_lit(tmp_path):
    building = Building().material(extensions={"KHR_materials_unlit": {}})
    building.root["extensionsUsed"] = ["KHR_materials_unlit"]
    assert not moit.read_mesh(building.write(tmp_path)).lit


BLACK = {"baseColorFactor": [0, 0, 0, 0.5]}


@pytest.mark.parametrize(("mode", "alpha"), [("OPAQUE", 1), ("BLEND", 0.5)])
@pytest.mark.parametrize("strength", [None, 8])
def test_black_materials_show_what_they_emit(tmp_path, mode, alpha, strength):
    """Unlit, and colours of vertices, which belong to the base colour, tint it not."""
    extensions = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
    building = Building(COLOR_0=np.array([[1, 0.5, 0.25]] * 4, "<f4")).material(
        pbrMetallicRoughness=BLACK,
        emissiveFactor=[0.5, 0.25, 1],
        extensions=extensions if strength else {},
        alphaMode=mode,
    )
    mesh = moit.read_mesh(building.write(tmp_path))  # warnings are errors here
    glow = np.array([0.5, 0.25, 1]) * (strength or 1)
    np.testing.assert_allclose(colors(mesh), [[*glow, alpha]] * 6, rtol=1e-6)
    assert not mesh.lit


def test_textures_of_emission_are_colours_without_alpha(tmp_path):
    building = Building(TEXCOORD_0=UV).material(png(BYTES))
    material = building.root["materials"][0]
    material["emissiveTexture"] = material["pbrMetallicRoughness"].pop("baseColorTexture")
    material |= {"emissiveFactor": [1, 1, 0.5], "pbrMetallicRoughness": BLACK, "alphaMode": "BLEND"}
    mesh = moit.read_mesh(building.write(tmp_path))
    assert (mesh.texture.texels[..., 3] == 1).all()
    np.testing.assert_allclose(mesh.texture.texels[0, 0, :3], [1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(colors(mesh), [[1, 1, 0.5, 0.5]] * 6, rtol=1e-6)


@pytest.mark.parametrize(
    ("material", "named"),
    [
        ({"pbrMetallicRoughness": {"baseColorFactor": [0, 0.1, 0, 1]}}, ["emission"]),
        ({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}}, ["emission"]),
        ({"extensions": {"KHR_materials_unlit": {}}}, []),
    ],
)
def test_emission_beside_other_light_is_named(tmp_path, material, named):
    material = {"pbrMetallicRoughness": BLACK, "emissiveFactor": [1, 0, 0]} | material
    path = Building().material(**material).write(tmp_path)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        moit.read_mesh(path)
    assert [str(one.message).rsplit(": ", 1)[1] for one in caught] == named


@pytest.mark.parametrize(
    ("material", "words"),
    [
        ({"emissiveFactor": [1, -1, 0]}, "emissiveFactor.* -1"),
        (
            {"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": -2}}},
            "emissiveStrength.* -2",
        ),
    ],
)
def test_emission_is_no_less_than_none(tmp_path, material, words):
    with pytest.raises(moit.MeshError, match=words):
        moit.read_mesh(Building().material(**material).write(tmp_path))


def test_specular_glossiness_gives_its_diffuse_colour(tmp_path):
    old = {"diffuseFactor": [0.1, 0.2, 0.3, 0.4]}
    extensions = {"KHR_materials_pbrSpecularGlossiness": old}
    building = Building().material(extensions=extensions, alphaMode="BLEND")
    mesh = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_allclose(colors(mesh)[0], [0.1, 0.2, 0.3, 0.4], rtol=1e-6)


def test_several_materials_without_textures_are_one_mesh(tmp_path):
    building = Building().material(
        pbrMetallicRoughness={"baseColorFactor": [0.1, 0.2, 0.3, 0.4]}, alphaMode="BLEND"
    )
    building.material(pbrMetallicRoughness={"baseColorFactor": [0.5, 0.6, 0.7, 0.8]})
    first = dict(building.primitive, material=0)
    building.root["meshes"][0]["primitives"] = [first, building.primitive]
    path = building.write(tmp_path)
    mesh = moit.read_mesh(path)
    np.testing.assert_allclose(colors(mesh)[0], [0.1, 0.2, 0.3, 0.4], rtol=1e-6)
    np.testing.assert_allclose(colors(mesh)[-1], [0.5, 0.6, 0.7, 1], rtol=1e-6)
    assert len(moit.read_meshes(path)) == 2


# ---- Textures

BYTES = [[[255, 0, 0, 255], [0, 255, 0, 128]], [[0, 0, 255, 0], [188, 188, 188, 255]]]


@pytest.mark.parametrize("mode", ["OPAQUE", "MASK", "BLEND"])
def test_textures_are_decoded_and_opaque_ones_have_no_alpha(tmp_path, mode):
    building = Building(TEXCOORD_0=UV).material(png(BYTES), alphaMode=mode)
    mesh = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_allclose(mesh.texture.texels[1, 1, :3], 0.5029, atol=1e-3)
    alpha = [[1, 1], [1, 1]] if mode == "OPAQUE" else [[1, 128 / 255], [0, 1]]
    np.testing.assert_allclose(mesh.texture.texels[..., 3], alpha, rtol=1e-6)
    np.testing.assert_array_equal(mesh.uv, UV[[0, 1, 2, 0, 2, 3]])
    np.testing.assert_array_equal(mesh.color, 1)


@pytest.mark.parametrize(
    ("sampler", "wrap", "filter"),
    [
        ({}, ("repeat", "repeat"), "mipmap"),
        ({"wrapS": 33071, "wrapT": 33648}, ("clamp", "mirror"), "mipmap"),
        ({"wrapS": 10497, "magFilter": 9728}, ("repeat", "repeat"), "nearest"),
        ({"magFilter": 9728, "minFilter": 9987}, ("repeat", "repeat"), "nearest"),
        ({"minFilter": 9728}, ("repeat", "repeat"), "nearest"),
        ({"magFilter": 9729, "minFilter": 9729}, ("repeat", "repeat"), "bilinear"),
        ({"magFilter": 9729, "minFilter": 9728}, ("repeat", "repeat"), "bilinear"),
        ({"magFilter": 9729}, ("repeat", "repeat"), "mipmap"),
        ({"magFilter": 9729, "minFilter": 9985}, ("repeat", "repeat"), "mipmap"),
    ],
)
def test_samplers_say_how_textures_go_on_and_are_read(tmp_path, sampler, wrap, filter):
    building = Building(TEXCOORD_0=UV).material(png(BYTES), sampler or None)
    texture = moit.read_mesh(building.write(tmp_path)).texture
    assert texture.wraps == wrap
    assert texture.filter == filter


@pytest.mark.parametrize(
    ("transform", "expected"),
    [
        ({"offset": [0.25, 0.5]}, lambda u, v: (u + 0.25, v + 0.5)),
        ({"scale": [2, -3]}, lambda u, v: (2 * u, -3 * v)),
        # the specification's example: the lower left quarter, turned clockwise
        (
            {"offset": [0, 1], "rotation": np.pi / 2, "scale": [0.5, 0.5]},
            lambda u, v: (0.5 * v, 1 - 0.5 * u),
        ),
        # it scales first, so that a turn does not shear
        ({"rotation": np.pi / 2, "scale": [2, 3]}, lambda u, v: (3 * v, -2 * u)),
    ],
)
def test_texture_transforms_move_coordinates(tmp_path, transform, expected):
    info = {"extensions": {"KHR_texture_transform": transform}}
    building = Building(TEXCOORD_0=UV).material(png(BYTES), info=info)
    mesh = moit.read_mesh(building.write(tmp_path))
    given = np.array([expected(u, v) for u, v in UV[CORNERS]])
    np.testing.assert_allclose(mesh.uv, given, atol=1e-6)


@pytest.mark.parametrize("by_transform", [False, True])
def test_a_texture_names_its_coordinates(tmp_path, by_transform):
    other = UV * 3
    info = {"texCoord": 0 if by_transform else 1}
    if by_transform:
        info["extensions"] = {"KHR_texture_transform": {"texCoord": 1}}
    building = Building(TEXCOORD_0=UV, TEXCOORD_1=other).material(png(BYTES), info=info)
    mesh = moit.read_mesh(building.write(tmp_path))
    np.testing.assert_array_equal(mesh.uv, other[CORNERS])


def test_coordinates_of_whole_numbers_are_shares(tmp_path):
    building = Building().material(png(BYTES))
    own = building.accessor((UV * 65535).astype("<u2"), normalized=True)
    building.primitive["attributes"]["TEXCOORD_0"] = own
    np.testing.assert_allclose(moit.read_mesh(building.write(tmp_path)).uv, UV[CORNERS])


@pytest.mark.parametrize("pixels", [np.full((2, 3), 7), np.full((2, 3, 3), 7)])
def test_grey_and_opaque_pictures_are_textures(tmp_path, pixels):
    building = Building(TEXCOORD_0=UV).material(png(pixels), alphaMode="BLEND")
    texture = moit.read_mesh(building.write(tmp_path)).texture
    assert texture.texels.shape == (2, 3, 4) and not texture.transparent


def test_pictures_may_be_files_beside(tmp_path):
    building = Building(TEXCOORD_0=UV).material(png(BYTES))
    building.root["images"] = [{"uri": "a%20picture.png"}]
    (tmp_path / "a picture.png").write_bytes(png(BYTES))
    assert moit.read_mesh(building.write(tmp_path)).texture.texels.shape == (2, 2, 4)


def test_parts_of_several_textures_are_several_meshes(tmp_path):
    building = Building(TEXCOORD_0=UV).material(png(BYTES))
    plain = dict(building.primitive)
    del plain["material"]
    building.root["meshes"][0]["primitives"].append(plain)
    path = building.write(tmp_path)
    with pytest.raises(MeshError, match="read_meshes gives"):
        moit.read_mesh(path)
    textured, bare = moit.read_meshes(path)
    assert textured.texture is not None and bare.texture is None


# ---- Nodes


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


# ---- Triangles and accessors


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


# ---- What is not read


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda b: b.material(emissiveFactor=[1, 0, 0]), "emission"),
        (lambda b: b.material(normalTexture={"index": 0}), "normalTexture"),
        (
            lambda b: b.material(extensions={"KHR_materials_volume": {}}),
            "KHR_materials_volume",
        ),
        (
            lambda b: b.root.update(extensions={"KHR_lights_punctual": {"lights": []}}),
            "KHR_lights_punctual",
        ),
    ],
)
def test_what_would_change_the_picture_is_named_once(tmp_path, change, named):
    building = Building()
    change(building)
    building.root["meshes"][0]["primitives"] *= 2
    path = building.write(tmp_path)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        moit.read_mesh(path)
    assert [str(one.message) for one in caught] == [f"{str(path)!r}: not drawn: {named}"]
    assert caught[0].filename == __file__


def test_nothing_is_warned_of_without_reason(tmp_path):
    building = Building().material(
        emissiveFactor=[0, 0, 0],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 2}},
    )
    building.root["extensionsUsed"] = ["KHR_materials_emissive_strength"]
    moit.read_mesh(building.write(tmp_path))  # warnings are errors here


# ---- Damage


def bad_index(b):
    b.primitive["indices"] = b.accessor(np.array([0, 1, 4], "<u2"))


def without_bytes(b):
    del b.root["accessors"][0]["bufferView"]
    b.root["accessors"][0]["count"] = 2**40


def instances_without_end(b):
    b.root["accessors"].append({"componentType": 5126, "count": 2**22, "type": "VEC3"})
    extension = {"attributes": {"TRANSLATION": 2}}
    b.root["nodes"] = [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": extension}}] * 64
    b.root["scenes"] = [{"nodes": list(range(64))}]


DAMAGE = {
    "an index beyond": (bad_index, r"primitives\[0\].indices: found 4; needed one of 4"),
    "a count beyond": (
        lambda b: b.root["accessors"][0].update(count=5),
        r"accessors\[0\]: 5 elements end at byte 60 of a view of 48",
    ),
    "a huge count": (
        lambda b: b.root["accessors"][0].update(count=2**60),
        r"accessors\[0\]: \d+ elements end at",
    ),
    "a count of another kind": (
        lambda b: b.root["accessors"][0].update(count="4"),
        r"accessors\[0\].count: found '4'; needed an integer",
    ),
    "zeros without end": (without_bytes, "elements without bytes"),
    "instances without end": (instances_without_end, "found more than"),
    "a view beyond": (
        lambda b: b.root["bufferViews"][0].update(byteLength=2**40),
        r"bufferViews\[0\]: ends at byte",
    ),
    "an offset below 0": (
        lambda b: b.root["bufferViews"][0].update(byteOffset=-4),
        "byteOffset: found -4",
    ),
    "no such view": (
        lambda b: b.root["accessors"][0].update(bufferView=99),
        r"accessors\[0\].bufferView: found 99",
    ),
    "no such material": (
        lambda b: b.primitive.update(material=3),
        "material: found 3; there are none",
    ),
    "no such mesh": (lambda b: b.root.update(nodes=[{"mesh": 7}]), r"nodes\[0\].mesh: found 7"),
    "a circle": (
        lambda b: b.root.update(nodes=[{"mesh": 0, "children": [1]}, {"children": [0]}]),
        r"nodes\[0\]: is in a circle",
    ),
    "itself": (
        lambda b: b.root.update(nodes=[{"mesh": 0, "children": [0]}]),
        r"nodes\[0\]: is in a circle",
    ),
    "two parents": (
        lambda b: b.root.update(nodes=[{"children": [2]}, {"children": [2]}, {"mesh": 0}]),
        r"nodes\[2\]: is a child of nodes 0 and 1",
    ),
    "a matrix of nine": (
        lambda b: b.root.update(nodes=[{"mesh": 0, "matrix": [1] * 9}]),
        r"nodes\[0\].matrix: found .*; needed 16 numbers",
    ),
    "a number that is none": (
        lambda b: b.root.update(nodes=[{"mesh": 0, "scale": [1, float("nan"), 1]}]),
        r"nodes\[0\].scale\[1\]: found nan",
    ),
    "an unknown kind": (
        lambda b: b.root["accessors"][0].update(componentType=5130),
        "componentType: found 5130",
    ),
    "an unknown type": (lambda b: b.root["accessors"][0].update(type="VEC5"), "type: found 'VEC5'"),
    "an unknown mode": (lambda b: b.primitive.update(mode=7), "mode: found 7"),
    "a stride too small": (
        lambda b: b.root["bufferViews"][0].update(byteStride=8),
        "byteStride: 8 is less than 12",
    ),
    "an attribute of another length": (
        lambda b: b.primitive["attributes"].update(NORMAL=b.accessor(SQUARE[:3].copy())),
        "NORMAL: has 3 elements; needed 4",
    ),
    "positions in a plane": (
        lambda b: b.primitive["attributes"].update(POSITION=b.accessor(UV)),
        "POSITION: has 2 components; needed 3",
    ),
    "positions that are not finite": (
        lambda b: b.primitive["attributes"].update(
            POSITION=b.accessor(SQUARE * np.float32(np.nan))
        ),
        "POSITION: has numbers that are not finite",
    ),
    "an extension that is needed": (
        lambda b: b.root.update(extensionsRequired=["KHR_draco_mesh_compression"]),
        "needs KHR_draco_mesh_compression, which is not read",
    ),
    "compression": (
        lambda b: b.primitive.update(extensions={"KHR_draco_mesh_compression": {}}),
        "is compressed by KHR_draco_mesh_compression",
    ),
    "version 1": (lambda b: b.root.update(asset={"version": "1.0"}), "asset.version: found '1.0'"),
    "no asset": (lambda b: b.root.pop("asset"), "asset.version: needed"),
    "a list for an object": (lambda b: b.root.update(nodes=[[]]), r"nodes\[0\]: found \[\]"),
    "an alpha mode": (lambda b: b.material(alphaMode="GLASS"), "alphaMode: found 'GLASS'"),
    "a factor": (
        lambda b: b.material(pbrMetallicRoughness={"baseColorFactor": [1, 1, 1, 1.5]}),
        "baseColorFactor: found",
    ),
    "nothing": (lambda b: b.root.update(scenes=[{"nodes": []}]), "expected triangles, found none"),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_damaged_files_say_what_is_wrong(tmp_path, kind):
    change, words = DAMAGE[kind]
    building = Building()
    change(building)
    with pytest.raises(MeshError, match=rf"file\.gltf.*{words}"):
        moit.read_mesh(building.write(tmp_path))


@pytest.mark.parametrize(
    ("uri", "words"),
    [
        ("http://example.org/a.bin", "needed data or a file beside this one"),
        ("/etc/hostname", "needed data or a file beside this one"),
        ("none.bin", "there is no file"),
        ("data:;base64,AAA", "base64 is damaged"),
        ("data:;base64,AAAA", r"buffers\[0\]: has 3 bytes; needed its byteLength"),
        ("data:nothing", "a data URI without data"),
        (None, "has no bytes"),
    ],
)
def test_buffers_that_are_not_there_say_so(tmp_path, uri, words):
    root = Building().json()
    root["buffers"][0]["uri"] = uri
    if uri is None:
        del root["buffers"][0]["uri"]
    path = tmp_path / "file.gltf"
    path.write_text(json.dumps(root))
    with pytest.raises(MeshError, match=words):
        moit.read_mesh(path)


def test_damaged_bytes_never_do_worse_than_a_mesh_error(tmp_path):
    building = Building(TEXCOORD_0=UV, COLOR_0=np.ones((4, 4), "<f4"))
    building.material(png(BYTES), {"wrapS": 33071}, alphaMode="BLEND")
    rng = np.random.default_rng(5)
    for path in (building.write(tmp_path), building.write_glb(tmp_path)):
        good = path.read_bytes()
        for _ in range(150):
            bad = bytearray(good)
            for _ in range(rng.integers(1, 6)):
                bad[rng.integers(len(bad))] = rng.integers(256)
            if rng.random() < 0.3:
                bad = bad[: rng.integers(len(bad))]
            path.write_bytes(bad)
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    moit.read_meshes(path)
            except MeshError:
                pass


def test_deep_json_is_damage(tmp_path):
    path = tmp_path / "deep.gltf"
    path.write_text("[" * 100000)
    with pytest.raises(MeshError, match="deep"):
        moit.read_mesh(path)


def test_a_long_chain_of_nodes_is_no_trouble(tmp_path):
    count = 5000
    nodes = [{"children": [i + 1], "translation": [1, 0, 0]} for i in range(count)]
    found = placed(tmp_path, [*nodes, {"mesh": 0}])
    np.testing.assert_allclose(found, SQUARE[CORNERS] + (count, 0, 0))


@pytest.mark.parametrize("mode", ["OPAQUE", "BLEND"])
@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_transmission_passes_light_tinted_by_the_base_colour(tmp_path, mode, share):
    building = Building()
    extension = {"KHR_materials_transmission": {"transmissionFactor": share}}
    base = {"baseColorFactor": [0.2, 0.5, 0.9, 0.5]}
    building.material(pbrMetallicRoughness=base, alphaMode=mode, extensions=extension)
    (mesh,) = moit.read_meshes(building.write(tmp_path))
    assert mesh.transmission == share
    f = moit.rasterize(mesh, moit.Camera(eye=(0, 0, 3)), (9, 9))[4, 4]
    alpha, tint = (1.0 if mode == "OPAQUE" else 0.5), np.array([0.2, 0.5, 0.9])
    assert f.alpha.tolist() == [alpha]
    if share:
        np.testing.assert_allclose(f.transmission, share * tint[None], rtol=1e-6)
    seen = moit.composite(f, "sorted", background=(1, 1, 1))[0, 0, :3]
    opaque = moit.rasterize(
        moit.Mesh(SQUARE, CORNERS.reshape(-1, 3), tint), moit.Camera((0, 0, 3)), (9, 9)
    )
    lit = opaque[4, 4].color[0]  # glass reflects what remains, as it is lit
    expected = alpha * (1 - share) * lit + 1 - alpha * (1 - share * tint)
    np.testing.assert_allclose(seen, expected, rtol=1e-5)


@pytest.mark.parametrize(
    ("material", "words"),
    [({"transmissionFactor": 1.5}, "needed .0, 1."), ({"transmissionFactor": "x"}, "transmission")],
)
def test_transmission_is_a_share(tmp_path, material, words):
    building = Building()
    building.material(extensions={"KHR_materials_transmission": material})
    with pytest.raises(MeshError, match=words):
        moit.read_meshes(building.write(tmp_path))


def test_a_texture_of_transmission_is_named(tmp_path):
    building = Building()
    glass = {"transmissionFactor": 1, "transmissionTexture": {"index": 0}}
    building.material(extensions={"KHR_materials_transmission": glass})
    with pytest.warns(UserWarning, match="the texture of KHR_materials_transmission"):
        moit.read_meshes(building.write(tmp_path))
