"""What `moit bench` prints, and that its rivals answer the same questions; never how fast."""

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

import moit
from moit import _core
from moit.__main__ import main
from moit.benching import passes, races, report, rivals, suite, timing, work

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
    assert f.depth.min() >= 1 and f.depth.max() <= 100 and f.depth_range == (1, 100)
    many = timing.fragments_of(layout, 200_000)
    assert many.counts.mean() == pytest.approx(mean, rel=0.03)
    assert 0.89 < many.alpha.max() <= 0.9 and many.alpha.mean() == pytest.approx(0.45, abs=0.01)
    assert timing.FRAGMENTS == 4 << 20


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
    assert shown.count("best of 1 rounds") == 2 and "of about 2,000 fragments" in written
    assert "import moit" in shown
    for text in (shown, written):
        assert all(layout in text for layout in timing.LAYOUTS if layout != timing.USUAL)
        for name in ("`power4`", "`sorted`", "NumPy", "flatten"):
            assert name in text
    assert "Million" not in written
    assert written.startswith("# Kept\n")
    assert written.endswith("and this\n")
    assert "old" not in written


def test_a_rate_is_of_the_best_in_millions_a_second():
    times = timing.Times(3_000_000, (0.5, 0.25, 2.0))
    assert times.best == 0.25 and times.rate == 12.0 and times.median_rate == 6.0


def test_cells_are_timed_in_rounds_with_their_threads(monkeypatch):
    seconds = iter(range(100))
    monkeypatch.setattr(timing.time, "perf_counter", lambda: float(next(seconds)) ** 2)
    called = []
    cells = {n: timing.Cell(lambda threads, n=n: called.append((n, threads)), n, n) for n in (3, 5)}
    found = timing.timed(cells, 2)
    assert called == [(3, 3), (5, 5)] * 2
    assert found == {3: timing.Times(3, (1.0, 9.0)), 5: timing.Times(5, (5.0, 13.0))}


def test_bytes_are_those_of_fragments_offsets_and_image():
    f = moit.Fragments([0, 2, 3], np.ones(3), np.full(3, 0.5), np.ones((3, 3)), dtype="f4")
    assert timing.bytes_of(f) == 3 * 8 + 3 * 4 * (1 + 1 + 3) + 2 * 4 * 4


def test_a_dense_image_has_twenty_samples_a_pixel_in_order():
    f = timing.dense_image(100_000)
    assert f.shape == (4, 1024) and (f.counts == 20).all()
    assert (np.diff(f.depth.reshape(-1, 20)) >= 0).all()


def times(*seconds):
    return timing.Times(1_000_000, seconds)


def made_suite(threads=4):
    """Of two techniques: rates that are all different."""
    names, sets = ("sorted", "power4"), ("baseline", "avx2", "avx512")
    layouts = {
        (name, layout): times((i + 1) * (j + 1) / 100, 1.0, (i + 1) * (j + 1) / 10)
        for i, name in enumerate(names)
        for j, layout in enumerate(timing.LAYOUTS)
    }
    one = {"sorted": times(0.12), "power4": times(0.3)}
    by_set = {
        (name, s): times((i + 1) * (3 - j) / 50)
        for i, name in enumerate(names)
        for j, s in enumerate(sets)
    }
    return suite.Suite(names, threads, sets, layouts, one, by_set, {timing.USUAL: 20.5})


def cells_of(table):
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()]


def test_rates_and_ratios_stand_where_they_belong():
    found = made_suite()
    head, _, one, base = cells_of(suite.rates_table(found))
    assert head[1:] == [*timing.LAYOUTS, "median", "1 thread", "baseline", "avx2"]
    # 1 / .01, ...; the median with 16 a pixel, which is third, is 1 / .3
    assert one == "`sorted` 100.0 50.0 33.3 25.0 20.0 16.7 3.3 8.3 16.7 25.0".split()
    assert base == "`power4` 50.0 25.0 16.7 12.5 10.0 8.3 1.7 3.3 8.3 12.5".split()
    head, _, one, base = cells_of(suite.ratios_table(found))
    others = [layout for layout in timing.LAYOUTS if layout != timing.USUAL]
    wider = ("avx2 over baseline", "avx512 over baseline")
    assert head[1:] == ["of power4", *others, "4 threads", *wider]
    assert one == "`sorted` 200% 300% 150% 75% 60% 50% 4.00x 1.50x 3.00x".split()
    assert base == "`power4` 100% 300% 150% 75% 60% 50% 5.00x 1.50x 3.00x".split()


