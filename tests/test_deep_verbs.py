"""Deep images from file to file: windows, metadata and all channels stay, light is what it was."""

import re
import warnings
from itertools import pairwise
from pathlib import Path

import deep_model
import numpy as np
import OpenEXR
import pytest

import moit
from moit import _core
from moit.__main__ import main
from moit.formats.deep_bands import LEAST_MEMORY
from moit.formats.deep_parts import ExrFile

SHAPE = (5, 40)


def random_image(seed, colored=False, volumes=True, empty=0.2):
    """Samples at few depths, so that many coincide, touch and overlap; some are opaque, some emit
    without opacity."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, 7, SHAPE[0] * SHAPE[1]) * (rng.random(SHAPE[0] * SHAPE[1]) > empty)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    n = int(offsets[-1])
    depth = rng.integers(1, 7, n).astype(np.float32)
    thick = rng.integers(0, 3, n) * (rng.random(n) < 0.6) if volumes else np.zeros(n)
    alpha = rng.uniform(0.05, 0.95, n)
    alpha[rng.random(n) < 0.1] = 1
    alpha[rng.random(n) < 0.1] = 0
    return moit.Fragments(
        offsets,
        depth,
        alpha.astype(np.float32),
        rng.random((n, 3)).astype(np.float32),
        transmission=rng.random((n, 3)).astype(np.float32) * 0.6 if colored else None,
        back=(depth + thick.astype(np.float32)),
        emission=(rng.random((n, 3)) * (alpha == 0)[:, None]).astype(np.float32),
        shape=SHAPE,
        origin=(-3, 11),
    )


def write(path, f):
    moit.write_deep(path, f)
    return moit.read_deep(path, tidy=False)


def undated(path):
    """A file's bytes, without the second in which it was written."""
    return re.sub(rb"\d{4}(:\d\d){2} \d\d(:\d\d){2}", b"", path.read_bytes())


def samples(f, pixel, light=None):
    """Those of deep_model, of other light: "none", or as much as each channel hides."""
    found = deep_model.samples_of(f, pixel)
    if light == "none":
        return [(a, b, opacity, 0 * p) for a, b, opacity, p in found]
    if light == "alpha":
        return [(a, b, opacity, opacity) for a, b, opacity, _ in found]
    return found


def up_to(pieces, depth):
    """(light, transmittance) of what ends in front of a depth or at it."""
    light, through = np.zeros(3), np.ones(3)
    for _, far, opacity, p in pieces:
        if far <= depth:
            light, through = light + through * p, through * (1 - opacity)
    return light, through


def seen_through(a, b, pixel, depth):
    """The light of a, and what it hides, behind b: of the float64 model of both."""
    holding = samples(b, pixel, "none")
    pieces = deep_model.tidy(samples(a, pixel) + holding)
    covers = deep_model.tidy(samples(a, pixel, "alpha") + holding)
    return up_to(pieces, depth)[0], up_to(covers, depth)[0]


@pytest.fixture(scope="module")
def held_out(tmp_path_factory):
    """Pairs of images, in one with an alpha for each colour, and each held out by the other."""
    folder = tmp_path_factory.mktemp("holdout")
    made = []
    for name, seeds, colored in (("plain", (1, 2), False), ("colored", (3, 4), True)):
        paths = [str(folder / f"{name}{i}.exr") for i in range(4)]
        a = write(paths[0], random_image(seeds[0]))
        b = write(paths[1], random_image(seeds[1], colored))
        moit.deep.holdout(paths[0], paths[1], paths[2])
        moit.deep.holdout(paths[1], paths[0], paths[3])
        made.append((a, b, *(moit.read_deep(one, tidy=False) for one in paths[2:]), paths))
    return made


def test_holdout_is_the_model_in_float64(held_out):
    """At every depth where anything begins or ends: 200 pixels, and 200 of coloured alphas."""
    for a, b, of_a, of_b, _ in held_out:
        for one, other, seen in ((a, b, of_a), (b, a, of_b)):
            for pixel in range(SHAPE[0] * SHAPE[1]):
                own = deep_model.tidy(samples(seen, pixel))
                for depth in (2.0, 4.0, 9.0):
                    light, through = up_to(own, depth)
                    wanted, covered = seen_through(one, other, pixel, depth)
                    assert np.abs(light - wanted).max() < 1e-6
                    assert np.abs(1 - through - covered).max() < 1e-6


