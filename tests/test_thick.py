"""Gaussians and volumes: what is held of them, what `sorted` makes of them, and what others do.

The truth is tests/thick_model.py.
"""

import dataclasses
import math
import pickle
import re

import numpy as np
import pytest
import thick_model
from gpu import needs_passes, software_device
from variants import WITH_CURVE

import moit
from moit.core.pieces import thinned

KINDS = [t for t in moit.techniques() if t.engine == "core"]
RANGE = (0.5, 8.0)


def ray(depth, alpha, deviation=None, back=None, color=None, seed=0, **arrays):
    count = len(depth)
    color = np.random.default_rng(seed).random((count, 3)) if color is None else color
    return moit.Fragments(
        [0, count],
        np.array(depth, float),
        np.array(alpha, float),
        np.array(color, float),
        deviation=None if deviation is None else np.array(deviation, float),
        back=None if back is None else np.array(back, float),
        **({"depth_range": RANGE} | arrays),
    )


RAYS = {
    "one": ray([2], [0.6], [0.3]),
    "two that overlap": ray([2, 2.2], [0.6, 0.9], [0.3, 0.5]),
    "thin in thick": ray([3, 3.1, 2.9], [0.9, 0.5, 0.7], [1.0, 0.01, 0.1]),
    "cut by the near end": ray([0.6, 1.0], [0.9, 0.5], [0.4, 2.0]),
    "at both ends": ray([0.5, 8.0], [0.9, 0.5], [0.4, 2.0]),
    "almost opaque": ray([2, 2.5, 3], [0.9999, 0.999, 0.5], [0.5, 0.5, 0.5]),
    "with volumes and surfaces": ray(
        [2, 1, 2.1, 3], [0.6, 0.8, 0.5, 0.7], [0.5, 0, 0, 0.2], [2, 4, 2.1, 3]
    ),
    "range of its own": ray([2, 3], [0.6, 0.5], [0.5, 1.5], depth_range=None),
}


@pytest.fixture(scope="module")
def truths():
    return {name: thick_model.ray(f) for name, f in RAYS.items()}


@pytest.mark.parametrize("name", RAYS)
def test_sorted_is_the_integral_along_the_ray(name, truths):
    f, (image, absorbed, z) = RAYS[name], truths[name]
    assert np.abs(moit.composite(f, "sorted")[0, 0] - image).max() < 1e-6  # what is promised
    depths = np.linspace(*f.depth_range, 41)
    expected = np.exp(-np.interp(depths, z, absorbed))
    # a step of the model, in which absorbance is taken to be linear
    np.testing.assert_allclose(moit.transmittance(f, "sorted", depths)[0, 0], expected, atol=2e-8)
    at = np.exp(-np.interp(f.depth, z, absorbed))
    np.testing.assert_allclose(moit.transmittance(f, "sorted"), at, atol=2e-8)
    single = moit.composite(f, "sorted", dtype=np.float32)[0, 0]
    assert np.abs(single - image).max() < 4e-6  # some forty pieces of float32


def test_panels_are_few_where_many_overlap_and_end_where_narrow_ones_begin():
    """Panels are shared by what overlaps; a narrow one begins in its own, not amid a wide one's."""
    rng = np.random.default_rng(57)
    many = ray(rng.uniform(2, 6, 60), rng.uniform(0.05, 0.4, 60), rng.uniform(0.3, 1, 60))
    assert len(many._split()[0]) < 150
    few = ray(*(array[:9] for array in (many.depth, many.alpha, many.deviation)))
    narrow = ray([1.67, 3.72], [0.97, 0.3], [0.1, 1.56])
    opaque = ray([3, 3.1, 3.2], [0.999, 0.9999, 0.99], [0.5, 0.6, 0.7])
    dense = ray([3, 3.1, 3.2], [1 - 1e-6, 1 - 1e-7, 1 - 1e-6], [0.5, 0.6, 0.7])
    alone_between = ray([4, 1.5, 6.5], [0.9, 0.5, 0.5], [1.2, 0.05, 0.05])
    for f, most in ((few, 60), (narrow, 30), (opaque, 60), (dense, 120), (alone_between, 40)):
        pieces, first = f._split()
        assert len(pieces) <= most
        assert np.array_equal(pieces.depth[first], f.depth)  # each is asked at its depth
        # as near as panels of a deviation are; of 1.5 deviations 1e-7
        image = moit.composite(f, "sorted")[0, 0]
        assert np.abs(image - thick_model.ray(f)[0]).max() < 2e-8
        assert abs(image[3] - (1 - np.prod(1 - f.alpha))) < 1e-13


