"""What `moit bench` prints, and that its rivals answer the same questions; never how fast."""

import numpy as np
import pytest

import moit
from moit import _core
from moit.__main__ import main
from moit.benching import races, report, rivals, timing, work

COUNT = 2000


def small(layout=timing.USUAL, dtype=None):
    f = timing.fragments_of(layout, COUNT)
    return (
        f
        if dtype is None
        else moit.Fragments(
            f.offsets, f.depth, f.alpha, f.color, depth_range=f.depth_range, dtype=dtype
        )
    )


def scalar(f, threads=1):
    try:
        return rivals.power4_scalar(f, threads)
    except rivals.Missing as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("layout", timing.LAYOUTS)
def test_fragments_are_as_many_a_pixel_as_their_layout_says(layout):
    f = small(layout)
    mean = int("".join(filter(str.isdigit, layout)))
    if "mean" in layout:
        assert np.ptp(f.counts) > mean
        assert f.counts.mean() == pytest.approx(mean, rel=0.3)
    else:
        assert (f.counts == mean).all()


def test_the_scalar_rival_is_the_published_power4():
    """In double both are the published formulas; in float32 the rival loses digits."""
    for layout in ("16 a pixel", "geometric, mean 4"):
        f = small(layout, np.float64)
        ours = moit.composite(f, "power4(bias=5e-07)")[0]
        # it clamps no alpha, of which these have none above .9
        np.testing.assert_allclose(scalar(f), ours, atol=1e-9)
    single = small()
    ours = moit.composite(single, 'power4(bias="published")')[0]
    assert np.quantile(np.abs(scalar(single) - ours), 0.9) < 1e-4


def test_the_rival_gives_the_same_bits_on_any_number_of_threads():
    f = small("geometric, mean 4")
    assert scalar(f, 1).tobytes() == scalar(f, 3).tobytes()


def test_the_numpy_rival_is_the_published_power4():
    f = small("geometric, mean 4", np.float64)
    ours = moit.composite(f, "power4(bias=5e-07)")[0]
    np.testing.assert_allclose(rivals.power4_numpy(f), ours, atol=1e-9)


def test_a_pixel_too_deep_for_the_scalar_rival_is_refused():
    n = rivals.MOST_IN_A_PIXEL + 1
    f = moit.Fragments([0, n], np.linspace(1, 2, n), np.full(n, 0.1), np.ones((n, 3)))
    with pytest.raises(rivals.Missing, match="4096"):
        rivals.power4_scalar(f)


def test_flatten_is_sorted():
    f = timing.dense_image(1)
    image = rivals.DeepImage(f)
    flat = image.flattened(2)
    ours = moit.composite(f, "sorted")
    order = [image.channels.index(name) for name in "RGBA"]
    np.testing.assert_allclose(flat[..., order], ours, atol=1e-5)  # its sums are in float32


def test_diffmoments_reconstructs_the_same():
    pytest.importorskip("diffmoments")
    b0, b, z = (one.astype(np.float64) for one in races._bare("power4", COUNT))
    ours = moit.moments.transmittance("power4(bias=5e-07)", b0, b, z)
    theirs = rivals.diffmoments_transmittance(b0, b, z)()
    assert np.quantile(np.abs(theirs - ours), 0.5) < 0.05  # its bias has another safe distribution


def test_an_instruction_set_is_chosen_for_what_follows_and_put_back():
    before = _core.build_info()["instruction set in use"]
    f = small()
    seen = []
    cells = {
        one: timing.Cell(
            lambda threads: seen.append(_core.build_info()["instruction set in use"]), 1, 1, one
        )
        for one in timing.instruction_sets()
    }
    timing.timed(cells, 2)
    assert seen == 2 * timing.instruction_sets()
    assert _core.build_info()["instruction set in use"] == before
    images = []
    for one in timing.instruction_sets():
        _core.use_instruction_set(one)
        images.append(moit.composite(f, "power4").tobytes())
    _core.use_instruction_set(before)
    assert len(set(images)) == 1


@pytest.mark.parametrize("wrong", ["sse9", "", None, 3])
def test_an_unknown_instruction_set_is_refused(wrong):
    with pytest.raises(ValueError, match="instruction set"):
        _core.use_instruction_set(wrong)


def test_a_missing_rival_leaves_a_line(monkeypatch):
    monkeypatch.setattr(rivals, "SOURCES", rivals.SOURCES / "nowhere")
    rivals.library.cache_clear()
    found = races.races(COUNT, threads=1, repeat=1, progress=False)
    lost = {one.rival: one.missing for one in found if one.missing}
    assert "source tree" in lost["scalar C with libm"]
    assert "NumPy" not in lost
    assert "source tree" in races.races_table(found, rates=True)
    with pytest.raises(rivals.Missing):
        work.work(["power4"], COUNT, 1, counted=False)


def test_a_report_has_rates_for_the_terminal_and_ratios_for_documents(tmp_path, capsys):
    document = tmp_path / "speed.md"
    document.write_text(f"# Kept\n{report.BEGIN}\nold\n{report.END}\nand this\n")
    command = ["bench", "-t", "power4", "-t", "sorted", "--fragments", str(COUNT)]
    assert main([*command, "--repeat", "1", "--threads", "2", "-o", str(document)]) == 0
    shown = capsys.readouterr().out
    written = document.read_text()
    assert "Million fragments a second on 2 threads" in shown
    assert "import moit" in shown
    for text in (shown, written):
        assert all(layout in text for layout in timing.LAYOUTS if layout != timing.USUAL)
        for name in ("`power4`", "`sorted`", "NumPy", "flatten"):
            assert name in text
    assert "Million" not in written
    assert written.startswith("# Kept\n")
    assert written.endswith("and this\n")
    assert "old" not in written


def test_a_ratio_is_of_rates():
    ours, theirs = timing.Times(10, (0.5, 0.25)), timing.Times(20, (2.0, 4.0))
    race = races.Race("q", "r", 1, ours, theirs)
    assert race.ratio == (10 / 0.25) / (20 / 2.0)


@pytest.mark.parametrize(
    "wrong", [["--repeat", "0"], ["--fragments", "0"], ["--threads", "0"], ["-t", "power5"]]
)
def test_nothing_to_time_is_a_users_error(wrong, capsys):
    assert main(["bench", *wrong]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_two_counts_are_for_a_gpu_only(capsys):
    assert main(["bench", "--fragments", "5", "--fragments", "6"]) == 1
    assert "--gpu" in capsys.readouterr().err
