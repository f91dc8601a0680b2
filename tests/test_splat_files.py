"""Files of splats: written by hand here as their formats say, and read."""

import gzip
import struct
import tracemalloc

import numpy as np
import pytest
from readings import splats as splat_reading

import moit
from moit.geometry.reading.splat_files import TURNED

C0 = 0.28209479177387814


def splats_of(degree, count=7):
    rng = np.random.default_rng(degree)
    return moit.Splats(
        rng.normal(size=(count, 3)),
        np.exp(rng.normal(-3, 1, (count, 3))),
        rng.normal(size=(count, 4)),
        np.append(rng.uniform(0.01, 0.99, count - 2), [1e-4, 0.9999]),
        sh=rng.normal(size=(count, (degree + 1) ** 2, 3)),
    )


def same_rotations(found, expected):
    turns = [splat_reading.rotation_matrices(q.astype(float)) for q in (found, expected)]
    np.testing.assert_allclose(*turns, atol=1e-6)


@pytest.mark.parametrize("degree", range(4))
def test_what_is_written_is_read(degree, tmp_path):
    splats = splats_of(degree)
    moit.write_splats(tmp_path / "a.ply", splats)
    found = moit.read_splats(tmp_path / "a.ply")
    np.testing.assert_array_equal(found.means, splats.means)
    np.testing.assert_array_equal(found.sh, splats.sh)
    np.testing.assert_allclose(found.scales, splats.scales, rtol=1e-5)
    np.testing.assert_allclose(found.opacities, splats.opacities, rtol=1e-5)
    assert splats.opacities.min() < 2e-4 and splats.opacities.max() > 0.9998
    same_rotations(found.rotations, splats.rotations)


def ply(rows, names, comments=()):
    header = ["ply", "format binary_little_endian 1.0", *(f"comment {c}" for c in comments)]
    header += [f"element vertex {len(rows)}", *(f"property float {n}" for n in names)]
    return "\n".join([*header, "end_header\n"]).encode() + np.asarray(rows, "<f4").tobytes()


NAMES = (
    "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3"
).split()
# right, down, forward: below and beyond the eye's world, turned by a quarter about down
ROW = [1, 2, 3, 0, 0, 0, 0.5, 0, -0.5, np.log(3), -1, -2, -3, np.sqrt(2), 0, np.sqrt(2), 0]


def test_a_ply_has_logits_logarithms_and_other_axes(tmp_path):
    (tmp_path / "a.ply").write_bytes(ply([ROW], NAMES))
    found = moit.read_splats(tmp_path / "a.ply", convention="exact")
    assert found.convention == "exact"
    np.testing.assert_allclose(found.means, [[1, -2, -3]])
    np.testing.assert_allclose(found.opacities, [0.75], rtol=1e-6)
    np.testing.assert_allclose(found.scales, np.exp([[-1, -2, -3]]), rtol=1e-6)
    np.testing.assert_allclose(found.sh, [[[0.5, 0, -0.5]]])
    turned = np.diag([1, -1, -1]) @ [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    matrix = splat_reading.rotation_matrices(found.rotations.astype(float))[0]
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-6)
    # columns are axes of the ellipsoid: where it is 1/e long, and so on
    np.testing.assert_allclose(np.abs(matrix), np.abs(turned), atol=1e-6)


def test_harmonics_of_a_ply_follow_channels_and_are_turned(tmp_path):
    names = [*NAMES[:9], *(f"f_rest_{k}" for k in range(9)), *NAMES[9:]]
    row = [*ROW[:9], *range(1, 10), *ROW[9:]]
    (tmp_path / "a.ply").write_bytes(ply([row], names))
    found = moit.read_splats(tmp_path / "a.ply").sh[0]
    np.testing.assert_allclose(found[1:], np.transpose([[-1, -2, 3], [-4, -5, 6], [-7, -8, 9]]))


def test_turned_harmonics_are_those_of_turned_directions():
    rng = np.random.default_rng(8)
    directions = rng.normal(size=(9, 3))
    sh = rng.normal(size=(9, 16, 3)) * 0.1
    still = ([[0.0, 0, 0]] * 9, np.ones(9), [[1.0, 0, 0, 0]] * 9, np.full(9, 0.9))
    for k in range(9):
        eye = 3 * directions[k] / np.linalg.norm(directions[k])
        lone = moit.Splats(*(np.asarray(one)[k : k + 1] for one in still), sh=sh[k : k + 1])
        other = moit.Splats(
            *(np.asarray(one)[k : k + 1] for one in still), sh=sh[k : k + 1] * TURNED[:, None]
        )
        seen = moit.rasterize(lone, moit.Camera(eye=eye), (1, 1)).color
        turned = moit.rasterize(other, moit.Camera(eye=eye * (1, -1, -1)), (1, 1)).color
        np.testing.assert_allclose(seen, turned, rtol=1e-5)


