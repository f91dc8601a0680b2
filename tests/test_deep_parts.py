"""Which samples of a deep file are meant: parts, views, layers, channels of other names, an alpha
for each colour; and what `moit.inspect` says of a file."""

import itertools

import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from test_deep import LINES, pixel_lists, point, random_fragments, write_channels

import moit
from moit.__main__ import main
from moit.formats.deep_channels import PartChannels, chosen_layer

# A product and a quotient of float32 numbers up to about 3.
ROUNDED = 1e-6


def deep(depth, name="", view="", **more):
    header = LINES | ({"view": view} if view else {}) | more
    channels = {
        c: pixel_lists({"dtype": "f", (0, 0): v}, (1, 2)) for c, v in point(depth=depth).items()
    }
    return OpenEXR.Part(dict(header), channels, name)


def flat(name):
    pixels = {c: np.ones((1, 2), "f") for c in "RGB"}
    return OpenEXR.Part({"type": OpenEXR.scanlineimage}, pixels, name)


def write(path, *parts):
    OpenEXR.File(list(parts)).write(str(path))
    return path


# Parts


@pytest.mark.parametrize("place", range(3))
def test_the_only_deep_part_is_found_by_itself(tmp_path, place):
    parts = [flat("a"), flat("b")]
    parts.insert(place, deep(7, "samples"))
    path = write(tmp_path / "f.exr", *parts)
    for part in (None, place, np.int64(place), "samples"):
        assert moit.read_deep(path, part=part).depth.tolist() == [7]
        assert sum(map(len, moit.read_deep_bands(path, part=part))) == 1
        assert moit.composite(path, "sorted", part=part)[0, 0].tolist() == [0.25] * 3 + [0.5]
    with pytest.raises(moit.FragmentsError, match="flat one"):
        moit.read_deep(path, part=(place + 1) % 3)


@pytest.fixture
def stereo(tmp_path):
    parts = [deep(1, "rgba.left", "left"), deep(2, "rgba.right", "right"), flat("preview")]
    return write(tmp_path / "stereo.exr", *parts)


def test_of_several_deep_parts_one_is_chosen(stereo):
    words = r"part: .* 0 'rgba\.left' \(view 'left'\), 1 'rgba\.right' \(view 'right'\); found None"
    for call in (moit.read_deep, moit.read_deep_bands, lambda p: moit.composite(p, "sorted")):
        with pytest.raises(moit.FragmentsError, match=words):
            call(stereo)
    for right in (1, "rgba.right", "right"):
        assert moit.read_deep(stereo, part=right).depth.tolist() == [2]
    assert moit.read_deep(stereo, subimage=1).depth.tolist() == [2]


@pytest.mark.parametrize(
    "part, error, words",
    [
        (3, ValueError, "part: expected 0 to 2 .* got 3"),
        (-1, ValueError, "part: expected 0 to 2 .* got -1"),
        ("rgba.lefd", ValueError, "did you mean 'rgba.left'"),
        ("", ValueError, "there is no ''"),
        (1.0, TypeError, "part: expected an index or a name, got float"),
        (True, TypeError, "part: expected an index or a name, got bool"),
    ],
)
def test_parts_that_are_not_there_are_named(stereo, part, error, words):
    for call in (moit.read_deep, moit.read_deep_bands):
        with pytest.raises(error, match=words):
            call(stereo, part=part)


def test_a_view_that_several_parts_have_is_not_one(tmp_path):
    path = write(tmp_path / "f.exr", deep(1, "a.left", "left"), deep(2, "b.left", "left"))
    with pytest.raises(ValueError, match="there is no 'left'"):
        moit.read_deep(path, part="left")


