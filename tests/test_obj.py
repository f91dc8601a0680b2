"""OBJ files and their materials; PLY, STL and OFF."""

import struct
import sys

import numpy as np
import pytest

import moit
from moit import MeshError

SQUARE = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
PLACES = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


def read(tmp_path, text, **others):
    for name, content in others.items():
        name = name.replace("_", ".")
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    path = tmp_path / "file.obj"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return moit.read_mesh(path)


def png(tmp_path, name, pixels):
    image = pytest.importorskip("PIL.Image", reason="no Pillow, so no textures")
    image.fromarray(np.asarray(pixels, np.uint8)).save(tmp_path / name)


def looks(mesh):
    rows = np.round(np.c_[mesh.color, mesh.alpha].astype(float), 5).tolist()
    return sorted({tuple(row) for row in rows})


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ("Kd 0.2 0.5 0.9\nd 0.4", (0.2, 0.5, 0.9, 0.4)),
        ("Kd 0.2 0.5 0.9\nTr 0.6", (0.2, 0.5, 0.9, 0.4)),
        ("Kd 0.2 0.5 0.9\nTr 0.6\nd 0.4", (0.2, 0.5, 0.9, 0.4)),
        ("Kd 0.25\n", (0.25, 0.25, 0.25, 1)),
        ("\tKd  0.2\t0.5  0.9 # blue\n\td -halo 0.5", (0.2, 0.5, 0.9, 0.5)),
        ("Ka 1 1 1\nKs 1 1 1\nNs 30\nillum 2\nKd 1 0 0\nd 1", (1, 0, 0, 1)),
        ("kd 0.1 0.2 0.3", (0.1, 0.2, 0.3, 1)),
    ],
)
def test_materials_give_colour_and_opacity(tmp_path, lines, expected):
    text = f"mtllib a.mtl\n{SQUARE}usemtl one\nf 1 2 3 4\n"
    mesh = read(tmp_path, text, a_mtl=f"newmtl one\n{lines}\n")
    assert looks(mesh) == [expected]


def test_each_face_has_the_material_before_it(tmp_path):
    materials = "newmtl a b\nKd 1 0 0\nnewmtl c\nKd 0 1 0\nd 0.5\nnewmtl d\nKd 0 0 1\n"
    text = (
        f"mtllib a.mtl\n{SQUARE}f 1 2 3\nusemtl a b\nf 1 2 3\nusemtl c\nf 1 3 4\nusemtl a b\n"
        "f 2 3 4\ng group\nf 4 1 2\n"
    )
    mesh = read(tmp_path, text, a_mtl=materials)
    first = [tuple(np.round(mesh.color[t[0]], 3)) for t in mesh.triangles]
    grey = (0.445, 0.445, 0.445)
    assert first == [grey, (1, 0, 0), (0, 1, 0), (1, 0, 0), (1, 0, 0)]


@pytest.mark.parametrize("line", ["mtllib a.mtl b.mtl", "mtllib a.mtl\nmtllib b.mtl"])
def test_several_libraries_are_read(tmp_path, line):
    text = f"{line}\n{SQUARE}usemtl x\nf 1 2 3\nusemtl y\nf 1 3 4\n"
    mesh = read(tmp_path, text, a_mtl="newmtl x\nKd 1 0 0\n", b_mtl="newmtl y\nKd 0 1 0\n")
    assert looks(mesh) == [(0, 1, 0, 1), (1, 0, 0, 1)]


def test_a_library_may_have_spaces_in_its_name(tmp_path):
    (tmp_path / "my colours.mtl").write_text("newmtl x\nKd 1 0 0\n")
    assert looks(read(tmp_path, f"mtllib my colours.mtl\n{SQUARE}usemtl x\nf 1 2 3\n")) == [
        (1, 0, 0, 1)
    ]


