"""The sentence a report opens with says what its rows say, whatever these hold."""

import math

import pytest

from moit.comparing.answer import Name, answer, distance, standings, steps, told
from moit.comparing.report import Report
from moit.comparing.rows import Result, Row


def report(rows, metrics=("flip",), reference="sorted"):
    """Of rows (scene, technique, bits, error[, device])."""
    filled = [
        Row(scene=scene, technique=name, bits_per_pixel=bits, device=(*device, "cpu")[0], note="")
        | {metrics[0]: error}
        for scene, name, bits, error, *device in rows
    ]
    return Report([Result(Row(row)) for row in filled], metrics=metrics, reference=reference)


def text(*rows, **how):
    return answer(report(rows, **how)).text


def test_each_budget_of_memory_has_the_technique_that_is_nearest_within_it():
    rows = [
        ("a", "sorted", None, 0.0),
        ("a", "small", 8, 0.3),
        ("a", "wasteful", 120, 0.4),
        ("a", "middle", 128, 0.1),
        ("a", "large", 400, 0.02),
        ("a", "larger", 2000, 0.05),
    ]
    assert text(*rows) == (
        "Nearest to sorted: within 32 bits per pixel small (FLIP 0.30), within 128 middle (0.10), "
        "within 512 large (0.020). More memory brings nothing nearer."
    )
    found = answer(report(rows))
    assert [word for word in found.sentences[0] if isinstance(word, Name)] == [
        *("small", "middle", "large")
    ]
    assert found.shown == ["small", "middle", "large"] and found.scene == "a"


def test_of_many_steps_the_first_the_last_and_one_between_are_told():
    rows = [("a", f"t{k}", 2**k, 0.5**k) for k in range(4, 12)]
    held = standings(report(rows).rows, "flip", 1)
    assert [(budget, one.technique) for budget, (one,) in steps(held)] == [
        *((32, "t5"), (256, "t8"), (2048, "t11"))
    ]


def test_memory_that_grows_is_in_no_budget_and_said_where_it_is_nearer():
    rows = [("a", "small", 8, 0.3), ("a", "list", None, 0.1)]
    assert text(*rows) == (
        "Nearest to sorted: within 32 bits per pixel small (FLIP 0.30). Nearer still: list, whose "
        "memory grows with the fragments (0.10)."
    )
    assert text(("a", "list", None, 0.1), ("a", "other", None, 0.2)) == (
        "Nearest to sorted: list, whose memory grows with the fragments (FLIP 0.10)."
    )
    assert "Nearer still" not in text(("a", "small", 8, 0.1), ("a", "list", None, 0.1))
    assert "Nearer still" not in text(("a", "small", 8, 0.1), ("a", "list", None, 0.0999))


def test_ties_are_told_as_such():
    rows = [("a", "x", 8, 0.1), ("a", "y", 8, 0.1005), ("a", "z", 16, 0.1), ("a", "w", 8, 0.12)]
    assert text(*rows) == ("Nearest to sorted: within 32 bits per pixel x and y (FLIP 0.10).")
    five = text(*[("a", name, 8, 0.1) for name in "vwxyz"])
    assert "v, w, x and 2 more (FLIP 0.10)" in five
    # More memory for a hundredth less of error is not said to be nearer.
    assert "within 64" not in text(("a", "x", 8, 0.1), ("a", "y", 64, 0.0999))


def test_roundings_are_no_difference():
    assert "x and y (no visible" in text(("a", "x", 8, 3e-7), ("a", "y", 8, 1e-9))
    said = text(("a", "x", 8, 3e-7), ("a", "y", 64, 1e-9))
    assert said == (
        "Nearest to sorted: within 32 bits per pixel x (no visible difference). More memory "
        "brings nothing nearer."
    )


def test_several_scenes_are_told_by_their_mean_and_by_the_worst():
    rows = [("a", "x", 8, 0.1), ("b", "x", 8, 0.3), ("a", "y", 8, 0.19), ("b", "y", 8, 0.22)]
    found = answer(report(rows))
    assert found.text == (
        "Nearest to sorted over 2 scenes: within 32 bits per pixel x (mean FLIP 0.20). "
        "x is farthest off on b (0.30)."
    )
    assert found.scene == "a"  # where they differ most


def test_failures_take_no_part_and_are_named():
    rows = [("a", "x", 8, 0.1), ("b", "x", 8, 0.1), ("a", "lost", 8, 0.01), ("b", "lost", 8, None)]
    assert text(*rows).endswith("Could not be held against it: lost.")
    assert "within 32 bits per pixel x (mean FLIP 0.10)" in text(*rows)
    for error in (None, math.nan, math.inf):
        assert text(("a", "x", 8, error), ("a", "y", 8, error), metrics=("mse",)) == (
            "No technique could be held against sorted: the table says why."
        )


def test_one_technique_the_reference_alone_and_nothing():
    assert text(("a", "x", 8, 0.1)) == "x, 8 bits per pixel: FLIP 0.10 from sorted."
    assert text(("a", "x", None, 0.1), ("b", "x", None, 0.3), reference="power8") == (
        "x, whose memory grows with the fragments: mean FLIP 0.20 from power8 over 2 scenes. "
        "x is farthest off on b (0.30)."
    )
    assert text(("a", "sorted", None, 0.0)) == "Only the reference, sorted, was compared."
    assert text() == "Nothing was compared."
    assert answer(report([])).shown == [] and answer(report([])).scene == ""


def test_devices_that_agree_have_one_sentence_and_others_one_each():
    rows = [("a", "x", 8, 0.1), ("a", "y", 8, 0.2)]
    both = [(*row, device) for row in rows for device in ("cpu", "gpu")]
    assert text(*both) == text(*rows)
    assert text(*rows, ("a", "x", 8, 0.3, "gpu"), ("a", "y", 8, 0.2, "gpu")) == (
        "CPU: Nearest to sorted: within 32 bits per pixel x (FLIP 0.10). "
        "GPU: Nearest to sorted: within 32 bits per pixel y (FLIP 0.20)."
    )


@pytest.mark.parametrize(
    ("metric", "value", "far", "words"),
    [
        ("psnr", 20.0, 0.1, "20.0 dB"),
        ("psnr", math.inf, 0.0, "inf dB"),
        ("ssim", 0.75, 0.25, "0.75"),
        ("mse", 0.25, 0.5, "0.25"),
        ("rmse", 0.25, 0.25, "0.25"),
    ],
)
def test_metrics_of_any_kind_are_distances(metric, value, far, words):
    assert distance(metric, value) == pytest.approx(far)
    assert told(metric, distance(metric, value)) == words


def test_metrics_that_count_upward_have_their_best_told():
    rows = [("a", "x", 8, 30.0), ("a", "y", 8, 20.0)]
    assert text(*rows, metrics=("psnr",)) == (
        "Nearest to sorted: within 32 bits per pixel x (PSNR 30.0 dB)."
    )