def test_a_file_of_2d_splats_has_two_scales(tmp_path):
    names = [n for n in NAMES if n != "scale_2"]
    row = [value for value, n in zip(ROW, NAMES, strict=True) if n != "scale_2"]
    (tmp_path / "a.ply").write_bytes(ply([row], names))
    found = moit.read_splats(tmp_path / "a.ply").scales
    np.testing.assert_allclose(found, [[np.exp(-1), np.exp(-2), 0]], rtol=1e-6)


COMMENTS = {
    "SplatRenderMode: mip": (True, False),
    "  SPLATRENDERMODE:  MIP": (True, False),
    "antialiased 1": (True, False),
    "antialiased 0": (False, False),
    "SplatRenderMode: 2dgs": (False, True),
    "SplatRenderMode: banana": (False, False),
    "antialiased 1\ncomment SplatRenderMode: default": (False, False),  # the last one counts
    "trained antialiased 1": (False, False),
}


@pytest.mark.parametrize("comment", COMMENTS)
def test_comments_say_how_splats_were_trained(comment, tmp_path):
    head = b"ply\ncomment " + comment.encode() + b"\n"
    (tmp_path / "a.ply").write_bytes(ply([ROW], NAMES).replace(b"ply\n", head, 1))
    found = moit.read_splats(tmp_path / "a.ply")
    assert (found.antialiased, found.scales[0, 2] == 0) == COMMENTS[comment]
    moit.write_splats(tmp_path / "b.ply", found)
    assert moit.read_splats(tmp_path / "b.ply").antialiased == found.antialiased


def test_a_filter_makes_splats_larger_and_fainter(tmp_path):
    (tmp_path / "a.ply").write_bytes(ply([ROW], NAMES))
    (tmp_path / "b.ply").write_bytes(ply([[*ROW, 0.2]], [*NAMES, "filter_3D"]))
    plain, filtered = (moit.read_splats(tmp_path / one) for one in ("a.ply", "b.ply"))
    larger = np.sqrt(plain.scales.astype(float) ** 2 + 0.04)
    np.testing.assert_allclose(filtered.scales, larger, rtol=1e-6)
    share = np.sqrt(np.prod(plain.scales.astype(float) ** 2) / np.prod(larger**2))
    np.testing.assert_allclose(filtered.opacities, plain.opacities * share, rtol=1e-6)


def test_a_splat_file_has_32_bytes_a_splat(tmp_path):
    row = struct.pack("<6f8B", 1, 2, 3, 0.1, 0.2, 0.3, 255, 0, 51, 102, 255, 128, 128, 128)
    (tmp_path / "a.splat").write_bytes(2 * row)
    found = moit.read_splats(tmp_path / "a.splat")
    assert len(found) == 2
    np.testing.assert_allclose(found.means[0], [1, -2, -3])
    np.testing.assert_allclose(found.scales[0], [0.1, 0.2, 0.3], rtol=1e-6)
    np.testing.assert_allclose(found.opacities, 0.4, rtol=1e-6)
    np.testing.assert_allclose(0.5 + C0 * found.sh[0, 0], [1, 0, 0.2], atol=1e-6)
    same_rotations(found.rotations[:1], np.array([[0, 1.0, 0, 0]]))


def spz_streams(version):
    """Of two splats, degree 1: positions 1, -2, 0.5 and 0, in 12 bits after the point."""
    fixed = [4096, -8192, 2048, 0, 0, 0]
    places = b"".join(struct.pack("<i", one)[:3] for one in fixed)
    if version == 1:
        places = np.array([1, -2, 0.5, 0, 0, 0], "<f2").tobytes()
    alphas = bytes([255, 51])
    colors = bytes([255, 128, 0] * 2)
    scales = bytes([160, 176, 144] * 2)
    first_three = bytes([255, 128, 128] * 2)  # x is 1
    # the largest is x (0), the others 0
    smallest = struct.pack("<II", 0, (3 << 30) | (1 << 29) | (511 << 20))
    harmonics = bytes([128, 0, 255, 192, 128, 128, 128, 128, 64] * 2)
    return [places, alphas, colors, scales, first_three if version < 3 else smallest, harmonics]


def spz(version, *, count=2, streams=None):
    body = b"".join(spz_streams(version) if streams is None else streams)
    return struct.pack("<4sIIBBBB", b"NGSP", version, count, 1, 12, 0, 0) + body


def spz4():
    zstandard = pytest.importorskip("zstandard")
    streams = spz_streams(4)
    packed = [zstandard.ZstdCompressor().compress(one) for one in streams]
    header = struct.pack("<4sIIBBBBI", b"NGSP", 4, 2, 1, 12, 0, len(streams), 32) + bytes(12)
    table = b"".join(
        struct.pack("<QQ", len(p), len(s)) for p, s in zip(packed, streams, strict=True)
    )
    return header + table + b"".join(packed)


