"""Times of passes: what is timed, and what is printed of it."""

import gpu
import pytest

import moit
from moit.benching import passes as benchmark

CHOSEN = ("unsorted", "trig2", "mlab2")


def test_passes_are_timed_by_kind():
    f = benchmark.fragments_for(4000)
    assert len(f) == 4000
    times = benchmark.array_times(gpu.device(), f, CHOSEN[:2], 2, progress=False)
    assert [one.technique for one in times] == ["unsorted", "trig2"]
    assert all(one.first > 0 and one.second > 0 and one.rate > 0 for one in times)
    table = benchmark.table(times)
    assert table.count("\n") == 3
    assert "| `unsorted` | 0 |" in table


def test_drawn_passes_are_timed_for_every_way():
    times = benchmark.raster_times(
        gpu.device(), "spheres-mesh", (32, 18), (*CHOSEN, "sorted"), 1, progress=False
    )
    assert [one.technique for one in times] == [*CHOSEN, "sorted"]
    assert times[0].first == 0  # it has one pass
    assert all(one.first > 0 for one in times[1:])
    assert all(one.second > 0 for one in times)


def test_a_report_names_the_device_and_what_was_timed():
    text = benchmark.report(gpu.device(), CHOSEN[:1], [320], (32, 18), 1)
    assert gpu.device().renderer in text.splitlines()[0]
    assert text.count("| `unsorted` |") == 3
    for words in ("`teapots` at 32 x 18", "`ship-like`", "320 fragments"):
        assert words in text


def test_what_engines_have_a_text_of_is_timed_twice():
    text = benchmark.report(gpu.device(), ["unsorted", "power4", "power4-16"], [320], (32, 18), 1)
    for row in ("| `power4` |", "| `power4`, exact |", "| `power4-16` |"):
        assert text.count(row) == 3
    assert "`power4-16`, exact" not in text and "`unsorted`, exact" not in text


@pytest.mark.parametrize("wrong", [{"counts": [0]}, {"repeat": 0}])
def test_nothing_to_time_is_refused(wrong):
    with pytest.raises(ValueError, match="expected at least 1"):
        benchmark.report(gpu.device(), CHOSEN, **wrong)


def test_what_is_unknown_is_named():
    with pytest.raises(ValueError, match="teapot"):
        benchmark.raster_times(gpu.device(), "teapot", (8, 8))
    with pytest.raises(ValueError, match="trig2"):
        moit.technique("trg2")