def test_every_call_that_takes_a_path_takes_a_part(stereo, tmp_path):
    f = moit.read_deep(stereo, part=1)
    for ask in (moit.composite, moit.transmittance, moit.total_transmittance):
        assert np.array_equal(ask(stereo, "power4", part="right"), ask(f, "power4"))
    lower, _ = moit.bounds(stereo, "power4", part=1)
    assert np.array_equal(lower, moit.bounds(f, "power4")[0])
    b0, _ = moit.moments.gather(stereo, "power4", part=1)
    assert np.array_equal(b0, moit.moments.gather(f, "power4")[0])
    assert str(moit.bias_advice(stereo, "power4", part=1)) == str(moit.bias_advice(f, "power4"))
    assert np.array_equal(moit.choose(stereo, part=1).image, moit.choose(f).image)
    report = moit.compare(
        [stereo, f], "sorted", metrics="mse", repeat=1, progress=False, part="right"
    )
    assert len(report.rows) == 2
    moit.composite_deep(stereo, tmp_path / "o.exr", "power4", part="right")
    assert np.array_equal(moit.read_image(tmp_path / "o.exr"), moit.composite(f, "power4"))


def test_recommend_plot_and_train_take_a_part(tmp_path):
    f = random_fragments(1, (12, 12))
    moit.write_deep(tmp_path / "f.exr", f)
    path = tmp_path / "f.exr"
    technique, _ = moit.recommend(
        path, max_error=9, metric="mse", techniques=["power4"], progress=False, part=0, layer=""
    )
    assert technique is not None
    moit.train(data=path, epochs=1, batch=50, fragments=100, progress=False, part=0)
    pytest.importorskip("matplotlib").use("Agg")
    moit.plot.curves(path, "power4", part=0, layer="")
    for wrong in ({"part": 1}, {"layer": "no"}):
        with pytest.raises(ValueError, match=r"part: expected|layer: there is no"):
            moit.plot.curves(path, "power4", **wrong)
        with pytest.raises(ValueError, match=r"part: expected|layer: there is no"):
            moit.train(data=path, progress=False, **wrong)


def test_a_part_is_of_deep_files_only(tmp_path):
    f = random_fragments(1)
    for given in (f, "cloud"):
        with pytest.raises(ValueError, match=r"part: only a deep \.exr has such"):
            moit.composite(given, "sorted", part=0)
        with pytest.raises(ValueError, match=r"layer: only a deep \.exr has such"):
            moit.compare(given, "sorted", layer="a", progress=False)


def test_flat_images_are_read_by_part_and_layer(tmp_path):
    pixels = {c: np.full((1, 2), 3, "f") for c in "RGBA"}
    other = {
        f"{layer}.{c}": np.full((1, 2), v, "f") for layer, v in (("a", 4), ("b", 5)) for c in RGB
    }
    lines = {"type": OpenEXR.scanlineimage}
    path = write(
        tmp_path / "f.exr",
        deep(1, "samples"),
        OpenEXR.Part(lines | {"view": "left"}, pixels, "beauty"),
        OpenEXR.Part(dict(lines), other, "layers"),
    )
    for part in (None, 1, "beauty", "left"):
        assert moit.read_image(path, part=part).shape == (1, 2, 4)
        assert moit.read_image(path, part=part)[0, 0, 0] == 3
    assert moit.read_image(path, part=2, layer="b")[0, 0].tolist() == [5, 5, 5]
    for wrong, words in (
        ({"part": 0}, "deep image"),
        ({"part": 3}, "part: expected 0 to 2"),
        ({"part": "beaut"}, "did you mean 'beauty'"),
        ({"part": 2}, "layer: needed one of 'a', 'b'"),
        ({"part": 2, "layer": ""}, "needed the channels R, G and B"),
        ({"part": 2, "layer": "c"}, "layer: there is no 'c'"),
    ):
        with pytest.raises(ValueError, match=words):
            moit.read_image(path, **wrong)


# Layers

RGB, RGBA, ALL = "RGB", "RGBA", "RGBAZ"


def channels(*groups):
    """ "beauty.RGB" is three channels; "beauty.ZBack!" is one."""
    found = []
    for group in groups:
        layer, dot, names = group.rpartition(".")
        names = [names[:-1]] if names.endswith("!") else list(names)
        found += [f"{layer}{dot}{name}" for name in names]
    return sorted(found)