def test_what_is_opaque_hides_a_gaussian_that_it_coincides_with():
    """A volume without end is a surface where it begins."""
    parts = ([2, 3, 2.5], [1, 0.5, 0.7], [0, 0.6, 0.4])
    volume = moit.composite(ray(*parts, back=[4, 3, 2.5]), "sorted")
    np.testing.assert_allclose(volume, moit.composite(ray(*parts), "sorted"), atol=1e-12)


def test_channels_and_emission_are_integrated_alike():
    """Of one channel, light and opacity are those of fragments without transmission."""
    rng = np.random.default_rng(5)
    transmission = rng.random((3, 3))
    parts = {"depth": [2, 2.3, 2.5], "deviation": [0.3, 0.6, 0.2]}
    alpha = np.array([0.6, 0.9, 0.5])
    color, emission = rng.random((3, 3)), rng.random((3, 3))
    whole = ray(alpha=alpha, color=color, transmission=transmission, emission=emission, **parts)
    image = moit.composite(whole, "sorted")[0, 0]
    for c in range(3):
        own = alpha * (1 - transmission[:, c])
        light = (alpha * color[:, c] + emission[:, c]) / own
        f = ray(alpha=own, color=np.repeat(light[:, None], 3, 1), **parts)
        np.testing.assert_allclose(image[c], moit.composite(f, "sorted")[0, 0, 0], atol=1e-6)


@pytest.mark.parametrize("technique", KINDS, ids=str)
def test_one_alone_has_its_alpha_however_thick(technique):
    """As much of it as a surface has: half floats and 16 bits are rounded."""
    if technique.kind == "hashed-alpha":
        pytest.skip("all of it or nothing")
    for extent in ({"deviation": [0.4]}, {"back": [4.0]}):
        f = ray([2], [0.6], color=[[1, 0.5, 0]], **extent)
        surface = ray([2], [0.6], color=[[1, 0.5, 0]])
        # three half floats in place of one
        rounded = 1e-3 if np.abs(lit(surface, technique) - ALONE).max() > 1e-7 else 1e-12
        rounded = 1e-3 if technique.kind in ("anchors", "strong") else rounded
        np.testing.assert_allclose(lit(f, technique), ALONE, atol=rounded)


ALONE = [0.6, 0.3, 0.4, 0.6]


def lit(f, technique):
    return moit.composite(f, technique, background=(0, 0, 1))[0, 0]


EXACT = [t for t in KINDS if t.thick in ("pieces", "moments", "waves")]


@pytest.mark.parametrize("technique", EXACT, ids=str)
def test_a_volume_is_what_thin_parts_of_it_are(technique):
    if technique.stored_in(True) is not None:
        technique = dataclasses.replace(technique, **technique.stored_in(False))
    others = [(1.2, 0.3), (2.6, 0.5), (5.0, 0.4)]
    edges = np.linspace(1.5, 4.5, 65)
    absorbed = -math.log1p(-0.9) / 64
    whole = ray(
        [1.5, *(d for d, _ in others)],
        [0.9, *(a for _, a in others)],
        back=[4.5, *(d for d, _ in others)],
    )
    parts = ray(
        [*edges[:-1], *(d for d, _ in others)],
        [-math.expm1(-absorbed)] * 64 + [a for _, a in others],
        back=[*edges[1:], *(d for d, _ in others)],
    )
    depths = np.linspace(*RANGE, 29)
    np.testing.assert_allclose(
        moit.transmittance(whole, technique, depths),
        moit.transmittance(parts, technique, depths),
        atol=1e-6,
    )


