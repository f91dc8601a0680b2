"""Deep files that a careful program would not write, and what verbs make of them."""

import subprocess
import sys

import numpy as np
import OpenEXR
import pytest

import moit
from moit import _core
from moit.__main__ import main

LIGHT = {name: np.float32([0.1, 0.2]) for name in "RGB"}
ALPHA = {"A": np.float32([0.5, 0.25])}
SURFACES = LIGHT | ALPHA | {"Z": np.float32([1, 2])}


def write(path, channels, counts=(2,), height=1, **header):
    """A row of pixels, or more."""
    offsets = np.concatenate([[0], np.cumsum(counts)])
    pixels = {
        name: _core.split_pixels(values, offsets).reshape(height, -1)
        for name, values in channels.items()
    }
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION} | header
    OpenEXR.File(header, pixels).write(str(path))
    return path


def held(path):
    """All samples of one row, by channel."""
    pixels = OpenEXR.File(str(path), separate_channels=True).channels()
    own = {name: [one for one in c.pixels.ravel() if one is not None] for name, c in pixels.items()}
    return {name: np.concatenate(arrays) for name, arrays in own.items()}


def in_layer(layer, channels):
    return {f"{layer}.{name}": values for name, values in channels.items()}


@pytest.mark.parametrize(
    ("other", "role"),
    [
        (in_layer("fg", SURFACES), "R"),
        (ALPHA | {"Z": SURFACES["Z"], "Y": LIGHT["R"]}, "R"),
        (in_layer("fg", LIGHT | ALPHA) | {"Z": SURFACES["Z"]}, "R"),
    ],
    ids=["all", "grey", "all but depth"],
)
def test_images_of_other_names_are_not_merged(tmp_path, other, role):
    # A reader of both would take one of them for black, clear and at depth 0.
    paths = [write(tmp_path / "a.exr", SURFACES), write(tmp_path / "b.exr", other)]
    for order in (paths, paths[::-1]):
        with pytest.raises(moit.FragmentsError, match=rf"merge: {role} is the channel .* in all"):
            moit.deep.merge(order, tmp_path / "c.exr")
        assert not (tmp_path / "c.exr").exists()


def test_what_a_file_lacks_is_told_by_its_own_channels(tmp_path):
    layer = in_layer("fg", LIGHT | ALPHA)
    depth = {"Z": SURFACES["Z"]}
    colored = {f"{name}A": np.float32([0.3, 0.6]) for name in "RB"} | {"GA": np.float32([0.6, 0.9])}
    thick = {"ZBack": np.float32([1.5, 2.5])}
    a = write(tmp_path / "a.exr", layer | depth)
    b = write(tmp_path / "b.exr", layer | depth | thick)
    for order in ([a, b], [b, a]):  # depths have no prefix, the layer has
        moit.deep.merge(order, tmp_path / "m.exr")
        assert held(tmp_path / "m.exr")["ZBack"].tolist() == [1, 1.5, 2, 2.5]
        assert held(tmp_path / "m.exr")["Z"].tolist() == [1, 1, 2, 2]
    c = write(tmp_path / "c.exr", SURFACES)
    d = write(tmp_path / "d.exr", LIGHT | depth | colored)
    moit.deep.merge([c, d], tmp_path / "m.exr")
    found = held(tmp_path / "m.exr")
    assert np.allclose(found["RA"], [0.5, 0.3, 0.25, 0.6])
    assert np.allclose(found["GA"], [0.5, 0.6, 0.25, 0.9])
    assert np.allclose(found["A"], [0.5, 0.4, 0.25, 0.7])


@pytest.mark.parametrize("channel", ["Z", "ZBack"])
def test_depths_without_order_are_not_merged(tmp_path, channel):
    own = SURFACES | {"ZBack": np.float32([3, 4])}
    bad = write(tmp_path / "a.exr", own | {channel: np.float32([2, np.nan])})
    with pytest.raises(moit.FragmentsError, match=f"{channel} of pixel x=0, y=0, sample 1: found"):
        moit.deep.merge([bad, bad], tmp_path / "c.exr")