@pytest.mark.parametrize(
    "groups, layer, expected",
    [
        # the channels without prefix come first
        ((ALL,), None, channels(ALL)),
        ((ALL, "left.RGBAZ"), None, channels(ALL)),
        ((ALL, "N.XYZ"), None, channels(ALL)),
        (("AZ",), None, channels("AZ")),
        (("AZ", "id.R!"), None, channels("AZ")),
        (("AZ", "N.XYZ"), None, channels("AZ")),
        # else the only layer that is whole
        (("beauty.RGBAZ",), None, channels("beauty.RGBAZ")),
        (("Z", "beauty.RGBA"), None, channels("Z", "beauty.RGBA")),
        (("AZ", "beauty.RGB"), None, channels("AZ", "beauty.RGB")),
        (("Z", "beauty.RGBA", "N.XYZ"), None, channels("Z", "beauty.RGBA")),
        (("Z", "beauty.RGBA", "matte.A"), None, channels("Z", "beauty.RGBA")),
        (("Z", "a.b.RGBA"), None, channels("Z", "a.b.RGBA")),
        (("beauty.YAZ",), None, channels("beauty.YAZ")),
        (("Z", "matte.A"), None, channels("Z", "matte.A")),
        # or the one that is asked for
        ((ALL, "left.RGBAZ"), "left", channels("left.RGBAZ")),
        ((ALL, "left.RGBAZ"), "", channels(ALL)),
        ((ALL, "diffuse.RGB"), "diffuse", channels("AZ", "diffuse.RGB")),
        (("AZ", "diffuse.RGB", "specular.RGB"), "specular", channels("AZ", "specular.RGB")),
        (("AZ", "diffuse.RGB", "specular.RGB"), "", channels("AZ")),
        (("a.AZ", "a.b.RGB"), "a.b", channels("a.AZ", "a.b.RGB")),
        (("Z", "ZBack!", "a.RGBA"), "a", channels("Z", "ZBack!", "a.RGBA")),
        (("Z", "ZBack!", "a.RGBAZ"), "a", channels("a.RGBAZ")),  # the other depth has that back
        (("AZ", "a.RGB", "a.AR!", "a.AG!", "a.AB!"), "a", None),
        (("Z", "a.RGB", "a.RA!", "a.GA!", "a.BA!"), None, None),
        ((ALL, "AR!", "AG!", "AB!", "a.RGBA"), "a", channels("Z", "a.RGBA")),
    ],
)
def test_a_layer_has_its_own_colour_and_the_nearest_depth(groups, layer, expected):
    names = chosen_layer(PartChannels(channels(*groups)), layer)[1]
    if expected is None:  # an alpha for each colour
        assert {"AR", "AG", "AB"} < set(names) and "A" not in names
    else:
        assert sorted(set(names.values())) == expected


@pytest.mark.parametrize(
    "groups, layer, words",
    [
        (("AZ", "diffuse.RGB", "specular.RGB"), None, "needed one of 'diffuse', 'specular'"),
        (("left.RGBAZ", "right.RGBAZ"), None, "needed one of 'left', 'right'"),
        (("beauty.RGBA",), None, "needed the channel Z, .*found beauty.A"),
        (("beauty.RGBA",), "beauty", "needed the channel Z, .* in the layer 'beauty'"),
        (("Z", "beauty.RGB"), "beauty", r"needed the channel A, .*channels=\{'A': NAME\}"),
        (("N.XYZ", "A"), None, "needed the channel Z"),
        ((ALL, "N.XYZ"), "M", "layer: there is no 'M'"),
        ((ALL,), "beauty", "layer: there is no 'beauty'; none has a prefix"),
        (("AZ", "beauty.RGB"), "beuaty", "did you mean 'beauty'"),
        (("Z", "beauty.RGA"), "beauty", "R, G and B, or none of them in the layer 'beauty'"),
    ],
)
def test_layers_that_are_not_clear_are_listed(groups, layer, words):
    with pytest.raises(ValueError, match=words):
        chosen_layer(PartChannels(channels(*groups)), layer)


def test_a_views_depth_is_not_taken_for_anothers():
    names = channels(ALL, "right.RGBA")
    views = ("left", "right")
    with pytest.raises(moit.FragmentsError, match="needed the channel Z"):
        chosen_layer(PartChannels(names, views), "right")
    chosen = chosen_layer(PartChannels([*names, "right.Z"], views), "right")
    assert chosen[1]["Z"] == "right.Z"