@pytest.mark.parametrize("technique", ["power4", "power6", "power8", "trig2", "trig4"])
@pytest.mark.parametrize("name", RAYS)
def test_moments_are_those_of_the_extents(name, technique, truths):
    f, (_, absorbed, z) = RAYS[name], truths[name]
    technique = dataclasses.replace(moit.technique(technique), max_alpha=0.99999)
    b0, b = moit.moments.gather(f, technique)
    mass = np.diff(absorbed)
    depth = 0.5 * (z[1:] + z[:-1])
    near, far = f.depth_range
    at = 2 * np.log(depth / near) / math.log(far / near) - 1
    count = b.shape[1]
    if technique.kind == "power":
        expected = [(mass @ at**k) / mass.sum() for k in range(1, count + 1)]
    else:
        angle = (2 * math.pi - technique.wrapping_zone) * (at + 1) / 2
        expected = [(mass @ np.exp(1j * k * angle)) / mass.sum() for k in range(1, count + 1)]
    np.testing.assert_allclose(b0, mass.sum(), rtol=1e-7)
    np.testing.assert_allclose(b.ravel(), expected, atol=2e-7)  # the model's steps


# As many slices as cells: none are joined, whatever there is.
EVEN = {warp: moit.Slices(256, 16, cells=64, warp=warp) for warp in ("linear", "log")}


@pytest.mark.parametrize("warp", EVEN)
@pytest.mark.parametrize("name", RAYS)
def test_slices_are_given_the_integrals_of_extents(name, warp, truths):
    """Each cell's two slices, in steps; of an independent reading of what they are given."""
    f, (_, absorbed, z) = RAYS[name], truths[name]
    technique = EVEN[warp]
    near, far = f.depth_range

    def place(depth):
        part = np.log(depth / near) / math.log(far / near) if warp == "log" else 0.0
        x = 64 * (part if warp == "log" else (depth - near) / (far - near))
        cell = np.minimum(x.astype(int), 63)
        return cell, x - cell

    cell, inside = place(0.5 * (z[1:] + z[:-1]))
    mass = np.diff(absorbed)
    slices = np.bincount(cell, mass * (1 - inside), minlength=65)
    slices = slices + np.bincount(cell + 1, mass * inside, minlength=65)
    middle = np.cumsum(slices) - slices / 2
    depths = np.linspace(near, far, 203)
    cell, inside = place(depths)
    expected = np.exp(-(middle[cell] * (1 - inside) + middle[cell + 1] * inside))
    found = moit.transmittance(f, dataclasses.replace(technique, max_alpha=1 - 1e-9), depths)
    # of each fragment a step is rounded, another waits for the next point, and two slices share one
    step = 16 * math.log(2) / 65535
    assert np.abs(found[0, 0] - expected).max() < 2.5 * len(f) * step
    assert np.abs(found[0, 0] - expected).mean() < 0.5 * len(f) * step
    again = f._with(*(None if a is None else a[::-1].copy() for a in f._arrays()))
    assert np.array_equal(
        found, moit.transmittance(again, dataclasses.replace(technique, max_alpha=1 - 1e-9), depths)
    )


def test_slices_of_a_volume_are_those_of_thin_parts_but_for_steps():
    """Of 64 parts each has a step that is rounded."""
    edges = np.linspace(1.5, 4.5, 65)
    absorbed = -math.log1p(-0.9) / 64
    whole = ray([1.5], [0.9], back=[4.5])
    parts = ray(edges[:-1], [-math.expm1(-absorbed)] * 64, back=edges[1:])
    depths = np.linspace(*RANGE, 29)
    found = [moit.transmittance(f, EVEN["log"], depths) for f in (whole, parts)]
    step = 16 * math.log(2) / 65535
    assert np.abs(found[0] - found[1]).max() < 64 * step
    given = []  # to cells, before anything is rounded
    for f in (whole, parts):
        points, _ = thinned(f, EVEN["log"], 1)
        place = 64 * np.log(points.depth / RANGE[0]) / math.log(RANGE[1] / RANGE[0])
        given.append(np.bincount(place.astype(int), -np.log1p(-points.alpha), minlength=64))
    assert np.count_nonzero(given[0]) > 20
    np.testing.assert_allclose(given[0], given[1], atol=2 * step)


def test_parts_of_less_than_a_step_are_added_up():
    """A thin Gaussian of many cells is a point for each step at most, and absorbs what it did."""
    fine = moit.Slices(64, 8, cells=8192)
    step = 5.5412635451584258 / 255
    z = np.linspace(0.5, 8, 100_001)
    mean = np.average(np.log(z), weights=np.exp(-0.5 * (z - 2) ** 2))
    for alpha, most in ((0.01, 1), (0.05, 3), (0.3, 18), (0.999, 8192)):
        f = ray([2], [alpha], [1.0])
        points, first = thinned(f, fine, 1)
        weight = -np.log1p(-points.alpha)
        assert len(points) <= most
        np.testing.assert_allclose(weight.sum(), -math.log1p(-alpha), rtol=1e-12)
        place = np.log(points.depth)  # what is linear in it is kept
        np.testing.assert_allclose(weight @ place / weight.sum(), mean, atol=1e-4)
        whole = np.abs(weight / step - np.round(weight / step)) < 1e-3
        assert np.count_nonzero(~whole) <= 1
        assert abs(points.depth[first[0]] - 2) == np.abs(points.depth - 2).min()


