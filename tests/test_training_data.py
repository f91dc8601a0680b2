"""What networks learn of: the sets, their recipes and their losses."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from small import some_fragments
from test_training import random_examples

import moit
from moit.neural import data, training
from moit.neural.examples import chosen, examples_of, joined, seen, some
from moit.neural.fitting import batches
from moit.neural.losses import COLOR_VARIANCE, LOSSES, Truth
from moit.neural.recipes import PAPER, QUICK, SHIPPED, Recipe
from moit.neural.scores import FRAGMENTS, scores


def test_the_loss_of_colour_is_what_random_colours_have_on_the_mean():
    f = data.drawn("layers", 3000, seed=4)
    T = moit.transmittance(f, "power4", dtype=np.float64)
    exact = moit.transmittance(f, "sorted", dtype=np.float64)
    counts = f.counts.ravel()
    truth = Truth(exact, f.alpha.astype(float), f.offsets[:-1], counts, np.ones(len(counts)))
    expected = LOSSES["color"](T, truth)[0]
    found, rng = [], np.random.default_rng(0)
    for _ in range(40):
        random = moit.Fragments(
            f.offsets, f.depth, f.alpha, rng.random((len(f), 3)), depth_range=f.depth_range
        )
        images = [moit.composite(random, t)[..., :3] for t in ("power4", "sorted")]
        found.append(np.mean((images[0] - images[1]) ** 2))
    # a mean of 40 is as sure as their spread says; four of that
    assert abs(np.mean(found) - expected) < 4 * np.std(found) / math.sqrt(40)
    assert pytest.approx(1 / 12) == COLOR_VARIANCE


def test_losses_are_what_they_are_called():
    examples = random_examples("share")
    t = examples.truth
    T = np.random.default_rng(5).uniform(0, 1, len(t.exact))
    weight, off = np.repeat(t.weight, t.counts), T - t.exact
    assert LOSSES["transmittance"](T, t)[0] == pytest.approx(np.mean(weight * off**2))
    visible = np.mean(weight * (t.alpha**2 + 0.1) * off**2)
    assert LOSSES["visible"](T, t)[0] == pytest.approx(visible)
    colour = picture = 0.0
    for start, count_, share in zip(t.starts, t.counts, t.weight, strict=True):
        own = slice(start, start + count_)
        held, exact = t.alpha[own] * T[own], t.alpha[own] * t.exact[own]
        apart = held * (exact.sum() / held.sum()) - exact
        opacity = 2 * np.sqrt(t.alpha[own]) - 1
        colour += share * (apart**2).sum() / 12
        picture += share * ((apart**2).sum() + 20 * (apart @ opacity) ** 2) / 12
    assert LOSSES["color"](T, t)[0] == pytest.approx(colour / len(t.counts))
    assert LOSSES["picture"](T, t)[0] == pytest.approx(picture / len(t.counts))


def test_as_many_units_are_kept_as_have_no_more_examples_than_asked_for():
    examples = random_examples("share")
    ends = examples.starts[1:]
    for most in (1, 5, 17, int(ends[6]), int(ends[6]) - 1, int(ends[-1]), 10**6):
        kept = examples.at_most(most)
        units = max(int((ends <= most).sum()), 1)
        assert len(kept.truth.counts) == units and len(kept.features) == ends[units - 1]


def test_batches_have_whole_pixels_and_all_of_them():
    examples = random_examples("share", pixels=300)
    found = list(batches(examples, 100))
    assert found[0][0] == 0 and found[-1][1] == 300
    assert all(a[1] == b[0] for a, b in pairwise(found))
    sizes = np.diff([examples.starts[first] for first, _ in found] + [examples.starts[-1]])
    assert sizes.min() >= 100 - 6 and sizes.max() <= 106


def test_taken_pixels_keep_their_fragments():
    examples = random_examples("absorbance")
    order = np.random.default_rng(2).permutation(40)
    taken = examples.taken(order)
    for i, unit in enumerate(order):
        one, other = taken.between(i, i + 1), examples.between(unit, unit + 1)
        assert np.array_equal(one.features, other.features)
        for name in vars(one.truth):
            assert np.array_equal(getattr(one.truth, name), getattr(other.truth, name))
        assert np.array_equal(one.from_, other.from_)
        assert np.array_equal(one.width, other.width)


def test_opaque_surfaces_and_what_they_hide_are_not_learnt_from():
    f = moit.Fragments(
        [0, 4, 4, 6], [3, 1, 2, 2, 5, 4], [0.5, 0.4, 1, 0.3, 1, 1], depth_range=(1, 5)
    )
    left = seen(f)
    assert left.offsets.tolist() == [0, 2, 2, 2]
    assert left.depth.tolist() == [1, 2] and left.alpha.tolist() == pytest.approx([0.4, 0.3])
    exact = moit.transmittance(f, "sorted")
    assert np.array_equal(moit.transmittance(left, "sorted"), exact[[1, 3]])


def test_some_pixels_are_whole_ones():
    f = some_fragments(seed=9)
    part = some(f, 300, np.random.default_rng(0))
    assert 290 <= len(part) <= 300
    there = part.counts > 0
    assert np.array_equal(part.counts[there], f.counts[there])
    keep = np.repeat(there.ravel(), f.counts.ravel())
    assert np.array_equal(part.depth, chosen(f, keep).depth)


def counts_and_sets(name, fragments=60_000, seed=3):
    f = data.drawn(name, fragments, seed)
    u = np.log(f.depth.astype(float))
    return f, f.counts[f.counts > 0], u


def test_the_sets_are_distributed_as_documented():
    f, counts, u = counts_and_sets("layers")
    assert counts.min() == 2 and counts.max() == 32
    assert 0.1 <= f.alpha.min() < 0.101 and 0.499 < f.alpha.max() <= 0.5
    assert abs(u.mean() - 0.5) < 0.01 and u.min() >= 0 and u.max() <= 1
    f, counts, u = counts_and_sets("surfaces")
    assert set(counts) == {1, 2, 3, 4}
    assert 0.2 <= f.alpha.min() and f.alpha.max() <= 0.95 and abs(f.alpha.mean() - 0.575) < 0.01
    f, counts, u = counts_and_sets("puffs")
    assert counts.min() >= 21 and counts.max() <= 64
    thick = np.add.reduceat(f.alpha > 0.1, f.offsets[:-1])
    assert set(thick) == {1, 2, 3, 4}
    f, counts, u = counts_and_sets("tufts")
    assert counts.min() >= 40 and counts.max() <= 170 and (f.alpha == np.float32(0.2)).all()
    for name in data.SETS:
        f, counts, _ = counts_and_sets(name)
        assert counts.mean() == pytest.approx(data.SETS[name][1], rel=0.05)
        again = data.drawn(name, 60_000, 3)
        assert np.array_equal(again.depth, f.depth)
        assert not np.array_equal(data.drawn(name, 60_000, 4).depth[:100], f.depth[:100])
        # in random order: the first fragment of a pixel is as likely the nearest as any
        first = f.offsets[:-1][counts > 1]
        nearest = np.minimum.reduceat(f.depth, f.offsets[:-1])[counts > 1]
        share = np.mean(f.depth[first] == nearest)
        assert share == pytest.approx(np.mean(1 / counts[counts > 1]), abs=0.03)


def test_the_recipe_of_the_paper_is_as_published():
    assert (PAPER.fragments, PAPER.epochs, PAPER.batch) == (250_000, 1000, 8192)
    assert (PAPER.rate, PAPER.falling, PAPER.loss) == (1e-3, False, "transmittance")
    f = data.drawn("neural-training", 250_000 / 0.9, 0)
    assert len(f) * 0.9 > 250_000 * 0.98
    counts = f.counts
    assert counts.min() == 2 and counts.max() == 32
    assert 0.1 <= f.alpha.min() and f.alpha.max() <= 0.5
    # depth fills .3 to 1 of the range
    extent = np.maximum.reduceat(f.depth, f.offsets[:-1]) - np.minimum.reduceat(
        f.depth, f.offsets[:-1]
    )
    assert 0.299 < extent.min() < 0.31 and 0.99 < extent.max() <= 1.0001


def test_parts_weigh_as_told():
    parts = [random_examples("share", 10), random_examples("share", 30, seed=1)]
    whole = joined(parts)
    weights = whole.truth.weight
    assert weights[:10].sum() == pytest.approx(weights[10:].sum())
    assert weights.mean() == pytest.approx(1)
    weights = joined(parts, [1, 3]).truth.weight
    assert 3 * weights[:10].sum() == pytest.approx(weights[10:].sum())


def test_a_set_weighs_the_less_the_more_is_lost_where_no_order_is_known():
    examples = random_examples("share")
    blind = LOSSES["visible"](np.full(len(examples.features), 0.5), examples.truth)[0]
    assert examples.ease("visible") == pytest.approx(1 / blind)


def test_networks_that_come_with_moit_say_the_recipes_that_moit_has():
    for kind, made_by in SHIPPED.items():
        told = moit.Network.shipped(kind).recipe
        for name, value in made_by.told().items():
            assert told[name] == (list(value) if isinstance(value, tuple) else value), (kind, name)
    four = ("layers", "surfaces", "puffs", "tufts")
    assert Recipe(four, 60_000, 20, 2048, 0.02, True, "color") == QUICK


@pytest.mark.parametrize("kind", SHIPPED)
def test_networks_that_come_with_moit_say_the_scores_that_they_have(kind):
    """On rays that are drawn anew: of another NumPy they may be others, of the same kinds."""
    names = {"neural-image": "neural(depth_range='image')", "strong": "strong5"}
    names["neural-slices"] = "neural-slices8"
    network = moit.Network.shipped(kind)
    found = scores(network, moit.technique(names.get(kind, kind)))
    sets = ("layers", "surfaces", "puffs", "tufts", "neural-training")
    assert set(found) == {f"{name} {what}" for name in sets for what in ("transmittance", "color")}
    assert found == pytest.approx(network.scores, rel=0.02)
    assert FRAGMENTS == 60_000


def test_sources_weigh_by_how_little_is_lost_on_them_and_by_the_recipe():
    sources = {name: data.drawn(name, 600, 0) for name in ("haze", "veils")}
    shares = []
    for weights in ((), (3.0, 1.0)):
        plan = replace(QUICK, fragments=500, weights=weights)
        work = training._Work(moit.technique("neural-bounded"), plan, sources, 0)
        weight = work.examples.truth.weight
        cut = int(np.flatnonzero(np.diff(weight))[0]) + 1  # one number for all of a source
        assert np.ptp(weight[:cut]) == np.ptp(weight[cut:]) == 0
        shares.append(weight[:cut].sum() / weight[cut:].sum())
    eases = [
        examples_of(f, moit.technique("neural-bounded")).ease("color") for f in sources.values()
    ]
    assert shares[0] == pytest.approx(eases[0] / eases[1], rel=0.35)
    assert shares[1] == pytest.approx(3 * shares[0], rel=1e-5)
    assert min(shares[0], eases[0] / eases[1]) > 1.4  # and not alike


def test_the_other_sets_are_distributed_as_documented():
    f, counts, u = counts_and_sets("sheets")
    assert counts.min() == 3 and counts.max() == 9
    assert 0.05 <= f.alpha.min() < 0.12 and 0.95 < f.alpha.max() <= 0.97
    parts = [np.ptp(part) for part in np.split(u, f.offsets[1:-1])]
    assert min(parts) < 0.02 and max(parts) > 0.9  # down to a thirtieth of the range
    f, counts, u = counts_and_sets("haze")
    assert 2 <= counts.min() and counts.max() <= 65
    surfaces = np.add.reduceat(f.alpha >= 0.2, f.offsets[:-1])
    assert set(surfaces) == {0, 1, 2, 3, 4, 5}
    spans = np.array([np.ptp(part) for part in np.split(u, f.offsets[1:-1])])
    # half take a part of the range only, evenly in its logarithm: a sixth less than a tenth
    assert 0.1 < (spans[counts >= 20] < 0.1).mean() < 0.25
    thin = f.alpha[f.alpha < 0.2]
    assert 0.001 <= thin.min() < 0.0011 and 0.11 < thin.max() <= 0.12
    f, counts, u = counts_and_sets("veils")
    assert 3 <= counts.min() and counts.max() <= 60
    dense = np.add.reduceat(f.alpha >= 0.4, f.offsets[:-1])
    assert set(dense) == set(range(1, 11))
    thin = f.alpha[f.alpha < 0.4]
    assert 0.18 < thin.max() <= 0.2 and f.alpha.max() <= 0.95
    for name in ("sheets", "haze", "veils"):
        assert 0 <= counts_and_sets(name)[2].min() and counts_and_sets(name)[2].max() <= 1
    # surfaces of one alpha or within a fifth of it: .4 of the pixels have one
    f, counts, _ = counts_and_sets("sheets")
    same = [np.ptp(part) == 0 for part in np.split(f.alpha, f.offsets[1:-1])]
    assert np.mean(same) == pytest.approx(0.4, abs=0.02)


def test_puffs_and_tufts_are_as_wide_as_documented():
    f, _, u = counts_and_sets("puffs")
    thin = f.alpha < 0.1
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)[thin]
    n = np.bincount(pixel)
    mean = np.bincount(pixel, u[thin]) / n
    spread = np.sqrt(np.bincount(pixel, (u[thin] - mean[pixel]) ** 2) / (n - 1))
    assert 0.01 < spread.min() < 0.025 and np.median(spread) == pytest.approx(0.11, abs=0.01)
    assert spread.max() < 0.28 and 0.13 < mean.min() and mean.max() < 0.87
    f, _, u = counts_and_sets("tufts")
    spans = [np.ptp(part) for part in np.split(u, f.offsets[1:-1])]
    # a third has one cluster of deviation .03: some five deviations for a hundred strands
    assert np.quantile(spans, 0.15) == pytest.approx(0.14, abs=0.015)