def test_what_is_cropped_needs_no_layer_and_no_alpha(tmp_path, capsys):
    several = in_layer("fg", SURFACES) | in_layer("bg", SURFACES)
    for own in (several, {"Z": SURFACES["Z"], "id": np.uint32([4, 5])}):
        write(tmp_path / "a.exr", own)
        out = str(tmp_path / "b.exr")
        assert main(["crop", str(tmp_path / "a.exr"), "-o", out, "--window", "-1,-1,3x3"]) == 0
        found = held(tmp_path / "b.exr")
        assert {k: v.tolist() for k, v in found.items()} == {k: v.tolist() for k, v in own.items()}
    with pytest.raises(SystemExit):  # an option that changes nothing is none
        main(["crop", "a.exr", "-o", "b.exr", "--window", "0,0,1x1", "--layer", "fg"])
    assert "--layer" in capsys.readouterr().err


@pytest.mark.parametrize("top", [0, 31, 33, 70])
def test_windows_of_tiles_begin_anywhere(tmp_path, top):
    height, width = 80, 5
    n = height * width
    own = {"Z": np.arange(n, dtype=np.float32)} | {name: np.ones(n, np.float32) for name in "RGBA"}
    tiles = {"type": OpenEXR.deeptile, "tiles": OpenEXR.TileDescription()}  # of 32 x 32
    write(tmp_path / "a.exr", own, (1,) * n, height, **tiles)
    moit.deep.crop(tmp_path / "a.exr", tmp_path / "b.exr", (9, 2), (top, 1))
    wanted = own["Z"].reshape(height, width)[top : top + 9, 1:3]
    assert held(tmp_path / "b.exr")["Z"].tolist() == wanted.ravel().tolist()


def test_what_is_of_no_colour_is_dimmed_by_the_mean(tmp_path):
    other = {"haze.A": np.float32([0.4, 0.8])}
    a = write(tmp_path / "a.exr", SURFACES | other)
    colored = {f"A{name}": np.float32([v]) for name, v in zip("RGB", (0.2, 0.4, 0.9), strict=True)}
    light = {name: np.float32([0]) for name in "RGB"}
    b = write(tmp_path / "b.exr", light | colored | {"Z": np.float32([0.5])}, (1,))
    moit.deep.holdout(a, b, tmp_path / "c.exr")
    found = held(tmp_path / "c.exr")
    gains = [found[name] / LIGHT[name] for name in "RGB"]
    assert np.allclose([one[0] for one in gains], [0.8, 0.6, 0.1])
    assert np.allclose(found["haze.A"], other["haze.A"] * np.mean(gains, axis=0))


def test_alphas_a_hair_beyond_their_range_are_at_its_end(tmp_path):
    write(tmp_path / "a.exr", SURFACES | {"A": np.float32([-0.0005, 0.5])})
    moit.write_image(tmp_path / "flat.exr", np.full((1, 1, 4), 0.25, np.float32))
    moit.deep.recolor(tmp_path / "a.exr", tmp_path / "flat.exr", tmp_path / "c.exr")
    found = held(tmp_path / "c.exr")
    assert [found[name].tolist() for name in "RGB"] == [[0, 0.25]] * 3


def test_pixels_of_no_samples_are_not_kept(tmp_path):
    write(tmp_path / "a.exr", SURFACES, (0, 2, 0))
    found = moit.deep.simplify(tmp_path / "a.exr", tmp_path / "b.exr", short_numbers=False)
    assert (found.pixels, found.pixels_kept) == (3, 1)