@pytest.mark.parametrize(
    "text",
    [
        SQUARE + "f 1 2 3 4\n",
        SQUARE + "f -4 -3 -2 -1\n",
        SQUARE + "f 1/ 2/ 3/ 4/\n",
        SQUARE + "f 1// 2// 3// 4//\n",
        SQUARE + PLACES + "f 1/1 2/2 3/3 4/4\n",
        SQUARE + PLACES + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n",
        SQUARE + "vn 0 0 1\nf -4//-1 -3//-1 -2//-1 -1//-1\n",
        SQUARE + "f 1 2 \\\n3 4\n",
        SQUARE.replace(" ", "\t") + "f\t1\t2\t3\t4\t\n",
        SQUARE.replace("\n", "\r\n") + "f 1 2 3 4\r\n",
        SQUARE.replace("\n", "\r") + "f 1 2 3 4\r",
        "\ufeff# a comment\n" + SQUARE + "o thing\ng a b\ns 1\nl 1 2 3\np 4\nf 1 2 3 4 # corners\n",
        "  v -1 -1 0 1.0\nv 1 -1 0\n v 1 1 0e0\nv -1. 1 0\n  f  1 2  3 4",
        "v -1 -1 0\nv 1 -1 0\nf -2 -1 3 4\nv 1 1 0\nv -1 1 0\n",
        SQUARE + "f 1 2 3\nf 1/ 3// 4\n",
    ],
)
def test_faces_are_written_in_many_ways(tmp_path, text):
    mesh = read(tmp_path, text)
    corners = mesh.points[mesh.triangles]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert area.sum() / 2 == 4
    assert {tuple(row) for row in mesh.points.tolist()} == {
        (x, y, 0.0) for x in (-1, 1) for y in (-1, 1)
    }
    np.testing.assert_allclose(np.abs(mesh.normals), [[0, 0, 1]] * len(mesh.normals), atol=1e-6)


def test_normals_and_places_belong_to_corners(tmp_path):
    text = SQUARE + PLACES + "vn 0 0 1\nvn 1 0 0\nf 1/1/1 2/2/1 3/3/2\nf 1/2/2 3/4/2 4/1/1\n"
    png(tmp_path, "p.png", np.zeros((2, 2, 3)))
    mesh = read(tmp_path, "mtllib a.mtl\nusemtl m\n" + text, a_mtl="newmtl m\nmap_Kd p.png\n")
    assert len(mesh.vertices) == 6  # no two of which share position, place and normal
    corners = mesh.triangles.reshape(-1)
    np.testing.assert_array_equal(mesh.normals[corners][:, 0], [0, 0, 1, 1, 1, 0])
    np.testing.assert_array_equal(
        mesh.uv[corners], [[0, 1], [1, 1], [1, 0], [1, 1], [0, 0], [0, 1]]
    )


def test_smoothing_says_which_facets_are_flat(tmp_path):
    roof = "v 0 0 0\nv 1 0 1\nv 1 1 1\nv 0 1 0\nv 2 0 0\nv 2 1 0\n"
    faces = "f 1 2 3 4\nf 2 5 6 3\n"
    smooth, flat = (read(tmp_path, roof + s + faces) for s in ("", "s off\n"))
    assert len({tuple(np.round(n, 3)) for n in smooth.normals.tolist()}) == 3
    assert len({tuple(np.round(n, 3)) for n in flat.normals.tolist()}) == 2
    assert len(smooth.vertices) == 6


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["0 0 0 0.2 0.5 0.9", "1 0 0 1 1 1", "0 1 0 0 0 0"], (0.2, 0.5, 0.9, 1)),
        (["0 0 0 0.2 0.5 0.9 0.4", "1 0 0 1 1 1 1", "0 1 0 0 0 0 1"], (0.2, 0.5, 0.9, 0.4)),
        (["0 0 0 255 0 188", "1 0 0 0 0 0", "0 1 0 0 0 0"], (1, 0, 0.50289, 1)),
        (["0 0 0 0.2 0.5 0.9", "1 0 0", "0 1 0"], (0.2, 0.5, 0.9, 1)),
    ],
)
def test_colours_after_positions_are_those_of_vertices(tmp_path, rows, expected):
    mesh = read(tmp_path, "".join(f"v {row}\n" for row in rows) + "f 1 2 3\n")
    at = int(np.argmin(np.abs(mesh.points).sum(axis=1)))
    np.testing.assert_allclose([*mesh.color[at], mesh.alpha[at]], expected, atol=1e-5)
    if "255" not in rows[0]:  # and multiply those of materials
        text = "mtllib a.mtl\nusemtl m\n" + "".join(f"v {row}\n" for row in rows) + "f 1 2 3\n"
        mesh = read(tmp_path, text, a_mtl="newmtl m\nKd 0.5 0.5 0.5\nd 0.5\n")
        at = int(np.argmin(np.abs(mesh.points).sum(axis=1)))
        found = [*mesh.color[at], mesh.alpha[at]]
        np.testing.assert_allclose(found, np.array(expected) * 0.5, atol=1e-5)


