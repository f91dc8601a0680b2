"""moit.show: what a screen shows of linear images, and how pictures show themselves."""

import io
import re
import types
from base64 import b64decode
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from small import some_fragments

import moit
from moit.reports.shown_images import WIDEST
from moit.showing import MOST_SCALE


def encoded(linear):
    """sRGB bytes by the standard's formula (IEC 61966-2-1)."""
    clipped = np.clip(np.asarray(linear, np.float64), 0, 1)
    curve = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    return np.rint(255 * curve).astype(np.uint8)


def stored(source):
    """Pixels of a PNG: of a file, or of bytes."""
    if isinstance(source, bytes):
        Path("given.png").write_bytes(source)
        source = "given.png"
    return oiio.ImageBuf(str(source)).get_pixels(oiio.UINT8)


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def picture(height=6, width=8, channels=3, most=1.0):
    return (most * np.random.default_rng(3).random((height, width, channels))).astype(np.float32)


def only(shown):
    (pixels,) = shown.pixels
    return pixels


@pytest.mark.parametrize("stops", [0, 1.5, -3])
def test_a_linear_image_is_exposed_and_encoded_as_srgb(stops):
    image = picture(most=2)
    found = only(moit.show(image, exposure=stops)).astype(int)
    assert np.abs(found - encoded(image * 2.0**stops).astype(int)).max() <= 1  # float32's rounding


def test_grey_has_three_channels_and_truth_values_are_black_and_white():
    grey = picture()[..., 0]
    assert np.array_equal(only(moit.show(grey)), only(moit.show(np.stack([grey] * 3, axis=2))))
    assert only(moit.show(np.array([[True, False]]))).tolist() == [[[255] * 3, [0] * 3]]


def test_integers_are_srgb_already():
    values = np.arange(255, dtype=np.uint8).reshape(5, 17, 3)
    assert np.array_equal(only(moit.show(values)), values)
    assert np.array_equal(only(moit.show(values.astype(np.uint16) * 257)), values)


def test_reinhard_is_of_the_luminance():
    # Of L = 0.7152 times 4 there comes L / (1 + L); the hue stays.
    found = only(moit.show(np.array([[[0, 4.0, 0], [1.0, 1, 1]]]), tone="reinhard"))
    assert np.array_equal(found[0, 0], encoded([0, 4 / (1 + 4 * 0.7152), 0]))
    assert np.array_equal(found[0, 1], encoded([0.5] * 3))


def test_aces_is_the_fit_of_each_channel():
    image = picture(most=6).astype(np.float64)
    x = 0.6 * image
    curve = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    assert np.array_equal(only(moit.show(image, tone="aces")), encoded(curve))


@pytest.mark.parametrize("tone", ["none", "reinhard", "aces"])
def test_tones_never_fall_and_end_white(tone):
    ramp = np.repeat(np.geomspace(1e-4, 1e30, 400)[None, :, None], 3, axis=2)
    found = only(moit.show(ramp, tone=tone)).astype(int)[0, :, 0]
    assert (np.diff(found) >= 0).all() and found[-1] == 255
    negative = only(moit.show(np.full((1, 1, 3), -2.0), tone=tone))
    assert not negative.any()


def test_a_background_is_seen_through_alpha_as_composite_puts_it():
    f = some_fragments(12, 16)
    behind = np.random.default_rng(1).random((12, 16, 3))
    image = moit.composite(f, "power4")
    for background in ((0.2, 0.3, 0.5), behind):
        whole = only(moit.show(moit.composite(f, "power4", background=background), exposure=1))
        found = only(moit.show(image, background=background, exposure=1))
        assert np.abs(found.astype(int) - whole.astype(int)).max() <= 1
    moit.write_image("behind.exr", behind.astype(np.float32))
    assert np.array_equal(
        only(moit.show(image, background="behind.exr")), only(moit.show(image, background=behind))
    )


def test_what_is_opaque_shows_no_background():
    image = picture(channels=4)
    image[..., 3] = 1
    for background in ("checkerboard", (1, 0, 0)):
        assert np.array_equal(
            only(moit.show(image, background=background)), encoded(image[..., :3])
        )
    colour = image[..., :3]
    assert np.array_equal(only(moit.show(colour, background=(1, 0, 0))), encoded(colour))


def test_a_checkerboard_is_not_exposed_and_has_two_greys():
    clear = np.zeros((32, 48, 4))
    found = only(moit.show(clear, background="checkerboard"))
    greys, counts = np.unique(found, return_counts=True)
    assert len(greys) == 2 and counts[0] == counts[1]
    assert np.array_equal(found, only(moit.show(clear, background="checkerboard", exposure=5)))
    assert found[0, 0, 0] != found[0, 8, 0] and found[0, 0, 0] == found[8, 8, 0]


def test_colour_without_alpha_in_it_is_multiplied():
    image = picture(channels=4)
    held = image.copy()
    held[..., :3] *= held[..., 3:]
    found = only(moit.show(image, premultiplied=False, background=(0.1, 0.2, 0.3)))
    assert np.array_equal(found, only(moit.show(held, background=(0.1, 0.2, 0.3))))