@pytest.mark.parametrize("technique", [t for t in WITH_CURVE if t.engine == "core"], ids=str)
def test_bounds_hold_within_gaussians(technique):
    f = RAYS["with volumes and surfaces"]
    depths = np.linspace(0.5, 8, 16)
    exact = moit.transmittance(f, "sorted", depths)
    lower, upper = moit.bounds(f, technique, depths)
    assert (lower <= exact * (1 + 1e-12)).all() and (exact <= upper * (1 + 1e-12)).all()
    exact = moit.transmittance(f, "sorted")
    lower, upper = moit.bounds(f, technique)
    assert (lower <= exact * (1 + 1e-12)).all() and (exact <= upper * (1 + 1e-12)).all()


def test_points_are_gausss_rule_of_the_cut_normal_distribution():
    """Nodes and weights of an independent reading: two points in closed form."""
    mean, deviation, near = 0.8, 0.5, 0.5
    f = ray([mean], [0.5], [deviation], depth_range=(near, 100.0))
    points, first = thinned(f, dataclasses.replace(moit.technique("power2"), warp="linear"), 1)
    a = (near - mean) / deviation
    m0 = math.sqrt(math.pi / 2) * (1 - math.erf(a / math.sqrt(2)))
    e = math.exp(-a * a / 2)
    m1, m2, m3 = e, m0 + a * e, 2 * e + a * a * e
    m = m1 / m0
    v = m2 / m0 - m * m
    skew = (m3 / m0 - 3 * m * m2 / m0 + 2 * m**3) / v
    r = math.sqrt(skew * skew / 4 + v)
    at = [mean + deviation * (m + skew / 2 + sign * r) for sign in (-1, 1)]
    lower = (skew / 2 + r) / (2 * r)
    np.testing.assert_allclose(points.depth, at, atol=1e-6)  # 6 deviations, not infinitely many
    weights = np.log1p(-points.alpha) / math.log(0.5)
    np.testing.assert_allclose(weights, [lower, 1 - lower], atol=1e-6)
    assert first.tolist() == [int(abs(at[1] - mean) < abs(at[0] - mean))]


def test_rules_are_of_enough_points_where_a_logarithm_stretches_gaussians():
    """Moments of waves, to 1e-9: a tenth of a deviation is told from the next near the eye."""
    for mean, deviation, near in ((1.0, 0.5, 1e-4), (10.0, 5.0, 1e-5)):
        f = ray([mean], [0.5], [deviation], depth_range=(near, 100.0))
        for name in ("power4", "trig4"):
            technique = moit.technique(name)
            points, _ = thinned(f, technique, 1)
            weight = np.log1p(-points.alpha) / math.log(0.5)
            s = np.linspace(math.log(near), math.log(mean + 6 * deviation), 400_001)
            mass = np.exp(s - 0.5 * ((np.exp(s) - mean) / deviation) ** 2)
            at = 2 * (s - math.log(near)) / math.log(100.0 / near) - 1
            mine = 2 * np.log(points.depth / near) / math.log(100.0 / near) - 1
            for k in range(1, 5):
                expected = np.average(at**k, weights=mass)
                np.testing.assert_allclose(weight @ mine**k, expected, atol=1e-8)


def test_extents_of_any_size_give_finite_points():
    for dtype in (np.float32, np.float64):
        most, least = np.finfo(dtype).max, np.finfo(dtype).smallest_subnormal
        depth = np.array([1, 1, 1, 1e-30, most, 1e10, least], dtype)
        deviation = np.array([least, most, 1e-7, most, most, 1e-3, least], dtype)
        f = moit.Fragments(
            [0, 7], depth, np.full(7, 0.5, dtype), np.ones((7, 3), dtype), deviation=deviation
        )
        for technique in ("sorted", "power4", "trig4", "fourier15", "mlab4"):
            technique = moit.technique(technique)
            if "warp" in {field.name for field in dataclasses.fields(technique)}:
                technique = dataclasses.replace(technique, warp="linear")
            image = moit.composite(f, technique)
            assert np.isfinite(image).all()
            # half floats of seven fragments
            np.testing.assert_allclose(image[0, 0, 3], 1 - 0.5**7, atol=2e-3)