def test_bands_are_as_small_as_what_is_made_is_wide(tmp_path, monkeypatch):
    n = 200
    f = moit.Fragments(np.arange(n + 1), np.ones(n), np.full(n, 0.5), shape=(n, 1))
    moit.write_deep(tmp_path / "a.exr", f)
    most = []
    put = moit.formats.deep_output.DeepOutput.put
    monkeypatch.setattr(
        moit.formats.deep_output.DeepOutput,
        "put",
        lambda self, rows: (most.append(rows.shape[0] * rows.shape[1]), put(self, rows)),
    )
    moit.deep.crop(tmp_path / "a.exr", tmp_path / "b.exr", (n, 1500), (0, 0), memory=1 << 20)
    moit.deep.merge([tmp_path / "a.exr", tmp_path / "b.exr"], tmp_path / "c.exr", memory=1 << 20)
    assert sum(most) == 2 * n * 1500 and max(most) <= max(1500, (1 << 20) // 640)


def test_pictures_are_numbers_that_the_file_can_hold(tmp_path):
    deep = write(tmp_path / "a.exr", SURFACES)
    out = tmp_path / "c.exr"
    for channel, value in ((0, 1e6), (1, np.nan), (2, -np.inf), (3, np.nan), (3, np.inf)):
        picture = np.full((1, 1, 4), 0.5, np.float32)
        picture[0, 0, channel] = value
        flat = {name: picture[..., i] for i, name in enumerate("RGBA")}
        OpenEXR.File({"type": OpenEXR.scanlineimage}, flat).write(str(tmp_path / "b.exr"))
        match = "R: found .* too large for float16" if value == 1e6 else "needed a finite number"
        with pytest.raises(ValueError, match=match):
            moit.deep.recolor(deep, tmp_path / "b.exr", out, match_alpha=True)
        assert not out.exists()
    picture[0, 0] = (1e6, 1, 1, 0.5)
    moit.write_image(tmp_path / "b.exr", picture)
    moit.deep.recolor(deep, tmp_path / "b.exr", out, half=False)
    assert moit.composite_deep(out, tmp_path / "flat.exr", "sorted") is None
    assert np.isclose(moit.read_image(tmp_path / "flat.exr")[0, 0, 0], 1e6, rtol=1e-5)


def test_half_depths_stay_apart_and_finite(tmp_path):
    # The number of fewest digits near both is 65536, which no half float is.
    own = SURFACES | {"Z": np.float16([60032, 65504])}
    write(tmp_path / "a.exr", own)
    found = moit.deep.simplify(tmp_path / "a.exr", tmp_path / "b.exr", depth_error=0.2)
    depth = held(tmp_path / "b.exr")["Z"].astype(np.float64)
    assert found.samples_after == 2 and np.isfinite(depth).all() and depth[0] < depth[1]
    assert (np.abs(depth - own["Z"]) <= 0.2 * own["Z"].astype(np.float64)).all()


def test_neighbours_never_move_onto_one_another(tmp_path):
    eps = 2.0**-23
    rng = np.random.default_rng(4)
    starts = np.float32(2.0) ** rng.integers(-3, 4, 300) * np.float32(1 - 2 * eps)
    steps = rng.integers(1, 4, (300, 3)).cumsum(axis=1) - 1
    depth = starts.astype(np.float32).view(np.int32)[:, None] + steps.astype(np.int32)
    depth = depth.view(np.float32) * rng.choice(np.float32([-1, 1]), (300, 1))
    channels = {name: np.full(900, 0.2, np.float32) for name in "RGBA"} | {"Z": depth.ravel()}
    write(tmp_path / "a.exr", channels, (3,) * 300)
    for share in (1e-7, 2e-7, 1e-3, 0.9):
        found = moit.deep.simplify(tmp_path / "a.exr", tmp_path / "b.exr", 1e-6, depth_error=share)
        assert found.samples_after == 900
        moved = np.sort(held(tmp_path / "b.exr")["Z"].reshape(300, 3).astype(np.float64), axis=1)
        truth = np.sort(depth.astype(np.float64), axis=1)
        assert (np.diff(moved, axis=1) > 0).all(), share
        assert (np.abs(moved - truth) <= share * np.abs(truth)).all(), share


def test_ends_are_as_exact_as_the_finer_of_both_depths(tmp_path):
    thick = {"Z": np.float16([1, 8]), "ZBack": np.float32([4.00001, 9.00001])}
    write(tmp_path / "a.exr", SURFACES | thick)
    write(tmp_path / "b.exr", SURFACES | {"Z": np.float32([2.00001, 8.00001])})
    moit.deep.holdout(tmp_path / "a.exr", tmp_path / "b.exr", tmp_path / "c.exr")
    found = held(tmp_path / "c.exr")
    assert found["Z"].tolist() == np.float32([1, 2.00001, 8, 8.00001]).tolist()
    assert found["ZBack"].tolist() == np.float32([2.00001, 4.00001, 8.00001, 9.00001]).tolist()
    moit.deep.simplify(tmp_path / "a.exr", tmp_path / "d.exr", 1e-4)
    found = held(tmp_path / "d.exr")
    assert found["ZBack"].tolist() == thick["ZBack"].tolist()


def test_moments_of_other_programs_are_named(tmp_path):
    write(tmp_path / "a.exr", SURFACES)
    moit.deep.to_moments(tmp_path / "a.exr", tmp_path / "m.exr", "trig3")
    whole = (tmp_path / "m.exr").read_bytes()
    for other in (b"trig9", b"wboit"):
        (tmp_path / "m.exr").write_bytes(whole.replace(b"trig3", other))
        with pytest.raises(moit.FragmentsError, match=r"m\.exr': moit:moments: technique: "):
            moit.deep.read_moments(tmp_path / "m.exr")


def test_an_output_may_be_an_input(tmp_path):
    a, b = write(tmp_path / "a.exr", SURFACES), write(tmp_path / "b.exr", SURFACES)
    moit.deep.merge([a, b], a)
    assert held(a)["Z"].tolist() == [1, 1, 2, 2]
    moit.deep.holdout(a, b, b)
    assert held(b)["Z"].tolist() == [1, 1, 2, 2]
    moit.deep.simplify(b, b)
    assert held(b)["Z"].tolist() == [1, 2]


KILLED = """
import os, sys, moit
from moit.formats import deep_output
put = deep_output.DeepOutput.put
def once(self, rows):
    put(self, rows)
    os.kill(os.getpid(), int(sys.argv[1]))
deep_output.DeepOutput.put = once
moit.deep.crop("a.exr", "b.exr", (1, 1), (0, 0))
"""


@pytest.mark.parametrize("signal", [2, 9, 15])
def test_who_is_killed_leaves_what_was_there(tmp_path, signal):
    write(tmp_path / "a.exr", SURFACES)
    (tmp_path / "b.exr").write_bytes(b"before")
    done = subprocess.run(
        [sys.executable, "-c", KILLED, str(signal)], cwd=tmp_path, capture_output=True, timeout=60
    )
    assert done.returncode != 0 and (tmp_path / "b.exr").read_bytes() == b"before"
    if signal == 2:  # Python sees Ctrl-C, and tidies up
        assert {one.name for one in tmp_path.iterdir()} == {"a.exr", "b.exr"}


EVERYWHERE = ["--part", "1", "--layer", "fg", "--memory", "3M"]
WRITES = ["--compression", "rle", *EVERYWHERE]


@pytest.mark.parametrize(
    ("verb", "words", "options"),
    [
        ("merge", ["a", "b", *WRITES], {}),
        ("flatten", ["a", *EVERYWHERE], {}),
        (
            "holdout",
            ["a", "b", "--by-part", "2", "--by-layer", "bg", *WRITES],
            {"by_part": 2, "by_layer": "bg"},
        ),
        (
            "recolor",
            ["a", "b", "--match-alpha", "--float", *WRITES],
            {"match_alpha": True, "half": False},
        ),
        (
            "simplify",
            [
                *"a --error 0.5 --depth-error 0.25 --keep-ids --volumes --long-numbers".split(),
                *WRITES,
            ],
            {"depth_error": 0.25, "keep_ids": True, "volumes": True, "short_numbers": False},
        ),
        ("to_points", ["a", "--least-alpha", "0.5", *EVERYWHERE], {"least_alpha": 0.5}),
        ("to_moments", ["a", "-t", "trig2", *EVERYWHERE], {}),
    ],
)
def test_the_shell_passes_every_option_on(tmp_path, monkeypatch, verb, words, options):
    asked = []
    monkeypatch.setattr(moit.deep, verb, lambda *given, **named: asked.append((given, named)))
    output = str(tmp_path / "o.exr")
    assert main([verb.replace("_", "-"), *words, "-o", output]) == 0
    ((given, named),) = asked
    options = options | {"part": 1, "layer": "fg", "memory": 3 << 20, "progress": True}
    if "--compression" in words:
        options["compression"] = "rle"
    assert named == options and output in given
    assert given[0] in ("a", ["a", "b"]) and ("b" not in words or "b" in [*given, *given[0]])
    assert ("trig2" in given) == (verb == "to_moments") and (0.5 in given) == (verb == "simplify")
