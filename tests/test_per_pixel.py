"""A technique for every pixel: how far off it is, what it takes, and what it says of itself."""

import dataclasses
import math

import gpu
import numpy as np
import pytest
from small import some_fragments

import moit
from moit import PerPixel, _core
from moit.comparing.choice import _shares, _told
from moit.gpu_costs.predicting import on_gpu
from moit.per_pixel import error_chances
from moit.per_pixel.plan import CANDIDATES, SORTED_BITS, Plan
from moit.per_pixel.selection import Selection, brightness

MAX_ERRORS = [2 / 255, 8 / 255]
SCENES = ["mixed", "teapots", "cloud", "hair", "panes"]
# What float32 images are off by from the exact one in float64, however they are made.
ROUNDING = 1e-5


def hard(seed: int, dtype="float32", most=24) -> moit.Fragments:
    """Few and many fragments, ties, thin and opaque ones, bright colours, empty pixels."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most, 400) * (rng.random(400) < 0.9)
    n = int(counts.sum())
    alpha = rng.choice([0, 1e-6, 0.03, 0.5, 0.999, 1], n, p=[0.05, 0.1, 0.4, 0.3, 0.1, 0.05])
    depth = np.exp(rng.uniform(0, 5, n))
    depth[::3] = rng.choice(np.geomspace(1, 100, 12), len(depth[::3]))
    return moit.Fragments(
        np.append(0, np.cumsum(counts)),
        depth,
        alpha,
        rng.uniform(-0.5, 3, (n, 3)) * rng.choice([0.01, 0.3, 1], (n, 1)),
        shape=(20, 20),
        dtype=dtype,
    )


def tinted(f: moit.Fragments, seed: int = 0) -> moit.Fragments:
    passed = np.random.default_rng(seed).choice([0, 0.2, 0.9, 1], (len(f), 3))
    arrays = (f.offsets, f.depth, f.alpha, f.color)
    return moit.Fragments(*arrays, transmission=passed, shape=f.shape, dtype=f.dtype)


def off(image, f, **options):
    """(height, width): the largest of the channels' differences from the exact image."""
    exact = moit.composite(f, "sorted", dtype=np.float64, **options)
    return np.abs(image - exact).max(axis=2)


def counts_of(f: moit.Fragments):
    """(P,) fragments in front of each pixel's opaque one."""
    kept = _core.surviving(f, True, 1)[0]
    return np.diff(np.append(0, np.cumsum(kept))[f.offsets])


# ---- What it must reach, on seeds and sizes that nothing was tuned on


@pytest.mark.parametrize("max_error", MAX_ERRORS)
@pytest.mark.parametrize("name", SCENES)
def test_of_pixels_that_were_not_tried_99_9_percent_are_good_enough(name, max_error):
    f = moit.scenes.load(name, size=(432, 243), seed=77)
    choice = moit.choose(f, PerPixel(max_error, sample=14000))
    untried = ~choice.tried & (choice.map >= 0)
    assert untried.sum() > 1000 and choice.tried.sum() == 14000
    assert (choice.error[untried] > max_error).mean() <= 1e-3
    assert choice.error[choice.tried].max() <= max_error
    sure = ("sorted", "depth-peeling4", "weighted-sum")
    used = {str(choice.techniques[i]) for i in np.unique(choice.map[untried])}
    assert used - set(sure), "something was proved"


@pytest.mark.parametrize("max_error", MAX_ERRORS)
@pytest.mark.parametrize("name", SCENES)
def test_with_a_certificate_every_pixel_is_good_enough(name, max_error):
    f = moit.scenes.load(name, size=(160, 90), seed=78)
    choice = moit.choose(f, PerPixel(max_error, certify=True))
    assert choice.error.max() <= max_error
    assert choice.predicted["worst"] <= max_error and choice.beyond == 0
    for share, most in choice.predicted.items():
        assert choice.measured[share] <= most + ROUNDING
    assert choice.predicted["p99"] < max_error  # what was proved, and not what was asked