def test_what_is_not_finite_is_magenta_and_said():
    image = picture(channels=4)
    image[0, 0, 1], image[2, 3, 0], image[4, 4, 3] = np.nan, np.inf, np.nan
    shown = moit.show(image, background="checkerboard")
    bad = (only(shown) == (255, 0, 255)).all(axis=2)
    assert np.argwhere(bad).tolist() == [[0, 0], [2, 3], [4, 4]]
    assert shown.lost == (3,)
    assert "3 pixels not finite" in repr(shown) and "3 pixels not finite" in shown._repr_html_()


def test_images_larger_than_the_rows_done_at_once_are_whole():
    image = picture(131, 70, 4)
    image[100, 5] = np.nan
    shown = moit.show(image, background=picture(131, 70))
    assert shown.lost == (1,)
    for part in (slice(0, 40), slice(40, 131)):
        own = moit.show(image[part], background=picture(131, 70)[part])
        assert np.array_equal(only(shown)[part], only(own))


def test_tiny_images_are_larger_by_whole_pixels():
    shown = moit.show(picture())
    assert shown.scales == (32,)  # 8 pixels become 256
    large = stored(shown._repr_png_())
    assert large.shape == (6 * 32, 8 * 32, 3)
    assert np.array_equal(large[::32, ::32], only(shown))
    assert np.array_equal(large[31::32, 31::32], only(shown))
    assert moit.show(picture(1, 1)).scales == (MOST_SCALE,)
    assert moit.show(picture(), scale=3).scales == (3,)
    assert moit.show(picture(4, 300)).scales == (1,)
    assert moit.show(picture(4, 100)).scales == (2,)  # no longer than 256


def test_large_images_are_shrunk_in_a_notebook_and_whole_in_a_file():
    image = np.zeros((40, 3000, 3))
    image[:, ::2] = 0.5  # stripes, of which a screen shows the mean of the light, not of the bytes
    shown = moit.show(image)
    small = stored(shown._repr_png_())
    assert small.shape[1] == WIDEST
    assert abs(int(small[:, 1:-1].mean()) - int(encoded(0.25))) <= 12
    shown.save("large.png")
    assert np.array_equal(stored("large.png"), encoded(image))


def test_tall_images_with_too_many_pixels_are_thinned_to_less_than_a_page(monkeypatch):
    monkeypatch.setattr("moit.reports.shown_images.MOST_PIXELS", 2000)
    shown = moit.show(np.broadcast_to(np.linspace(0, 1, 1000), (60, 1000)).copy())
    small = stored(shown._repr_png_())
    assert small.shape == (10, 167, 3)  # every sixth
    assert (np.diff(small[0, :, 0].astype(int)) >= 0).all()


def test_several_stand_side_by_side_with_titles():
    a, b = picture(), picture(5, 8)
    shown = moit.show({"one <a>": a, "two": b}, scale=1)
    assert shown.titles == ("one <a>", "two") and shown.columns == 2
    page = shown._repr_html_()
    assert shown._repr_png_() is None
    assert "one &lt;a&gt;" in page and "<a>" not in page
    sources = re.findall(r"data:image/png;base64,([^\"]+)", page)
    for source, own in zip(sources, shown.pixels, strict=True):
        assert np.array_equal(stored(b64decode(source)), own)
    shown.save("both.png")
    sheet = stored("both.png")
    assert sheet.shape == (6, 26, 3)
    assert np.array_equal(sheet[:, :8], shown.pixels[0])
    assert np.array_equal(sheet[:5, 18:], shown.pixels[1])
    assert (sheet[:, 8:18] == 255).all()
    shown.save("both.svg")
    drawn = Path("both.svg").read_text()
    assert "one &lt;a&gt;" in drawn and drawn.count("<image ") == 2


def test_lists_have_titles_where_they_are_given_or_files():
    moit.write_image("left.png", picture())
    assert moit.show([picture(), "left.png"]).titles == ("", "left.png")
    assert moit.show([picture()] * 2, titles=("a", "b")).titles == ("a", "b")
    assert moit.show(picture(), titles="a").titles == ("a",)
    assert moit.show([picture()] * 7).columns == 3
    shown = moit.show([picture()] * 3, columns=2, scale=1)
    shown.save("three.png")
    assert stored("three.png").shape == (6 + 10 + 6, 8 + 10 + 8, 3)


def test_what_carries_a_picture_and_paths_are_shown():
    glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    made = moit.render(glass, "power4", (8, 6), report=True)
    assert np.array_equal(only(moit.show(made)), only(moit.show(made.image)))
    choice = moit.choose(moit.scenes.load("panes", (8, 6)))
    assert np.array_equal(only(moit.show(choice)), only(moit.show(choice.image)))
    moit.write_image("made.exr", made.image)
    assert np.array_equal(only(moit.show(Path("made.exr"))), only(moit.show(made)))


