"""Attributes of headers that pixels do not need: they stop no reading, and none is lost."""

import io
import pickle
import struct

import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from exr_files import header_end, packed, with_attributes, with_value
from test_deep import point, random_fragments, write_channels

import moit
from moit.formats.exr_headers import HeaderError, read_headers

STRANGE = {
    "deep image state": (b"openexr:deepImageState", b"deepImageState", b"\3"),
    "unknown type": (b"renderer", b"vendorBlob", bytes(range(256))),
    "unknown, empty": (b"renderer", b"vendorBlob", b""),
    "not UTF-8": (b"owner", b"string", b"M\xfcller \xff\xfe"),
    "a string of another type": (b"owner", b"int", struct.pack("<i", 3)),
    "strings not UTF-8": (b"cameras", b"stringvector", struct.pack("<i", 2) + b"\xe9\xe8"),
    "strings that leave the attribute": (b"cameras", b"stringvector", struct.pack("<i", 2**30)),
    "name not UTF-8": (b"gr\xf6\xdfe", b"float", struct.pack("<f", 1.5)),
    "type not UTF-8": (b"size", b"gr\xf6\xdfe", b"1.5"),
    "a name of 32 letters": (b"n" * 32, b"vendorBlob", b"1"),
    "a name of 255 letters": (b"n" * 255, b"string", b"1"),
    "a float of 3 bytes": (b"aperture", b"float", b"abc"),
    "chromaticities of 3 bytes": (b"chromaticities", b"chromaticities", b"abc"),
    "an envmap that is none": (b"envmap", b"envmap", b"\x63"),
    "a preview without pixels": (b"preview", b"preview", struct.pack("<2I", 1000, 1000)),
    "bytes of another length": (b"blob", b"bytes", struct.pack("<I", 300) + b"abc"),
    "a manifest": (b"idManifest", b"idmanifest", b"\0" * 40),
    "bytes": (b"blob", b"bytes", struct.pack("<I", 3) + b"abc" + b"\xff" * 9),
    "zeros in a string": (b"comments", b"string", b"a\0b\0"),
    "a rational": (b"framesPerSecond", b"rational", struct.pack("<iI", 24000, 1001)),
    "a time code": (b"timeCode", b"timecode", struct.pack("<2I", 1, 2)),
    "a matrix": (b"worldToCamera", b"m44f", struct.pack("<16f", *range(16))),
    "much": (b"log", b"vendorLog", b"line\n" * 50_000),
}
DAMAGED = (
    "strings that leave the attribute",
    "a float of 3 bytes",
    "bytes of another length",
    "chromaticities of 3 bytes",
)


@pytest.fixture
def whole(tmp_path):
    """A small deep file, as bytes."""
    return write_channels(tmp_path / "whole.exr", (3, 2), **point()).read_bytes()


def written(tmp_path, data):
    path = tmp_path / "strange.exr"
    path.write_bytes(data)
    return path


def raw_attributes(path):
    """{name: (type, value)}, all bytes, of a file's only header."""
    with open(path, "rb") as stream:
        (header,) = read_headers(stream).parts
    return {one.raw_name: (one.raw_type, one.data) for one in header.attributes}


@pytest.mark.parametrize("kind", STRANGE)
def test_an_attribute_that_pixels_do_not_need_stops_no_reading(tmp_path, whole, kind):
    path = written(tmp_path, with_attributes(whole, STRANGE[kind]))
    f = moit.read_deep(path)
    assert f.depth.tolist() == [2] and f.color.tolist() == [[0.5] * 3] and f.shape == (3, 2)
    assert sum(map(len, moit.read_deep_bands(path))) == 1


def test_all_strange_attributes_together(tmp_path, whole):
    unique = {one[0]: one for one in STRANGE.values()}
    path = written(tmp_path, with_attributes(whole, *unique.values()))
    assert moit.read_deep(path).depth.tolist() == [2]


