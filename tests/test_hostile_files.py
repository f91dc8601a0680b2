"""Files made to harm: what they cost is bounded, and what is raised is moit's own, with their name.

Bombs: a few kilobytes that claim or unpack to gigabytes. Each reader of archives meets each.
"""

import io
import json
import random
import struct
import warnings
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from numpy.lib import format as npy

import moit
from moit.checks.exceptions import MoitError
from moit.formats import limits
from moit.formats.images import read_image
from moit.neural import checkpoint
from moit.neural.fitting import State

resource = pytest.importorskip("resource")

PLAN = {"sizes": [3, 8, 1], "seed": 1}
MUCH = 1 << 29  # bytes that reading a bomb may not take

READERS = {
    "fragments": moit.load,
    "network": moit.Network.read,
    "checkpoint": lambda path: checkpoint.read(path, PLAN),
}
FIRST = {"fragments": "depth", "network": "weights0", "checkpoint": "parameters"}
readers = pytest.mark.parametrize("reader", READERS)


def written(reader: str, path: Path) -> dict:
    """A good file, and its arrays."""
    if reader == "fragments":
        moit.save(path, moit.scenes.load("panes", (4, 3)))
    elif reader == "network":
        moit.Network.shipped("neural-bounded").write(path)
    else:
        state = State.start((3, 8, 1), 0)
        state.losses.append((0.5, 0.25))
        checkpoint.write(path, state, PLAN)
    with np.load(path) as archive:
        return dict(archive)


def packed(path: Path, arrays: dict, method: int = zipfile.ZIP_DEFLATED, **raw: bytes) -> None:
    """An archive of arrays, and of members given as they are."""
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, array in arrays.items():
            content = io.BytesIO()
            npy.write_array(content, np.asanyarray(array))
            archive.writestr(f"{name}.npy", content.getvalue())
        for name, content in raw.items():
            archive.writestr(f"{name}.npy", content)


def header(descr: str, shape: str) -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"
    text += " " * (-(len(text) + 11) % 64) + "\n"
    return npy.magic(1, 0) + struct.pack("<H", len(text)) + text.encode("latin1")


def refuses(reader: str, path: Path, said: str | None = None) -> None:
    """The reader raises an error of its own that names the file, and takes little memory."""
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises((MoitError, OSError), match=said) as caught:
        READERS[reader](path)
    assert path.name in str(caught.value)
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - used) * 1024 < MUCH


@readers
@pytest.mark.parametrize("method", [zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2], ids=["lzma", "bzip2"])
def test_only_stored_and_deflated_members_are_read(tmp_path, reader, method):
    path = tmp_path / "a.npz"
    arrays = written(reader, path)
    packed(path, arrays)
    READERS[reader](path)
    packed(path, arrays, method)
    refuses(reader, path, "neither stored nor deflated")


@readers
def test_zeros_that_deflate_to_little_are_refused_before_they_are_read(
    tmp_path, reader, monkeypatch
):
    path = tmp_path / "a.npz"
    arrays = written(reader, path)
    del arrays[FIRST[reader]]
    packed(path, arrays, **{FIRST[reader]: header("'<f4'", f"({1 << 25},)") + bytes(1 << 27)})
    assert path.stat().st_size < 1 << 18
    monkeypatch.setattr(limits, "USUAL_MEMORY", 1 << 26)
    refuses(reader, path, "bytes of memory")


BAD_HEADERS = {
    "more than there is": header("'<f4'", "(4294967296,)"),
    "more than numbers hold": header("'<f4'", f"({2**40}, {2**40})"),
    "a shape that overflows to few": header("'<f4'", f"({2**62}, 4)"),
    "no elements of huge rows": header("'<f4'", f"(0, {2**70})"),
    "negative lengths": header("'<f4'", "(-2, -2)") + bytes(16),
    "truth for a length": header("'<f4'", "(True,)") + bytes(4),
    "elements of no bytes": header("'|V0'", f"({2**60},)"),
    "text of no bytes": header("'<U0'", f"({2**60},)"),
    "objects": header("'|O'", "(1,)") + b"\x80\x04K\x01.",
    "objects in records": header("[('a', '|O')]", "(1,)") + b"\x80\x04K\x01.",
    "records": header("[('a', '<f4'), ('b', '<f4')]", "(1,)") + bytes(8),
    "arrays in elements": header("('<f4', (1000, 1000))", "(1000,)"),
    "dates": header("'<M8[s]'", "(1,)") + bytes(8),
    "nested deeply": header("'<f4'", "-" * 9000 + "1"),
    "parentheses": header("'<f4'", "(" * 9000),
    "a header beyond the end": npy.magic(2, 0) + struct.pack("<I", 2**32 - 1) + b"{}",
    "another format": npy.magic(3, 0) + b"\0" * 64,
    "no array": b"\x80\x04K\x01.",
    "nothing": b"",
    "text beyond Unicode": header("'<U1'", "()") + struct.pack("<I", 0x7FFFFFFF),
}


