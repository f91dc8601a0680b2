"""Images in files: what is written is read back, and what cannot be is refused."""

import os
from dataclasses import dataclass

import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import moit


def picture(shape, seed=0, scale=1.0, dtype=np.float32):
    return (scale * np.random.default_rng(seed).random(shape)).astype(dtype)


def header(path):
    file = oiio.ImageInput.open(str(path))
    found = {attribute.name: attribute.value for attribute in file.spec().extra_attribs}
    file.close()
    return found


@settings(max_examples=25)
@given(st.integers(1, 9), st.integers(1, 9), st.sampled_from([3, 4]), st.integers(0, 99))
def test_openexr_keeps_every_bit(tmp_path_factory, height, width, channels, seed):
    path = tmp_path_factory.mktemp("images") / "f.exr"
    image = picture((height, width, channels), seed, scale=50)
    image[0, 0] = [np.nan, np.inf, -3, 0][:channels]
    moit.write_image(path, image)
    found = moit.read_image(path)
    assert found.dtype == np.float32 and np.array_equal(found, image, equal_nan=True)


def test_half_floats_round_to_eleven_bits(tmp_path):
    image = picture((5, 7, 4), scale=50)
    moit.write_image(tmp_path / "f.exr", image, half=True)
    assert np.array_equal(moit.read_image(tmp_path / "f.exr"), image.astype(np.float16))