@pytest.mark.parametrize("max_error", MAX_ERRORS)
@pytest.mark.parametrize("name", ["mixed", "panes", "teapots"])
def test_bits_are_a_quarter_below_the_cheapest_single_technique_that_is_as_good(name, max_error):
    f = moit.scenes.load(name, size=(256, 144), seed=79)
    choice = moit.choose(f, PerPixel(max_error))
    bits = {"sorted": SORTED_BITS * counts_of(f).mean()}
    for one in moit.techniques():
        if one.bits_per_pixel is not None:
            good = off(moit.composite(f, one), f) <= max_error
            if good.mean() >= 0.999:
                bits[str(one)] = one.bits_per_pixel
    assert choice.bits_per_pixel <= 0.75 * min(bits.values())


# ---- What it takes, and what it says


def test_bits_are_the_candidates_and_96_for_a_sorted_fragment():
    f = hard(1)
    for technique in (PerPixel(0.02), PerPixel(0.02, certify=True), PerPixel(1e-9, ("power4",))):
        choice = moit.choose(f, technique)
        counts, chosen = counts_of(f), choice.map.ravel()
        assert ((chosen == -1) == (counts == 0)).all()
        bits = np.array([t.bits_per_pixel or 0 for t in choice.techniques])[chosen]
        bits = np.where(chosen == len(choice.techniques) - 1, SORTED_BITS * counts, bits)
        bits[chosen == -1] = 0
        assert choice.bits_per_pixel == pytest.approx(bits.mean())
        *rows, every = choice.rows
        assert every["share"] == pytest.approx(sum(row["share"] for row in rows)) == 1
        assert every["bits"] == pytest.approx(sum(row["bits"] for row in rows))
        assert every["worst"] == choice.error.max()


def test_no_pixel_takes_more_bits_than_sorting_it():
    f = hard(2)
    for technique in (PerPixel(0.02), PerPixel(0.02, ("power8", "adaptive32"), sample=5)):
        choice = moit.choose(f, technique)
        counts = counts_of(f).reshape(f.shape)
        for index, one in enumerate(choice.techniques[:-1]):
            assert (SORTED_BITS * counts[choice.map == index] >= one.bits_per_pixel).all()


def test_each_pixel_is_what_its_technique_gives():
    f = hard(3)
    choice = moit.choose(f, PerPixel(0.05), background=(0.2, 0.3, 0.4))
    assert len(np.unique(choice.map)) > 4
    for index in np.unique(choice.map):
        here = choice.map == index
        one = "sorted" if index < 0 else choice.techniques[index]
        image = moit.composite(f, one, background=(0.2, 0.3, 0.4))
        np.testing.assert_array_equal(choice.image[here], image[here])
    assert (choice.image == moit.composite(f, PerPixel(0.05), background=(0.2, 0.3, 0.4))).all()


def test_a_larger_error_takes_fewer_bits():
    f = moit.scenes.load("mixed", size=(128, 72), seed=4)
    for certify in (False, True):
        bits = [
            moit.choose(f, PerPixel(e / 255, certify=certify)).bits_per_pixel for e in (1, 4, 16)
        ]
        assert bits[0] > bits[1] > bits[2]


def test_a_certificate_costs_bits():
    f = moit.scenes.load("mixed", size=(128, 72), seed=5)
    sure, likely = (moit.choose(f, PerPixel(8 / 255, certify=c)) for c in (True, False))
    assert likely.bits_per_pixel < sure.bits_per_pixel < SORTED_BITS * counts_of(f).mean()


def test_predictions_are_near_what_is_measured():
    f = moit.scenes.load("hair", size=(320, 180), seed=8)
    choice = moit.choose(f, PerPixel(8 / 255, sample=16000))
    for share in ("p99", "p999"):
        assert choice.measured[share] == pytest.approx(choice.predicted[share], rel=0.5)


