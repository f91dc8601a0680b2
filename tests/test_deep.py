"""Deep OpenEXR files: what is read, what is written, and what is refused."""

import os
from pathlib import Path

import deep_model
import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import moit
from moit import _core

IMAGES = sorted((Path(__file__).parent / "data" / "deep").glob("*.exr"))

LINES = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}

# A product and a quotient, each rounded to float32: relative 2**-24 each, and a little for both.
ROUND_TRIP = 2.0**-22


def pixel_lists(samples, shape):
    """An array of arrays, as OpenEXR takes it, from {(y, x): numbers}."""
    pixels = np.empty(shape, object)
    for y, x in np.ndindex(*shape):
        pixels[y, x] = np.asarray(samples.get((y, x), []), samples["dtype"])
    return pixels


def write_channels(path, shape=(1, 1), dtype=np.float32, part=None, **channels):
    """A deep file; a channel is a list of samples for the last pixel, or a dict of pixels."""
    at = (shape[0] - 1, shape[1] - 1)
    arrays = {}
    for name, samples in channels.items():
        samples = samples if isinstance(samples, dict) else {at: samples}
        arrays[name] = pixel_lists({"dtype": dtype, **samples}, shape)
    OpenEXR.File(LINES | (part or {}), arrays).write(str(path))
    return path


def point(alpha=0.5, color=0.25, depth=2.0):
    """The channels of one surface; colour is multiplied by alpha."""
    return {"A": [alpha], "B": [color], "G": [color], "R": [color], "Z": [depth]}


def random_fragments(seed, shape=(5, 7), dtype=np.float32, most=4, color=True, origin=(0, 0)):
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, shape[0] * shape[1])
    offsets = np.concatenate([[0], np.cumsum(counts)])
    n = offsets[-1]
    return moit.Fragments(
        offsets,
        rng.uniform(0.5, 9, n).astype(dtype),
        rng.uniform(0.001, 1, n).astype(dtype),
        rng.uniform(0, 3, (n, 3)).astype(dtype) if color else None,
        shape=shape,
        origin=origin,
    )


def read_with_oiio(path):
    """(counts, {channel: samples}) by OpenImageIO, an implementation of its own."""
    file = oiio.ImageInput.open(str(path))
    assert file, oiio.geterror()
    deep = file.read_native_deep_image()
    counts = np.array([deep.samples(p) for p in range(deep.pixels)])
    pixel = np.repeat(np.arange(deep.pixels), counts).tolist()
    sample = (np.arange(len(pixel)) - np.repeat(np.cumsum(counts) - counts, counts)).tolist()
    found = {}
    for c, name in enumerate(file.spec().channelnames):
        values = map(deep.deep_value, pixel, [c] * len(pixel), sample)
        found[name] = np.fromiter(values, np.float32, len(pixel))
    file.close()
    return counts, found


# Reading


@pytest.mark.parametrize("path", IMAGES, ids=lambda p: p.stem)
def test_every_sample_is_what_openimageio_reads(path):
    f = moit.read_deep(path, tidy=False)
    counts, found = read_with_oiio(path)
    assert np.array_equal(f.counts, counts)
    assert np.array_equal(f.depth, found["Z"])
    assert np.array_equal(f.alpha, found["A"])
    for i, channel in enumerate("RGB"):
        np.testing.assert_allclose(f.color[:, i] * f.alpha, found[channel], rtol=ROUND_TRIP)


@pytest.mark.parametrize("path", IMAGES, ids=lambda p: p.stem)
def test_the_exact_composite_is_openimageios_flatten(path):
    flat = oiio.ImageBufAlgo.flatten(oiio.ImageBuf(str(path)))
    names = flat.spec().channelnames
    expected = flat.get_pixels(oiio.FLOAT)[..., [names.index(c) for c in "RGBA"]]
    # float32 results of a few products and sums of numbers up to about 1
    f = moit.read_deep(path, tidy=False)
    np.testing.assert_allclose(moit.composite(f, "sorted"), expected, atol=1e-6)


