"""glTF 2.0 files: colours, textures, light, and what is not read."""

import warnings

import numpy as np
import pytest
from gltf_files import CORNERS, SQUARE, UV, Building, png

import moit
from moit import MeshError


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


# ---- Transmission


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