@pytest.mark.parametrize("kind", STRANGE)
def test_attributes_survive_a_flatten_byte_for_byte(tmp_path, whole, kind):
    name, of_type, value = STRANGE[kind]
    path = written(tmp_path, with_attributes(whole, STRANGE[kind]))
    moit.composite_deep(path, tmp_path / "flat.exr", "sorted")
    f = moit.read_deep(path)
    moit.write_image(tmp_path / "same.exr", moit.composite(f, "sorted"), frame=f.frame)
    moit.write_deep(tmp_path / "again.exr", f)
    # what is no longer true of other pixels, or would make others refuse the file
    dropped = of_type in (b"deepImageState", b"preview", b"idmanifest") or kind in DAMAGED
    for copy in ("flat.exr", "same.exr", "again.exr"):
        found = raw_attributes(tmp_path / copy)
        assert found.get(name) == (None if dropped else (of_type, value))
    assert len(moit.read_deep(tmp_path / "again.exr")) == 1
    # OpenImageIO, as other programs do, reads such a file
    assert moit.read_image(tmp_path / "flat.exr").shape == (3, 2, 4)


@pytest.mark.parametrize("long", [False, True])
def test_few_bytes_of_metadata_are_kept_too(tmp_path, whole, long):
    tiny = (b"n" * 32, b"t", b"") if long else (b"n", b"t", b"1")
    frame = moit.Frame((3, 2), attributes=(moit_attribute(*tiny),))
    moit.write_image(tmp_path / "flat.exr", np.ones((3, 2, 3)), frame=frame)
    assert raw_attributes(tmp_path / "flat.exr")[tiny[0]] == tiny[1:]


def moit_attribute(name, kind, value):
    from moit.fragments.frame import Attribute

    return Attribute(name, kind, value)


def test_metadata_are_values(tmp_path, whole):
    shown = ("not UTF-8", "a rational", "a matrix", "unknown type")
    path = written(tmp_path, with_attributes(whole, *(STRANGE[kind] for kind in shown)))
    found = moit.read_deep(path).frame.metadata
    assert found["owner"] == "Müller ÿþ"
    assert found["framesPerSecond"] == (24000, 1001)
    assert found["worldToCamera"] == tuple(range(16))
    assert found["renderer"] == bytes(range(256))
    with pytest.raises(TypeError):
        found["owner"] = "me"


def test_own_words_come_before_those_of_the_file(tmp_path, whole):
    path = written(tmp_path, with_attributes(whole, (b"owner", b"string", b"them")))
    frame = moit.read_deep(path).frame
    image = np.ones((3, 2, 3))
    moit.write_image(tmp_path / "a.exr", image, frame=frame)
    assert raw_attributes(tmp_path / "a.exr")[b"owner"] == (b"string", b"them")
    # Copyright is OpenImageIO's word for owner
    moit.write_image(tmp_path / "b.exr", image, frame=frame, attributes={"Copyright": "us"})
    assert raw_attributes(tmp_path / "b.exr")[b"owner"] == (b"string", b"us")
    moit.write_image(tmp_path / "c.png", image, frame=frame)
    assert oiio.ImageBuf(str(tmp_path / "c.png")).spec()["owner"] == "them"


@pytest.mark.parametrize("bad", [b"B\xe9", b"\xff"])
def test_a_channel_whose_name_is_not_utf8_is_passed_over(tmp_path, whole, bad):
    name = b"z" * len(bad)
    path = write_channels(tmp_path / "f.exr", **point(), **{name.decode(): [9]})
    data = path.read_bytes()
    at = data.index(name + b"\0", data.index(b"chlist"))
    path.write_bytes(data[:at] + bad + data[at + len(bad) :])
    if bad < b"Z":  # out of order: damaged
        with pytest.raises(OSError, match="damaged"):
            moit.read_deep(path)
    else:
        assert moit.read_deep(path).color.tolist() == [[0.5] * 3]
        assert [len(band) for band in moit.read_deep_bands(path)] == [1]


def test_a_part_whose_name_is_not_utf8_is_read(tmp_path, whole):
    path = written(tmp_path, with_attributes(whole, (b"name", b"string", b"links \xfc")))
    assert moit.read_deep(path, part="links ü").depth.tolist() == [2]


@pytest.mark.parametrize("name", [b"channels", b"compression", b"dataWindow", b"type"])
def test_what_pixels_need_is_still_checked(tmp_path, whole, name):
    at = whole.index(name + b"\0")
    renamed = whole[:at] + name[:-1] + b"_" + whole[at + len(name) :]
    with pytest.raises(OSError, match="damaged"):
        moit.read_deep(written(tmp_path, renamed))


