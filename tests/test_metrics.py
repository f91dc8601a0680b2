"""Errors of images: against NumPy, scikit-image and flip-evaluator, and what must hold of any."""

import pickle
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from small import PATIENCE

from moit import _core, metrics

HEIGHT, WIDTH = 75, 101  # odd, and no multiple of any vector's length

NAMES = metrics.NAMES
SYMMETRIC = [name for name in NAMES if name != "hdr_flip"]
EQUAL = {"psnr": np.inf, "ssim": 1.0}  # of equal images; 0 for the others

# What flip-evaluator gives, in a process of its own: on some input it exits the interpreter.
EVALUATE = """
import sys
import flip_evaluator
import numpy as np
pairs, found = np.load(sys.argv[1]), {}
for name in sorted({key.rpartition("/")[0] for key in pairs}):
    image, reference = pairs[name + "/image"], pairs[name + "/reference"]
    for metric, kind, clip in (("flip", "LDR", 1), ("hdr_flip", "HDR", np.inf)):
        parameters = {}
        if kind == "HDR" and reference.max() == 0:
            exposure = pairs["black/exposure"].item()
            parameters = {"startExposure": exposure, "stopExposure": exposure, "numExposures": 2}
        errors, mean, _ = flip_evaluator.evaluate(
            np.clip(reference, 0, clip), np.clip(image, 0, clip), kind, inputsRGB=False,
            applyMagma=False, parameters=parameters)
        found[f"{name}/{metric}"] = errors[..., 0]
        found[f"{name}/{metric}/mean"] = mean
np.savez(sys.argv[2], **found)
"""


