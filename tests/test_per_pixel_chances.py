"""The test behind a prediction for each pixel: chances, samples, and what is exact for sure."""

import math
from itertools import combinations

import numpy as np
import pytest
from small import some_fragments
from test_per_pixel import ROUNDING, counts_of, hard, off, tinted

import moit
from moit import PerPixel
from moit.per_pixel import error_chances
from moit.per_pixel.error_chances import chance_of_so_few, least_price
from moit.per_pixel.plan import CANDIDATES, SORTED_BITS, candidates


def test_the_chance_of_so_few_is_that_of_drawing_them():
    total, bad, tested = 9, 4, 5
    draws = list(combinations(range(total), tested))
    for found in range(tested + 1):
        share = sum(sum(i < bad for i in draw) <= found for draw in draws) / len(draws)
        assert chance_of_so_few(found, tested, total - tested, bad) == pytest.approx(share)
    assert chance_of_so_few(0, 5, 3, 9) == 0  # there are not that many


def test_a_test_that_is_too_small_proves_nothing():
    # One in a thousand of a million, by 1000 pixels: not with 99 % certainty.
    assert least_price(lambda price: 0, 1000, 10**6, 1000, 0.01) is None
    assert least_price(lambda price: 0, 5000, 10**6, 1000, 0.01) is not None


def test_one_more_than_allowed_would_be_found_out():
    # C(20, k) / C(40, k) that k bad ones are all among those that were not tested
    doubt = math.comb(20, 5) / math.comb(40, 5)
    assert least_price(lambda price: 0, 20, 20, 4, 1.001 * doubt) is not None
    assert least_price(lambda price: 0, 20, 20, 4, 0.999 * doubt) is None
    # of six bad ones at most one is found
    doubt = (math.comb(20, 6) + 20 * math.comb(20, 5)) / math.comb(40, 6)
    assert least_price(lambda price: 1, 20, 20, 4, 1.001 * doubt) is not None
    assert least_price(lambda price: 1, 20, 20, 4, 0.999 * doubt) is None


def test_chances_are_how_often_techniques_err_and_tell_pixels_apart():
    rng = np.random.default_rng(7)
    facts = rng.random((6000, 4))
    facts[:, 3] = rng.integers(0, 5, 6000)  # says nothing
    middle = np.exp(3 * (facts[:, 0] - 0.5) + 1.5 * (facts[:, 1] > facts[:, 2]) - 1)
    spread = np.stack([0.1 + 0.5 * facts[:, 2], np.full(6000, 0.3)], axis=1)
    error = 0.02 * middle[:, None] * np.exp(spread * rng.normal(size=(6000, 2)))
    known = error_chances.Chances(facts[:3000], error[:3000], 0.02, seed=0)
    bad = error[3000:] > 0.02
    chance = known.at(facts[3000:])
    for j in range(2):
        for low, high in ((0, 0.05), (0.05, 0.2), (0.2, 0.5), (0.5, 0.8), (0.8, 1.01)):
            here = (chance[:, j] >= low) & (chance[:, j] < high)
            # measured: .054 at most; a quarter of the steps is .25 off, a spread too great .076
            assert abs(bad[here, j].mean() - chance[here, j].mean()) < 0.065
        # of always saying the mean it would be .24
        assert ((chance[:, j] - bad[:, j]) ** 2).mean() < 0.09


def test_the_first_price_that_fails_ends_the_search():
    asked = []

    def failures(price):
        asked.append(price)
        return 0 if len(asked) != 5 else 4000

    assert least_price(failures, 5000, 10**6, 1000, 0.01) == asked[3]
    assert len(asked) == 5 and asked == sorted(asked, reverse=True)


def test_the_test_is_of_what_is_promised(monkeypatch):
    """Of pixels that nobody looked at one in a thousand, with 99.9 % certainty; pixels that taught
    are none of those that test."""
    asked = []

    def recorded(choose, tested, others, allowed, doubt):
        asked.append((tested, others, allowed, doubt, choose(0.0), choose(2.0**40)))

    monkeypatch.setattr(error_chances, "least_price", recorded)
    f = moit.scenes.load("cloud", size=(160, 90), seed=3)
    choice = moit.choose(f, PerPixel(2 / 255, sample=1600))
    ((tested, others, allowed, doubt, cheapest, dearest),) = asked
    unseen = int((counts_of(f) > 0).sum()) - 1600
    assert tested == 1600 - 600 and doubt == 0.001
    assert allowed == unseen // 1000 and others <= unseen
    assert cheapest > 100 and dearest <= 2
    # nothing was proved, and the rest is exact
    assert choice.beyond == 0 and choice.predicted["worst"] < ROUNDING