@pytest.mark.parametrize("path", IMAGES, ids=lambda p: p.stem)
def test_a_tidy_image_is_what_the_document_makes_of_it(path):
    """OpenImageIO flattens samples that coincide in the file's order, which Trunks has."""
    f = moit.read_deep(path, tidy=False)
    expected = np.zeros((len(f.counts), 4))
    for pixel in range(len(f.counts)):
        light, opacity = deep_model.flattened(deep_model.samples_of(f, pixel))
        expected[pixel] = *light, opacity[0]
    image = moit.composite(path, "sorted")
    np.testing.assert_allclose(image, expected.reshape(image.shape), atol=1e-6)
    assert np.array_equal(moit.composite(moit.read_deep(path), "sorted"), image)


def test_the_data_window_gives_shape_and_origin():
    f = moit.read_deep(next(p for p in IMAGES if p.stem == "Balls"))
    assert f.shape == (24, 32) and f.origin == (410, 707)
    seen_through = f.depth[f.alpha < 1]
    assert f.depth_range == (seen_through.min(), seen_through.max())
    assert f.dtype == np.float32


def test_samples_keep_the_files_order(tmp_path):
    path = write_channels(tmp_path / "f.exr", Z=[3, 1, 2], A=[0.1, 0.2, 0.3])
    f = moit.read_deep(path, tidy=False)
    assert f.depth.tolist() == [3, 1, 2]
    assert f.color is None
    assert moit.read_deep(path).depth.tolist() == [1, 2, 3]  # a tidy image is sorted


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.uint32])
def test_every_pixel_type_is_read(tmp_path, dtype):
    path = write_channels(tmp_path / "f.exr", dtype=dtype, R=[3], G=[2], B=[1], A=[1], Z=[7])
    f = moit.read_deep(path)
    assert f.color.tolist() == [[3, 2, 1]] and f.alpha.tolist() == [1] and f.depth.tolist() == [7]


def test_channels_may_have_different_types(tmp_path):
    arrays = {"Z": np.float32, "A": np.float16, "id": np.uint32, "R": np.float16, "G": np.float32}
    arrays = {c: pixel_lists({"dtype": t, (0, 0): [1]}, (1, 1)) for c, t in arrays.items()}
    arrays["B"] = arrays["R"]
    OpenEXR.File(dict(LINES), arrays).write(str(tmp_path / "f.exr"))
    assert moit.read_deep(tmp_path / "f.exr").color.tolist() == [[1, 1, 1]]


def test_other_channels_are_ignored(tmp_path):
    path = write_channels(tmp_path / "f.exr", **point(), **{"left.R": [9], "id": [4], "Y": [5]})
    assert moit.read_deep(path).color.tolist() == [[0.5, 0.5, 0.5]]


def test_tiles_are_read_like_lines(tmp_path):
    shape, channels = (70, 90), {"Z": {}, "A": {}}
    rng = np.random.default_rng(1)
    for pixel in np.ndindex(*shape):
        n = rng.integers(0, 3)
        channels["Z"][pixel] = rng.random(n)
        channels["A"][pixel] = rng.random(n)
    lines = write_channels(tmp_path / "l.exr", shape, **channels)
    tiled = {"type": OpenEXR.deeptile, "tiles": OpenEXR.TileDescription()}
    tiles = write_channels(tmp_path / "t.exr", shape, part=tiled, **channels)
    a, b = moit.read_deep(lines), moit.read_deep(tiles)
    assert np.array_equal(a.offsets, b.offsets) and len(a) > 1000
    assert np.array_equal(a.depth, b.depth) and np.array_equal(a.alpha, b.alpha)


def write_parts(path):
    parts = [
        OpenEXR.Part(
            dict(LINES),
            {c: pixel_lists({"dtype": "f", (0, 0): [z]}, (1, 1)) for c in "AZ"},
            name,
        )
        for name, z in (("first", 1), ("last", 0.5))
    ]
    flat = OpenEXR.Part({"type": OpenEXR.scanlineimage}, {"R": np.ones((1, 1), "f")}, "flat")
    OpenEXR.File([parts[0], flat, parts[1]]).write(str(path))
    return path