COLORS = [[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [188, 188, 188]]]


def textured(tmp_path, lines):
    text = f"mtllib a.mtl\n{SQUARE}{PLACES}usemtl m\nf 1/1 2/2 3/3 4/4\n"
    return read(tmp_path, text, a_mtl=f"newmtl m\n{lines}\n")


def test_textures_multiply_the_colour(tmp_path):
    png(tmp_path, "my map.png", COLORS)
    mesh = textured(tmp_path, "Kd 0.5 0.25 1\nd 0.5\nmap_Kd my map.png")
    assert looks(mesh) == [(0.5, 0.25, 1, 0.5)]
    np.testing.assert_allclose(mesh.texture.texels[1, 1, :3], 0.5029, atol=1e-3)
    lower_left = np.argmin(mesh.points[:, :2].sum(axis=1))
    np.testing.assert_array_equal(mesh.uv[lower_left], [0, 1])


def test_without_a_diffuse_colour_a_texture_is_as_it_is(tmp_path):
    png(tmp_path, "a.png", COLORS)
    assert looks(textured(tmp_path, "map_Kd a.png")) == [(1, 1, 1, 1)]


@pytest.mark.parametrize(
    "line",
    [
        "map_d alpha.png",
        "map_Kd a.png\nmap_d alpha.png",
        "map_Kd both.png\nmap_d both.png",
        "map_Kd both.png",
    ],
)
def test_opacity_comes_of_a_picture_or_its_alpha(tmp_path, line):
    alpha = np.array([[0, 255], [51, 255]])
    png(tmp_path, "a.png", COLORS)
    png(tmp_path, "alpha.png", alpha)
    png(tmp_path, "both.png", np.dstack([COLORS, alpha]))
    mesh = textured(tmp_path, line)
    np.testing.assert_allclose(mesh.texture.texels[..., 3], alpha / 255, atol=1e-6)


def test_pictures_of_several_sizes_are_stretched(tmp_path):
    png(tmp_path, "a.png", COLORS)
    png(tmp_path, "alpha.png", [[0, 100, 200, 255]] * 4)
    mesh = textured(tmp_path, "map_Kd a.png\nmap_d alpha.png")
    assert mesh.texture.texels.shape == (4, 4, 4)
    np.testing.assert_allclose(mesh.texture.texels[0, :, 3], np.array([0, 100, 200, 255]) / 255)
    np.testing.assert_array_equal(mesh.texture.texels[:2, :2, :3], [[[1, 0, 0]] * 2] * 2)


@pytest.mark.parametrize(
    ("options", "uv", "wrap"),
    [
        ("-s 2 3 1", (2, -2), "repeat"),
        ("-o 0.25 0.5", (1.25, -0.5), "repeat"),
        ("-clamp on -blendu off -mm 0 1", (1, 0), "clamp"),
        ("-o 0.5 -s 2 2 2 -imfchan m", (2.5, -1), "repeat"),
    ],
)
def test_options_say_how_a_texture_lies(tmp_path, options, uv, wrap):
    png(tmp_path, "a b.png", COLORS)
    mesh = textured(tmp_path, f"map_Kd {options} a b.png")
    upper_right = np.argmax(mesh.points[:, :2].sum(axis=1))
    np.testing.assert_allclose(mesh.uv[upper_right], uv)
    assert mesh.texture.wrap == wrap