def test_a_rendering_shows_its_picture_and_what_it_took():
    glass = moit.Mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]], alpha=0.5)
    made = moit.render(glass, "power4", (8, 6), report=True)
    page = made._repr_html_()
    assert "Rendering(8x6" in page
    (source,) = re.findall(r"data:image/png;base64,([^\"]+)", page)
    scale = moit.show(made).scales[0]
    assert np.array_equal(stored(b64decode(source))[::scale, ::scale], only(moit.show(made)))
    nothing = moit.Rendering(None, (8, 6), {}, {}, "add", None)
    assert "img" not in nothing._repr_html_() and "Rendering(8x6" in nothing._repr_html_()


def test_of_a_huge_rendering_few_pixels_are_looked_at(monkeypatch):
    monkeypatch.setattr("moit.reports.shown_images.MOST_PIXELS", 600)
    looked = []
    monkeypatch.setattr(
        "moit.showing.show",
        lambda image: looked.append(image.shape) or types.SimpleNamespace(html=str),
    )
    moit.Rendering(picture(60, 80, 4), (80, 60), {}, {}, "add", None)._repr_html_()
    assert looked == [(20, 27, 4)]


@pytest.mark.parametrize(
    ("image", "options", "error", "words"),
    [
        (np.zeros((2, 3, 5)), {}, ValueError, r"image: expected \(height.*\(2, 3, 5\)"),
        (np.zeros(4), {}, ValueError, "image: expected .*"),
        (np.zeros((0, 3, 3)), {}, ValueError, "at least one pixel"),
        (np.zeros((2, 3), int), {}, TypeError, "image: expected floats.*int64"),
        (np.zeros((2, 3), complex), {}, TypeError, "image: expected floats.*complex"),
        (some_fragments(2, 2), {}, TypeError, "image: expected .*Fragments"),
        (None, {}, TypeError, "image: expected .*NoneType"),
        (moit.Rendering(None, (8, 6), {}, {}, "add", None), {}, ValueError, "image: .*without"),
        ("missing.png", {}, FileNotFoundError, "missing.png"),
        ([], {}, ValueError, "image: expected at least one"),
        ({1: np.zeros((2, 3))}, {}, TypeError, "image: expected titles as str"),
        ([np.zeros((2, 3)), np.zeros(3)], {}, ValueError, r"image\[1\]: "),
        ({"a": np.zeros(3)}, {}, ValueError, r"image\['a'\]: "),
        (np.zeros((2, 3)), {"tone": "filmic"}, ValueError, "tone: expected .*'aces'"),
        (np.zeros((2, 3)), {"exposure": "1"}, TypeError, "exposure: "),
        (np.zeros((2, 3)), {"exposure": np.nan}, ValueError, "exposure: "),
        (np.zeros((2, 3)), {"exposure": 101}, ValueError, "exposure: "),
        (np.zeros((2, 3, 4)), {"background": (1, 2)}, ValueError, r"background: .*\(2,\)"),
        (np.zeros((2, 3, 4)), {"background": np.zeros((3, 2, 3))}, ValueError, r"\(2, 3, 3\)"),
        (np.zeros((2, 3, 4)), {"background": (1, 2, np.nan)}, ValueError, "background"),
        (np.zeros((2, 3, 4)), {"background": "chess"}, FileNotFoundError, "checkerboard.*chess"),
        (np.zeros((2, 3)), {"premultiplied": 1}, TypeError, "premultiplied: "),
        (np.zeros((2, 3)), {"titles": ["a", "b"]}, ValueError, "titles: expected 1"),
        (np.zeros((2, 3)), {"titles": [1]}, TypeError, "titles: expected str"),
        (np.zeros((2, 3)), {"titles": 3}, TypeError, "titles: expected str, or .* got int"),
        (np.zeros((2, 3)), {"titles": {"a": 1}}, TypeError, "titles: expected str, or .* got dict"),
        ("a\0.png", {}, ValueError, "null"),
        (np.zeros((2, 3)), {"columns": 0}, ValueError, "columns: "),
        (np.zeros((2, 3)), {"scale": 65}, ValueError, "scale: "),
    ],
)
def test_what_cannot_be_shown_is_named(image, options, error, words):
    with pytest.raises(error, match=words):
        moit.show(image, **options)


def test_other_endings_are_refused():
    with pytest.raises(ValueError, match=r"path: expected a name that ends in \.png or \.svg"):
        moit.show(picture()).save("a.exr")


def test_a_terminal_sees_how_to_save_it():
    out = io.StringIO()
    print(moit.show({"a": picture(), "b": picture(5, 4)}), file=out)
    assert out.getvalue() == "<a 8x6, b 4x5: a picture in Jupyter; .save('NAME.png') writes it>\n"


def test_alpha_beyond_its_range_takes_no_light_away():
    image = np.full((1, 2, 4), 0.25, np.float32)
    image[0, :, 3] = (1.5, -0.5)
    moit.show(image, background=(0.5, 0.5, 0.5), scale=1).save("a.png")
    assert np.array_equal(stored("a.png")[0, :, :3], encoded([[0.25] * 3, [0.75] * 3]))