def test_subimage_chooses_a_part(tmp_path):
    path = write_parts(tmp_path / "f.exr")
    assert moit.read_deep(path, subimage=0).depth.tolist() == [1]
    assert moit.read_deep(path, subimage=2).depth.tolist() == [0.5]
    with pytest.raises(moit.FragmentsError, match=r"flat one; moit\.read_image"):
        moit.read_deep(path, subimage=1)
    for absent in (3, -1):
        with pytest.raises(ValueError, match=f"expected 0 to 2 .* got {absent}"):
            moit.read_deep(path, subimage=absent)
    with pytest.raises(TypeError, match="subimage: expected an integer, got str"):
        moit.read_deep(path, subimage="0")


def test_a_damaged_part_is_not_taken_for_another(tmp_path):
    path = write_parts(tmp_path / "f.exr")
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])  # the last part's only line
    assert moit.read_deep(path, part=0).depth.tolist() == [1]
    with pytest.raises(OSError, match="cannot be decoded"):
        moit.read_deep(path, subimage=2)


# Numbers that Fragments cannot hold


def test_color_without_alpha_is_emission(tmp_path):
    path = write_channels(
        tmp_path / "f.exr", Z=[1, 2, 3], A=[0, 0.5, 0], R=[1, 1, 0], G=[0, 1, 0], B=[0, 1, 0]
    )
    f = moit.read_deep(path)
    assert f.color.tolist() == [[0, 0, 0], [2, 2, 2], [0, 0, 0]]
    assert f.emission.tolist() == [[1, 0, 0], [0, 0, 0], [0, 0, 0]]
    assert moit.composite(f, "sorted")[0, 0].tolist() == [2, 1, 1, 0.5]
    moit.write_deep(tmp_path / "g.exr", f)
    g = moit.read_deep(tmp_path / "g.exr")
    assert np.array_equal(g.emission, f.emission) and np.array_equal(g.color, f.color)


@pytest.mark.parametrize(
    "samples",
    [
        [(1, 0, 0.3)],
        [(1, 0, 0.3), (1, 0, 0.5)],
        [(2, 0, 0.3), (1, 0.5, 0.25)],
        [(1, 0, 0.3), (1, 0.5, 0.25)],
        [(1, 1, 0.5), (1, 0, 0.3)],
        [(1, 0.5, 0.25), (2, 1, 0.5), (3, 0, 9)],
        [(1, 1e-45, 0.5), (2, 0.5, 0.25)],
        [(1, 1e-38, 0.5), (2, 0.5, 0.25)],
        [(1, 1e-30, 1e30)],
        [(1, 3e-39, 1e-3)],
        [(1, 1e-20, 1e10), (1, 0, 1e10)],
        [(1, 0, -0.5), (2, 0.5, 0.25)],
        [(1, 0, 3e38), (1, 0, 1e38)],
    ],
)
def test_light_of_no_or_hardly_any_alpha_is_added(tmp_path, samples):
    """(depth, alpha, colour times alpha) each, in any order."""
    for order in (samples, samples[::-1]):
        z, a, c = map(list, zip(*order, strict=True))
        path = write_channels(tmp_path / "f.exr", Z=z, A=a, R=c, G=c, B=[0] * len(c))
        f = moit.read_deep(path)
        light = np.array([[p, p, 0] for p in np.float32(c).astype(float)])
        rays = [
            (depth, depth, np.full(3, alpha), own)
            for depth, alpha, own in zip(z, np.float32(a).astype(float), light, strict=True)
        ]
        most = float(np.finfo(np.float32).max)
        expected = np.clip(deep_model.flattened(rays)[0], -most, most)
        image = moit.composite(f, "sorted")[0, 0]
        assert np.isfinite(f.color).all()
        np.testing.assert_allclose(image[:3], expected, rtol=1e-6)
        moit.write_deep(tmp_path / "g.exr", f)
        again = moit.composite(tmp_path / "g.exr", "sorted")[0, 0]
        np.testing.assert_allclose(again[:3], expected, rtol=1e-6)