def test_paths_of_other_systems_are_found(tmp_path):
    (tmp_path / "maps").mkdir()
    png(tmp_path, "maps/a.png", COLORS)
    assert textured(tmp_path, "map_Kd maps\\a.png").texture is not None
    png(tmp_path, "b.png", COLORS)
    assert textured(tmp_path, "map_Kd C:\\pictures\\b.png").texture is not None


def test_textures_of_two_materials_are_two_meshes(tmp_path):
    png(tmp_path, "a.png", COLORS)
    text = f"mtllib a.mtl\n{SQUARE}{PLACES}usemtl m\nf 1/1 2/2 3/3\nusemtl n\nf 1/1 3/3 4/4\n"
    materials = "newmtl m\nKd 1 1 1\nmap_Kd a.png\nnewmtl n\nKd 1 0 0\n"
    with pytest.raises(MeshError, match="read_meshes"):
        read(tmp_path, text, a_mtl=materials)
    first, second = moit.read_meshes(tmp_path / "file.obj")
    assert first.texture is not None and second.texture is None


@pytest.mark.parametrize(
    ("text", "materials", "words"),
    [
        ("mtllib none.mtl\nusemtl m\n", None, "the materials of 'none.mtl', which is not there"),
        ("mtllib a.mtl\nusemtl other\n", "newmtl m\n", "the material 'other', which is not there"),
        ("mtllib a.mtl\nusemtl m\n", "newmtl m\nKe 1 1 0\n", "emission"),
        ("mtllib a.mtl\nusemtl m\n", "newmtl m\nmap_Bump b.png\n", "bump maps"),
        ("mtllib a.mtl\nusemtl m\n", "newmtl m\nTf 1 0.5 0.5\n", "transmission"),
        ("mtllib a.mtl\nusemtl m\n", "newmtl m\nKd spectral a.rfl\n", "Kd spectral"),
        ("mtllib a.mtl\nusemtl m\n", "newmtl m\nmap_Kd no.png\n", "the texture 'no.png'"),
        ("cstype bezier\n", None, "curves and surfaces"),
    ],
)
def test_what_is_not_drawn_is_named(tmp_path, text, materials, words):
    others = {} if materials is None else {"a_mtl": materials}
    with pytest.warns(UserWarning, match=f"not drawn: {words}"):
        read(tmp_path, text + SQUARE + "f 1 2 3\n", **others)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("v 0 0\nf 1 1 1\n", "v 1: found '0 0'; needed 3 finite numbers"),
        ("v 0 0 x\nf 1 1 1\n", "v 1: found '0 0 x'"),
        ("v 0 0 nan\nf 1 1 1\n", "v 1: found '0 0 nan'"),
        (SQUARE + "v 1e999 0 0\nf 1 2 3\n", "v 5: found"),
        (SQUARE + "f 1 2 5\n", "line 5: found v 5; needed one of 4, from 1"),
        (SQUARE + "f 1 2 0\n", "line 5: found v 0"),
        (SQUARE + "f 1 2 -5\n", "line 5: found v -5"),
        (SQUARE + "f 1/1 2/1 3/1\n", "line 5: found vt 1; needed one of 0"),
        (SQUARE + "f 1//1 2//1 3//1\n", "line 5: found vn 1"),
        (SQUARE + "f 1 2 x\n", "line 5: found 'x'; needed a corner"),
        (SQUARE + "f 1/2/3/4 2 3\n", "needed a corner"),
        (SQUARE + "f 1 2 99999999999999999999\n", "needed a corner|needed one of"),
        (SQUARE + "f 1.5 2 3\n", "found '1.5'"),
        (SQUARE + "f 1 2\n", "expected triangles, found none"),
        ("", "expected triangles, found none"),
        ("v 0 0 0 -1 0 0\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n", "colour below 0"),
    ],
)
def test_damaged_files_say_what_is_wrong(tmp_path, text, words):
    with pytest.raises(MeshError, match=words):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("Kd a b c", "material 'm': Kd: found 'a b c'"),
        ("d 3", "d: found '3'"),
        ("d", "d: found ''"),
    ],
)
def test_damaged_materials_say_what_is_wrong(tmp_path, lines, words):
    with pytest.raises(MeshError, match=rf"a\.mtl.*{words}"):
        textured(tmp_path, lines)