def test_png_holds_eight_bits_of_srgb(tmp_path):
    image = picture((31, 17, 3))
    image[0, 0] = [-1, 0, 2]
    moit.write_image(tmp_path / "f.png", image)
    stored = oiio.ImageBuf(str(tmp_path / "f.png")).get_pixels(oiio.UINT8)
    linear = np.clip(image.astype(np.float64), 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.array_equal(stored, np.floor(255 * encoded + 0.5))
    # Half a step of 1/255, where the decoding curve is steepest (2.4 / 1.055).
    assert np.abs(moit.read_image(tmp_path / "f.png") - linear).max() < 0.5 / 255 * 2.4 / 1.055


def test_what_png_holds_comes_back(tmp_path):
    moit.write_image(tmp_path / "a.png", picture((31, 17, 4)), alpha=True)
    image = moit.read_image(tmp_path / "a.png")
    moit.write_image(tmp_path / "b.png", image, alpha=True)
    assert image.shape == (31, 17, 4)
    assert np.array_equal(moit.read_image(tmp_path / "b.png"), image)


def test_png_color_does_not_depend_on_alpha(tmp_path):
    image = picture((9, 8, 4))
    image[..., 3] = np.linspace(0, 1, 8)
    moit.write_image(tmp_path / "rgb.png", image)
    moit.write_image(tmp_path / "rgba.png", image, alpha=True)
    without, with_alpha = (
        moit.read_image(tmp_path / "rgb.png"),
        moit.read_image(tmp_path / "rgba.png"),
    )
    assert without.shape == (9, 8, 3)
    assert np.array_equal(with_alpha[..., :3], without)
    assert np.abs(with_alpha[..., 3] - image[..., 3]).max() <= 0.501 / 255


def test_alpha_may_be_left_out_of_openexr(tmp_path):
    moit.write_image(tmp_path / "f.exr", picture((2, 3, 4)), alpha=False)
    assert moit.read_image(tmp_path / "f.exr").shape == (2, 3, 3)


@dataclass(frozen=True)
class Blend:
    weight: float = 0.25

    def __str__(self):
        return "blend"


@pytest.mark.parametrize("ending", ["exr", "png"])
def test_the_header_says_what_made_the_image(tmp_path, ending):
    path = tmp_path / f"f.{ending}"
    attributes = {"scene": "panes", "fragments": 12, "seconds": 0.5}
    moit.write_image(path, picture((2, 3, 3)), technique=Blend(), attributes=attributes)
    found = header(path)
    assert found["Software"] == f"moit {moit.__version__}"
    assert found["moit:version"] == moit.__version__
    assert found["moit:technique"] == "blend"
    assert found["moit:parameters"] == "Blend(weight=0.25)"
    kept = attributes if ending == "exr" else {k: str(v) for k, v in attributes.items()}
    assert {name: found[name] for name in attributes} == kept


def test_a_technique_may_be_a_name(tmp_path):
    moit.write_image(tmp_path / "f.exr", picture((2, 3, 3)), technique="power4")
    found = header(tmp_path / "f.exr")
    assert found["moit:technique"] == "power4" and "moit:parameters" not in found


@pytest.mark.parametrize("seed", range(2))
def test_channels_of_any_order_are_found(tmp_path, seed):
    names = list(np.random.default_rng(seed).permutation(["R", "G", "B", "A", "Z", "id"]))
    spec = oiio.ImageSpec(2, 2, 6, "float")
    spec.channelnames = [str(name) for name in names]
    file = oiio.ImageOutput.create(str(tmp_path / "f.exr"))
    file.open(str(tmp_path / "f.exr"), spec)
    file.write_image(np.tile(np.arange(6, dtype=np.float32), (2, 2, 1)))
    file.close()
    assert moit.read_image(tmp_path / "f.exr")[0, 0].tolist() == [names.index(c) for c in "RGBA"]


def test_strided_and_float64_images_are_written(tmp_path):
    image = picture((8, 9, 4), dtype=np.float64)[::2, ::-1]
    moit.write_image(tmp_path / "f.exr", image)
    assert np.array_equal(moit.read_image(tmp_path / "f.exr"), image.astype(np.float32))


# What is refused


@pytest.mark.parametrize(
    "image, error, message",
    [
        (np.zeros((4, 4, 3), np.uint8), TypeError, "image: expected linear floats, got uint8"),
        (np.zeros((4, 4, 3), complex), TypeError, "linear floats, got complex128"),
        (np.array([[["a"] * 3]]), TypeError, "linear floats"),
        (np.zeros((4, 4)), ValueError, r"expected \(height, width, 3 or 4\).* got \(4, 4\)"),
        (np.zeros((4, 4, 1)), ValueError, "3 or 4"),
        (np.zeros((0, 4, 3)), ValueError, "at least one pixel"),
        (None, TypeError, "image: expected"),
    ],
)
def test_what_is_no_image_is_refused(tmp_path, image, error, message):
    with pytest.raises(error, match=message):
        moit.write_image(tmp_path / "f.exr", image)
    assert not os.listdir(tmp_path)


def test_numbers_that_the_file_cannot_hold_are_named(tmp_path):
    image = np.zeros((2, 3, 3))
    image[1, 2, 0] = np.nan
    with pytest.raises(ValueError, match=r"image\[1, 2, 0\]: found nan; needed .* NaN"):
        moit.write_image(tmp_path / "f.png", image)
    image[1, 2, 0] = 1e5
    with pytest.raises(ValueError, match=r"image\[1, 2, 0\]: found 100000.0; needed .*float16"):
        moit.write_image(tmp_path / "f.exr", image, half=True)
    image[1, 2, 0] = 1e300
    with pytest.raises(ValueError, match=r"image\[1, 2, 0\]: found 1e\+300; needed .*float32"):
        moit.write_image(tmp_path / "f.exr", image)
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize("name", ["f", "f.jpg", "f.exr.gz", ".png"])
def test_other_endings_are_refused(tmp_path, name):
    with pytest.raises(ValueError, match=r"ends in \.exr or \.png"):
        moit.write_image(tmp_path / name, picture((2, 2, 3)))


@pytest.mark.parametrize(
    "attributes, error",
    [
        ({"a": None}, TypeError),
        ({"a": True}, TypeError),
        ({"a": [1]}, TypeError),
        ({"": 1}, TypeError),
        ({1: 1}, TypeError),
        ({"a": 2**31}, ValueError),
    ],
)
def test_other_attributes_are_refused(tmp_path, attributes, error):
    with pytest.raises(error, match="attributes"):
        moit.write_image(tmp_path / "f.exr", picture((2, 2, 3)), attributes=attributes)


def test_half_is_not_for_png(tmp_path):
    with pytest.raises(ValueError, match="half: PNG has 8 bits"):
        moit.write_image(tmp_path / "f.png", picture((2, 2, 3)), half=True)


def test_what_is_no_file_raises_the_systems_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        moit.read_image(tmp_path / "absent.png")
    with pytest.raises(IsADirectoryError):
        moit.read_image(tmp_path)
    with pytest.raises(FileNotFoundError):
        moit.write_image(tmp_path / "absent" / "f.png", picture((2, 2, 3)))
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(IsADirectoryError):
        moit.write_image(tmp_path / "folder.png", picture((2, 2, 3)))


def test_devices_are_not_replaced(tmp_path):
    link = tmp_path / "f.png"
    link.symlink_to("/dev/null")
    with pytest.raises(OSError, match="regular file"):
        moit.write_image(link, picture((2, 2, 3)))
    assert not os.path.isfile("/dev/null")


@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n", b"words\n" * 99, b"\0" * 999])
@pytest.mark.parametrize("ending", ["exr", "png", "jpg", "xyz"])
def test_files_of_another_kind_raise_oserror(tmp_path, content, ending):
    path = tmp_path / f"f.{ending}"
    path.write_bytes(content)
    with pytest.raises(OSError, match=rf"f\.{ending}"):
        moit.read_image(path)


@pytest.mark.parametrize("ending", ["exr", "png"])
def test_truncated_files_raise_oserror(tmp_path, ending):
    path = tmp_path / f"f.{ending}"
    moit.write_image(path, picture((20, 30, 3)))
    whole = path.read_bytes()
    # The last bytes of a PNG say only that it ends.
    for length in range(0, len(whole) - 16, max(1, len(whole) // 60)):
        path.write_bytes(whole[:length])
        with pytest.raises(OSError, match=rf"f\.{ending}"):
            moit.read_image(path)


@pytest.mark.parametrize("ending", ["exr", "png"])
def test_damaged_files_are_read_or_refused(tmp_path, ending):
    path = tmp_path / f"f.{ending}"
    moit.write_image(path, picture((20, 30, 3)))
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(150):
        damaged = bytearray(whole)
        start = int(rng.integers(len(whole)))
        damaged[start : start + 4] = rng.bytes(len(damaged[start : start + 4]))
        path.write_bytes(damaged)
        try:
            assert moit.read_image(path).shape[2] in (3, 4)
        except (OSError, ValueError) as error:
            assert f"f.{ending}" in str(error)


def test_deep_images_are_refused(tmp_path):
    f = moit.Fragments([0, 1], [1], [0.5], [[1, 1, 1]])
    moit.write_deep(tmp_path / "f.exr", f)
    with pytest.raises(ValueError, match=r"deep image.* moit\.read_deep"):
        moit.read_image(tmp_path / "f.exr")


@pytest.mark.parametrize(
    "types, found",
    [
        ({"Y": "f4"}, "found Y"),
        ({"R": "f4", "G": "f4"}, "found R, G"),
        ({"R": "u4", "G": "u4", "B": "u4"}, "found uint"),
        ({"R": "f4", "G": "u4", "B": "f4"}, "uint"),
    ],
)
def test_images_without_color_are_refused(tmp_path, types, found):
    channels = {name: np.ones((2, 2), kind) for name, kind in types.items()}
    OpenEXR.File({}, channels).write(str(tmp_path / "f.exr"))
    with pytest.raises(ValueError, match=rf"f\.exr.*{found}"):
        moit.read_image(tmp_path / "f.exr")


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "f.exr"
    path.write_bytes(b"old")

    class Full:
        def open(self, *_):
            return True

        def write_scanlines(self, *_):
            return False

        def geterror(self):
            return "disk full"

        def close(self):
            return True

    monkeypatch.setattr(oiio.ImageOutput, "create", lambda *_: Full())
    with pytest.raises(OSError, match=r"f\.exr': disk full"):
        moit.write_image(path, picture((2, 2, 3)))
    assert path.read_bytes() == b"old" and os.listdir(tmp_path) == ["f.exr"]