def test_alphas_a_little_outside_are_clamped_with_a_warning(tmp_path):
    channels = {c: [1, 1, 0] for c in "RGB"}
    path = write_channels(tmp_path / "f.exr", Z=[1, 2, 3], A=[1.0005, 1, -0.0002], **channels)
    with pytest.warns(UserWarning, match=r"2 alphas outside \[0, 1\], by at most 0\.0005"):
        f = moit.read_deep(path)
    assert f.alpha.tolist() == [1, 1, 0]
    assert f.color[0].tolist() == [1, 1, 1]  # what the file adds to the pixel stays


@pytest.mark.parametrize(
    "channel, value, needed",
    [
        ("A", 1.01, r"a number in \[0, 1\]"),
        ("A", -0.01, r"a number in \[0, 1\]"),
        ("A", np.nan, "a finite number"),
        ("R", np.nan, "a finite number"),
        ("B", np.inf, "a finite number"),
        ("Z", np.inf, "a finite number"),
        ("Z", np.nan, "a finite number"),
        ("ZBack", np.nan, "a finite number"),
    ],
)
def test_other_bad_numbers_name_their_place(tmp_path, channel, value, needed):
    channels = {"A": [0.5, 0.5], "ZBack": [0, 0], "Z": [1, 1]} | {c: [0.5, 0.5] for c in "RGB"}
    channels[channel][1] = value
    window = {"dataWindow": ((10, 20), (12, 21))}
    path = write_channels(tmp_path / "f.exr", (2, 3), part=window, **channels)
    place = rf"{channel} of pixel x=12, y=21, sample 1: found .*; needed {needed}"
    with pytest.raises(moit.FragmentsError, match=place):
        moit.read_deep(path)


# Files that are something else


@pytest.mark.parametrize(
    "names, needed",
    [
        ("RGBA", "the channel Z"),
        ("RGBZ", "the channel A"),
        (["Y", "RY", "BY", "A", "Z"], "not luminance and chroma"),
        ("RAZ", "R, G and B, or none"),
        (["R", "G", "B", "RA", "BA", "Z"], "an alpha for each of R, G and B"),
        (["R", "G", "B", "A", "AR", "Z"], "an alpha for each of R, G and B"),
        (["left.R", "left.Z"], "the channel Z"),
    ],
)
def test_missing_channels_are_named_with_those_found(tmp_path, names, needed):
    path = write_channels(tmp_path / "f.exr", **{name: [0.5] for name in names})
    with pytest.raises(moit.FragmentsError, match=f"needed .*{needed}.*; found {min(names)}"):
        moit.read_deep(path)


def test_a_flat_image_is_refused(tmp_path):
    pixels = np.ones((3, 4, 4), np.float32)
    OpenEXR.File({}, {"RGBA": pixels}).write(str(tmp_path / "f.exr"))
    with pytest.raises(moit.FragmentsError, match=r"not a deep image .* moit\.read_image"):
        moit.read_deep(tmp_path / "f.exr")


def test_what_is_no_file_raises_the_systems_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        moit.read_deep(tmp_path / "absent.exr")
    with pytest.raises(IsADirectoryError):
        moit.read_deep(tmp_path)


@pytest.mark.parametrize("content", [b"", b"v", b"\x76\x2f\x31", b"words\n" * 99, b"\0" * 999])
def test_what_is_not_openexr_raises_oserror(tmp_path, content):
    path = tmp_path / "f.exr"
    path.write_bytes(content)
    with pytest.raises(OSError, match=r"f\.exr': not an OpenEXR file"):
        moit.read_deep(path)


def test_truncated_files_raise_oserror_at_any_length(tmp_path):
    moit.write_deep(tmp_path / "whole.exr", random_fragments(1))
    whole = (tmp_path / "whole.exr").read_bytes()
    path = tmp_path / "f.exr"
    for length in range(0, len(whole), 3):
        path.write_bytes(whole[:length])
        with pytest.raises(OSError, match=r"f\.exr"):
            moit.read_deep(path)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_damaged_files_are_read_or_refused(tmp_path, seed):
    rng = np.random.default_rng(seed)
    path = tmp_path / "f.exr"
    moit.write_deep(path, random_fragments(seed, (9, 11)))
    whole = path.read_bytes()
    for _ in range(100):
        damaged = bytearray(whole)
        start, width = int(rng.integers(4, len(whole) - 4)), int(rng.integers(1, 5))
        damaged[start : start + width] = rng.choice([b"\xff" * 4, b"\0" * 4, rng.bytes(4)])[:width]
        path.write_bytes(damaged)
        try:
            f = moit.read_deep(path)
        except (OSError, moit.FragmentsError) as error:
            assert "f.exr" in str(error)
        else:
            assert f.offsets[-1] == len(f)