def test_concave_polygons_are_covered_once(tmp_path):
    pytest.importorskip("mapbox_earcut", reason="no mapbox_earcut, so convex polygons only")
    text = "v 3 1 0\nv 1 1 0\nv 1 2 0\nv 3 2 0\nv 3 3 0\nv 0 3 0\nv 0 0 0\nv 3 0 0\n"
    mesh = read(
        tmp_path,
        "mtllib a.mtl\nusemtl m\n" + text + "f 1 2 3 4 5 6 7 8\n",
        a_mtl="newmtl m\nd 0.5\n",
    )
    camera = moit.Camera(eye=(1.5, 1.5, 10), target=(1.5, 1.5, 0), fov_y=2 * np.arctan(0.15))
    f = moit.rasterize(mesh, camera, (90, 90))
    assert f.counts.max() == 1
    assert len(f) == 6300  # 7/9 of it


def test_reading_of_concave_polygons_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mapbox_earcut", None)
    read(tmp_path, SQUARE + "f 1 2 3 4\n")  # these need nothing
    with pytest.raises(ImportError, match=r"moit\[mesh\]"):
        read(tmp_path, SQUARE + "v -0.9 0.9 0\nf 1 2 5 3 4\n")


def test_obj_gltf_ply_stl_and_off_need_no_trimesh(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    read(tmp_path, SQUARE + "f 1 2 3 4\n")
    moit.read_mesh(write(tmp_path, "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"))


# ---- PLY, STL, OFF


def write(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def ply(form, vertices, faces, *, kind="float", more=(), count="uchar", item="int", comment=""):
    """A PLY file of vertex rows and face lists."""
    names = ["x", "y", "z", *(name for name, _ in more)]
    kinds = [kind] * 3 + [one for _, one in more]
    head = ["ply", f"format {form} 1.0", *([f"comment {comment}"] if comment else [])]
    head += [f"element vertex {len(vertices)}"]
    head += [f"property {k} {n}" for k, n in zip(kinds, names, strict=True)]
    head += [
        f"element face {len(faces)}",
        f"property list {count} {item} vertex_indices",
        "end_header",
    ]
    text = ("\n".join(head) + "\n").encode()
    if form == "ascii":
        rows = [" ".join(map(str, row)) for row in vertices]
        rows += [" ".join(map(str, [len(face), *face])) for face in faces]
        return text + "\n".join(rows).encode() + b"\n"
    order = "<" if "little" in form else ">"
    letters = {"float": "f", "double": "d", "uchar": "B", "int": "i", "ushort": "H", "uint": "I"}
    row = order + "".join(letters[k] for k in kinds)
    text += b"".join(struct.pack(row, *vertex) for vertex in vertices)
    for face in faces:
        text += struct.pack(order + letters[count] + letters[item] * len(face), len(face), *face)
    return text


FORMS = ["ascii", "binary_little_endian", "binary_big_endian"]
PLACE = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (1, 1, 0)]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("faces", "area"),
    [
        ([(0, 1, 2), (0, 2, 3)], 4),
        ([(0, 1, 2, 3)], 4),
        ([(0, 1, 4), (0, 4, 2, 3)], 3),  # of two sizes, and one concave
        ([(0, 1, 2, 4, 3)], 3),
    ],
)
def test_ply_polygons_are_triangles(tmp_path, form, faces, area):
    mesh = moit.read_mesh(write(tmp_path, "a.ply", ply(form, PLACE, faces, count="uchar")))
    corners = mesh.points[mesh.triangles]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(sides, axis=1).sum() / 2 == pytest.approx(area)
    assert len(mesh.vertices) == 5