def waves(seed, height=HEIGHT, width=WIDTH):
    """A picture in [0, 1] of a few waves of many lengths."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    image = np.zeros((height, width, 3))
    for _ in range(12):
        fy, fx = random.normal(0, 0.3, 2)
        wave = np.cos(fy * y + fx * x + random.uniform(0, 6))
        image += wave[..., None] * random.normal(0, 1, 3)
    return (image - image.min()) / np.ptp(image)


def pairs_of_images():
    random = np.random.default_rng(7)
    base, other = waves(1), waves(2)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    board = np.repeat(((x // 5 + y // 5) % 2)[..., None], 3, axis=2)
    left = (x < 40)[..., None]
    green, blue = np.zeros((2, 20, 31, 3))
    green[..., 1], blue[..., 2] = 1, 1
    return {
        "noisy": (base + random.normal(0, 0.05, base.shape), base),
        "shifted": (np.roll(base, 2, axis=1), base),
        "unlike": (other, base),
        "board": (board, base),
        "white on black": (np.ones((33, 40, 3)), np.full((33, 40, 3), 1e-3)),
        "green and blue": (green, blue),
        "smallest": (random.random((11, 11, 3)), random.random((11, 11, 3))),
        "wide": (waves(3, 13, 157), waves(4, 13, 157)),
        "bright": (np.exp(6 * base) * 1.05, np.exp(6 * base)),
        "bright, unlike": (np.exp(12 * other - 5), np.exp(12 * base - 5)),
        "fireflies": (np.exp(random.normal(0, 3, base.shape)), np.exp(base)),
        "mostly black": (left * (base * 3 + 0.1), left * base * 3),
        "black": (base, np.zeros_like(base)),
    }


PAIRS = {
    name: tuple(np.maximum(image, 0).astype(np.float32) for image in pair)
    for name, pair in pairs_of_images().items()
}


@pytest.fixture(scope="session")
def evaluated(tmp_path_factory):
    pytest.importorskip("flip_evaluator")
    folder = tmp_path_factory.mktemp("flip")
    given = {}
    for name, (image, reference) in PAIRS.items():
        given[f"{name}/image"], given[f"{name}/reference"] = image, reference
    # The luminance 2^-23 at 0.85 on the ACES curve x (.9036 x + .018) / (x (.8748 x + .354) + .14)
    white = max(np.roots([0.9036 - 0.85 * 0.8748, 0.018 - 0.85 * 0.354, -0.85 * 0.14]))
    given["black/exposure"] = np.log2(white) + 23
    np.savez(folder / "pairs.npz", **given)
    run = [sys.executable, "-c", EVALUATE, folder / "pairs.npz", folder / "found.npz"]
    subprocess.run(run, check=True, timeout=PATIENCE)
    return np.load(folder / "found.npz")


def metric(name):
    return getattr(metrics, name), getattr(metrics, f"{name}_map")


def encoded(image):
    linear = np.clip(image.astype(np.float64), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


# -- Against others ---------------------------------------------------------------------------


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("name", ["flip", "hdr_flip"])
def test_flip_agrees_with_flip_evaluator(evaluated, name, pair):
    mean_of, map_of = metric(name)
    expected = evaluated[f"{pair}/{name}"]
    # Both round in float32, in another order: 5e-5 was the largest seen, at a pixel of nearly
    # equal colors, where the error grows like a root. The mean evens that out.
    np.testing.assert_allclose(map_of(*PAIRS[pair]), expected, rtol=0, atol=5e-4)
    assert mean_of(*PAIRS[pair]) == pytest.approx(expected.mean(dtype=np.float64), abs=1e-5)
    # flip-evaluator's mean is summed in float32.
    assert mean_of(*PAIRS[pair]) == pytest.approx(evaluated[f"{pair}/{name}/mean"], abs=1e-4)


@pytest.mark.parametrize("pair", PAIRS)
def test_ssim_agrees_with_scikit_image(pair):
    structural_similarity = pytest.importorskip("skimage.metrics").structural_similarity
    image, reference = (image.astype(np.float64) for image in PAIRS[pair])
    mean, full = structural_similarity(
        encoded(image),
        encoded(reference),
        channel_axis=2,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        data_range=1,
        full=True,
    )
    # Both in float64; a variance of rounding errors is divided by no less than k2^2 = 9e-4.
    assert metrics.ssim(image, reference) == pytest.approx(mean, abs=1e-11)
    np.testing.assert_allclose(metrics.ssim_map(image, reference), full.mean(2), atol=1e-11)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("pair", PAIRS)
def test_errors_of_pixels_agree_with_numpy(pair, dtype):
    image, reference = (image.astype(dtype) for image in PAIRS[pair])
    difference = image.astype(np.float64) - reference.astype(np.float64)
    square, magnitude = difference**2, np.abs(difference)
    with np.errstate(divide="ignore"):  # a pixel that is equal has infinitely many decibels
        expected = {
            "mse": (square.mean(), square.mean(2)),
            "rmse": (np.sqrt(square.mean()), np.sqrt(square.mean(2))),
            "mae": (magnitude.mean(), magnitude.mean(2)),
            "psnr": (-10 * np.log10(square.mean()), -10 * np.log10(square.mean(2))),
        }
    last_bits = 1e-6 if dtype == np.float32 else 1e-12  # of the map; the mean is a double
    for name, (mean, by_pixel) in expected.items():
        mean_of, map_of = metric(name)
        assert mean_of(image, reference) == pytest.approx(mean, rel=1e-12)
        np.testing.assert_allclose(map_of(image, reference), by_pixel, rtol=last_bits)


# -- What holds of any images -----------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_bits_are_the_same_for_any_number_of_threads(name):
    mean_of, map_of = metric(name)
    for image, reference in PAIRS.values():
        one, one_map = (f(image, reference, threads=1) for f in (mean_of, map_of))
        for threads in (2, 4, 1000):
            assert mean_of(image, reference, threads=threads) == one
            np.testing.assert_array_equal(map_of(image, reference, threads=threads), one_map)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", NAMES)
def test_equal_images_have_no_error(name, dtype):
    mean_of, map_of = metric(name)
    for _, image in PAIRS.values():
        image = image.astype(dtype)
        assert mean_of(image, image) == EQUAL.get(name, 0.0)
        np.testing.assert_array_equal(map_of(image, image), EQUAL.get(name, 0.0))


@pytest.mark.parametrize("name", SYMMETRIC)
def test_all_but_hdr_flip_are_symmetric(name):
    mean_of, map_of = metric(name)
    for image, reference in PAIRS.values():
        assert mean_of(image, reference) == mean_of(reference, image)
        np.testing.assert_array_equal(map_of(image, reference), map_of(reference, image))


@pytest.mark.parametrize("name", ["flip", "hdr_flip"])
def test_flip_stays_within_its_range(name):
    for pair in PAIRS.values():
        errors = metric(name)[1](*pair)
        assert errors.min() >= 0
        assert errors.max() <= 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", NAMES)
def test_maps_pool_to_the_error(name, dtype):
    image, reference = (image.astype(dtype) for image in PAIRS["unlike"])
    mean_of, map_of = metric(name)
    errors = map_of(image, reference)
    assert errors.shape == (HEIGHT, WIDTH)
    assert errors.dtype == dtype
    pooled = {
        "rmse": lambda e: np.sqrt((e**2).mean()),
        "psnr": lambda e: -10 * np.log10((10 ** (-e / 10)).mean()),
        "ssim": lambda e: e[5:-5, 5:-5].mean(),
    }.get(name, np.mean)(errors.astype(np.float64))
    assert mean_of(image, reference) == pytest.approx(pooled, rel=1e-6)  # a map of float32


@pytest.mark.parametrize("name", NAMES)
def test_alpha_is_ignored_even_where_it_is_nan(name):
    image, reference = PAIRS["unlike"]
    alpha = np.full((HEIGHT, WIDTH, 1), np.nan, np.float32)
    with_alpha = np.concatenate([image, alpha], axis=2)
    mean_of, _ = metric(name)
    assert mean_of(with_alpha, reference) == mean_of(image, reference)
    assert mean_of(image, np.concatenate([reference, 1 - alpha], 2)) == mean_of(image, reference)


@pytest.mark.parametrize("name", NAMES)
def test_layout_and_type_of_arrays_do_not_matter(name):
    mean_of, _ = metric(name)
    # Halves, so that every type holds the same numbers.
    image, reference = (image.astype(np.float16) for image in PAIRS["noisy"])
    expected = mean_of(image.astype(np.float32), reference.astype(np.float32))
    wide = np.repeat(np.repeat(image.astype(np.float32), 2, 0), 3, 1)[::2, ::3]
    read_only = image.astype(np.float32)
    read_only.flags.writeable = False
    for same in (
        image,
        wide,
        np.asfortranarray(image, np.float32),
        np.ascontiguousarray(image[::-1], np.float32)[::-1],
        read_only,
        image.astype(">f4"),
        image.astype(np.float32).tolist(),
    ):
        error = mean_of(same, reference.astype(np.float32))
        # A list becomes float64; only FLIP's maps know the difference, and pool the same floats.
        assert error == pytest.approx(expected, rel=1e-14)
    assert mean_of(image.astype(np.longdouble), reference) == pytest.approx(expected, rel=1e-14)


def test_what_equals_far_around_has_no_flip_error():
    image, reference = PAIRS["noisy"][1].copy(), PAIRS["noisy"][1]
    image[30:32, 50:53] = 1
    for map_of in (metrics.flip_map, metrics.hdr_flip_map):
        errors = map_of(image, reference)
        assert errors[30:32, 50:53].min() > 0
        outside = np.ones(errors.shape, bool)
        outside[20:42, 40:63] = False  # the widest filter reaches 10 pixels
        np.testing.assert_array_equal(errors[outside], 0)


@pytest.mark.parametrize(("name", "reach"), [("ssim", 5), ("flip", 10), ("hdr_flip", 10)])
def test_a_pixel_that_differs_is_seen_as_far_as_filters_reach(name, reach):
    """And no row farther, whichever blocks of pixels these are in."""
    reference = waves(9, 150, 40) * 0.5
    for y in (63, 64, 75):
        image = reference.copy()
        image[y, 20] = 1
        found = metric(name)[1](image, reference) != EQUAL.get(name, 0.0)
        rows = np.flatnonzero(found.any(axis=1))
        assert (rows[0], rows[-1]) == (y - reach, y + reach)
        assert found.any(axis=1).sum() == 2 * reach + 1


def test_flip_and_ssim_see_what_a_display_shows():
    image, reference = PAIRS["fireflies"]
    shown = [np.clip(image, 0, 1) for image in (image, reference)]
    for name in ("flip", "ssim"):
        assert metric(name)[0](image, reference) == metric(name)[0](*shown)
    assert metrics.flip(-image, 0 * image) == 0
    assert metrics.flip(image + 1, 0 * image + 1) == 0


def test_flip_is_greatest_between_green_and_blue():
    # 1 by definition; its rounding error is that of a power.
    assert metrics.flip(*PAIRS["green and blue"]) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("stops", [-10, -3, 7, 60])
def test_hdr_flip_does_not_depend_on_exposure(stops):
    image, reference = (image.astype(np.float64) for image in PAIRS["bright, unlike"])
    scaled = metrics.hdr_flip(image * 2.0**stops, reference * 2.0**stops)
    # Floats differ in the last bit of exp2 alone.
    assert scaled == pytest.approx(metrics.hdr_flip(image, reference), abs=1e-6)


def test_exposures_are_of_the_upper_of_two_medians():
    """A reference of 4096 pixels, half dark and half bright: two more bright ones change nothing,
    and two more dark ones do."""
    rng = np.random.default_rng(4)
    bright = rng.random((64, 64)) < 0.5
    corner = (slice(48, 64), slice(48, 64))  # out of sight of the upper left
    bright[corner] = False
    order = np.flatnonzero(~bright[corner].ravel())
    missing = 2048 - int(bright.sum())
    within = bright[corner].copy()
    within.ravel()[order[:missing]] = True
    assert 0 < missing < 200

    def seen(more):
        held = bright.copy()
        ours = within.copy()
        if more:
            changed = order[missing : missing + more] if more > 0 else order[:-more]
            ours.ravel()[changed] = more > 0
        held[corner] = ours
        assert held.sum() == 2048 + more
        reference = np.where(held, 4.0, 0.25)[..., None] * np.ones(3)
        image = reference * np.where(rng_of_errors < 0.5, 1.25, 1)[..., None]
        return metrics.hdr_flip_map(image, reference)[:24, :24]

    rng_of_errors = np.random.default_rng(5).random((64, 64))
    even, brighter, darker = seen(0), seen(2), seen(-2)
    np.testing.assert_allclose(even, brighter, atol=1e-5)
    assert np.abs(even - darker).max() > 0.01


def test_hdr_flip_of_a_black_reference_is_that_of_a_nearly_black_one():
    # Exposures come from luminances of at least 2^-23; below that a reference is black.
    image = PAIRS["unlike"][0]
    black = np.zeros_like(image)
    nearly = np.full_like(image, 1e-12)
    assert metrics.hdr_flip(black, black) == 0
    assert metrics.hdr_flip(image, nearly) == pytest.approx(
        metrics.hdr_flip(image, black), abs=1e-3
    )
    assert metrics.hdr_flip(image, black) > 0.5
    assert metrics.hdr_flip(image * np.float32(1e-12), black) < 1e-3


def test_hdr_flip_takes_negative_radiance_as_black():
    image, reference = PAIRS["mostly black"]
    below = np.where(reference == 0, np.float32(-50), reference)
    assert metrics.hdr_flip(image, below) == metrics.hdr_flip(image, reference)


@pytest.mark.parametrize(
    "value", [0.0, -1.0, 5e-324, 1e-310, 1e-45, 1e-38, 1.0, 3e38, 1e300, np.finfo(float).max]
)
@pytest.mark.parametrize("name", NAMES)
def test_extreme_values_never_give_nan(name, value):
    image, reference = (waves(1, 12, 17), waves(2, 12, 17))
    reference[3, 4] = value
    for pair in ((image, reference), (reference, image), (image * 0 + value, reference)):
        assert not np.isnan(metric(name)[0](*pair))
        assert not np.isnan(metric(name)[1](*pair)).any()


def test_errors_has_every_error():
    pair = PAIRS["noisy"]
    assert metrics.errors(*pair) == {name: metric(name)[0](*pair) for name in NAMES}


def test_known_errors():
    image, reference = np.full((11, 30, 3), 0.6), np.full((11, 30, 3), 0.5)
    found = metrics.errors(image, reference)
    assert found["mse"] == pytest.approx(0.01)
    assert found["rmse"] == pytest.approx(0.1)
    assert found["mae"] == pytest.approx(0.1)
    assert found["psnr"] == pytest.approx(20)


# -- What is refused --------------------------------------------------------------------------

GOOD = np.full((12, 13, 3), 0.5, np.float32)


@pytest.mark.parametrize(
    ("bad", "error", "message"),
    [
        (np.zeros((12, 14, 3)), ValueError, "12 x 1[34].*12 x 1[34].*same size"),
        (np.zeros((12, 13)), ValueError, r"\(height, width, 3 or 4\), got \(12, 13\)"),
        (np.zeros((1, 12, 13, 3)), ValueError, "height, width, 3 or 4"),
        (np.zeros((12, 13, 2)), ValueError, r"got \(12, 13, 2\)"),
        (np.zeros((12, 13, 5)), ValueError, r"got \(12, 13, 5\)"),
        (np.zeros((10, 13, 3)), ValueError, "at least 11 pixels a side, got 10 x 13"),
        (np.zeros((12, 10, 3)), ValueError, "at least 11 pixels a side, got 12 x 10"),
        (np.zeros((0, 13, 3)), ValueError, "at least 11 pixels"),
        (np.zeros(()), ValueError, r"got \(\)"),
        (np.zeros((12, 13, 3), np.uint8), TypeError, "expected linear floats, got uint8"),
        (np.zeros((12, 13, 3), bool), TypeError, "got bool"),
        (np.zeros((12, 13, 3), complex), TypeError, "got complex128"),
        (np.zeros((12, 13, 3), object), TypeError, "got object"),
        (np.zeros((12, 13, 3), "U3"), TypeError, "got <U3"),
        (np.ma.zeros((12, 13, 3)), TypeError, "mask"),
        ("image.exr", TypeError, "expected an array of floats"),
        (None, TypeError, "expected an array of floats"),
        ([[1.0], [1.0, 2.0]], TypeError, "expected an array"),
    ],
)
@pytest.mark.parametrize("which", ["image", "reference"])
@pytest.mark.parametrize("function", [metrics.mse, metrics.hdr_flip_map, metrics.errors])
def test_bad_images_are_refused_by_name(function, which, bad, error, message):
    pair = {"image": GOOD, "reference": GOOD, which: bad}
    with pytest.raises(error, match=message) as refused:
        function(**pair)
    assert which in str(refused.value)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_the_first_value_that_is_not_finite_is_named(dtype, bad):
    image = GOOD.astype(dtype)
    image[4, 5, 2] = image[7, 0, 0] = bad
    with pytest.raises(ValueError, match=rf"image\[4, 5, 2\]: expected a finite number, got {bad}"):
        metrics.mse(image, GOOD)
    with pytest.raises(ValueError, match=r"reference\[4, 5, 2\]"):
        metrics.flip_map(GOOD, image)


@pytest.mark.parametrize(
    ("threads", "error"), [(0, ValueError), (-1, ValueError), (1.5, TypeError)]
)
def test_threads_are_a_count(threads, error):
    for function in (metrics.mse, metrics.flip_map, metrics.errors):
        with pytest.raises(error, match="threads"):
            function(GOOD, GOOD, threads=threads)


shapes = arrays.array_shapes(min_dims=0, max_dims=4, max_side=14)
dtypes = st.one_of(
    arrays.boolean_dtypes(),
    arrays.integer_dtypes(),
    arrays.floating_dtypes(),
    arrays.complex_number_dtypes(),
)
anything = dtypes.flatmap(lambda dtype: arrays.arrays(dtype, shapes))
images = st.tuples(st.integers(11, 14), st.integers(11, 14), st.integers(3, 4)).flatmap(
    lambda shape: arrays.floating_dtypes().flatmap(lambda dtype: arrays.arrays(dtype, shape))
)


@settings(max_examples=60)
@given(image=st.one_of(anything, images), reference=st.one_of(anything, images))
def test_any_arrays_give_an_error_or_a_number(image, reference):
    try:
        found = metrics.errors(image, reference)
    except (TypeError, ValueError) as refused:
        assert "image" in str(refused) or "reference" in str(refused)
    else:
        assert not any(np.isnan(error) for error in found.values())


@pytest.mark.skipif(
    threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"),
    reason="needs signals",
)
def test_a_signal_stops_a_long_call():
    class Stop(Exception):
        pass

    def stop(*_):
        raise Stop

    random = np.random.default_rng(0)
    image = np.exp(random.uniform(-80, 80, (700, 700, 3))).astype(np.float32)  # 140 exposures
    before = signal.signal(signal.SIGALRM, stop)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(Stop):
            metrics.hdr_flip(image, image[::-1])
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("kept", [0, 1 << 18, metrics.KEPT_BYTES])
def test_a_reference_gives_every_image_the_same_bits_as_a_pair(monkeypatch, kept):
    """Whatever it keeps: nothing, what one block needs, or all; whoever was compared before."""
    monkeypatch.setattr(metrics, "KEPT_BYTES", kept)
    base, rng = waves(5, 140, 150) * 3, np.random.default_rng(3)
    spot = base.copy()
    spot[70:72, 66] *= 1.5  # some rows of some blocks
    images = [spot, base * 1.01, base, rng.random(base.shape).astype(np.float32), spot]
    reference = metrics.Reference(base)
    assert reference.shape == base.shape[:2]
    for image, threads in zip(images, (1, 3, 2, 1, 2), strict=True):
        expected = metrics.errors(image, base)
        assert reference.errors(image, threads=threads) == expected
        for name in NAMES:
            assert reference.errors(image, [name]) == {name: expected[name]}
            assert metric(name)[0](image, base) == expected[name]


def test_a_reference_goes_to_other_processes_and_takes_one_name():
    base = waves(6, 20, 30)
    reference = pickle.loads(pickle.dumps(metrics.Reference(base)))
    assert repr(reference) == "Reference(20x30)"
    assert reference.errors(base + 0.1, "flip") == {"flip": metrics.flip(base + 0.1, base)}


def test_threads_may_share_a_reference():
    base = waves(6, 130, 70)
    images = [base + 0.01 * i for i in range(8)]
    expected = [metrics.errors(image, base) for image in images]
    reference = metrics.Reference(base)
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(reference.errors, images)) == expected


def test_a_reference_says_what_does_not_fit():
    reference = metrics.Reference(np.zeros((12, 13, 3)))
    for wrong in (metrics.flip, metrics.ssim_map, metrics.errors):
        with pytest.raises(TypeError, match=r"reference: .*a Reference has `errors` of its own"):
            wrong(np.zeros((12, 13, 3)), reference)
    with pytest.raises(ValueError, match=r"image is 13 x 12 .* and reference 12 x 13"):
        reference.errors(np.zeros((13, 12, 3)))
    with pytest.raises(ValueError, match=r"names: expected some of mse, .*, got 'sharpness'"):
        reference.errors(np.zeros((12, 13, 3)), ["mse", "sharpness"])
    with pytest.raises(ValueError, match=r"image\[1, 2, 0\]: expected a finite number, got nan"):
        broken = np.zeros((12, 13, 4))
        broken[1, 2, 0] = np.nan
        metrics.Reference(broken)


def test_blocks_do_not_show():
    """An image of several blocks, and one of their corners by itself: the same errors where no
    filter reaches beyond."""
    image, reference = waves(7, 150, 160), waves(8, 150, 160)
    part = (slice(40, 110), slice(45, 120))
    for name, reach in (("flip", 10), ("ssim", 5)):
        inner = (slice(reach, -reach),) * 2
        whole, alone = (metric(name)[1](image[at], reference[at]) for at in ((), part))
        np.testing.assert_array_equal(whole[part][inner], alone[inner])


def test_flip_and_ssim_are_the_same_bits_for_any_instruction_set():
    rng = np.random.default_rng(11)
    image, reference = rng.exponential(1.0, (2, 13, 37, 3)).astype(np.float32)  # no whole lanes
    before = _core.build_info()["instruction set in use"]
    maps = {}
    try:
        for one in _core.build_info()["instruction sets"].split(", "):
            _core.use_instruction_set(one)
            maps[one] = [metric(name)[1](image, reference) for name in ("ssim", "flip", "hdr_flip")]
    finally:
        _core.use_instruction_set(before)
    for found in maps.values():
        np.testing.assert_array_equal(found, maps["base"])