def test_a_window_too_large_for_the_file_is_refused(tmp_path):
    path = write_channels(tmp_path / "f.exr", **point())
    whole = path.read_bytes()
    corner = np.array([0, 0, 0, 0], "<i4").tobytes()
    at = whole.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    assert whole[at : at + 16] == corner
    vast = np.array([0, 0, 2**20, 2**20], "<i4").tobytes()
    path.write_bytes(whole[:at] + vast + whole[at + 16 :])
    with pytest.raises(OSError, match=r"f\.exr"):
        moit.read_deep(path)


def test_names_of_any_bytes_are_taken(tmp_path):
    name = os.fsencode(tmp_path) + b"/\xff\xe9 \xe2\x98\x83.exr"
    f = random_fragments(3)
    moit.write_deep(name, f)
    assert np.array_equal(moit.read_deep(name, tidy=False).depth, f.depth)
    assert len(os.listdir(tmp_path)) == 1


# Writing


@settings(max_examples=25)
@given(
    st.integers(0, 2**32),
    st.tuples(st.integers(1, 9), st.integers(1, 9)),
    st.booleans(),
    st.tuples(st.integers(-50, 50), st.integers(-50, 50)),
)
def test_writing_and_reading_gives_the_same(tmp_path_factory, seed, shape, color, origin):
    f = random_fragments(seed, shape, color=color, origin=origin)
    path = tmp_path_factory.mktemp("deep") / "f.exr"
    moit.write_deep(path, f)
    g = moit.read_deep(path, tidy=False)
    assert g.shape == f.shape and g.origin == f.origin and g.dtype == f.dtype
    for name in ("offsets", "depth", "alpha"):
        assert np.array_equal(getattr(f, name), getattr(g, name)), name
    if color:
        np.testing.assert_allclose(g.color, f.color, rtol=ROUND_TRIP)
    else:
        assert g.color is None


def test_opaque_fragments_come_back_bit_for_bit(tmp_path):
    f = random_fragments(5)
    f = moit.Fragments(f.offsets, f.depth, np.ones(len(f)), f.color, dtype=np.float32)
    moit.write_deep(tmp_path / "f.exr", f)
    assert np.array_equal(moit.read_deep(tmp_path / "f.exr", tidy=False).color, f.color)


def test_openimageio_reads_what_is_written(tmp_path):
    f = random_fragments(7, origin=(-3, 40))
    moit.write_deep(tmp_path / "f.exr", f)
    counts, found = read_with_oiio(tmp_path / "f.exr")
    assert np.array_equal(counts, f.counts)
    assert np.array_equal(found["Z"], f.depth) and np.array_equal(found["A"], f.alpha)
    for i, channel in enumerate("RGB"):
        assert np.array_equal(found[channel], f.color[:, i] * f.alpha)
    spec = oiio.ImageInput.open(str(tmp_path / "f.exr")).spec()
    assert (spec.x, spec.y, spec.width, spec.height) == (40, -3, 7, 5)
    assert spec["Software"] == f"moit {moit.__version__}"


def test_half_floats_hold_alpha_and_color_but_not_depth(tmp_path):
    f = random_fragments(8)
    moit.write_deep(tmp_path / "f.exr", f, half=True)
    g = moit.read_deep(tmp_path / "f.exr", tidy=False)
    assert np.array_equal(g.depth, f.depth)
    assert np.array_equal(g.alpha, f.alpha.astype(np.float16).astype(np.float32))
    # alpha and the product each round to 11 bits, alpha of at least .001 is a normal number
    np.testing.assert_allclose(g.color, f.color, rtol=2.0**-10, atol=1e-4)