def test_what_both_show_of_one_another_adds_up_to_the_merge(held_out, tmp_path):
    for a, _, of_a, of_b, paths in held_out:
        moit.deep.merge(paths[:2], tmp_path / "both.exr")
        both = moit.composite(moit.read_deep(tmp_path / "both.exr"), "sorted", dtype="f8")
        one, other = (moit.composite(f.tidy(), "sorted", dtype="f8") for f in (of_a, of_b))
        assert np.abs(one + other - both).max() < 2e-6
        assert of_a.shape == a.shape and of_a.origin == a.origin


def test_opaque_holdouts_leave_nothing_behind_and_all_in_front(tmp_path):
    a = moit.Fragments([0, 3], [1.0, 2.0, 3.0], [0.25, 0.5, 0.75], np.eye(3))
    b = moit.Fragments([0, 1], [2.5], [1.0], np.ones((1, 3)))
    write(tmp_path / "a.exr", a)
    write(tmp_path / "b.exr", b)
    moit.deep.holdout(tmp_path / "a.exr", tmp_path / "b.exr", tmp_path / "c.exr")
    found = moit.read_deep(tmp_path / "c.exr")
    assert found.depth.tolist() == [1.0, 2.0] and found.alpha.tolist() == [0.25, 0.5]


def sample_sets(path):
    """For each pixel all its samples with all channels, in no order."""
    with open(path, "rb") as stream:
        file = ExrFile(str(path), stream)
        pixels = file.pixels(file.parts[0], 1)
    joined = {name: _core.join_pixels(array) for name, array in sorted(pixels.items())}
    (counts, _), *_ = joined.values()
    rows = zip(*(values.tolist() for _, values in joined.values()), strict=True)
    rows = list(rows)
    ends = np.concatenate([[0], np.cumsum(counts)])
    return list(joined), [sorted(rows[i:j]) for i, j in pairwise(ends)]


def test_merges_are_associative_and_commute(tmp_path):
    for i in range(3):
        moit.write_deep(tmp_path / f"{i}.exr", random_image(i + 10, colored=i == 2))
    names = [str(tmp_path / f"{i}.exr") for i in range(3)]
    out = [str(tmp_path / f"m{i}.exr") for i in range(4)]
    moit.deep.merge(names, out[0])
    moit.deep.merge(names[::-1], out[1])
    moit.deep.merge(names[:2], out[2])
    moit.deep.merge([names[2], out[2]], out[3])
    wanted = sample_sets(out[0])
    assert wanted == sample_sets(out[1]) == sample_sets(out[3])
    assert {"AR", "ZBack"} <= set(wanted[0])
    pictures = [moit.composite(moit.read_deep(one), "sorted") for one in (out[0], out[1], out[3])]
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-6
    assert np.abs(pictures[0] - pictures[2]).max() < 1e-6
    depth = moit.read_deep(out[0], tidy=False)
    for p in range(len(depth.counts)):
        assert (np.diff(depth.depth[depth.offsets[p] : depth.offsets[p + 1]]) >= 0).all()