# What is held, and goes wherever the other arrays go

FULL = ray([2, 1, 3, 4], [0.6, 0.8, 0.5, 0.7], [0.5, 0, 0, 0.2], [2, 4, 3, 4])


def test_files_pickles_windows_and_orders_keep_deviations(tmp_path):
    moit.save(tmp_path / "f.npz", FULL)
    for f in (moit.load(tmp_path / "f.npz"), pickle.loads(pickle.dumps(FULL)), FULL[0, 0]):
        assert np.array_equal(f.deviation, FULL.deviation) and f.depth_range == FULL.depth_range
    assert FULL.sorted().deviation.tolist() == [0, 0.5, 0, 0.2]
    assert "deviation" in repr(FULL)
    assert moit.composite(FULL, "sorted", dtype=np.float32).dtype == np.float32


def test_merging_lists_layers_and_records_take_deviations():
    plain = ray([5], [0.5])
    f = moit.merge([plain, FULL])
    assert f.deviation.tolist() == [0, 0.5, 0, 0, 0.2] and f.back.tolist()[0] == 5
    assert moit.merge([plain, plain]).deviation is None
    listed = moit.Fragments.from_pixels(
        [1, 0], [1.0, 2.0], [0.5, 0.5], deviation=[0.1, 0.2], shape=(1, 2)
    )
    assert np.allclose(listed.deviation, [0.2, 0.1])
    layers = moit.Fragments.from_layers(
        np.ones((2, 1, 1)), np.array([[[0.5]], [[0.0]]]), deviation=np.full((2, 1, 1), 0.25)
    )
    assert layers.deviation.tolist() == [0.25]
    record = [("x", "u2"), ("y", "u2"), ("depth", "f4"), ("deviation", "f4"), ("rgba", "f2", 4)]
    drawn = np.array([(0, 0, 2.0, 0.5, (1, 0, 0, 0.5))], record)
    assert moit.Fragments.from_records(drawn, shape=(1, 1)).deviation.tolist() == [0.5]


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"deviation": [-0.1]}, "deviation[0]: found -0.1; needed a finite float64, at least 0"),
        ({"deviation": [np.nan]}, "deviation[0]: found nan; needed a finite float64, at least 0"),
        ({"deviation": [np.inf]}, "deviation[0]: found inf; needed a finite float64, at least 0"),
        (
            {"deviation": [0.5], "back": [3.0]},
            "deviation[0]: found 0.5; needed 0 where back is behind depth",
        ),
        (
            {"deviation": [0.5, 0.5]},
            "deviation: with depth of shape (1,), deviation must be (1,); got (2,)",
        ),
    ],
)
def test_errors_say_what_is_wrong(arrays, said):
    with pytest.raises(moit.FragmentsError, match=re.escape(said)):
        ray([2], [0.5], **arrays)


def test_a_range_that_nobody_gave_has_room_for_gaussians():
    assert ray([2], [0.5], [0.25], depth_range=None).depth_range == (1.25, 2.75)
    near, far = ray([2], [0.5], [3.0], depth_range=None).depth_range
    assert near == 0.25 and far == 11  # in front of the eye
    assert ray([-2], [0.5], [3.0], depth_range=None).depth_range == (-11, 7)
    assert ray([2], [1.0], [3.0], depth_range=None).depth_range == (2, 2)  # opaque: a surface


def test_tidy_makes_volumes_of_gaussians_that_deep_files_hold(tmp_path, truths):
    name = "with volumes and surfaces"
    f = RAYS[name]
    with pytest.raises(ValueError, match=re.escape("f: OpenEXR has no Gaussians")):
        moit.write_deep(tmp_path / "f.exr", f)
    tidy = f.tidy()
    assert tidy.deviation is None and (tidy.depth[1:] >= tidy.back[:-1]).all()
    np.testing.assert_allclose(moit.composite(tidy, "sorted")[0, 0], truths[name][0], atol=1e-6)
    moit.write_deep(tmp_path / "f.exr", tidy)
    again = moit.read_deep(tmp_path / "f.exr")
    np.testing.assert_allclose(moit.composite(again, "sorted")[0, 0], truths[name][0], atol=4e-6)