@readers
@pytest.mark.parametrize("name", BAD_HEADERS)
def test_headers_that_lie_are_refused(tmp_path, reader, name):
    path = tmp_path / "a.npz"
    for key in list(arrays := written(reader, path)):
        others = {other: array for other, array in arrays.items() if other != key}
        packed(path, others, **{key: BAD_HEADERS[name]})
        refuses(reader, path)


@readers
def test_no_member_is_unpickled(tmp_path, reader):
    path, ran = tmp_path / "a.npz", tmp_path / "ran"

    class Runs:
        def __reduce__(self):
            return open, (str(ran), "w")

    arrays = written(reader, path)
    np.savez(path, **(arrays | {FIRST[reader]: np.array([Runs()], object)}))
    refuses(reader, path)
    assert not ran.exists()


@readers
def test_an_archive_within_an_archive_is_no_array(tmp_path, reader):
    path = tmp_path / "a.npz"
    arrays = written(reader, path)
    inner = path.read_bytes()
    for _ in range(5):
        packed(path, {}, **{FIRST[reader]: inner})
        inner = path.read_bytes()
    del arrays[FIRST[reader]]
    packed(path, arrays, **{FIRST[reader]: inner})
    refuses(reader, path)


@readers
def test_a_list_of_many_members_is_refused(tmp_path, reader):
    path = tmp_path / "a.npz"
    written(reader, path)
    with zipfile.ZipFile(path, "a") as archive:
        for i in range(30_000):
            archive.writestr(f"{i}.npy", b"")
    refuses(reader, path, "list of members")


@readers
def test_members_may_not_share_their_bytes(tmp_path, reader):
    """A list of two entries for one member: each alone would be believed."""
    path = tmp_path / "a.npz"
    arrays = written(reader, path)
    names = sorted(arrays)
    packed(path, {names[0]: np.zeros(1000)}, zipfile.ZIP_STORED)
    content = path.read_bytes()
    at = content.index(b"PK\1\2")
    end = content.index(b"PK\5\6")
    entry, tail = content[at:end], bytearray(content[end:])
    name = f"{names[0]}.npy".encode()
    same = [
        entry[:28] + struct.pack("<H", len(one)) + entry[30:46] + one + entry[46 + len(name) :]
        for one in (f"{each}.npy".encode() for each in names)
    ]
    struct.pack_into("<HHI", tail, 8, len(same), len(same), sum(map(len, same)))
    path.write_bytes(content[:at] + b"".join(same) + bytes(tail))
    refuses(reader, path)


@readers
@pytest.mark.parametrize(
    ("at", "value"),
    [
        (6, struct.pack("<H", 255)),  # a version that no program reads
        (8, struct.pack("<H", 1)),  # encrypted
        (10, struct.pack("<H", 99)),  # an unknown method
        (20, struct.pack("<I", 2**32 - 2)),  # bytes as compressed
        (24, struct.pack("<I", 2**32 - 2)),  # and as they are
        (42, struct.pack("<I", 2**32 - 2)),  # where it begins
    ],
)
def test_lists_that_lie_are_refused(tmp_path, reader, at, value):
    path = tmp_path / "a.npz"
    packed(path, written(reader, path))
    content = bytearray(path.read_bytes())
    entry = content.index(b"PK\1\2")
    content[entry + at : entry + at + len(value)] = value
    path.write_bytes(content)
    refuses(reader, path)