def full_file(path, shape=(6, 7), origin=(4, -2), seed=0):
    """A file with layers, ids, a channel that is no light, and a header full of attributes."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, 5, shape[0] * shape[1])
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    n = int(offsets[-1])
    flat = {
        "Z": np.sort(rng.integers(1, 9, n)).astype(np.float32),
        "id": rng.integers(1, 4, n).astype(np.uint32),
        "normal.X": rng.normal(size=n).astype(np.float32),
    }
    flat["Z"] = rng.integers(1, 9, n).astype(np.float32)
    flat["A"] = rng.uniform(0.1, 0.9, n).astype(np.float16)
    for name in ("R", "G", "B", "diffuse.R", "diffuse.G", "diffuse.B"):
        flat[name] = (rng.random(n) * flat["A"]).astype(np.float16)
    header = {
        "type": OpenEXR.deepscanline,
        "compression": OpenEXR.ZIPS_COMPRESSION,
        "dataWindow": (
            (origin[1], origin[0]),
            (origin[1] + shape[1] - 1, origin[0] + shape[0] - 1),
        ),
        "displayWindow": ((0, 0), (99, 49)),
        "pixelAspectRatio": 2.0,
        "owner": "somebody",
        "worldToCamera": np.eye(4, dtype=np.float32),
    }
    pixels = {k: _core.split_pixels(v, offsets).reshape(shape) for k, v in flat.items()}
    OpenEXR.File(header, pixels).write(str(path))
    return offsets, flat


def assert_kept(path):
    (part,) = moit.inspect(path).parts
    assert part.frame.display_shape == (50, 100) and part.frame.display_origin == (0, 0)
    assert part.frame.pixel_aspect == 2.0
    assert part.frame.metadata["owner"] == "somebody"
    assert len(part.frame.metadata["worldToCamera"]) == 16
    assert part.channels["id"] == "uint" and part.channels["A"] == "half"
    assert part.channels["Z"] == "float" and "diffuse.R" in part.channels
    return part


def test_crops_keep_every_bit_and_may_lie_half_outside(tmp_path):
    offsets, flat = full_file(tmp_path / "a.exr")
    moit.deep.crop(tmp_path / "a.exr", tmp_path / "b.exr", (4, 5), (7, -4))
    part = assert_kept(tmp_path / "b.exr")
    assert part.shape == (4, 5) and part.origin == (7, -4)
    names, found = sample_sets(tmp_path / "b.exr")
    for y in range(4):
        for x in range(5):
            row, column = 7 + y - 4, -4 + x + 2
            inside = 0 <= row < 6 and 0 <= column < 7
            p = row * 7 + column
            own = slice(offsets[p], offsets[p + 1]) if inside else slice(0, 0)
            wanted = sorted(zip(*(flat[name][own].tolist() for name in names), strict=True))
            assert found[y * 5 + x] == wanted
    with pytest.raises(ValueError, match="found none of them"):
        moit.deep.crop(tmp_path / "a.exr", tmp_path / "c.exr", (4, 5), (90, 0))
    assert not (tmp_path / "c.exr").exists()


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.uint32])
def test_files_of_one_type_keep_it(tmp_path, kind):
    """OpenImageIO names no type for each channel then."""
    flat = {name: np.array([1, 0, 1], kind) for name in "ABGRZ"}
    pixels = {k: _core.split_pixels(v, np.array([0, 1, 3])).reshape(1, 2) for k, v in flat.items()}
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    OpenEXR.File(header, pixels).write(str(tmp_path / "a.exr"))
    moit.deep.crop(tmp_path / "a.exr", tmp_path / "b.exr", (1, 2), (0, 0))
    (part,) = moit.inspect(tmp_path / "b.exr").parts
    names = {np.float16: "half", np.float32: "float", np.uint32: "uint"}
    assert set(part.channels.values()) == {names[kind]}
    assert sample_sets(tmp_path / "a.exr") == sample_sets(tmp_path / "b.exr")
    (band,) = moit.read_deep_bands(tmp_path / "a.exr", tidy=False)
    assert band.alpha.tolist() == [1, 0, 1] and band.depth.tolist() == [1, 0, 1]


def test_merges_hold_what_the_widest_of_the_files_holds(tmp_path):
    f = moit.scenes.load("panes", (4, 3))
    a, b, out = (str(tmp_path / f"{name}.exr") for name in ("a", "b", "out"))
    moit.write_deep(a, f)
    moit.write_deep(b, f, half=True)
    for files in ((a, b), (b, a)):
        moit.deep.merge(files, out)
        assert set(moit.inspect(out).parts[0].channels.values()) == {"float"}


def several_parts(path):
    """A flat part, one of tiles, and two deep ones, which are different."""

    def deep(n):
        offsets = np.arange(7) * n
        flat = {name: np.linspace(0.1, 0.9, 6 * n).astype("f2") for name in "ABGR"}
        flat["Z"] = np.tile(np.arange(1, n + 1), 6).astype("f4")
        return {k: _core.split_pixels(v, offsets).reshape(2, 3) for k, v in flat.items()}

    window = {"dataWindow": ((4, 5), (6, 6)), "displayWindow": ((0, 0), (9, 9))}
    flat = {"R": np.arange(6, dtype="f4").reshape(2, 3)}
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 16
    of_deep = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    parts = [
        OpenEXR.Part({"type": OpenEXR.scanlineimage, **window}, flat, "flat"),
        OpenEXR.Part({**of_deep, "owner": "one", **window}, deep(2), "left"),
        OpenEXR.Part({"type": OpenEXR.tiledimage, "tiles": tiles, **window}, flat, "tiles"),
        OpenEXR.Part({**of_deep, "owner": "two", **window}, deep(3), "right"),
    ]
    OpenEXR.File(parts).write(str(path))


@pytest.mark.parametrize("part", ["left", "right"])
def test_other_parts_are_copied(tmp_path, part):
    several_parts(tmp_path / "a.exr")
    before = moit.inspect(tmp_path / "a.exr").parts
    other = "left" if part == "right" else "right"
    for n, write in enumerate(
        [
            lambda a, b: moit.deep.crop(a, b, (1, 2), (6, 4), part=part),
            lambda a, b: moit.deep.simplify(a, b, 0.2, part=part),
            lambda a, b: moit.deep.holdout(a, a, b, part=part, by_part=other),
            lambda a, b: moit.deep.merge([a, a], b, part=part),
        ]
    ):
        out = tmp_path / f"{n}.exr"
        write(tmp_path / "a.exr", out)
        after = moit.inspect(out).parts
        assert [one.name for one in after] == ["flat", "left", "tiles", "right"]
        for one, was in zip(after, before, strict=True):
            assert one.name == part or one == was
            assert one.kind == was.kind
            assert one.frame.metadata.get("owner") == was.frame.metadata.get("owner")
        kept, own = (moit.read_deep(path, part=other) for path in (out, tmp_path / "a.exr"))
        assert np.array_equal(kept.color, own.color) and np.array_equal(kept.depth, own.depth)
        with OpenEXR.File(str(out), separate_channels=True) as file:
            for index in (0, 2):
                pixels = file.parts[index].channels["R"].pixels
                assert np.array_equal(pixels, np.arange(6).reshape(2, 3))
    assert len(moit.read_deep(tmp_path / "3.exr", part=part, tidy=False)) == 2 * len(
        moit.read_deep(tmp_path / "a.exr", part=part)
    )
    cropped = moit.read_deep(tmp_path / "0.exr", part=part)
    assert cropped.shape == (1, 2) and cropped.origin == (6, 4)
    with pytest.raises(moit.FragmentsError, match="several deep parts"):
        moit.deep.crop(tmp_path / "a.exr", tmp_path / "c.exr", (1, 2), (6, 4))


def test_damage_of_other_parts_is_named(tmp_path):
    several_parts(tmp_path / "a.exr")
    whole = (tmp_path / "a.exr").read_bytes()
    with open(tmp_path / "a.exr", "rb") as stream:
        at = ExrFile(str(tmp_path / "a.exr"), stream).headers.parts[-1].end + 2
    for place in (2**40, 12):  # beyond the file, and in its header
        (tmp_path / "b.exr").write_bytes(whole[:at] + place.to_bytes(8, "little") + whole[at + 8 :])
        with pytest.raises(OSError, match=r"b\.exr': damaged: a chunk"):
            moit.deep.crop(tmp_path / "b.exr", tmp_path / "c.exr", (1, 2), (6, 4), part="left")
    assert not (tmp_path / "c.exr").exists()


def test_ids_and_layers_travel(tmp_path):
    full_file(tmp_path / "a.exr")
    full_file(tmp_path / "b.exr", seed=1)
    moit.deep.merge([tmp_path / "a.exr", tmp_path / "b.exr"], tmp_path / "m.exr")
    assert_kept(tmp_path / "m.exr")
    moit.deep.holdout(tmp_path / "a.exr", tmp_path / "b.exr", tmp_path / "h.exr")
    assert_kept(tmp_path / "h.exr")
    (names, own), (_, seen) = sample_sets(tmp_path / "a.exr"), sample_sets(tmp_path / "h.exr")
    z, i, x = (names.index(name) for name in ("Z", "id", "normal.X"))
    for before, after in zip(own, seen, strict=True):
        assert {(s[z], s[i], s[x]) for s in after} <= {(s[z], s[i], s[x]) for s in before}
    both = moit.read_deep(tmp_path / "h.exr", layer="diffuse", tidy=False)
    beauty = moit.read_deep(tmp_path / "h.exr", tidy=False)
    assert both.color is not None and np.array_equal(both.depth, beauty.depth)
    whole = moit.read_deep(tmp_path / "a.exr", layer="diffuse")
    assert (moit.composite(both.tidy(), "sorted") <= moit.composite(whole, "sorted") + 1e-3).all()


def test_merge_refuses_what_it_cannot_hold(tmp_path):
    full_file(tmp_path / "a.exr")
    f = moit.read_deep(tmp_path / "a.exr")
    moit.write_deep(tmp_path / "b.exr", moit.Fragments(f.offsets, f.depth, f.alpha, shape=f.shape))
    with pytest.raises(moit.FragmentsError, match="color must be present in all or in none"):
        moit.deep.merge([tmp_path / "a.exr", tmp_path / "b.exr"], tmp_path / "c.exr")
    with pytest.raises(TypeError, match="expected a list of paths"):
        moit.deep.merge(str(tmp_path / "a.exr"), tmp_path / "c.exr")
    with pytest.raises(ValueError, match="compression: expected one of"):
        moit.deep.merge([tmp_path / "a.exr"], tmp_path / "c.exr", compression="jpeg")
    assert not (tmp_path / "c.exr").exists()


@pytest.mark.parametrize("match_alpha", [False, True])
def test_recoloured_and_flattened_is_the_picture(tmp_path, match_alpha):
    deep = random_image(21, empty=0.1)
    alone = moit.Fragments(
        deep.offsets, deep.depth, deep.alpha, back=deep.back, shape=deep.shape, origin=deep.origin
    )
    moit.write_deep(tmp_path / "a.exr", alone)
    rng = np.random.default_rng(5)
    flat = rng.random((*SHAPE, 4)).astype(np.float32)
    flat[..., 3] *= 1.3  # what is more than 1 counts as 1
    moit.write_image(tmp_path / "flat.exr", flat[1:], origin=(-2, 11))
    names = [str(tmp_path / name) for name in ("a.exr", "flat.exr", "b.exr")]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        moit.deep.recolor(*names, match_alpha=match_alpha, half=False)
    wanted = np.concatenate([0 * flat[:1], flat[1:]])
    wanted[..., 3] = wanted[..., 3].clip(max=1)
    colored = moit.read_deep(tmp_path / "b.exr", tidy=False)
    found = moit.composite(colored.tidy(), "sorted", dtype="f8")
    alpha = moit.composite(deep.tidy(), "sorted")[..., 3]
    some = alpha > 0
    assert np.abs(found[some][:, :3] - wanted[some][:, :3]).max() < 2e-6
    assert np.abs(found[some][:, 3] - (wanted[..., 3] if match_alpha else alpha)[some]).max() < 2e-6
    without = int(np.count_nonzero(~some[1:]))
    assert without and f"{without} pixels" in str(caught[0].message)
    with pytest.raises(ValueError, match="needed a picture with alpha"):
        moit.write_image(tmp_path / "rgb.exr", flat[..., :3])
        moit.deep.recolor(names[0], tmp_path / "rgb.exr", names[2], match_alpha=True)


def test_flattened_is_what_sorted_composites(tmp_path):
    full_file(tmp_path / "a.exr")
    moit.deep.flatten(tmp_path / "a.exr", tmp_path / "flat.exr")
    wanted = moit.composite(moit.read_deep(tmp_path / "a.exr"), "sorted")
    assert np.array_equal(moit.read_image(tmp_path / "flat.exr"), wanted)


def test_bands_give_the_file_of_the_whole(tmp_path):
    rng = np.random.default_rng(3)
    for i, (height, width) in enumerate(((300, 60), (250, 80))):
        counts = rng.integers(0, 4, height * width)
        offsets = np.concatenate([[0], np.cumsum(counts)])
        n = int(offsets[-1])
        alpha, color = rng.uniform(0, 1, n).astype("f4"), rng.random((n, 3)).astype("f4")
        depth = rng.uniform(1, 5, n).astype("f4")
        f = moit.Fragments(offsets, depth, alpha, color, shape=(height, width), origin=(9 * i, -i))
        moit.write_deep(tmp_path / f"{i}.exr", f)
    names = [tmp_path / "0.exr", tmp_path / "1.exr"]
    steps = []
    for memory, name in ((LEAST_MEMORY, "s.exr"), (1 << 30, "l.exr")):
        moit.deep.merge(names, tmp_path / f"m{name}", memory=memory)
        moit.deep.holdout(
            *names,
            tmp_path / f"h{name}",
            memory=memory,
            progress=lambda done, total, _: steps.append((done, total)),
        )
    for verb in "mh":
        assert undated(tmp_path / f"{verb}s.exr") == undated(tmp_path / f"{verb}l.exr")
    assert steps[0] == (0, 300) and steps[300] == (300, 300)


def test_damage_is_named(tmp_path):
    f = moit.Fragments([0, 1, 2], [1.0, 2.0], [0.5, 0.5], np.ones((2, 3)))
    moit.write_deep(tmp_path / "a.exr", f)
    offsets = np.array([0, 1, 2])
    pixels = {
        "Z": np.array([1, 2], "f4"),
        "A": np.array([0.5, 7.0], "f4"),
    }
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    split = {k: _core.split_pixels(v, offsets).reshape(1, 2) for k, v in pixels.items()}
    OpenEXR.File(header, split).write(str(tmp_path / "b.exr"))
    with pytest.raises(moit.FragmentsError, match=r"A of pixel x=1, y=0, sample 0: found 7.0"):
        moit.deep.holdout(tmp_path / "a.exr", tmp_path / "b.exr", tmp_path / "c.exr")
    (tmp_path / "d.exr").write_bytes((tmp_path / "a.exr").read_bytes()[:-9])
    with pytest.raises(OSError, match="damaged"):
        moit.deep.merge([tmp_path / "a.exr", tmp_path / "d.exr"], tmp_path / "c.exr")
    assert not (tmp_path / "c.exr").exists()


def test_the_shell_has_each_verb(tmp_path, capsys):
    a, b, out, other = (str(tmp_path / f"{name}.exr") for name in ("a", "b", "out", "other"))
    full_file(a)
    full_file(b, seed=1)
    moit.deep.flatten(a, str(tmp_path / "flat.exr"))
    for verb, given, call in (
        ("merge", [a, b], lambda: moit.deep.merge([a, b], other)),
        ("holdout", [a, b], lambda: moit.deep.holdout(a, b, other)),
        ("crop", [a, "--window", "0,5,3x2"], lambda: moit.deep.crop(a, other, (2, 3), (5, 0))),
        ("flatten", [a], lambda: moit.deep.flatten(a, other)),
        (
            "recolor",
            [a, str(tmp_path / "flat.exr")],
            lambda: moit.deep.recolor(a, str(tmp_path / "flat.exr"), other),
        ),
    ):
        assert main([verb, *given, "-o", out]) == 0
        assert capsys.readouterr().out == f"{out}\n"
        call()
        with open(out, "rb") as one, open(other, "rb") as two:
            # a flat file has the second in which it was written
            same = [re.sub(rb"\d{4}(:\d\d){2} \d\d(:\d\d){2}", b"", f.read()) for f in (one, two)]
            assert same[0] == same[1]
        with pytest.raises(SystemExit):
            main([verb, "--help"])
        assert f"example: moit {verb}" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main(["crop", a, "-o", out, "--window", "0,5"])
    assert main(["merge", a, str(tmp_path / "none.exr"), "-o", out]) == 1


def test_composite_merges_several_files(tmp_path):
    a, b = (str(tmp_path / f"{name}.exr") for name in "ab")
    full_file(a)
    full_file(b, origin=(2, -3), seed=1)
    moit.deep.merge([a, b], tmp_path / "both.exr")
    for technique in ("sorted", "per-pixel"):  # in bands, and of all as Fragments
        assert main(["composite", a, b, "-t", technique, "-o", str(tmp_path / "c.exr")]) == 0
        wanted = moit.composite(moit.read_deep(tmp_path / "both.exr"), technique)
        assert np.abs(moit.read_image(tmp_path / "c.exr") - wanted).max() < 1e-6


def test_fragments_are_taken_as_their_files(tmp_path):
    f, other = random_image(31), random_image(32)
    moit.write_deep(tmp_path / "f.exr", f)
    moit.write_deep(tmp_path / "g.exr", other)
    a, b = (str(tmp_path / f"{name}.exr") for name in "fg")
    for n, (verb, of_fragments, of_files) in enumerate(
        [
            (moit.deep.merge, ([f, other],), ([a, b],)),
            (moit.deep.holdout, (f, other), (a, b)),
            (moit.deep.simplify, (f,), (a,)),
            (moit.deep.flatten, (f,), (a,)),
            (moit.deep.to_moments, (f,), (a,)),
        ]
    ):
        one, two = (tmp_path / f"{n}{kind}.exr" for kind in "xy")
        verb(*of_fragments, one)
        verb(*of_files, two)
        assert undated(one) == undated(two)


def test_a_curve_is_the_ones_the_shell_draws(tmp_path, capsys):
    f = moit.scenes.load("panes", (8, 6))
    moit.write_deep(tmp_path / "a.exr", f)
    paths = [str(tmp_path / f"{name}.svg") for name in ("shell", "python", "fragments")]
    assert main(["curve", str(tmp_path / "a.exr"), "--pixel", "3,2", "-o", paths[0]]) == 0
    assert capsys.readouterr().out == f"{paths[0]}\n"
    moit.deep.curve(tmp_path / "a.exr", paths[1], pixel=(2, 3))
    moit.deep.curve(moit.read_deep(tmp_path / "a.exr"), paths[2], pixel=(2, 3))
    shell, *others = (Path(path).read_bytes() for path in paths)
    assert others == [shell, shell]
    titles = re.findall(r'class="series"[^>]*><title>([^<]*)', shell.decode())
    assert len(titles) == 6 and "power4" in titles and "sorted" not in titles


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        ({"output": "c.txt"}, ValueError, "output: expected a name that ends in one of .svg"),
        ({"techniques": "wboit"}, ValueError, "wboit has no transmittance but at fragments"),
        ({"pixel": (6, 0)}, IndexError, "pixel: "),
        ({"path": 5}, TypeError, "path: expected Fragments"),
        ({"layer": "fg"}, ValueError, "layer"),
    ],
)
def test_what_no_curve_can_be_drawn_of_is_told(tmp_path, monkeypatch, change, kind, words):
    monkeypatch.chdir(tmp_path)
    given = {"path": moit.scenes.load("panes", (8, 6)), "output": "c.svg", "techniques": "power4"}
    with pytest.raises(kind, match=words):
        moit.deep.curve(**given | change)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("origin", [(6, 0), (0, 8), (-4, 0), (0, -4)])
def test_a_window_that_only_touches_the_image_is_refused(tmp_path, origin):
    moit.write_deep(tmp_path / "a.exr", moit.scenes.load("panes", (8, 6)))
    with pytest.raises(ValueError, match="found none of them in a window"):
        moit.deep.crop(tmp_path / "a.exr", tmp_path / "b.exr", shape=(4, 4), origin=origin)


def test_a_channel_that_nothing_hides_takes_no_colour_and_is_told(tmp_path):
    """Light may come in a channel that a fragment lets through."""
    glass = {"alpha": [1.0, 0.5], "transmission": [[0, 0, 1], [0, 0, 0]]}
    f = moit.Fragments([0, 1, 2], [1.0, 1.0], color=np.full((2, 3), 0.5), **glass)
    moit.write_deep(tmp_path / "a.exr", f)
    picture = moit.composite(f, "sorted").astype(np.float32)
    moit.write_image(tmp_path / "flat.exr", picture)
    paths = (tmp_path / name for name in ("a.exr", "flat.exr", "b.exr"))
    with pytest.warns(UserWarning, match="1 pixels that are not black have no deep sample"):
        moit.deep.recolor(*paths)
    moit.deep.flatten(tmp_path / "b.exr", tmp_path / "c.exr")
    found = moit.read_image(tmp_path / "c.exr")[..., :3]
    np.testing.assert_allclose(found, picture[..., :3] * [[[1, 1, 0], [1, 1, 1]]], atol=1e-3)