def test_layers_are_read_and_composited(tmp_path):
    both = {f"beauty.{c}": v for c, v in point(color=0.25).items()}
    both |= {f"matte.{c}": v for c, v in point(color=0.125, depth=5).items()}
    path = write_channels(tmp_path / "f.exr", (3, 2), **both)
    with pytest.raises(moit.FragmentsError, match="'beauty', 'matte'"):
        moit.read_deep(path)
    assert moit.read_deep(path, layer="beauty").depth.tolist() == [2]
    assert moit.read_deep(path, layer="matte").depth.tolist() == [5]
    assert [len(b) for b in moit.read_deep_bands(path, layer="matte")] == [1]
    image = moit.composite(path, "sorted", layer="matte")
    assert image[2, 1].tolist() == [0.125] * 3 + [0.5]
    moit.composite_deep(path, tmp_path / "o.exr", "sorted", layer="matte")
    assert np.array_equal(moit.read_image(tmp_path / "o.exr"), image)


# Channels of other names


@pytest.mark.parametrize("name", ["alpha", "opacity", "Alpha", "a", "A.x", "größe"])
def test_alpha_may_have_another_name(tmp_path, name):
    held = point()
    held[name] = held.pop("A")
    path = write_channels(tmp_path / "f.exr", **held)
    with pytest.raises(moit.FragmentsError, match=r"channel A.*channels=\{'A': NAME\}"):
        moit.read_deep(path)
    f = moit.read_deep(path, channels={"A": name})
    assert f.alpha.tolist() == [0.5] and f.color.tolist() == [[0.5] * 3]
    assert [b.alpha.tolist() for b in moit.read_deep_bands(path, channels={"A": name})] == [[0.5]]


def test_every_channel_may_have_another_name(tmp_path):
    given = {"R": "red", "G": "green", "B": "blue", "A": "alpha", "Z": "near", "ZBack": "far"}
    held = {given[role]: values for role, values in point().items()} | {"far": [2.0]}
    path = write_channels(tmp_path / "f.exr", **held)
    f = moit.read_deep(path, channels=given)
    assert f.depth.tolist() == [2] and f.alpha.tolist() == [0.5] and f.color.tolist() == [[0.5] * 3]
    moit.composite_deep(path, tmp_path / "o.exr", "sorted", channels=given)
    assert moit.read_image(tmp_path / "o.exr")[0, 0].tolist() == [0.25] * 3 + [0.5]


def test_names_are_looked_for_in_the_layer_first(tmp_path):
    held = {"alpha": [1.0], "a.alpha": [0.5], "b.R": [1.0], "b.G": [1.0], "b.B": [1.0], "Z": [1.0]}
    held |= {f"a.{c}": [0.25] for c in "RGB"}
    path = write_channels(tmp_path / "f.exr", **held)
    assert moit.read_deep(path, layer="a", channels={"A": "alpha"}).alpha.tolist() == [0.5]
    assert moit.read_deep(path, layer="b", channels={"A": "alpha"}).alpha.tolist() == [1]


@pytest.mark.parametrize(
    "given, error, words",
    [
        ({"A": "no"}, ValueError, r"channels\['A'\]: there is no channel 'no'; found A, B"),
        ({"alpha": "A"}, ValueError, "channels: expected keys of R, G, B, A"),
        ({"A": 3}, TypeError, r"channels\['A'\]: expected a name as str, got 3"),
        (["A"], TypeError, "channels: expected a dict, got list"),
    ],
)
def test_wrong_channels_are_named(tmp_path, given, error, words):
    path = write_channels(tmp_path / "f.exr", **point())
    with pytest.raises(error, match=words):
        moit.read_deep(path, channels=given)


def test_luminance_is_grey(tmp_path):
    path = write_channels(tmp_path / "f.exr", Y=[0.25], A=[0.5], Z=[2.0])
    assert moit.read_deep(path).color.tolist() == [[0.5] * 3]