def test_shares_of_errors_are_those_of_their_weight():
    even = np.random.default_rng(0).permutation(10000) / 10000
    found = _shares(even, np.ones(10000))
    assert found == {"p99": 0.9899, "p999": 0.9989, "worst": 0.9999}
    found = _shares(np.array([3.0, 1, 2, 9]), np.array([5.0, 980, 15, 0]))
    assert found == {"p99": 2, "p999": 3, "worst": 3}
    assert _shares(np.ones(3), np.zeros(3)) == {"p99": 0, "p999": 0, "worst": 0}


def test_measured_is_what_pixels_with_fragments_that_were_not_tried_are_off_by():
    power4, exact = moit.technique("power4"), moit.technique("sorted")
    of_pixel = np.array([[0, 0, 1], [1, 0, 1]]).ravel()
    bits = np.array([160.0, 160, 96, 192, 160, 0])
    plan = Plan(
        (power4, exact),
        of_pixel,
        bits,
        np.array([9, 9, 1, 2, 9, 0]),
        np.array([0, 2]),
        np.array([0.25, 0.5]),
        np.array([1.0, 1.0]),
    )
    error = np.array([[0.75, 0.25, 0.0], [0.0, 0.5, 1.0]])
    choice = _told(PerPixel(0.3), plan, np.zeros((2, 3, 4)), error)
    assert choice.map.tolist() == [[0, 0, 1], [1, 0, -1]]
    assert choice.tried.tolist() == [[True, False, True], [False, False, False]]
    assert choice.measured == {"p99": 0.5, "p999": 0.5, "worst": 0.5}
    assert choice.beyond == pytest.approx(1 / 3)
    assert choice.predicted == {"p99": 0.5, "p999": 0.5, "worst": 0.5}
    assert choice.bits_per_pixel == bits.mean()
    told = [tuple(row.values()) for row in choice.rows]
    assert [row[:4] for row in told] == [
        ("power4", 0.5, 160, 80),
        ("sorted", pytest.approx(1 / 3), 144, 48),
        ("no fragments", pytest.approx(1 / 6), 0, 0),
        ("all", 1, 128, 128),
    ]
    assert [row[-1] for row in told] == [0.75, 0, 1, 1]


def test_what_is_said_of_a_choice_is_of_the_pixels_that_it_is_said_of():
    f = moit.scenes.load("cloud", size=(120, 68), seed=2)
    technique = PerPixel(2 / 255, sample=700)
    choice = moit.choose(f, technique)
    filled = choice.map >= 0
    untried = filled & ~choice.tried
    assert untried.sum() > choice.tried.sum() == 700
    off = choice.error[untried]
    assert choice.measured["worst"] == off.max()
    assert choice.beyond == (off > technique.max_error).mean()
    assert choice.technique == technique
    for row in choice.rows[:-1]:
        here = ~filled
        if row["technique"] != "no fragments":
            (index,) = (i for i, t in enumerate(choice.techniques) if str(t) == row["technique"])
            here = choice.map == index
        assert row["share"] == here.mean() and row["worst"] == choice.error[here].max()
        bits = choice.techniques[index].bits_per_pixel if here[filled].any() else 0
        if bits is not None:
            assert row["bits_per_pixel"] == pytest.approx(bits)
            assert row["bits"] == pytest.approx(bits * here.mean())
    exact = moit.composite(f, "sorted", dtype="f8")
    assert (choice.error == np.abs(choice.image - exact).max(2)).all()
    found, known = choice.gpu_ms("rx6800"), []
    for row in choice.rows[:-1]:
        if row["technique"] != "no fragments":
            one, covered = moit.technique(row["technique"]), round(row["share"] * choice.map.size)
            ms = on_gpu("rx6800", None).milliseconds(
                one, row["fragments"], choice.map.size, covered
            )
            assert found[row["technique"]] == ms
            known.append(ms)
    assert "sorted" in found and found["sorted"] is None is found["all"]
    told = [row for row in choice.rows[:-1] if found.get(row["technique"]) is not None]
    rest = dataclasses.replace(choice, rows=tuple(told)).gpu_ms("rx6800")
    assert len(told) > 1 and rest["all"] == sum(ms for ms in known if ms is not None)


