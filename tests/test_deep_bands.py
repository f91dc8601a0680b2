"""Deep images in bands: the same fragments and pictures as from the whole, in bounded memory."""

import os
import subprocess
import sys
import warnings

import gpu
import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from variants import EVERY

import moit
from moit.__main__ import main
from moit.formats.deep_bands import (
    BYTES_A_PIXEL,
    BYTES_A_SAMPLE,
    LEAST_MEMORY,
    Bands,
    band_part,
)
from moit.formats.deep_channels import Wanted
from moit.formats.deep_source import Source


def dense(height=96, width=64, most=40, seed=0):
    """Random samples, more and more of them from the top on."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(
        0, 1 + most * np.arange(1, height + 1)[:, None] // height, (height, width)
    )
    offsets = np.concatenate([[0], np.cumsum(counts.ravel())])
    n = int(offsets[-1])
    return moit.Fragments(
        offsets,
        rng.uniform(1, 9, n).astype(np.float32),
        rng.uniform(0.05, 0.9, n).astype(np.float32),
        rng.random((n, 3), np.float32),
        shape=(height, width),
        origin=(7, -3),
    )


@pytest.fixture
def path(tmp_path):
    moit.write_deep(tmp_path / "deep.exr", dense())
    return tmp_path / "deep.exr"


@pytest.fixture(scope="module")
def six_bands(tmp_path_factory):
    """A file of as many, in the least memory that may be asked for."""
    path = tmp_path_factory.mktemp("bands") / "deep.exr"
    moit.write_deep(path, dense(48, 32))
    assert len(list(moit.read_deep_bands(path, memory=LEAST_MEMORY))) == 6
    return path


def joined(bands):
    return moit.merge(bands)


def assert_same(found, wanted):
    assert found.shape == wanted.shape and found.origin == wanted.origin
    assert found.depth_range == wanted.depth_range
    for name in ("offsets", "depth", "alpha", "color", "back", "emission"):
        one, other = getattr(found, name), getattr(wanted, name)
        assert (one is None) == (other is None), name
        assert one is None or np.array_equal(one, other), name


@pytest.mark.parametrize("memory", [LEAST_MEMORY, 4 << 20, 1 << 30])
def test_bands_are_the_whole(path, memory):
    whole = moit.read_deep(path)
    bands = list(moit.read_deep_bands(path, memory=memory))
    assert (len(bands) > 8) == (memory == LEAST_MEMORY)
    assert all(one.depth_range == whole.depth_range for one in bands)
    assert all(one.shape[1] == whole.shape[1] for one in bands)
    assert_same(joined(bands), whole)


@pytest.mark.parametrize("name", [t for t in EVERY if moit.technique(t).local])
def test_a_picture_in_bands_has_the_bits_of_the_whole(six_bands, tmp_path, name):
    moit.composite_deep(six_bands, tmp_path / "out.exr", name, memory=LEAST_MEMORY)
    whole = moit.composite(moit.read_deep(six_bands), name)
    assert np.array_equal(moit.read_image(tmp_path / "out.exr"), whole)


def test_what_hangs_on_neighbours_is_refused_before_anything_is_written(path, tmp_path):
    for name in ("moment-transparency-lr8", "per-pixel"):
        with pytest.raises(ValueError, match="local"):
            moit.composite_deep(path, tmp_path / "out.exr", name)
    assert os.listdir(tmp_path) == ["deep.exr"]


def test_a_background_by_pixel_is_cut_as_the_image_is(path, tmp_path):
    background = np.random.default_rng(1).random((96, 64, 3))
    moit.composite_deep(
        path, tmp_path / "o.exr", "sorted", background=background, memory=LEAST_MEMORY
    )
    whole = moit.composite(moit.read_deep(path), "sorted", background=background)
    assert np.array_equal(moit.read_image(tmp_path / "o.exr"), whole)
    with pytest.raises(ValueError, match=r"background: expected \(3,\) or \(96, 64, 3\)"):
        moit.composite_deep(path, tmp_path / "p.exr", "sorted", background=background[1:])


def test_png_is_written_in_bands_too(path, tmp_path):
    moit.composite_deep(path, tmp_path / "a.png", "power4", memory=LEAST_MEMORY)
    moit.write_image(tmp_path / "b.png", moit.composite(moit.read_deep(path), "power4"))
    a, b = (moit.read_image(tmp_path / f"{one}.png") for one in "ab")
    assert np.array_equal(a, b)


def test_tiled_files_go_through_in_rows_of_tiles(path, tmp_path):
    source = oiio.ImageInput.open(str(path))
    spec, deep = source.spec(), source.read_native_deep_image(0, 0)
    spec.tile_width, spec.tile_height = 16, 8
    spec.x = spec.y = 0
    out = oiio.ImageOutput.create(str(tmp_path / "tiles.exr"))
    assert out.open(str(tmp_path / "tiles.exr"), spec) and out.write_deep_image(deep)
    out.close()
    bands = list(moit.read_deep_bands(tmp_path / "tiles.exr", memory=LEAST_MEMORY))
    assert len(bands) > 4 and all(one.shape[0] % 8 == 0 for one in bands)
    assert_same(joined(bands), moit.read_deep(tmp_path / "tiles.exr"))


def volumes(path):
    """Overlapping volumes, an alpha above 1 and a light without opacity, in every row."""
    shape = (40, 30)
    z = np.array([1, 2, 3, 4], np.float32)
    samples = {
        "Z": z,
        "ZBack": z + np.float32(1.5),
        "A": np.array([0.5, 1.0005, 0, 0.25], np.float32),
        **{c: np.array([0.1, 0.2, 0.3, 0.1], np.float32) for c in "RGB"},
    }
    channels = {}
    for name, values in samples.items():
        channels[name] = np.empty(shape, object)
        for at in np.ndindex(shape):
            channels[name][at] = values + np.float32(at[0] * (name in ("Z", "ZBack")))
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    OpenEXR.File(header, channels).write(str(path))


def test_warnings_count_over_all_bands(tmp_path):
    volumes(tmp_path / "v.exr")
    with warnings.catch_warnings(record=True) as whole:
        warnings.simplefilter("always")
        f = moit.read_deep(tmp_path / "v.exr")
    with warnings.catch_warnings(record=True) as parts:
        warnings.simplefilter("always")
        bands = list(moit.read_deep_bands(tmp_path / "v.exr", memory=LEAST_MEMORY))
    assert len(whole) == 1 and [str(w.message) for w in parts] == [str(w.message) for w in whole]
    assert_same(joined(bands), f)


@pytest.mark.parametrize("device", ["cpu", "gpu"])
def test_a_picture_in_bands_says_once_in_how_many_pixels_halves_overflow(tmp_path, device):
    f = dense()
    bright = f.color.copy()
    bright[:: 3 * 7] = 1e8
    f = moit.Fragments(f.offsets, f.depth, f.alpha, bright, shape=f.shape, origin=f.origin)
    moit.write_deep(tmp_path / "bright.exr", f)
    if device == "gpu":
        device = gpu.software_device()
    with pytest.warns(RuntimeWarning, match="keep sums beyond 65504") as whole:
        image = moit.composite(tmp_path / "bright.exr", "mlab4", device=device)
    with pytest.warns(RuntimeWarning) as parts:
        moit.composite_deep(
            tmp_path / "bright.exr",
            tmp_path / "o.exr",
            "mlab4",
            device=device,
            memory=LEAST_MEMORY,
        )
    assert len(list(moit.read_deep_bands(tmp_path / "bright.exr", memory=LEAST_MEMORY))) > 4
    assert len(parts) == 1
    assert str(parts[0].message) == str(whole[0].message)
    assert parts[0].filename == __file__
    assert np.array_equal(moit.read_image(tmp_path / "o.exr"), image)


def test_memory_is_bounded(tmp_path):
    """A file of 6 million samples, of which fragments alone take 120 MiB."""
    rng = np.random.default_rng(0)
    height, width, each = 300, 400, 50
    n = height * width * each
    f = moit.Fragments(
        np.arange(height * width + 1) * each,
        rng.uniform(1, 9, n).astype(np.float32),
        np.full(n, 0.1, np.float32),
        np.full((n, 3), 0.5, np.float32),
        shape=(height, width),
    )
    moit.write_deep(tmp_path / "big.exr", f)
    del f
    code = (
        "import re, sys, moit, OpenImageIO, OpenEXR\n"
        "from moit.__main__ import main\n"
        "def most():\n"
        "    return int(re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1])\n"
        "before = most()\n"
        "assert main(sys.argv[1:]) == 0\n"
        "print(most() - before)\n"
    )
    command = ["composite", "big.exr", "-t", "power4", "-o", "out.exr", "--memory"]

    def taken(memory):
        done = subprocess.run(
            [sys.executable, "-c", code, *command, memory],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        )
        assert done.returncode == 0, done.stderr
        return int(done.stdout.split()[-1]) / 1024

    small, large = taken("32M"), taken("4G")
    assert small < 96, large  # what allocators keep comes on top
    assert large > 160, small  # or this file is too small to tell


def test_the_command_line_takes_bands(path, tmp_path, capsys):
    arguments = ["composite", str(path), "-t", "power4", "-o", str(tmp_path / "o.exr")]
    assert main([*arguments, "--memory", "1M"]) == 0
    whole = moit.composite(moit.read_deep(path), "power4")
    assert np.array_equal(moit.read_image(tmp_path / "o.exr"), whole)
    assert main(["composite", "panes", "-t", "power4", "-o", "o.exr", "--memory", "1G"]) == 1
    assert "--memory" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main([*arguments, "--memory", "much"])
    assert "500M" in capsys.readouterr().err


def test_wrong_arguments_are_named(path, tmp_path):
    for memory, error in ((0, ValueError), (1.5, TypeError), ("1G", TypeError)):
        with pytest.raises(error, match="memory: expected"):
            moit.read_deep_bands(path, memory=memory)
    with pytest.raises(FileNotFoundError):
        moit.read_deep_bands(tmp_path / "none.exr")
    with pytest.raises(ValueError, match="part: expected 0 to 0"):
        moit.read_deep_bands(path, part=3)
    flat = tmp_path / "flat.exr"
    moit.write_image(flat, np.zeros((4, 4, 3), np.float32))
    with pytest.raises(moit.FragmentsError, match="not a deep image"):
        moit.composite_deep(flat, tmp_path / "o.exr", "sorted")
    moit.write_deep(tmp_path / "grey.exr", moit.Fragments([0, 1], [1.0], [0.5], shape=(1, 1)))
    with pytest.raises(moit.FragmentsError, match="needs the fragments' colour"):
        moit.composite_deep(tmp_path / "grey.exr", tmp_path / "o.exr", "sorted")


def test_a_damaged_file_leaves_the_old_picture(path, tmp_path):
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    (tmp_path / "o.exr").write_bytes(b"old")
    with pytest.raises(OSError, match=r"deep\.exr'"):
        moit.composite_deep(path, tmp_path / "o.exr", "sorted", memory=LEAST_MEMORY)
    assert (tmp_path / "o.exr").read_bytes() == b"old"
    assert sorted(os.listdir(tmp_path)) == ["deep.exr", "o.exr"]


def test_an_interrupt_leaves_the_old_picture(path, tmp_path):
    (tmp_path / "o.exr").write_bytes(b"old")

    def stop(done, total, label):
        if done == 70:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        moit.composite_deep(path, tmp_path / "o.exr", "sorted", memory=LEAST_MEMORY, progress=stop)
    assert sorted(os.listdir(tmp_path)) == ["deep.exr", "o.exr"]


def test_bands_are_kept_while_they_fill_no_more_than_half_of_the_memory(path):
    name = str(path)
    bands = Bands(name, band_part(name, Wanted()), 1 << 30)
    with Source(name, bands.part) as source:
        kept = bands.survey(source, False)[0]
        held = sum(
            band.offsets.nbytes + band.depth.nbytes + band.alpha.nbytes + band.color.nbytes
            for band in kept
        )
        bands.first_rows = lambda: 16  # a few rows at once, whatever the memory
        bands.next_rows = lambda rows, counts: 16
        for memory in (2 * held + 200, 2 * held - 200):
            bands.memory = memory
            assert (bands.survey(source, False)[0] is not None) == (memory > 2 * held)


def planned(rows, step=1):
    """Bands of twelve rows of 5 pixels and 10 samples each, with memory for so many rows."""
    bands = Bands.__new__(Bands)
    bands.width, bands.height = 5, 12
    bands.memory = int(rows * (5 * BYTES_A_PIXEL + 10 * BYTES_A_SAMPLE))
    return bands.plan(np.full(12, 10), step)


def test_a_band_takes_no_row_more_than_there_is_memory_for():
    assert planned(3) == [(0, 3), (3, 6), (6, 9), (9, 12)]
    assert planned(3.999) == planned(3) and planned(2.999) == [(2 * i, 2 * i + 2) for i in range(6)]
    assert planned(0.5) == [(i, i + 1) for i in range(12)]  # a row at least
    assert planned(5, step=2) == [(0, 4), (4, 8), (8, 12)]  # as rows of tiles are
    assert planned(100) == [(0, 12)]
