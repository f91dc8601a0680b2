"""Bad arguments of the questions, of moments, compare and plots: errors that name them."""

import warnings

import numpy as np
import pytest

import moit
from moit import WeightedBlended, _core, moments
from moit.checks.arguments import whole

GREAT = np.array(["1e400"] * 3, np.longdouble)  # beyond float64
needs_longdouble = pytest.mark.skipif(
    not np.isfinite(GREAT).all(), reason="long double is float64 here"
)


@pytest.fixture(scope="module")
def f():
    return moit.scenes.load("panes", size=(12, 11))


@pytest.fixture(scope="module")
def report(f):
    return moit.compare(f, "power4", metrics="mse", repeat=1, progress=False)


@pytest.fixture(autouse=True)
def no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def raises(error, words):
    return pytest.raises(error, match=words)


@needs_longdouble
def test_numbers_too_great_for_the_type_are_named(f):
    with raises(ValueError, r"background\[0\]: .* finite float64"):
        moit.composite(
            f.__class__(f.offsets, f.depth, f.alpha, f.color, shape=f.shape, dtype=np.float64),
            "power4",
            background=GREAT,
        )
    with raises(ValueError, r"depth\[0\]: "):
        moit.transmittance(f, "power4", GREAT)


def test_a_background_that_the_image_cannot_show_is_refused(f):
    with raises(ValueError, r"background\[1\]: found 1e\+300; needed a finite float32"):
        moit.composite(f, "power4", background=(0, 1e300, 0))
    assert moit.composite(f, "power4", background=(0, 1e300, 0), dtype=float).max() == 1e300


def test_weights_and_scales_that_the_type_cannot_hold_are_refused(f):
    with raises(ValueError, r"weight\[0\]: "):
        moit.composite(f, WeightedBlended(lambda z, a, c: np.full(len(z), 1e300)))
    with raises(ValueError, "depth_scale: "):
        moit.composite(f, WeightedBlended(lambda z, a, c: a, depth_scale=1e300))


@pytest.mark.parametrize("device", [None, 1, "cuda", np.array(["cpu", "gpu"])])
def test_a_bad_device_is_named(f, device):
    with raises(ValueError, "device: expected"):
        moit.composite(f, "power4", device=device)


@pytest.mark.parametrize("name", ["b0", "b", "z"])
def test_moments_that_are_missing_or_out_of_range_are_named(name):
    good = {"b0": np.ones(2), "b": np.zeros((2, 4)), "z": np.zeros((2, 3))}
    with raises(TypeError, f"{name}: expected real numbers"):
        moments.transmittance("power4", **{**good, name: None})
    bad = good[name].copy()
    bad.flat[1] = np.nan
    with raises(ValueError, rf"{name}\[.*1\]: found nan"):
        moments.bounds("power4", **{**good, name: bad})
    bad.flat[1] = -1.1
    with raises(ValueError, rf"{name}\[.*1\]: found -1.1"):
        moments.transmittance("power4", **{**good, name: bad})
    with raises(ValueError, r"alpha\[0, 1\]: found 1.1"):
        moments.bounds("power4", *good.values(), alpha=[[0, 1.1, 0], [0, 0, 0]])
    with raises(TypeError, "raw: expected True or False"):
        moments.gather("panes", "power4", raw="no")


def test_bad_arguments_of_compare_are_named(f):
    for name, bad in (("devices", 5), ("metrics", 5), ("devices", [1]), ("metrics", [[]])):
        with raises(TypeError, f"{name}: expected names as str"):
            moit.compare(f, "power4", **{name: bad}, progress=False)
    with raises(TypeError, "executor: expected"):
        moit.compare(f, "power4", executor=5, progress=False)


def test_bad_arguments_of_reports_and_plots_are_named(f, report, tmp_path):
    pytest.importorskip("matplotlib").use("agg")
    with raises(ValueError, "by: expected"):
        report.pareto(by=[])
    with raises(ValueError, "metric: expected"):
        report.pareto(np.zeros(2))
    with raises(TypeError, "title: expected str"):
        report.to_html(tmp_path / "page.html", 5)
    for draw in (moit.plot.speed_error, moit.plot.error_maps):
        with raises(TypeError, "report: expected a Report"):
            draw(None)
        with raises(ValueError, "scene: expected"):
            draw(report, scene=np.zeros(2))
    for columns, error in ((0, ValueError), (-1, ValueError), (1.5, TypeError)):
        with raises(error, "columns: expected"):
            moit.plot.error_maps(report, metric="mse", columns=columns)
    with raises(ValueError, "report: it has no rows"):
        moit.plot.error_maps(moit.Report([]))
    with raises(TypeError, "techniques: expected"):
        moit.plot.curves(f, 5)