# An alpha for each colour

COLORED = [("AR", "AG", "AB"), ("RA", "GA", "BA")]


def expected_flatten(samples):
    """(R, G, B, mean of alphas) of samples (depth, colour, alphas) by the over operator."""
    through, light = np.ones(3), np.zeros(3)
    for _, color, alpha in sorted(samples, key=lambda one: one[0]):
        light += through * color
        through *= 1 - np.asarray(alpha)
    return [*light, 1 - through.mean()]


@pytest.mark.parametrize("names", COLORED)
@pytest.mark.parametrize("with_mean", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_an_alpha_for_each_colour_is_transmission(tmp_path, names, with_mean, seed):
    rng = np.random.default_rng(seed)
    alphas = rng.random((6, 3)).astype("f") * np.array([1, 0.3, 0.8, 1, 0, 1], "f")[:, None]
    colors = (rng.random((6, 3)) * alphas).astype("f")
    depth = rng.permutation(6).astype("f")
    held = {"Z": depth} | {c: colors[:, i].copy() for i, c in enumerate("RGB")}
    held |= {c: alphas[:, i].copy() for i, c in enumerate(names)}
    held |= {"A": alphas.mean(axis=1)} if with_mean else {}
    path = write_channels(tmp_path / "f.exr", **held)
    f = moit.read_deep(path, tidy=False)
    assert np.array_equal(f.alpha, alphas.max(axis=1))
    np.testing.assert_allclose(f.alpha[:, None] * (1 - f.transmission), alphas, atol=1e-7)
    samples = list(zip(depth, colors, alphas, strict=True))
    found = moit.composite(path, "sorted")[0, 0]
    np.testing.assert_allclose(found, expected_flatten(samples), atol=ROUNDED)
    bands = moit.merge(moit.read_deep_bands(path, tidy=False))
    assert np.array_equal(bands.transmission, f.transmission)


def test_an_alpha_for_each_colour_is_openimageios_flatten(tmp_path):
    held = {"Z": [1, 2], "R": [0.1, 0.4], "G": [0.2, 0.1], "B": [0.3, 0.2]}
    held |= {"AR": [0.2, 0.5], "AG": [0.9, 0.1], "AB": [0.6, 0.4]}  # it knows no other names
    path = write_channels(tmp_path / "f.exr", **held)
    flat = oiio.ImageBufAlgo.flatten(oiio.ImageBuf(str(path)))
    expected = [flat.getpixel(0, 0)[flat.spec().channelnames.index(c)] for c in "RGB"]
    found = moit.composite(path, "sorted")[0, 0, :3]
    np.testing.assert_allclose(found, expected, atol=ROUNDED)


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("color", [False, True])
def test_transmission_is_written_and_read(tmp_path, half, color):
    f = random_fragments(3, color=color)
    rng = np.random.default_rng(4)
    through = rng.random((len(f), 3)) * rng.integers(0, 2, (len(f), 1))
    f = moit.Fragments(f.offsets, f.depth, f.alpha, f.color, transmission=through, shape=f.shape)
    moit.write_deep(tmp_path / "f.exr", f, half=half)
    back = moit.read_deep(tmp_path / "f.exr", tidy=False)
    assert (back.color is not None) == color
    blocked = [one.alpha[:, None] * (1 - one.transmission) for one in (f, back)]
    tolerance = 2e-3 if half else ROUNDED  # half floats have 11 bits, and there are sums
    np.testing.assert_allclose(*blocked, atol=tolerance)
    if color:
        images = [moit.composite(one, "sorted") for one in (f, back)]
        np.testing.assert_allclose(*images, atol=10 * tolerance)
    moit.write_deep(tmp_path / "g.exr", back, half=half)
    again = moit.read_deep(tmp_path / "g.exr", tidy=False)
    np.testing.assert_allclose(again.alpha, back.alpha, atol=tolerance)


def test_opaque_is_opaque_in_every_colour(tmp_path):
    held = {"AR": [1, 1], "AG": [1, 1], "AB": [1, 0.5], "Z": [1, 2]}
    f = moit.read_deep(write_channels(tmp_path / "f.exr", **held))
    assert f.alpha.tolist() == [1, 1]
    assert f.transmission.tolist() == [[0, 0, 0], [0, 0, 0.5]]


# Background at infinity


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_an_opaque_sample_at_infinity_is_background(tmp_path, dtype):
    held = {"Z": [1, np.inf, 2], "A": [0.5, 1, 0.25]} | {c: [0.5, 0.75, 0.25] for c in "RGB"}
    path = write_channels(tmp_path / "f.exr", dtype=dtype, **held)
    f = moit.read_deep(path, tidy=False)
    assert f.depth.tolist() == [1, np.finfo("f").max, 2] and f.color[1].tolist() == [0.75] * 3
    image = moit.composite(f, "sorted")[0, 0]
    assert image.tolist() == [0.5 + 0.5 * 0.25 + 0.375 * 0.75] * 3 + [1]
    assert np.array_equal(moit.read_deep(path).depth, moit.merge(moit.read_deep_bands(path)).depth)


def test_an_opaque_volume_may_reach_infinity(tmp_path):
    held = {"Z": [1], "ZBack": [np.inf], "A": [1]} | {c: [0.5] for c in "RGB"}
    path = write_channels(tmp_path / "f.exr", **held)
    assert moit.read_deep(path).back.tolist() == [np.finfo("f").max]
    image = moit.composite(path, "sorted")[0, 0]
    assert image.tolist() == [0.5, 0.5, 0.5, 1]


@pytest.mark.parametrize(
    "held",
    [
        {"Z": [np.inf], "A": [0.5]},
        {"Z": [-np.inf], "A": [1]},
        {"Z": [np.nan], "A": [1]},
        {"Z": [np.inf], "AR": [1], "AG": [1], "AB": [0.5]},
        {"Z": [1], "ZBack": [np.inf], "A": [0.5]},
    ],
)
def test_what_can_be_seen_through_is_not_at_infinity(tmp_path, held):
    path = write_channels(tmp_path / "f.exr", **held)
    with pytest.raises(moit.FragmentsError, match="needed a finite number"):
        moit.read_deep(path)


# moit.inspect


def test_inspect_tells_what_there_is(tmp_path):
    held = {"Z": [1, 2, 4], "ZBack": [1, 3, 4], "a.A": [0.5] * 3, "b.A": [1] * 3, "N.X": [0] * 3}
    held |= {f"{layer}.{c}": [0.5] * 3 for layer in "ab" for c in "RGB"}
    place = {"dataWindow": ((10, 20), (12, 21)), "owner": "me"}
    path = write_channels(tmp_path / "f.exr", (2, 3), part=place, **held)
    (part,) = moit.inspect(path).parts
    assert part.deep and part.kind == "deepscanline" and part.compression == "zips"
    assert part.layers == ("N", "", "a", "b") or set(part.layers) == {"N", "", "a", "b"}
    assert part.readable == ("a", "b") and part.layer is None and "'a', 'b'" in part.problem
    assert part.shape == (2, 3) and part.origin == (20, 10)
    assert (part.samples, part.most_samples, part.covered, part.volumes) == (3, 3, 1, 1)
    assert part.depth_range == (1, 4) and part.channels["a.R"] == "float"
    assert part.frame.metadata["owner"] == "me" and part.memory > 0
    text = str(moit.inspect(path))
    for words in ("data window", "3 x 2 from x 10, y 20", "1 to 4", "'me'", "(no prefix)", "a, b"):
        assert words in text
    assert moit.inspect(path, samples=False).parts[0].samples is None
    held = {"Z": [1.0, 2.0, np.inf], "A": [0.5, 0.5, 1.0]}
    (part,) = moit.inspect(write_channels(tmp_path / "far.exr", **held)).parts
    assert part.depth_range == (1, 2)  # of what is infinitely far nobody asks how far


def test_inspect_counts_what_read_deep_reads():
    from test_deep import IMAGES

    for path in IMAGES:
        (part,) = moit.inspect(path).parts
        f = moit.read_deep(path, tidy=False)
        assert part.samples == len(f) and part.most_samples == f.counts.max()
        assert part.depth_range == (f.depth.min(), f.depth.max())
        assert part.covered == np.count_nonzero(f.counts) and part.frame == f.frame


@pytest.mark.parametrize(
    "held", [{"R": [1.0]}, {"Z": [np.nan, 1.0]}, {"id": [3.0]}, {"A": [1.0], "Z": []}]
)
def test_inspect_shows_what_cannot_be_read_too(tmp_path, held):
    if held.get("Z") == []:
        held = {"A": [], "Z": []}
    path = write_channels(tmp_path / "f.exr", **held)
    (part,) = moit.inspect(path).parts
    assert part.samples == len(next(iter(held.values())))
    assert str(part)


def test_inspect_of_flat_images_and_several_parts(stereo, tmp_path, capsys):
    found = moit.inspect(stereo)
    assert [part.name for part in found.parts] == ["rgba.left", "rgba.right", "preview"]
    assert [part.view for part in found.parts] == ["left", "right", ""]
    assert [part.deep for part in found.parts] == [True, True, False]
    moit.write_image(tmp_path / "flat.exr", np.ones((2, 3, 4)))
    assert main(["inspect", str(stereo), str(tmp_path / "flat.exr")]) == 0
    out = capsys.readouterr().out
    assert "part 1 'rgba.right' (view 'right'): deepscanline" in out and "scanlineimage" in out
    assert main(["inspect", "--headers", str(stereo)]) == 0
    assert "samples" not in capsys.readouterr().out


def test_inspect_refuses_what_is_no_image(tmp_path, capsys):
    with pytest.raises(FileNotFoundError):
        moit.inspect(tmp_path / "none.exr")
    (tmp_path / "f.exr").write_bytes(b"no")
    assert main(["inspect", str(tmp_path / "f.exr")]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    whole = write_channels(tmp_path / "g.exr", **point()).read_bytes()
    (tmp_path / "g.exr").write_bytes(whole[:-3])
    with pytest.raises(OSError, match="damaged"):
        moit.inspect(tmp_path / "g.exr")


# The command line


def test_commands_take_parts_layers_and_channels(stereo, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for technique, part in itertools.product(("power4", "stochastic8"), ("1", "right")):
        command = ["composite", str(stereo), "-t", technique, "-o", "o.exr", "--part", part]
        assert main(command) == 0
        expected = moit.composite(stereo, technique, part=1)
        assert np.array_equal(moit.read_image("o.exr"), expected)
    assert main(["composite", str(stereo), "-t", "power4", "-o", "o.exr"]) == 1
    assert "several deep parts" in capsys.readouterr().err
    command = ["compare", str(stereo), "-t", "sorted", "--repeat", "1", "--part", "right"]
    assert main(command) == 0
    assert main([*command, "--merge"]) == 0
    curve = ["curve", str(stereo), "-t", "power4", "-o", "c.svg", "--pixel", "0,0"]
    assert main([*curve, "--part", "left"]) == 0
    assert main([*curve, "--part", "up"]) == 1
    held = {f"a.{c}": v for c, v in point().items()}
    held["a.alpha"] = held.pop("a.A")
    path = write_channels(tmp_path / "layers.exr", **held)
    command = ["composite", str(path), "-t", "power4", "-o", "o.exr", "--layer", "a"]
    assert main([*command, "--channel", "A=alpha"]) == 0
    assert main(command) == 1
    with pytest.raises(SystemExit):
        main([*command, "--channel", "alpha"])


def test_composites_keep_their_place_on_the_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    place = {"dataWindow": ((10, 20), (12, 21)), "displayWindow": ((0, 0), (99, 49)), "owner": "me"}
    path = write_channels(tmp_path / "f.exr", (2, 3), part=place, **point())
    for technique in ("power4", "avboit"):  # in bands, and whole
        assert moit.technique(technique).local == (technique == "power4")
        assert main(["composite", str(path), "-t", technique, "-o", "o.exr"]) == 0
        header = OpenEXR.File("o.exr", header_only=True).header()
        for key, value in place.items():
            assert np.array_equal(header[key], value)