@pytest.mark.parametrize("corner", [(5, 5, 4, 5), (0, 0, 2**30, 2**30), (-(2**31), 0, 1, 1)])
@pytest.mark.parametrize("window", [b"dataWindow", b"displayWindow"])
def test_windows_that_cannot_be_are_damage(tmp_path, whole, window, corner):
    path = written(tmp_path, with_value(whole, window, struct.pack("<4i", *corner)))
    with pytest.raises(OSError, match="damaged"):
        moit.read_deep(path)


@pytest.mark.parametrize("call", [moit.read_deep, moit.inspect, moit.read_deep_bands])
def test_a_deep_type_in_a_file_that_is_marked_flat_is_damage(tmp_path, whole, call):
    # OpenEXR takes such a file for a flat one; OpenImageIO would crash.
    path = written(tmp_path, whole[:4] + b"\2\0\0\0" + whole[8:])
    with pytest.raises(OSError, match="contradicts itself"):
        call(path)


def test_a_display_beyond_what_libraries_take_is_one_line(tmp_path, whole):
    display = struct.pack("<4i", 0, 0, 2**24, 1)
    path = written(tmp_path, with_value(whole, b"displayWindow", display))
    assert moit.read_deep(path).frame.display_shape == (2, 2**24 + 1)
    with pytest.raises(OSError, match="exceeds") as caught:
        list(moit.read_deep_bands(path))
    assert "\n" not in str(caught.value)


def test_headers_that_end_early_are_damage(tmp_path, whole):
    path = tmp_path / "cut.exr"
    for length in range(header_end(whole) + 1):
        path.write_bytes(whole[:length])
        with pytest.raises(OSError, match=r"damaged|not an OpenEXR"):
            moit.read_deep(path)


def test_a_header_of_millions_of_attributes_is_refused_quickly():
    many = b"".join(packed(b"a%d" % i, b"t", b"") for i in range(70_000))
    with pytest.raises(HeaderError, match="more than 65536"):
        read_headers(io.BytesIO(b"\x76\x2f\x31\x01\2\x08\0\0" + many + b"\0"))


# Windows


@pytest.mark.parametrize(
    "data, display",
    [
        ((0, 0, 3, 2), (0, 0, 3, 2)),
        ((5, 7, 8, 9), (0, 0, 99, 49)),
        ((-6, -4, -3, -2), (0, 0, 9, 9)),  # all off the display
        ((-2, -1, 1, 1), (-20, -10, 20, 10)),
        ((0, 0, 3, 2), (100, 100, 163, 127)),
        ((1000, 2000, 1003, 2002), (0, 0, 4095, 2159)),
        ((0, 0, 3, 2), (1, 1, 2, 2)),  # overscan
    ],
)
@pytest.mark.parametrize("aspect", [1.0, 2.0])
def test_a_flatten_lies_where_the_deep_image_lay(tmp_path, data, display, aspect):
    corners = {
        "dataWindow": (data[:2], data[2:]),
        "displayWindow": (display[:2], display[2:]),
        "pixelAspectRatio": aspect,
        "screenWindowCenter": (0.5, -2.0),
        "screenWindowWidth": 3.0,
    }
    path = write_channels(tmp_path / "f.exr", (3, 4), part=corners, **point())
    f = moit.read_deep(path)
    for band in moit.read_deep_bands(path):
        assert band.frame == f.frame
    moit.composite_deep(path, tmp_path / "a.exr", "power4")
    image = moit.composite(f, "power4")
    moit.write_image(tmp_path / "b.exr", image, origin=f.origin, frame=f.frame)
    moit.write_deep(tmp_path / "c.exr", f)
    for name in "abc":
        header = OpenEXR.File(str(tmp_path / f"{name}.exr"), header_only=True).header()
        for key, value in corners.items():
            assert np.array_equal(header[key], value), (name, key)
    assert np.array_equal(moit.read_image(tmp_path / "a.exr"), image)
    assert np.array_equal(moit.read_image(tmp_path / "b.exr"), image)
    again = moit.read_deep(tmp_path / "c.exr")
    assert again.origin == f.origin and again.frame.display_origin == display[1::-1]