@pytest.mark.parametrize("path", [None, 5, 1.5, [], np.zeros(2)])
def test_what_is_no_path_is_named(f, path):
    for call in (
        lambda: moit.read_deep(path),
        lambda: moit.write_deep(path, f),
        lambda: moit.read_image(path),
        lambda: moit.write_image(path, np.zeros((2, 2, 3))),
        lambda: moit.save(path, f),
        lambda: moit.load(path),
    ):
        with raises(TypeError, "path: expected str, bytes or os.PathLike"):
            call()


@pytest.mark.parametrize("bad", [None, 1, "no", np.zeros(2)])
def test_what_is_not_true_or_false_is_named(f, tmp_path, bad):
    image = np.zeros((2, 2, 3))
    with raises(TypeError, "half: expected True or False"):
        moit.write_image(tmp_path / "a.exr", image, half=bad)
    with raises(TypeError, "half: expected True or False"):
        moit.write_deep(tmp_path / "a.exr", f, half=bad)
    with raises(TypeError, "cull_opaque: expected True or False"):
        moit.composite(f, "power4", cull_opaque=bad)
    if bad is not None:
        with raises(TypeError, "alpha: expected True or False"):
            moit.write_image(tmp_path / "a.png", image, alpha=bad)


@pytest.mark.parametrize(
    "wrong",
    [
        {"b": np.zeros((3, 4))},
        {"b": np.zeros((2, 6))},
        {"z": np.zeros((3, 5))},
        {"z": np.zeros((1, 5))},
        {"alpha": np.zeros((2, 4))},
        {"alpha": np.zeros((3, 5))},
    ],
)
def test_the_core_looks_at_shapes_of_moments_itself(wrong):
    fields = moit.technique("power4").fields_for_core(np.dtype(float))
    good = {"b0": np.ones(2), "b": np.zeros((2, 4)), "z": np.zeros((2, 5)), "alpha": None}
    _core.moments_bounds(fields, 1, *good.values())
    with pytest.raises(ValueError, match="do not fit one another"):
        _core.moments_bounds(fields, 1, *(good | wrong).values())
    if "alpha" not in wrong:
        with pytest.raises(ValueError, match="do not fit one another"):
            _core.moments_transmittance(fields, 1, *list((good | wrong).values())[:3])


def test_whole_numbers_have_both_their_ends():
    assert [whole("n", value, 2, 4) for value in (2, np.int8(3), 4)] == [2, 3, 4]
    assert whole("n", 2, 2) == 2
    for value, raised in ((1, ValueError), (5, ValueError), (True, TypeError), (2.0, TypeError)):
        with pytest.raises(raised, match="n: expected"):
            whole("n", value, 2, 4)
    with pytest.raises(ValueError, match="n: expected at least 2, got 1"):
        whole("n", 1, 2)


@pytest.mark.parametrize(
    ("place", "wrong", "said"),
    [
        ("b0", np.inf, r"b0\[0\]: found inf; needed a finite number"),
        ("b0", -1.0, r"b0\[0\]: found -1.0; needed a number that is not negative"),
        ("b", np.nan, r"b\[0, 0\]: found nan; needed a finite number"),
        ("b", 2.0, r"b\[0, 0\]: found 2.0; needed a number from -1 to 1"),
        ("z", -np.inf, r"z\[0, 0\]: found -inf; needed a finite number"),
        ("z", 1.1, r"z\[0, 0\]: found 1.1; needed a number from -1 to 1"),
    ],
)
def test_moments_that_are_not_finite_or_in_range_are_named(place, wrong, said):
    given = {"b0": np.ones(1), "b": np.array([[0.1, 0.5, 0.1, 0.4]]), "z": np.zeros((1, 1))}
    given[place].flat[0] = wrong
    with raises(ValueError, said):
        moit.moments.transmittance("power4", *given.values())


@pytest.mark.parametrize("place", ["b0", "b", "z"])
def test_what_is_wrong_with_moments_is_found_wherever_it_is(place):
    """Threads look at parts of arrays, one after the other."""
    n = (1 << 16) + 5
    given = {"b0": np.ones(n), "b": np.tile([0.1, 0.5, 0.1, 0.4], (n, 1)), "z": np.zeros((n, 1))}
    given = {name: array.astype(np.float32) for name, array in given.items()}
    moit.moments.transmittance("power4", *given.values())
    given[place].flat[-1] = np.nan
    with raises(ValueError, rf"{place}\[{n - 1}.*: found nan"):
        moit.moments.transmittance("power4", *given.values())