def test_the_limit_of_fragments_can_be_raised_and_lowered(tmp_path):
    path = tmp_path / "a.npz"
    f = moit.scenes.load("panes", (40, 30))
    moit.save(path, f)
    with pytest.raises(
        moit.FragmentsError, match=r"a\.npz': it needs \d+ bytes .* 1000,"
    ) as caught:
        moit.load(path, memory=1000)
    needed = int(str(caught.value).rsplit("memory=")[1].split()[0])
    assert len(moit.load(path, memory=needed)) == len(f)
    with pytest.raises(moit.FragmentsError, match="bytes of memory"):
        moit.load(path, memory=needed - 1)
    for memory, error in ((0, ValueError), (1.5, TypeError), ("1G", TypeError)):
        with pytest.raises(error, match="memory: expected"):
            moit.load(path, memory=memory)


def png(width: int, height: int, content: bytes = b"") -> bytes:
    def chunk(name: bytes, data: bytes) -> bytes:
        check = zlib.crc32(data, zlib.crc32(name))
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", check)

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", content) + chunk(b"IEND", b"")
    )


def test_an_image_that_claims_to_be_huge_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "a.png"
    packer = zlib.compressobj(9)
    rows = b"".join(packer.compress(bytes(3 * 20_000 + 1)) for _ in range(20_000)) + packer.flush()
    path.write_bytes(png(20_000, 20_000, rows))
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ValueError, match=r"a\.png': it needs 4800000000 bytes .*memory=4800000000"):
        read_image(path)
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - used) * 1024 < MUCH
    path.write_bytes(png(2**30, 2**30))
    with pytest.raises((ValueError, OSError), match=r"a\.png"):
        read_image(path)
    moit.write_image(path, np.zeros((10, 20, 3)))
    with pytest.raises(ValueError, match="memory=2400"):
        read_image(path, memory=2399)
    assert read_image(path, memory=2400).shape == (10, 20, 3)


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '{"a":' * 50_000, "1" * 10_000, "\xff", "{}", "NaN"]
)
def test_json_that_is_nested_or_no_text_is_measured_again(tmp_path, text):
    f = moit.scenes.load("panes", (4, 3))
    scenes = {"panes": f}
    first = moit.compare(scenes, ["power4"], repeat=1, out=tmp_path)
    kept = tmp_path / "panes" / "power4.json"
    kept.write_bytes(text.encode("latin1"))
    again = moit.compare(scenes, ["power4"], repeat=1, out=tmp_path)
    assert again.rows[-1]["T_mae"] == first.rows[-1]["T_mae"]
    assert json.loads(kept.read_text())["digest"]


def test_a_kept_result_of_which_a_digit_or_a_pixel_changed_is_measured_again(tmp_path):
    f = moit.scenes.load("panes", (4, 3))

    def row():
        return moit.compare({"panes": f}, ["power4"], repeat=1, out=tmp_path).rows[-1]

    true, kept = row(), tmp_path / "panes" / "power4.json"
    assert row()["seconds"] == true["seconds"]  # taken back
    content = json.loads(kept.read_text())
    content["row"]["T_mae"] = 0.75
    kept.write_text(json.dumps(content))
    assert row()["T_mae"] == true["T_mae"]
    image = tmp_path / "panes" / "power4.exr"
    pixels = read_image(image)
    pixels[0, 0, 0] += 1
    moit.write_image(image, pixels)
    moit.compare({"panes": f}, ["power4"], repeat=1, out=tmp_path)
    assert read_image(image)[0, 0, 0] == pixels[0, 0, 0] - 1


def test_deeply_nested_json_in_an_archive_is_an_error_of_ours(tmp_path):
    path = tmp_path / "a.npz"
    for reader, key in (("network", "told"), ("checkpoint", "plan")):
        arrays = written(reader, path)
        packed(path, arrays | {key: np.array("[" * 100_000)})
        refuses(reader, path)


def test_a_checkpoint_that_lacks_or_mangles_an_array_is_refused(tmp_path):
    path = tmp_path / "a.npz"
    arrays = written("checkpoint", path)
    for key in arrays:
        packed(path, {other: array for other, array in arrays.items() if other != key})
        refuses("checkpoint", path, "there is no")
        for wrong in (np.zeros(0), np.zeros((2, 3, 4)), np.array("x"), np.float32(np.nan)):
            packed(path, arrays | {key: wrong})
            refuses("checkpoint", path)
    packed(path, arrays | {"steps": np.int64(-1)})
    refuses("checkpoint", path)