def test_bands_of_a_large_image_have_its_frame(tmp_path):
    frame = moit.Frame((1000, 2000), (-5, 3), 2.0)
    f = random_fragments(1, (300, 100), most=4)
    f = moit.Fragments(f.offsets, f.depth, f.alpha, f.color, shape=f.shape, frame=frame)
    moit.write_deep(tmp_path / "f.exr", f)
    whole = moit.read_deep(tmp_path / "f.exr").frame
    assert whole.display_origin == (-5, 3)
    bands = list(moit.read_deep_bands(tmp_path / "f.exr", memory=1 << 20))
    assert len(bands) > 1 and all(band.frame == whole for band in bands)


def test_frames_go_with_fragments():
    f = random_fragments(1)
    frame = moit.Frame((10, 20), (1, 2), 2)
    framed = moit.Fragments(f.offsets, f.depth, f.alpha, f.color, shape=f.shape, frame=frame)
    same = [framed[1:3, 2:5], framed.sorted(), framed.shuffled(1), moit.merge([f, framed])]
    same += [pickle.loads(pickle.dumps(framed))]
    assert all(one.frame == frame for one in same)
    assert f.frame is None
    assert np.array_equal(moit.composite(f, "power4"), moit.composite(framed, "power4"))


def test_frames_go_into_npz_files(tmp_path, whole):
    kinds = ("unknown type", "not UTF-8", "a matrix")
    path = written(tmp_path, with_attributes(whole, *(STRANGE[kind] for kind in kinds)))
    f = moit.read_deep(path)
    moit.save(tmp_path / "f.npz", f)
    assert moit.load(tmp_path / "f.npz").frame == f.frame
    held = dict(np.load(tmp_path / "f.npz"))
    for bad in (held["frame"][:50], held["frame"].astype(float), held["frame"][:0]):
        np.savez(tmp_path / "g.npz", **(held | {"frame": bad}))
        with pytest.raises(moit.FragmentsError, match="frame: "):
            moit.load(tmp_path / "g.npz")


def test_an_image_without_frame_is_shown_whole(tmp_path):
    for origin in ((0, 0), (5, 6), (-5, -6)):
        moit.write_image(tmp_path / "f.exr", np.ones((3, 4, 3)), origin=origin)
        header = OpenEXR.File(str(tmp_path / "f.exr"), header_only=True).header()
        y, x = origin
        assert np.array_equal(header["dataWindow"], ((x, y), (x + 3, y + 2)))
        last = (max(x + 3, 0), max(y + 2, 0))
        assert np.array_equal(header["displayWindow"], ((min(x, 0), min(y, 0)), last))


@pytest.mark.parametrize(
    "make, error, words",
    [
        (lambda: moit.Frame((0, 4)), ValueError, "display_shape: expected"),
        (lambda: moit.Frame("ab"), TypeError, "display_shape: expected two integers"),
        (lambda: moit.Frame((4, 4), (0,)), TypeError, "origin"),
        (lambda: moit.Frame((4, 4), pixel_aspect=0), ValueError, "pixel_aspect: expected"),
        (lambda: moit.Frame((4, 4), pixel_aspect="1"), TypeError, "pixel_aspect: expected"),
        (lambda: moit.Frame((4, 4), attributes=("a",)), TypeError, "attributes: expected"),
        (lambda: moit.Fragments([0], [], [], frame=3), TypeError, "frame: expected a Frame"),
    ],
)
def test_wrong_frames_are_refused(make, error, words):
    with pytest.raises(error, match=words):
        make()


def test_wrong_places_of_images_are_refused(tmp_path):
    image = np.ones((3, 4, 3))
    for origin, error in (((2**30, 0), ValueError), ((0,), TypeError), ("ab", TypeError)):
        with pytest.raises(error, match="origin"):
            moit.write_image(tmp_path / "f.exr", image, origin=origin)
    with pytest.raises(TypeError, match="frame: expected a Frame"):
        moit.write_image(tmp_path / "f.exr", image, frame={})
    assert not list(tmp_path.iterdir())