def test_claims_hold_more_often_than_doubt_allows():
    # Pixels of one kind, of which 1.2 in a thousand are bad: too many. Tests rarely say otherwise.
    rng, wrong = np.random.default_rng(0), 0
    for _ in range(400):
        bad = rng.permutation(30000) < 36
        tests, others = bad[:8000], bad[8000:]
        allowed = len(others) // 1000
        price = least_price(lambda price: int(tests.sum()), 8000, len(others), allowed, 0.01)  # noqa: B023
        wrong += price is not None and int(others.sum()) > allowed
    assert wrong / 400 <= 0.03  # 0.01, and what 400 draws may add to it


def test_a_small_sample_leaves_the_rest_to_what_is_exact():
    f = moit.scenes.load("cloud", size=(160, 90), seed=3)
    choice = moit.choose(f, PerPixel(2 / 255, sample=600))
    assert choice.beyond == 0 and choice.measured["worst"] < ROUNDING
    rest = choice.map[~choice.tried & (choice.map >= 0)]
    used = {str(choice.techniques[i]) for i in np.unique(rest)}
    assert used <= {"sorted", "depth-peeling4", "weighted-sum"}


def test_a_sample_of_nothing_is_as_good_as_exact():
    f = some_fragments(most=9)
    assert off(moit.composite(f, PerPixel(sample=0)), f).max() < ROUNDING


def test_an_image_that_is_tried_as_a_whole_is_never_off_by_more():
    for seed in range(3):
        f = hard(seed)
        for g in (f, tinted(f)):
            choice = moit.choose(g, PerPixel(0.02), background=(1, 0, 2))
            assert choice.error.max() <= 0.02
            assert choice.bits_per_pixel < SORTED_BITS * counts_of(g).mean()


def test_an_image_with_not_many_more_pixels_than_the_sample_is_tried_as_a_whole():
    f = hard(0)
    every = int(moit.choose(f, PerPixel(0.02)).tried.sum())
    for share, whole in ((1.2, True), (1.3, False)):
        sample = round(every / share)
        tried = moit.choose(f, PerPixel(0.02, sample=sample)).tried.sum()
        assert tried == (every if whole else sample)


def with_deep_pixels(count: int, every: int, deep: int = 1) -> moit.Fragments:
    """Pixels of one fragment, which is exact for sure, but for `deep` of `every`, which have 30."""
    counts = np.where(np.arange(count) % every < deep, 30, 1)
    n, rng = int(counts.sum()), np.random.default_rng(4)
    return moit.Fragments(
        np.append(0, np.cumsum(counts)),
        rng.uniform(1, 9, n),
        rng.uniform(0.05, 0.3, n),
        rng.random((n, 3)) * np.repeat(rng.random(count), counts)[:, None] ** 2,
        shape=(10, count // 10),
    )


def test_what_is_predicted_of_an_image_that_is_tried_as_a_whole_is_what_is_measured():
    for every, deep in ((1, 1), (2, 1), (5, 1), (4, 3)):
        choice = moit.choose(with_deep_pixels(500, every, deep), PerPixel(0.2))
        assert choice.tried.sum() == 500 * deep / every
        assert choice.predicted == pytest.approx(choice.measured, abs=ROUNDING)
        assert (choice.measured["worst"] > 0.01) == (every == 1)  # else of those that are exact


def test_what_is_predicted_counts_pixels_that_are_exact_for_sure(monkeypatch):
    monkeypatch.setattr(error_chances, "least_price", lambda *_: 0.0)  # the cheapest everywhere
    choice = moit.choose(with_deep_pixels(20000, 10), PerPixel(0.02, ("power4",), sample=900))
    assert choice.tried.sum() == 900
    errors = np.sort(choice.error[~choice.tried])
    assert errors[-11] > 1.3 * errors[-191]  # what 99 % of the open ones, and of all, are off by
    assert choice.predicted["p99"] == pytest.approx(choice.measured["p99"], rel=0.15)


def test_candidates_need_a_curve_only_where_one_is_asked_for():
    f = hard(3)
    for technique in (PerPixel(), PerPixel(0.1, ("wboit", "power4", "mlab4"))):
        every, curved = (candidates(f, technique, curve) for curve in (False, True))
        assert not all(one.has_curve for one in every)
        assert curved == [one for one in every if one.has_curve]
    assert {str(one) for one in candidates(f, PerPixel(), False)} == set(CANDIDATES)