def test_a_choice_shows_itself():
    choice = moit.choose(some_fragments(), "per-pixel")
    for row in choice.rows:
        assert row["technique"] in str(choice) and row["technique"] in choice._repr_html_()
    assert "predicted" in str(choice) and "measured" in str(choice)
    sure = moit.choose(some_fragments(), PerPixel(certify=True))
    assert "at most" in str(sure) and "bits a pixel" in repr(sure)


# ---- The same for everybody


@pytest.mark.parametrize("certify", [False, True])
def test_threads_and_order_of_questions_change_no_bit(certify):
    f = moit.scenes.load("mixed", size=(128, 72), seed=6)
    technique = PerPixel(4 / 255, certify=certify, sample=2000)
    first = moit.composite(f, technique, threads=1)
    for threads in (2, 3):
        np.testing.assert_array_equal(moit.composite(f, technique, threads=threads), first)


def test_the_seed_says_which_pixels_are_tried():
    f = moit.scenes.load("cloud", size=(128, 72), seed=6)
    one, same, other = (moit.choose(f, PerPixel(sample=1000, seed=s)) for s in (1, 1, 2))
    np.testing.assert_array_equal(one.map, same.map)
    np.testing.assert_array_equal(one.tried, same.tried)
    assert (one.tried != other.tried).any()


# ---- All questions


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("certify", [False, True])
def test_all_questions_have_answers_of_the_usual_shape(dtype, certify):
    f = hard(4, dtype)
    technique = PerPixel(0.02, certify=certify)
    for g in (f, tinted(f)):
        assert moit.composite(g, technique).shape == (20, 20, 4)
        T = moit.transmittance(g, technique)
        curve = moit.transmittance(g, technique, [0.5, 3, 200])
        lower, upper = moit.bounds(g, technique)
        assert T.shape == lower.shape == (len(g),) and curve.shape == (20, 20, 3)
        exact = moit.transmittance(g, "sorted", dtype=np.float64)
        assert (lower <= exact + ROUNDING).all() and (exact <= upper + ROUNDING).all()
        low, high = moit.bounds(g, technique, [0.5, 3, 200])
        truth = moit.transmittance(g, "sorted", [0.5, 3, 200], dtype=np.float64)
        assert (low <= truth + ROUNDING).all() and (truth <= high + ROUNDING).all()
        total = moit.total_transmittance(g, technique)
        assert np.abs(total - moit.total_transmittance(g, "sorted")).max() <= 0.02 + ROUNDING
        for array in (T, curve, total):
            assert array.dtype == dtype and np.isfinite(array).all()


@pytest.mark.parametrize("certify", [False, True])
def test_backgrounds_up_to_white_change_no_choice(certify):
    f = hard(5, "float64")
    technique = PerPixel(0.02, certify=certify)
    for g in (f, tinted(f)):
        background = np.random.default_rng(1).random((20, 20, 3))
        total = moit.total_transmittance(g, technique).reshape(20, 20, -1)
        image = moit.composite(g, technique, background=background)[..., :3]
        alone = moit.composite(g, technique)[..., :3]
        np.testing.assert_allclose(image, alone + total * background, rtol=0, atol=1e-12)


@pytest.mark.parametrize("certify", [False, True])
def test_what_is_behind_may_be_as_bright_as_a_sky(certify):
    f = hard(5)
    for g in (f, tinted(f)):
        background = np.random.default_rng(1).choice([-3, 0, 1, 200], (20, 20, 3))
        image = moit.composite(g, PerPixel(0.02, certify=certify), background=background)
        assert off(image, g, background=background).max() <= 0.02
        for level in (-50, 50):
            background = np.full(3, level)
            image = moit.composite(g, PerPixel(0.02, certify=certify), background=background)
            assert off(image, g, background=background).max() <= 0.02