@pytest.mark.parametrize("version", [1, 2, 3, 4])
def test_spz_files_of_all_versions(version, tmp_path):
    content = spz4() if version == 4 else gzip.compress(spz(version))
    (tmp_path / "a.spz").write_bytes(content)
    found = moit.read_splats(tmp_path / "a.spz")
    np.testing.assert_allclose(found.means, [[1, -2, 0.5], [0, 0, 0]])
    np.testing.assert_allclose(found.opacities, [1, 0.2], rtol=1e-6)
    np.testing.assert_allclose(found.scales[0], np.exp([0, 1, -1]), rtol=1e-6)
    np.testing.assert_allclose(found.sh[0, 0], [0.5 / 0.15, (128 / 255 - 0.5) / 0.15, -0.5 / 0.15])
    np.testing.assert_allclose(found.sh[0, 1:], [[0, -1, 127 / 128], [0.5, 0, 0], [0, 0, -0.5]])
    if version < 3:
        x = np.array([1, 0.5 / 127.5, 0.5 / 127.5])
        same_rotations(found.rotations[:1], np.array([[0, *x]]))
    else:
        half = np.sqrt(0.5)
        same_rotations(found.rotations, np.array([[0, 1.0, 0, 0], [half, -half, 0, 0]]))


def test_spz_files_say_whether_splats_were_trained_antialiased(tmp_path):
    content = bytearray(spz(2))
    for flags in (0, 1, 2):
        content[14] = flags
        (tmp_path / "a.spz").write_bytes(gzip.compress(bytes(content)))
        assert moit.read_splats(tmp_path / "a.spz").antialiased == (flags == 1)


BAD = {
    "a.ply": [
        (b"plz", "has no header of a PLY file"),
        (ply([[0, 0, 0]], ["x", "y", "z"]), "has no property 'scale_0' of splats"),
        (ply([ROW], NAMES)[:-1], "ends within its 1 rows"),
        (ply([[np.nan, *ROW[1:]]], NAMES), r"means\[0, 0\]: found nan"),
        (ply([[*ROW[:13], 0, 0, 0, 0]], NAMES), "a quaternion that is not 0"),
        (ply([[*ROW, 1]], [*NAMES, "f_rest_0"]), "has 1 properties f_rest"),
    ],
    "a.splat": [(bytes(33), "has 33 bytes; needed a multiple of 32")],
    "a.spz": [
        (b"\x1f\x8b1234", "cannot be unpacked"),
        (b"1234", "has no header of an .spz file"),
        (spz(9), "is of version 9"),
        (spz(2, count=4_000_000_000), "says that it holds 4000000000 splats"),
        (spz(2)[:-1], "ends within its 2 splats"),
    ],
}


@pytest.mark.parametrize(
    ("name", "at"), [(n, i) for n, some in BAD.items() for i in range(len(some))]
)
def test_bad_files_are_refused_by_name(name, at, tmp_path):
    content, said = BAD[name][at]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(moit.SplatsError, match=f"{name}.*{said}"):
        moit.read_splats(tmp_path / name)


def test_no_more_is_unpacked_than_the_header_says(tmp_path):
    (tmp_path / "a.spz").write_bytes(gzip.compress(spz(2) + bytes(200_000_000), 1))
    tracemalloc.start()
    try:
        assert len(moit.read_splats(tmp_path / "a.spz")) == 2
        assert tracemalloc.get_traced_memory()[1] < 20_000_000
    finally:
        tracemalloc.stop()


def test_every_shorter_file_is_refused(tmp_path):
    whole = {"a.spz": spz(3), "b.spz": spz4(), "a.ply": ply([ROW], NAMES)}
    for name, content in whole.items():
        for length in range(0, len(content), 7):
            (tmp_path / name).write_bytes(content[:length])
            with pytest.raises(moit.SplatsError, match=name):
                moit.read_splats(tmp_path / name)


def test_names_are_checked(tmp_path):
    with pytest.raises(FileNotFoundError):
        moit.read_splats(tmp_path / "none.ply")
    with pytest.raises(moit.SplatsError, match=r"expected a file .ply, .splat, .spz, got '.sog'"):
        moit.read_splats(tmp_path / "a.sog")
    with pytest.raises(moit.SplatsError, match=r"path: expected a file .ply"):
        moit.write_splats(tmp_path / "a.spz", splats_of(0))
    with pytest.raises(TypeError, match="splats: expected Splats, got list"):
        moit.write_splats(tmp_path / "a.ply", [])


def test_a_file_of_splats_stands_where_fragments_do(tmp_path):
    moit.write_splats(tmp_path / "a.ply", splats_of(1))
    (tmp_path / "a.splat").write_bytes(
        struct.pack("<6f8B", 1, 2, 3, 0.1, 0.2, 0.3, 255, 0, 51, 102, 255, 128, 128, 128)
    )
    for name in ("a.ply", "a.splat"):
        assert moit.composite(tmp_path / name, "power4").shape == (360, 640, 4)
    with pytest.raises(moit.MeshError, match=r"Gaussian splats.*moit.read_splats reads them"):
        moit.read_mesh(tmp_path / "a.ply")
    triangle = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    triangle += "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
    (tmp_path / "b.ply").write_text(triangle + "end_header\n0 0 0 1 0 0 0 1 0 3 0 1 2\n")
    assert moit.composite(tmp_path / "b.ply", "power4").shape == (360, 640, 4)