@pytest.mark.parametrize("form", FORMS)
def test_ply_colours_are_decoded(tmp_path, form):
    more = [("red", "uchar"), ("green", "uchar"), ("blue", "uchar"), ("alpha", "uchar")]
    rows = [(*place, 255, 188, 0, 51) for place in PLACE]
    mesh = moit.read_mesh(write(tmp_path, "a.ply", ply(form, rows, [(0, 1, 2)], more=more)))
    np.testing.assert_allclose(mesh.color[0], [1, 0.50289, 0], atol=1e-5)
    np.testing.assert_allclose(mesh.alpha[0], 0.2)


@pytest.mark.parametrize("form", FORMS)
def test_ply_in_double_keeps_its_digits(tmp_path, form):
    rows = [(x + 500000.125, y + 4600000.25, z) for x, y, z in PLACE]
    mesh = moit.read_mesh(write(tmp_path, "a.ply", ply(form, rows, [(0, 1, 2)], kind="double")))
    np.testing.assert_array_equal(mesh.points[:3], rows[:3])


def test_ply_normals_faces_colours_and_strips(tmp_path):
    more = [("nx", "float"), ("ny", "float"), ("nz", "float")]
    rows = [(*place, 1, 0, 0) for place in PLACE]
    mesh = moit.read_mesh(write(tmp_path, "a.ply", ply("ascii", rows, [(0, 1, 2)], more=more)))
    np.testing.assert_array_equal(mesh.normals[0], [1, 0, 0])
    text = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty list uchar int vertex_index\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n"
    )
    mesh = moit.read_mesh(write(tmp_path, "b.ply", text))
    np.testing.assert_array_equal(mesh.color[mesh.triangles[:, 0]], [[1, 0, 0], [0, 0, 1]])
    text = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
        "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 1 2\n"
    )
    assert len(moit.read_mesh(write(tmp_path, "c.ply", text)).triangles) == 3


def test_ply_textures_lie_as_their_coordinates_say(tmp_path):
    png(tmp_path, "skin.png", COLORS)
    more = [("s", "float"), ("t", "float")]
    rows = [(*place, place[0] / 2, place[1] / 2) for place in PLACE]
    content = ply("ascii", rows, [(0, 1, 2)], more=more, comment="TextureFile skin.png")
    mesh = moit.read_mesh(write(tmp_path, "a.ply", content))
    assert mesh.texture is not None
    np.testing.assert_array_equal(mesh.uv[:3], [[0, 1], [1, 1], [1, 0]])


def test_splats_and_points_say_what_they_are(tmp_path):
    more = [(name, "float") for name in ("f_dc_0", "opacity", "scale_0", "rot_0")]
    content = ply("binary_little_endian", [(0, 0, 0, 1, 1, 1, 1)] * 3, [], more=more)
    with pytest.raises(MeshError, match="holds 3 Gaussian splats"):
        moit.read_mesh(write(tmp_path, "a.ply", content))
    with pytest.raises(MeshError, match="found 5 points without faces"):
        moit.read_mesh(write(tmp_path, "a.ply", ply("ascii", PLACE, [])))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (ply("ascii", PLACE, [(0, 1, 9)]), "found vertex 9; needed one of 5"),
        (ply("ascii", PLACE, [(0, 1, -1)]), "found vertex -1"),
        (ply("ascii", PLACE, [(0, 1, "x")]), "something else than numbers"),
        (ply("ascii", [("nan", 0, 0), *PLACE], [(0, 1, 2)]), "vertex 0: found"),
        (ply("ascii", PLACE, [(0, 1, 2)])[:-8], "ends within|a list of"),
        (ply("binary_little_endian", PLACE, [(0, 1, 2)])[:-3], "ends within"),
        (ply("binary_little_endian", PLACE, [])[:-3], "ends within its 5 rows of 'vertex'"),
        (ply("ascii", PLACE, []).replace(b"vertex 5", b"vertex 99999999999999"), "ends within"),
        (ply("ascii", PLACE, []).replace(b"float x", b"half x"), "has the line 'property half x'"),
        (b"ply\nformat binary 1.0\nend_header\n", "has the line"),
        (b"ply\nelement vertex 1\nend_header\n", "names no format"),
        (b"plyy", "no header of a PLY"),
    ],
)
def test_damaged_ply_files_say_what_is_wrong(tmp_path, content, words):
    with pytest.raises(MeshError, match=rf"a\.ply.*({words})"):
        moit.read_mesh(write(tmp_path, "a.ply", content))