def test_the_suite_times_every_layout_all_threads_one_and_every_set(monkeypatch):
    asked = {}

    def recorded(cells, repeat, progress, title):
        asked.update(cells)
        return {key: times(1.0 + i) for i, key in enumerate(cells)}

    monkeypatch.setattr(suite, "timed", recorded)
    monkeypatch.setattr(suite, "instruction_sets", lambda: ["baseline", "avx2"])
    found = suite.suite(["sorted"], COUNT, 3, 1, False)
    assert {key: (cell.threads, cell.instruction_set) for key, cell in asked.items()} == {
        **{("sorted", layout): (3, None) for layout in timing.LAYOUTS},
        ("sorted", 1): (1, None),
        ("sorted", "baseline"): (3, "baseline"),
    }
    assert all(abs(cell.count - COUNT) < 0.4 * COUNT for cell in asked.values())
    assert found.by_set["sorted", "avx2"] == found.layouts["sorted", timing.USUAL]
    assert found.one_thread["sorted"] == times(7.0) and found.by_set["sorted", "baseline"] == (
        times(8.0)
    )
    assert found.bytes_a_fragment[timing.USUAL] == pytest.approx(20 + (8 + 16) / 16, rel=0.01)


def test_work_is_in_cycles_and_shares_of_memorys_rate(monkeypatch):
    f = timing.fragments_of(timing.USUAL, COUNT)
    rates = {"bytes": 2e10, "cycles": 3e9, "sorted": 1e7}

    def recorded(cells, repeat):
        assert {key: cell.threads for key, cell in cells.items()} == dict.fromkeys(rates, 1)
        return {key: timing.Times(10**9, (1e9 / rates[key],)) for key in cells}

    monkeypatch.setattr(work, "timed", recorded)
    monkeypatch.setattr(rivals, "bytes_read", lambda: lambda: 7)
    monkeypatch.setattr(rivals, "clock_cycles", lambda: lambda: 9)
    (found,) = work.work(["sorted"], COUNT, 1, counted=False)
    assert found.cycles == pytest.approx(300) and found.instructions is None
    assert found.bandwidth == pytest.approx(1e7 * timing.bytes_of(f) / len(f) / 2e10)
    counted = work.Work("power4", "avx2", 450.0, 300.0, 0.25)
    assert cells_of(work.work_table([counted]))[2] == ["`power4`", "450.0", "300.0", "1.50", "25%"]


def test_instructions_are_those_that_callgrind_collected_for_each_fragment(monkeypatch):
    asked = []

    def ran(command, **options):
        asked.append((command, options["env"]["MOIT_ISA"]))
        return SimpleNamespace(returncode=0, stderr="==1== Collected : 6553600\n")

    monkeypatch.setattr(work.shutil, "which", lambda name: name)
    monkeypatch.setattr(work.subprocess, "run", ran)
    assert work.instructions("power4", "avx2") == 100.0  # of 65,536 fragments
    assert work.instructions("power4", "avx2", 6553600) == 1.0
    command, used = asked[0]
    assert command[0] == "valgrind" and command[-2:] == ["power4", "65536"] and used == "avx2"
    monkeypatch.setattr(
        work.subprocess,
        "run",
        lambda *a, **k: ran(*a, **k).__class__(returncode=1, stderr="Collected : 5"),
    )
    assert work.instructions("power4", "avx2") is None
    monkeypatch.setattr(work.shutil, "which", lambda name: None)
    assert work.instructions("power4", "avx2") is None


def test_the_best_of_fresh_imports_is_told(monkeypatch):
    seconds = iter([b"0.5", b"0.25", b"0.75"])
    monkeypatch.setattr(work.subprocess, "check_output", lambda command: next(seconds))
    found = work.besides(20 * 1024, 3)
    assert found.imported == 0.25 and len(found.written.seconds) == len(found.read.seconds) == 3
    assert found.written.count == found.read.count == 20 * 1024