def test_backgrounds_count_from_white_and_on_both_sides_of_black():
    levels = (
        [0, 0, 0],
        [0.5, 0, -0.5],
        [-3, 0.5, 2],
        np.full((2, 2, 3), -7.0),
        np.zeros((0, 0, 3)),
    )
    assert [brightness(np.asarray(one, float)) for one in levels] == [1, 1, 3, 7, 1]
    # an error grows evenly with what is behind: of colours, it is greatest at either end
    assert Selection(tinted(hard(0)), True, 1).levels(7) == (-7, 7)
    assert Selection(hard(0), True, 1).levels(7) == (0,)


def test_a_gpu_composites_what_the_cpu_chose():
    device = gpu.device()
    f = hard(10)
    for technique in (PerPixel(0.02), PerPixel(0.02, certify=True)):
        image = moit.composite(f, technique, device=device, exact=True)
        # passes on llvmpipe are the core's texts: a sum may end in another order
        np.testing.assert_allclose(image, moit.composite(f, technique), rtol=0, atol=1e-6)
        with pytest.raises(moit.GpuError, match="bounds"):
            moit.bounds(f, technique, device=device)


def test_a_crop_is_chosen_for_by_itself_and_is_good_enough():
    f = moit.scenes.load("mixed", size=(96, 54), seed=2)
    window = f[10:40, 20:61]
    assert off(moit.composite(window, PerPixel(0.02)), window).max() <= 0.02
    assert off(moit.composite(f[3, 5], PerPixel(0.02)), f[3, 5]).max() <= 0.02


def test_images_of_nothing():
    for f in (
        moit.Fragments([0], [], [], np.zeros((0, 3))),
        moit.Fragments([0, 0, 0], [], [], np.zeros((0, 3))),
        moit.Fragments([0, 1], [1.0], [1.0], np.ones((1, 3))),
    ):
        for technique in (PerPixel(), PerPixel(certify=True)):
            image = moit.composite(f, technique, background=(1, 2, 3))
            np.testing.assert_array_equal(image, moit.composite(f, "sorted", background=(1, 2, 3)))
            assert moit.choose(f, technique).bits_per_pixel == 0
            moit.transmittance(f, technique, [1.0])


def test_depth_that_is_not_positive_is_warped_linearly():
    f = hard(6)
    shifted = moit.Fragments(f.offsets, f.depth - 50, f.alpha, f.color, shape=f.shape)
    for technique in (PerPixel(0.02), PerPixel(0.02, certify=True)):
        assert off(moit.composite(shifted, technique), shifted).max() <= 0.02


# ---- Names and bad input


def test_names_read_back():
    for technique in (
        PerPixel(),
        PerPixel(0.01),
        PerPixel(0.01, ["power4", moit.TrigonometricMoments(2), "power4"], True, sample=7, seed=3),
    ):
        assert moit.technique(str(technique)) == technique
        assert hash(technique) == hash(moit.technique(str(technique)))
    assert str(PerPixel()) == "per-pixel"
    assert PerPixel(0.1, ("power4", "sorted", "power4")).techniques == ("power4",)


def test_all_default_candidates_can_be_named():
    assert PerPixel(0.1, CANDIDATES).techniques == CANDIDATES


@pytest.mark.parametrize(
    "options, error, words",
    [
        ({"max_error": 0}, ValueError, "max_error: expected a positive number"),
        ({"max_error": "x"}, TypeError, "max_error: expected a number"),
        ({"max_error": math.nan}, ValueError, "max_error"),
        ({"techniques": "power4"}, TypeError, "several names"),
        ({"techniques": 3}, TypeError, "several names"),
        ({"techniques": ["power5"]}, ValueError, "there is no 'power5'"),
        ({"techniques": ["moment-transparency-lr8"]}, ValueError, "neighbours"),
        ({"techniques": ["stochastic8"]}, ValueError, "random"),
        ({"techniques": ["deep-shadow"]}, ValueError, "bits that are not known"),
        ({"techniques": ["per-pixel"]}, ValueError, "no candidate"),
        ({"techniques": [moit.WeightedBlended(lambda z, a, c: a)]}, ValueError, "no name"),
        ({"certify": 1}, TypeError, "certify"),
        ({"sample": -1}, ValueError, "sample"),
        ({"seed": 0.5}, TypeError, "seed"),
    ],
)
def test_bad_options_say_what_was_needed(options, error, words):
    with pytest.raises(error, match=words):
        PerPixel(**options)