def test_float64_is_rounded(tmp_path):
    f = random_fragments(9, dtype=np.float64)
    moit.write_deep(tmp_path / "f.exr", f)
    g = moit.read_deep(tmp_path / "f.exr", tidy=False)
    assert np.array_equal(g.depth, f.depth.astype(np.float32))
    assert np.array_equal(g.alpha, f.alpha.astype(np.float32))


def test_images_without_fragments_are_written(tmp_path):
    f = moit.Fragments(np.zeros(13, int), [], [], np.zeros((0, 3)), shape=(3, 4))
    moit.write_deep(tmp_path / "f.exr", f)
    g = moit.read_deep(tmp_path / "f.exr")
    assert g.shape == (3, 4) and len(g) == 0 and g.color.shape == (0, 3)


@pytest.mark.parametrize(
    "f, options, message",
    [
        (moit.Fragments([0], [], []), {}, "1 x 0 pixels"),
        (moit.Fragments([0, 1], [1e300], [0.5]), {}, "depth: found 1e.300 at fragment 0"),
        (moit.Fragments([0, 1], [1], [1], [[1e6, 0, 0]]), {"half": True}, "alpha, R: .*float16"),
        (moit.Fragments([0, 1], [1], [1], origin=(0, 2**31 - 1)), {}, "coordinates end at"),
    ],
)
def test_what_the_file_cannot_hold_is_refused(tmp_path, f, options, message):
    if message.startswith("depth"):
        f = moit.Fragments(f.offsets, np.array([1e300]), f.alpha)
    with pytest.raises(ValueError, match=message):
        moit.write_deep(tmp_path / "f.exr", f, **options)
    assert not os.listdir(tmp_path)


def test_only_fragments_are_written(tmp_path):
    with pytest.raises(TypeError, match="f: expected Fragments, got ndarray"):
        moit.write_deep(tmp_path / "f.exr", np.zeros(3))


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "f.exr"
    path.write_bytes(b"old")

    def fail(*_, **__):
        raise RuntimeError("disk full")

    monkeypatch.setattr(OpenEXR, "File", fail)
    with pytest.raises(OSError, match=r"f\.exr': OpenEXR cannot write it: disk full"):
        moit.write_deep(path, random_fragments(1))
    assert path.read_bytes() == b"old" and len(os.listdir(tmp_path)) == 1


def test_places_that_cannot_be_written_raise_oserror(tmp_path):
    f = random_fragments(1)
    with pytest.raises(FileNotFoundError):
        moit.write_deep(tmp_path / "absent" / "f.exr", f)
    with pytest.raises(IsADirectoryError):
        moit.write_deep(tmp_path, f)


# Volumes; how they are split is in test_deep_volumes.py


def test_volumes_are_kept(tmp_path):
    path = write_channels(
        tmp_path / "f.exr", Z=[1, 2], ZBack=[3, 2], A=[0.5, 0.25], R=[0.5, 0], G=[0, 0.25], B=[0, 0]
    )
    f = moit.read_deep(path)
    assert f.depth.tolist() == [1, 2, 2] and f.back.tolist() == [2, 2, 3]
    half = 1 - np.sqrt(0.5)  # each half of an alpha of 1/2
    np.testing.assert_allclose(f.alpha, [half, 0.25, half], rtol=1e-6)  # float32
    assert f.color.tolist() == [[1, 0, 0], [0, 1, 0], [1, 0, 0]]
    f = moit.read_deep(path, tidy=False)
    assert f.depth.tolist() == [1, 2] and f.back.tolist() == [3, 2]
    moit.write_deep(tmp_path / "g.exr", f, half=True)
    g = moit.read_deep(tmp_path / "g.exr", tidy=False)
    for name in ("depth", "back", "alpha", "color"):
        assert np.array_equal(getattr(g, name), getattr(f, name)), name