def test_medians_of_passes_leave_out_the_first_run(monkeypatch):
    runs = iter(
        [[(1, 9.0), (passes.COMPOSITE, 9.0)]]
        + [[(1, 0.5), (2, 0.25 * k), (passes.COMPOSITE, 0.125)] for k in (1, 3, 2)]
    )

    class Asked:
        def __init__(self, *arguments, **options):
            pass

        def pass_times(self):
            return next(runs)

    monkeypatch.setattr(passes, "Question", Asked)
    f = small()
    found = passes._times(None, f, moit.technique("power4"), 3, exact=False)
    assert (found.first, found.second) == (1000.0, 125.0)
    assert found.rate == pytest.approx(len(f) / 0.125 / 1e9)


def test_what_is_drawn_before_shading_is_the_first_pass(monkeypatch):
    timings = {"opaque": 8.0, "capture": 0.5, "factors": 0.25, "shade": 2.0, "resolve": 1.0}
    drawn = []

    def render(meshes, one, size, device, exact, report):
        drawn.append((one, size, device, exact, report))
        return SimpleNamespace(timings=timings if len(drawn) > 1 else dict.fromkeys(timings, 99.0))

    monkeypatch.setattr(passes, "render", render)
    monkeypatch.setattr(passes, "rasterize", lambda *a, **k: range(6_000_000_000))
    device = nullcontext()
    (found,) = passes.raster_times(device, "spheres-mesh", (4, 3), ["wboit"], 2, progress=False)
    assert (found.technique, found.first, found.second, found.rate) == ("wboit", 750.0, 3000.0, 2.0)
    assert drawn == [(moit.technique("wboit"), (4, 3), device, False, True)] * 3


def test_races_are_on_one_thread_and_on_all(monkeypatch):
    asked = {}

    def recorded(cells, repeat, progress, title):
        asked.update(cells)
        return {key: times(0.5 if key[-1] == "moit" else 2.0) for key in cells}

    monkeypatch.setattr(races, "timed", recorded)
    monkeypatch.setattr(rivals, "power4_scalar", lambda f, threads: None)
    monkeypatch.setattr(rivals, "diffmoments_transmittance", lambda *a: lambda: None)
    found = races.races(COUNT, threads=3, repeat=1, progress=False)
    assert {race.threads for race in found} == {1, 3} and not any(race.missing for race in found)
    assert {(key[2], cell.threads) for key, cell in asked.items()} == {(1, 1), (3, 3)}
    assert all(race.ratio == 4.0 for race in found)
    questions = {race.question for race in found}
    assert questions == {
        *("composite, power4", "composite, sorted"),
        *(f"bare reconstruction, power{m}" for m in (4, 6, 8)),
    }


def test_passes_are_told_in_milliseconds_and_beyond_unsorted():
    power4 = moit.technique("power4")
    found = passes._median_times(power4, [0.5, 0.25, 4], [0.125, 2, 0.0625], 250_000_000, False)
    assert found == passes.Times("power4", power4.bits_per_pixel, 500.0, 125.0, 2.0)
    unsorted = passes.Times("unsorted", 0.0, 0.0, 25.0, 1.0)
    grows = passes.Times("sorted", None, 1.0, 2.0, 3.0)
    rows = cells_of(passes.table([found, unsorted, grows]))
    bits = f"{power4.bits_per_pixel:g}"
    assert rows[2] == ["`power4`", bits, "500 ms", "125 ms", "+600 ms", "2"]
    assert rows[4] == ["`sorted`", "grows", "1 ms", "2 ms", "-22 ms", "3"]
    f = passes.fragments_for(100, layers=16)
    assert len(f) == 96 and (f.counts == 16).all()


def test_races_are_told_by_rates_and_ratios():
    race = races.Race("q", "r", 2, times(0.125), times(0.5))
    lost = races.Race("q", "s", 0, missing="no compiler")
    rows = cells_of(races.races_table([race, lost], rates=True))
    assert rows[2] == ["q", "r", "2", "8.0", "2.0", "4.00 times as fast"]
    assert rows[3] == ["q", "s", "-", "-", "-", "no compiler"]
    rows = cells_of(races.races_table([race, lost], rates=False))
    assert rows[2] == ["q", "r", "2", "4.00 times as fast"]
    assert rows[3] == ["q", "s", "-", "no compiler"]


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