def test_bad_questions_say_what_was_needed():
    f = some_fragments()
    with pytest.raises(TypeError, match="expected a PerPixel, got power4"):
        moit.choose(f, "power4")
    with pytest.raises(moit.FragmentsError, match="color"):
        moit.choose(some_fragments(color=False))
    with pytest.raises(ValueError, match="background"):
        moit.choose(f, background=(1, 2))
    with pytest.raises(ValueError, match="transmission: per-pixel"):
        moit.composite(tinted(f), PerPixel(0.1, ("mlab4",)))
    shifted = moit.Fragments(f.offsets, f.depth - 50, f.alpha, f.color)
    with pytest.raises(moit.FragmentsError, match="log warp"):
        moit.composite(shifted, PerPixel(0.1, ("power4",)))


def test_pixels_can_be_taken_from_fragments():
    f = tinted(hard(7))
    pixels = np.array([7, 7, 399, 0, 21])
    offsets, *arrays = _core.take_pixels(f, pixels, 2)
    place = np.concatenate([np.arange(f.offsets[p], f.offsets[p + 1]) for p in pixels])
    np.testing.assert_array_equal(np.diff(offsets), f.counts[pixels])
    names = ("depth", "alpha", "color", "transmission")
    for array, name in zip(arrays, names, strict=True):
        np.testing.assert_array_equal(array, getattr(f, name)[place])
    for bad in (-1, 400):
        with pytest.raises(ValueError, match="indices of pixels"):
            _core.take_pixels(f, np.array([bad]), 1)


def test_facts_are_what_they_are_called():
    f = hard(8, "float64")
    facts = _core.pixel_facts(f, False, 2)
    for p in range(0, 400, 7):
        one = f[divmod(p, 20)]
        n, alpha, color = len(one), one.alpha, one.color
        if not n:
            assert not facts[p].any()
            continue
        weight = -np.log1p(-np.minimum(alpha, 1 - 0.5 / 256))
        share = weight / weight.sum() if weight.sum() else np.zeros(n)
        d, e = one.depth - share @ one.depth, color - share @ color
        deviation = np.sqrt(share @ d**2) or 1.0
        covered = 1 - np.prod(1 - alpha)
        expected = [n, weight.sum(), covered, max(alpha.sum() - covered, 0), alpha.max()]
        range_ = f.depth_range[1] - f.depth_range[0]
        expected += [np.sqrt(share @ d**2) / range_, share @ d**3 / deviation**3]
        expected += [share @ d**4 / deviation**4, np.ptp(color, axis=0).max()]
        expected += [np.sqrt((share @ e**2).max()), np.abs((share * d) @ e).max() / deviation]
        expected += [np.abs((share * d**2) @ e).max() / deviation**2, 0]
        if weight.sum():
            np.testing.assert_allclose(facts[p], expected, rtol=1e-6, atol=1e-9)


def test_candidates_are_found_to_be_frozen_dataclasses():
    with pytest.raises(dataclasses.FrozenInstanceError):
        PerPixel().max_error = 1


def test_cells_are_cut_right_behind_the_last_bin_and_never_into_small_ones():
    low = np.repeat([0, 5], 30)[:, None]
    target = np.repeat([0.0, 1.0], 30)[:, None]
    tree = error_chances._Tree(low, target, target, depth=1, least=20)
    assert tree.means[:, 0].tolist() == [0, 1]
    assert tree.at(np.array([[0], [5]])).tolist() == [0, 1]
    for rare in (1, 59):  # one cell would have a single pixel, the nearer or the farther
        place = np.repeat([0, 5], [rare, 60 - rare])[:, None]
        tree = error_chances._Tree(place, place / 5, place / 5, depth=1, least=20)
        assert not tree.cell.any()