@pytest.mark.parametrize("technique", ["sorted", "power4", "trig3", "slices64", "mlab4", "wboit"])
def test_a_gpu_sees_the_same_gaussians(technique):
    technique = moit.technique(technique)
    needs_passes(technique)
    f = moit.merge([RAYS["with volumes and surfaces"], RAYS["two that overlap"]])
    image = moit.composite(f, technique, device=software_device(), exact=True)
    assert np.array_equal(image, moit.composite(f, technique))


def test_comparisons_are_with_the_integral():
    rng = np.random.default_rng(3)
    f = moit.Fragments(
        np.arange(0, 486, 4),
        rng.uniform(1, 5, 484),
        rng.uniform(0, 0.9, 484),
        rng.random((484, 3)),
        deviation=rng.uniform(0, 1, 484),
        shape=(11, 11),
    )
    report = moit.compare(f, ["sorted", "power4"], metrics="mse", repeat=1, progress=False)
    errors = {str(row["technique"]): row["mse"] for row in report.rows}
    assert errors["sorted"] < 1e-12 < errors["power4"]


@pytest.mark.parametrize("technique", KINDS, ids=str)
def test_techniques_are_given_what_their_fact_says(technique):
    f = RAYS["with volumes and surfaces"]  # two Gaussians, a volume and a surface
    given, _ = thinned(f, technique, 1)
    if technique.thick == "pieces":
        assert given is f
        return
    assert given.deviation is None
    assert (given.back is None) == (technique.thick in ("moments", "waves", "cells"))
    if technique.thick == "moments":
        assert len(given) == 1 + 3 * (technique.moment_count // 2 + 1)
    if technique.thick == "waves":
        assert len(given) >= 1 + 3 * 3
    if technique.thick in ("points", "middle"):
        assert len(given) == 2 + 2 * (3 if technique.thick == "points" else 1)
        assert given.back.tolist().count(4) == 1  # the volume stays


def test_what_sees_the_middle_sees_surfaces():
    f = RAYS["two that overlap"]
    surfaces = f._with(*f._arrays()[:4])
    for technique in ("mlab4", "wboit", "kbuffer4", "weighted-sum"):
        assert np.array_equal(moit.composite(f, technique), moit.composite(surfaces, technique))


@pytest.mark.parametrize("name", ["hashed-alpha", "front1", "front1(key_bits=32)"])
def test_gaussians_whose_points_coincide_are_seen_in_any_order(name):
    # so wide that both are even over the whole range, which gives them the same points
    depth, alpha, color = [9.0, 20.0], [0.9, 0.7], [[1, 0, 0], [0, 0, 1]]
    pair = [
        ray(
            *(np.array(x)[order] for x in (depth, alpha)),
            [1e30, 1e30],
            color=np.array(color)[order],
            depth_range=(0.6, 20.0),
        )
        for order in ([0, 1], [1, 0])
    ]
    technique = moit.technique(name)
    points = thinned(pair[0], technique, 1)[0].depth
    assert len(np.unique(points)) < len(points)
    assert np.array_equal(*(moit.composite(f, technique) for f in pair))
    T = [moit.transmittance(f, technique) for f in pair]
    assert np.array_equal(T[0], T[1][::-1])


@pytest.mark.parametrize("technique", KINDS, ids=str)
def test_volumes_alone_are_given_as_the_fact_says(technique):
    f = ray([1, 3], [0.5, 0.5], back=[2, 4])
    given, _ = thinned(f, technique, 1)
    assert (given.back is None) == (technique.thick in ("moments", "waves", "cells"))


def test_points_of_what_is_a_few_ulps_thick_lie_within_it():
    """A logarithm and back again leave it."""
    front = np.random.default_rng(3).uniform(0.6, 7, 500)
    back = np.nextafter(np.nextafter(front, 9), 9)
    f = moit.Fragments(np.arange(501), front, np.full(500, 0.5), back=back, depth_range=RANGE)
    points, _ = thinned(f, moit.technique("power4"), 1)
    of = np.repeat(np.arange(500), points.counts.ravel())
    assert len(points) > len(f)
    assert ((front[of] <= points.depth) & (points.depth <= back[of])).all()