def test_stl_in_text_and_in_bytes_are_the_same(tmp_path):
    trimesh = pytest.importorskip("trimesh", reason="no trimesh to write files")
    ball = trimesh.creation.icosphere(subdivisions=1, radius=2)
    text = write(tmp_path, "a.stl", ball.export(file_type="stl_ascii"))
    both = [
        moit.read_mesh(text),
        moit.read_mesh(write(tmp_path, "b.stl", ball.export(file_type="stl"))),
    ]
    for mesh in both:
        assert mesh.vertices.shape == (42, 3) and mesh.triangles.shape == (80, 3)
        out = np.sum(mesh.normals * mesh.vertices, axis=1) / 2
        np.testing.assert_allclose(out, 1, atol=1e-2)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (bytes(80) + struct.pack("<I", 2**31) + bytes(50), "ends within its 2147483648 triangles"),
        (b"solid a\nvertex 1 2 3\n", "found 1 corners"),
        (b"solid a\nvertex 1 2 3e-\nvertex 0 0 0\nvertex 0 0 0\n", "needed three numbers"),
        (bytes(80) + struct.pack("<I12fH", 1, *[np.inf] * 12, 0), "not finite"),
        (b"abc", "is no STL file"),
    ],
)
def test_damaged_stl_files_say_what_is_wrong(tmp_path, content, words):
    with pytest.raises(MeshError, match=words):
        moit.read_mesh(write(tmp_path, "a.stl", content))


@pytest.mark.parametrize(
    ("text", "color"),
    [
        ("OFF\n4 2 0\n{v}3 0 1 2\n3 0 2 3\n", None),
        ("OFF 4 2 0 # counts\n# a comment\n{v}\n3 0 1 2\n3 0 2 3\n", None),
        ("OFF\n4 2 0\n{v}3 0 1 2 255 0 0\n3 0 2 3 255 0 0\n", (1, 0, 0)),
        ("OFF\n4 2 0\n{v}3 0 1 2 1.0 0.0 0.0\n3 0 2 3 1.0 0.0 0.0\n", (1, 0, 0)),
        ("OFF\n4 1 0\n{v}4 0 1 2 3\n", None),
        ("COFF\n4 1 0\n{c}4 0 1 2 3\n", (1, 0, 0)),
        ("NOFF\n4 1 0\n{n}4 0 1 2 3\n", None),
    ],
)
def test_off_files_are_read_in_their_ways(tmp_path, text, color):
    rows = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"]
    forms = {"v": "", "c": " 255 0 0 255", "n": " 0 0 1"}
    held = {key: "".join(f"{row}{end}\n" for row in rows) for key, end in forms.items()}
    mesh = moit.read_mesh(write(tmp_path, "a.off", text.format(**held)))
    assert mesh.triangles.shape == (2, 3)
    if color:
        np.testing.assert_allclose(mesh.color, [color] * len(mesh.color))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("OFF\n4 2", "ends within"),
        ("OFF\nx", "numbers of its vertices"),
        ("OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "a vertex"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "found vertex 7"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9 0 1\n", "face 0"),
        ("4OFF\n1 1 1\n", "three dimensions"),
        ("hello", "does not begin with OFF"),
    ],
)
def test_damaged_off_files_say_what_is_wrong(tmp_path, text, words):
    with pytest.raises(MeshError, match=words):
        moit.read_mesh(write(tmp_path, "a.off", text))
