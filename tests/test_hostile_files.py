"""Files made to harm: what they cost is bounded, and what is raised is moit's own, with their name.

Bombs: a few kilobytes that claim or unpack to gigabytes. Each reader of archives meets each.
"""

import json
import struct
import zipfile
import zlib
from pathlib import Path

import hostile_files
import numpy as np
import pytest
from hostile_files import FIRST, KINDS, READERS, packed, written
from numpy.lib import format as npy

import moit
from moit.checks.exceptions import MoitError
from moit.formats import limits
from moit.formats.images import read_image

resource = pytest.importorskip("resource")

MUCH = 1 << 29  # bytes that reading a bomb may not take

readers = pytest.mark.parametrize("reader", READERS)


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


@pytest.mark.parametrize("kind", KINDS)
def test_whatever_is_wrong_with_a_file_the_error_is_ours_and_names_it(tmp_path, kind, capfd):
    if kind in ("mesh", "materials"):
        pytest.importorskip("trimesh")
    read = 0
    for i in range(120):
        found, broken = hostile_files.tried(KINDS.index(kind) + i * len(KINDS), tmp_path)
        assert broken == []
        read += found
    assert read < 100 or kind == "materials"  # most did harm
    capfd.readouterr()  # the libraries' own complaints


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (KeyError("x"), "not moit's own"),
        (UnicodeDecodeError("utf-8", b"", 0, 1, "x"), "not moit's own"),
        (MoitError("a file"), "does not name the file"),
    ],
)
def test_what_is_raised_and_is_not_ours_is_told(tmp_path, monkeypatch, error, words):
    def fails(path):
        raise error

    monkeypatch.setitem(hostile_files.MUTATED, "fragments", fails)
    read, broken = hostile_files.tried(0, tmp_path)
    assert not read and words in broken[0]


def test_a_damaged_file_is_the_same_for_the_same_number(tmp_path):
    for number in (7, 8):
        contents = []
        for _ in range(2):
            hostile_files.tried(number, tmp_path)
            contents.append(sorted((p.name, p.read_bytes()) for p in tmp_path.iterdir()))
        assert contents[0] == contents[1]