def test_volumes_may_have_an_alpha_for_each_colour(tmp_path):
    z, back, r, c = [1, 2], [3, 4], [0.5, 0.25], [0.25, 0.125]
    path = write_channels(
        tmp_path / "f.exr", Z=z, ZBack=back, AR=r, AG=[0, 0.5], AB=[1, 0], R=c, G=c, B=c
    )
    rays = [
        (1.0, 3.0, np.array([0.5, 0, 1]), np.full(3, 0.25)),
        (2.0, 4.0, np.array([0.25, 0.5, 0]), np.full(3, 0.125)),
    ]
    light, opacity = deep_model.flattened(rays)
    np.testing.assert_allclose(moit.composite(path, "sorted")[0, 0, :3], light, atol=1e-6)
    total = moit.total_transmittance(path, "sorted")[0, 0]
    np.testing.assert_allclose(1 - total, opacity, atol=1e-6)


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_samples_that_coincide_are_mixed_in_any_order(tmp_path, order):
    light = np.array([[0.6, 0], [0, 0], [0, 0.6]])[:, order]
    path = write_channels(
        tmp_path / "f.exr", Z=[3, 3], A=[0.6, 0.6], R=light[0], G=light[1], B=light[2]
    )
    image = moit.composite(path, "sorted")[0, 0]
    np.testing.assert_allclose(image, [0.42, 0, 0.42, 0.84], atol=1e-6)
    (band,) = moit.read_deep_bands(path)
    assert np.array_equal(moit.composite(band, "sorted")[0, 0], image)
    moit.composite_deep(path, tmp_path / "flat.exr", "sorted")
    assert np.array_equal(moit.read_image(tmp_path / "flat.exr")[0, 0], image)
    (band,) = moit.read_deep_bands(path, tidy=False)
    assert len(band) == 2 == len(moit.read_deep(path, tidy=False))


def test_zback_at_or_before_z_is_a_surface(tmp_path):
    path = write_channels(tmp_path / "f.exr", Z=[2, 1], ZBack=[2, 0], A=[0.5, 0.25])
    f = moit.read_deep(path, tidy=False)
    assert f.back is None
    assert f.depth.tolist() == [2, 1] and f.alpha.tolist() == [0.5, 0.25]


@pytest.mark.parametrize(
    "pixel", [1, np.ones(2), np.ones((2, 2), "f"), np.ones(4, "f")[::2], np.ones(2, ">f4")]
)
def test_pixels_that_are_no_plain_arrays_are_refused(pixel):
    pixels = np.empty(2, object)
    pixels[1] = pixel
    with pytest.raises(TypeError, match="neither None nor an array"):
        _core.join_pixels(pixels)


def test_pixels_are_split_into_views():
    samples = np.arange(12, dtype=np.float32)[::2]
    pixels = _core.split_pixels(samples, np.array([0, 2, 2, 6]))
    assert [p.tolist() for p in pixels] == [[0, 2], [], [4, 6, 8, 10]]
    assert all(np.shares_memory(p, samples) for p in pixels if len(p))
    counts, joined = _core.join_pixels(_core.split_pixels(samples.copy(), np.array([0, 2, 2, 6])))
    assert counts.tolist() == [2, 0, 4] and np.array_equal(joined, samples)


@pytest.mark.parametrize("offsets", [[0, 3], [-1, 1], [2, 1], []])
def test_offsets_that_leave_the_samples_are_refused(offsets):
    with pytest.raises(ValueError, match="offsets"):
        _core.split_pixels(np.zeros(2, np.float32), np.array(offsets, np.int64))


@pytest.mark.parametrize("alpha, moved", [(1.0009, True), (1.0011, False), (-0.0009, True)])
def test_alphas_off_by_more_than_a_thousandth_are_refused(alpha, moved, tmp_path):
    channels = {c: [0] for c in "RGB"}
    path = write_channels(tmp_path / "f.exr", Z=[1], A=[alpha], **channels)
    if moved:
        with pytest.warns(UserWarning, match=r"outside \[0, 1\]"):
            assert moit.read_deep(path).alpha.tolist() == [round(alpha)]
    else:
        with pytest.raises(moit.FragmentsError, match=r"needed a number in \[0, 1\]"):
            moit.read_deep(path)
