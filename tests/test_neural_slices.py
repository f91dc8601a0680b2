"""Slices that a network reads: what it sees, in any order, and what slices prove.

The reference places fragments by their definition, in float64, with steps of 16 bits.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from gpu import expect_bits_of_the_core
from test_slices import STEP, one_ray, picture, shuffled

import moit
from moit import NeuralSlices
from moit.catalog.network import NetworkError
from moit.neural import data, training
from moit.neural.features import features
from moit.neural.recipes import QUICK, SHIPPED

precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def seen_by_definition(z, alpha, count):
    """What the network sees of the fragments of one ray at z of [0, 1], and L and W, without
    rounding to steps."""
    near, far = np.floor(z.min() * 65535) / 65535, np.ceil(z.max() * 65535) / 65535
    x = (z - near) / (far - near) * (count - 1)
    tau, cell = -np.log1p(-alpha), np.minimum(np.floor(x), count - 2).astype(int)
    inside = x - cell
    slices = np.zeros(count + 3)  # one before the first, two behind the last
    for j, t, share in zip(cell, tau, inside, strict=True):
        slices[j + 1] += t * (1 - share)
        slices[j + 2] += t * share
    total, rows = slices.sum(), []
    for j, t, share in zip(cell, tau, inside, strict=True):
        before, here, there, behind = slices[j : j + 4]
        least, room = slices[: j + 1].sum(), here + there - t
        even = least + here / 2 + share * (here + there) / 2 - (1 - share) * t / 2 - share * t / 2
        even = (even - least) / room if room > 1e-6 else 0.0
        open_ = (min(max(even, 0), 1), math.log(max(room, 1e-4)), least, room)
        shares = (least / total, room / total, t, share, here / (here + there))
        rows.append([*shares, before / total, behind / total, math.log(total), *open_])
    return np.array(rows)


@precisions
@pytest.mark.parametrize("count", [3, 8])
def test_the_network_sees_slices_of_each_pixel_s_own_extent(count, dtype):
    rng = np.random.default_rng(count)
    z, alpha = np.sort(rng.uniform(0.2, 0.7, 12)), rng.uniform(0.2, 0.8, 12)
    f = one_ray(z, alpha, dtype)
    technique = NeuralSlices(count, 16, warp="linear")
    found = features(f, technique)
    expected = seen_by_definition(z, alpha, count)
    np.testing.assert_allclose(found, expected, atol=40 * STEP[16])
    assert np.ptp(expected, axis=0).min() > 1e-3 or np.ptp(expected[:, 7]) == 0
    network = moit.Network.shipped("neural-slices")
    share = 1 / (1 + np.exp(-network.forward(found[:, :10])[:, 0]))
    T = np.exp(-(found[:, 10] + share * found[:, 11]))
    np.testing.assert_allclose(moit.transmittance(f, technique), T, atol=3e-6)


@precisions
@pytest.mark.parametrize("technique", [NeuralSlices(5, 6), NeuralSlices(16)], ids=str)
def test_transmittance_is_the_same_bits_in_any_order(technique, dtype):
    f = picture(1, dtype=dtype, opaque=0.05)
    T = moit.transmittance(f, technique, cull_opaque=False)
    for k in range(3):
        other, order = shuffled(f, k)
        again = moit.transmittance(other, technique, cull_opaque=False)
        np.testing.assert_array_equal(again, T[order])
    depth, alpha = np.resize([1.5, 1.6, 7.0], 900), np.resize([0.9, 0.5, 0.7, 0.2], 900)
    crowded = moit.Fragments([0, 900], depth, alpha, np.ones((900, 3)), depth_range=(1, 8))
    other, order = shuffled(crowded, 3)  # slices hold no more, in any order
    T, again = (moit.transmittance(one, technique) for one in (crowded, other))
    np.testing.assert_array_equal(again, T[order])
    # what a slice tells at most, twice in front of the last
    assert T.min() > math.exp(-technique.count * moit.catalog.slices.codes_of(technique.bits)[1])


@precisions
def test_a_fragment_alone_is_not_occluded_and_coincident_ones_are_alike(dtype):
    rng = np.random.default_rng(1)
    alone = moit.Fragments(
        np.arange(301), rng.uniform(1, 9, 300), rng.uniform(0, 1, 300), shape=(20, 15),
        depth_range=(1, 9), dtype=dtype,
    )  # fmt: skip
    assert (moit.transmittance(alone, NeuralSlices(4)) == 1).all()
    T = moit.transmittance(one_ray([0.3] * 5, [0.4] * 5, dtype), NeuralSlices(8, warp="linear"))
    assert np.ptp(T) == 0 and 0.6**5 < T[0] < 1


def test_thin_layers_count_right_in_the_mean():
    """Half of a step each, twenty in each of three hundred pixels."""
    alpha = -math.expm1(-0.5 * STEP[8])
    rng = np.random.default_rng(5)
    n, layers = 300, 20
    f = moit.Fragments(
        np.arange(n + 1) * layers, np.sort(rng.uniform(1, 2, (n, layers))).ravel(),
        np.full(n * layers, alpha), shape=(20, 15), depth_range=(1, 2),
    )  # fmt: skip
    found = features(f, NeuralSlices(8, warp="linear"))
    total = np.exp(found[:, 7]).reshape(n, layers)[:, 0] / STEP[8]
    assert abs(total.mean() / (layers / 2) - 1) < 0.05 and (abs(total - layers / 2) < 9).all()


def error(f, technique) -> float:
    exact, found = (moit.composite(f, t)[..., :3].astype(float) for t in ("sorted", technique))
    return math.sqrt(np.mean((exact - found) ** 2))


@pytest.mark.parametrize("technique", [NeuralSlices(5, 6), NeuralSlices(16)], ids=str)
def test_a_network_is_nearer_than_slices_of_the_same_bytes(technique):
    """Beside slices of two words of 16 bits for where they begin and end, and 64 marks of cells."""
    found = [], []
    for name in data.SETS:
        f = data.drawn(name, 4000, 21)
        plain = moit.Slices(technique.count, technique.bits, "pixel", cells=64, depth_range="pixel")
        found[0].append(error(f, technique))
        found[1].append(error(f, plain))
    assert np.mean(found[0]) < 0.8 * np.mean(found[1])
    assert np.mean(found[0]) < {5: 0.030, 16: 0.014}[technique.count]


def bounds_hold(seed: int, fragments: int) -> int:
    """Of how many rays of each kind, all counts, bits, and both precisions in turn."""
    rays = 0
    for k, name in enumerate(data.SETS):
        drawn = data.drawn(name, fragments, seed)
        for dtype in (np.float32, np.float64):
            f = moit.Fragments(
                drawn.offsets, drawn.depth, drawn.alpha, drawn.color, shape=drawn.shape,
                depth_range=drawn.depth_range, dtype=dtype,
            )  # fmt: skip
            technique = NeuralSlices((2, 5, 8, 16, 64)[(k + seed) % 5], (2, 6, 8, 16)[k % 4])
            exact = moit.transmittance(f, "sorted", dtype=np.float64)
            lower, upper = moit.bounds(f, technique)
            assert (lower <= exact).all() and (exact <= upper).all(), (name, technique)
            rays += int(np.count_nonzero(f.counts))
    return rays


def test_bounds_hold_on_rays_of_every_kind():
    assert bounds_hold(3, 3000) > 4000


def test_bounds_are_of_slices_and_narrow_with_their_count():
    f = data.drawn("layers", 4000, 8)
    widths = []
    for count in (4, 16, 64):
        lower, upper = moit.bounds(f, NeuralSlices(count, 12))
        widths.append(np.mean(upper - lower))
    total = moit.bounds(f, "wboit")
    assert widths[0] < 0.8 * np.mean(total[1] - total[0])
    assert widths[1] < 0.6 * widths[0] and widths[2] < 0.6 * widths[1]


def test_the_curve_begins_and_ends_as_all_do():
    f = data.drawn("layers", 2000, 11)
    technique = NeuralSlices(16)
    total = moit.total_transmittance(f, technique).ravel()
    curve = moit.transmittance(f, technique, depth=[0.9, 3.0]).reshape(-1, 2)
    assert (curve[:, 0] == 1).all() and (curve[:, 1] == total).all()


def test_a_depth_sees_what_a_fragment_that_absorbs_nothing_sees():
    rng = np.random.default_rng(9)
    f = one_ray(rng.uniform(0.1, 0.9, 20), np.append(rng.uniform(0.1, 0.6, 18), [1e-9, 1e-9]))
    technique = NeuralSlices(6, warp="linear")
    T = moit.transmittance(f, technique)[-2:]
    curve = moit.transmittance(f, technique, depth=f.depth[-2:]).ravel()
    assert T == pytest.approx(curve, abs=1e-6)
    assert T.max() < 1 and T.min() > 0


def test_what_is_refused_and_what_is_kept():
    with pytest.raises(ValueError, match="depth_range: 'pixel' has no meaning"):
        NeuralSlices(5, depth_range="pixel")
    with pytest.raises(NetworkError, match="expected one of kind 'neural-slices'"):
        NeuralSlices(5, network=moit.Network.shipped("strong"))
    for wrong in ({"count": 1}, {"count": 257}, {"bits": 1}, {"bits": 17}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            NeuralSlices(**wrong)
    assert NeuralSlices(5, 6).bits_per_pixel == 62 and NeuralSlices(16).bits_per_pixel == 160
    assert NeuralSlices().order_independent and NeuralSlices().access == "atomics"


def test_a_recipe_learns_of_several_counts_and_bits_at_once():
    technique = moit.technique("neural-slices5(bits=6)")
    sources = {"layers": data.drawn("layers", 600, 0)}
    sizes = []
    for plan in (QUICK, replace(QUICK, slices=("4x4", "16x8"))):
        work = training._Work(technique, replace(plan, fragments=500), sources, 0)
        sizes.append(len(work.examples.features))
        weights = np.unique(work.examples.truth.weight)
        assert len(weights) == max(len(plan.slices), 1)
    assert weights[1] > 3 * weights[0]  # each by how its slices err by themselves
    assert 1.8 < sizes[1] / sizes[0] < 2.2
    assert [str(one) for one in SHIPPED["neural-slices"].read_by(technique)][:2] == [
        "neural-slices4(bits=4)",
        "neural-slices4",
    ]


def test_shadows_are_asked_by_points_that_change_no_slice():
    """A point has alpha 0: it widens no extent, and what is before or behind all sees so."""
    rng = np.random.default_rng(6)
    f = one_ray(rng.uniform(0.3, 0.6, 9), rng.uniform(0.1, 0.6, 9))
    points = [0.0, 0.1, 0.8, 1.0]
    more = one_ray([*f.depth, *points], [*f.alpha, *np.zeros(4)])
    technique = NeuralSlices(6, 16, warp="linear")
    T, with_points = (moit.transmittance(one, technique) for one in (f, more))
    np.testing.assert_array_equal(with_points[:9], T)
    total = moit.total_transmittance(f, technique).ravel()[0]
    assert (with_points[9:11] == 1).all() and with_points[11:] == pytest.approx(total, rel=0.01)
    assert technique.takes_points


@pytest.mark.parametrize(
    ("technique", "dtype"),
    [(NeuralSlices(5, 6), "float32"), (NeuralSlices(16, warp="linear"), "float64")],
    ids=str,
)
def test_passes_give_the_bits_of_the_core(technique, dtype):
    f = picture(7, 12, 9, dtype=dtype)
    alpha = np.where(np.arange(len(f)) % 5, f.alpha, 0)  # what covers nothing widens no extent
    f = moit.Fragments(
        f.offsets, f.depth, alpha, f.color, shape=f.shape, depth_range=f.depth_range, dtype=dtype
    )
    expect_bits_of_the_core(f, technique)