# A share of the fuzzing that was done at length.


def mutated(content: bytes, r: random.Random) -> bytes:
    b = bytearray(content)
    for _ in range(r.choice((1, 1, 1, 2, 3, 8))):
        at, kind = r.randrange(max(len(b), 1)), r.randrange(6)
        if r.random() < 0.4:
            at = min(at, r.randrange(600))
        end = at + r.choice((1, 4, 8, 50, 500))
        if kind == 0:
            b[at:end] = b""
        elif kind == 1:
            b[at:at] = b[at:end]
        elif kind == 2:
            number = r.choice((0, 1, 2**15, 2**30, 2**31 - 1, 2**32 - 1, 2**63 - 1, 2**64 - 1))
            width = r.choice((2, 4, 8))
            number %= 1 << 8 * width
            b[at : at + width] = number.to_bytes(width, r.choice(("little", "big")))
        elif kind == 3 and r.random() < 0.5:
            b = b[:at]
        elif at < len(b):
            b[at] ^= 1 << r.randrange(8)
    return bytes(b)


def mesh_files() -> list[tuple[str, bytes]]:
    ply = (
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    stl = bytes(80) + struct.pack("<I12fH", 1, *(0, 0, 1), *(0, 0, 0), *(1, 0, 0), *(0, 1, 0), 0)
    obj = "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n"
    off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    data = struct.pack("<9f3H", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 2)
    told = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
             "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }  # fmt: skip
    text = json.dumps(told).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    glb = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
    glb += struct.pack("<I4s", len(text), b"JSON") + text
    glb += struct.pack("<I4s", len(data), b"BIN\0") + data
    named = {"ply": ply.encode(), "stl": stl, "obj": obj.encode(), "off": off.encode(), "glb": glb}
    return [(f"a.{ending}", content) for ending, content in named.items()]


def good_files(kind: str, folder: Path) -> list[tuple[str, bytes]]:
    if kind in READERS:
        arrays = written(kind, folder / "good.npz")
        files = [("a.npz", (folder / "good.npz").read_bytes())]
        packed(folder / "good.npz", arrays)
        return [*files, ("a.npz", (folder / "good.npz").read_bytes())]
    if kind in ("deep", "bands"):
        files = []
        for name, half in (("panes", False), ("cloud", True)):
            moit.write_deep(folder / "good.exr", moit.scenes.load(name, (9, 7)), half=half)
            files.append(("a.exr", (folder / "good.exr").read_bytes()))
        return files
    if kind == "image":
        files, image = [], np.random.default_rng(2).random((9, 11, 4), np.float32)
        for compression in ("zip", "piz", "dwaa", "b44", "rle"):
            told = {"compression": compression}
            moit.write_image(folder / "good.exr", image, attributes=told, half=True)
            files.append(("a.exr", (folder / "good.exr").read_bytes()))
        moit.write_image(folder / "good.png", image)
        return [*files, ("a.png", (folder / "good.png").read_bytes())]
    pytest.importorskip("trimesh")
    return mesh_files()


MUTATED = {
    **READERS,
    "deep": moit.read_deep,
    "bands": lambda path: list(moit.read_deep_bands(path)),
    "image": read_image,
    "mesh": moit.read_mesh,
}


@pytest.mark.parametrize("kind", MUTATED)
def test_whatever_is_wrong_with_a_file_the_error_is_ours_and_names_it(tmp_path, kind, capfd):
    files, r = good_files(kind, tmp_path), random.Random(kind)
    read = 0
    for i in range(120):
        name, content = files[i % len(files)]
        path = tmp_path / name
        path.write_bytes(mutated(content, r))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                MUTATED[kind](path)
            read += 1
        except (MoitError, OSError, ValueError) as error:
            assert isinstance(error, (MoitError, OSError)) or kind == "image"
            assert name in str(error)
    assert read < 100  # most did harm
    capfd.readouterr()  # the libraries' own complaints
