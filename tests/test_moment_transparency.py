"""Moment Transparency as published, against golden data and a model in NumPy."""

import numpy as np
import pytest
from golden import golden
from mpmath import mp
from oracle.hard_rays import flat, hard_rays
from readings import c, glsl

import moit
from moit import MomentTransparency

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])
SCALE = 1 - 0.5 / 256
LEAST_PIVOT = 1e-15  # below this a pivot is rounding alone, at the default bias


def fragments_of(data: dict, dtype) -> moit.Fragments:
    return moit.Fragments(data["offsets"], data["depth01"], data["alpha"], dtype=dtype)


def rays(*rows, dtype="float64", shape=None, depth_range=(0, 1)) -> moit.Fragments:
    """Rows of (depth, alpha) pairs, a pixel each."""
    counts = [len(row) for row in rows]
    flat = np.array([one for row in rows for one in row], float).reshape(-1, 2)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    color = np.random.default_rng(0).uniform(0.2, 0.8, (len(flat), 3))
    return moit.Fragments(
        offsets, *flat.T, color, shape=shape, depth_range=depth_range, dtype=dtype
    )


def unwarped(*arguments, **options) -> MomentTransparency:
    return MomentTransparency(*arguments, warp="none", **options)


# ---- Golden data ---------------------------------------------------------------------------------


@precisions
def test_moments_are_the_golden_ones(dtype):
    data = golden("moment_transparency")
    b0, b = moit.moments.gather(fragments_of(data, dtype), unwarped(), cull_opaque=False)
    # the golden ones are rounded to float32, and so are ours and each absorbance
    np.testing.assert_allclose(b0, data["total"], rtol=2e-7)
    np.testing.assert_allclose(b, data["moments"], rtol=0, atol=1.2e-7)


@precisions
@pytest.mark.parametrize("beta", [0.0, 0.25, 1.0])
def test_reconstruction_is_the_golden_hamburger_bound(dtype, beta):
    data = golden("moment_transparency")
    arrays = (data[name].astype(dtype) for name in ("total", "moments", "eval_depth01"))
    found = moit.moments.transmittance(MomentTransparency(overestimation=beta), *arrays)
    share = data["hamburger_lower"] + beta * data["hamburger_weight"]
    error = np.abs(found - np.exp(-data["total"][:, None].astype(float) * share))
    # three of 1800 rays are so near degenerate that biased moments in double move T by 1e-8
    assert np.quantile(error, 0.998) <= {"float32": 2e-6, "float64": 1e-9}[dtype]
    assert error.max() <= {"float32": 1e-5, "float64": 2e-8}[dtype]


def test_two_passes_are_the_golden_ones():
    data = golden("moment_transparency")
    technique = unwarped(2)
    state = moit.moments.gather(fragments_of(data, "float32"), technique, cull_opaque=False)
    found = moit.moments.transmittance(technique, *state, data["eval_depth01"])
    error = np.abs(found - data["twopass_transmittance"])
    assert np.quantile(error, 0.999) <= 1e-4


@precisions
def test_nonlinear_moments_are_read_as_published(dtype):
    data = golden("moment_transparency")
    given = {
        name: data[f"nlqm_{name}"].astype(dtype)
        for name in ("support", "weight", "fourth_offset", "interval_end", "overestimation")
    }
    found = c.nonlinear_share(*given.values())
    error = np.abs(found - data["nlqm_exact"])
    assert np.quantile(error, 0.999) <= {"float32": 1e-5, "float64": 1e-9}[dtype]


# ---- One text ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def many() -> moit.Fragments:
    """Hard rays of every kind, ordinary ones, and an empty one, with depths in [0, 1]."""
    offsets, depth, alpha = flat(hard_rays(seed=11, of_each_kind=10))
    rng = np.random.default_rng(12)
    counts = np.append(rng.integers(1, 30, 300), 0)
    more = int(counts.sum())
    return moit.Fragments(
        np.concatenate([offsets, offsets[-1] + np.cumsum(counts)]),
        np.concatenate([(depth + 1) / 2, rng.uniform(0, 1, more)]),
        np.concatenate([alpha, rng.uniform(0, 1, more)]),
    )


def depths_of(f: moit.Fragments, each: int, dtype) -> np.ndarray:
    """Depths between 0 and 1, half of them a fragment's."""
    rng = np.random.default_rng(7)
    z = rng.uniform(0, 1, (len(f.counts), each))
    full = f.counts > 0
    z[full, : each // 2] = f.depth[f.offsets[:-1][full], None]
    return z.astype(dtype)


def told_in_glsl(technique, b0, b, z) -> np.ndarray:
    """What the passes for power moments make of a state, with the technique's bias."""
    bias, safe = technique.bias_for(b.dtype), (0.0, 0.375, 0.0, 0.375)
    if technique.storage == "unorm16":
        safe = (0.5,) * 4
    if technique.storage == "nlqm":
        rules = glsl.power_rules(b, bias, safe, LEAST_PIVOT)
        rules = glsl.nonlinear_rules(rules, 0.0, 1.0, b.dtype)
    else:
        rules = glsl.power_rules(b, bias, safe, LEAST_PIVOT, b.dtype)
    ray_of = np.repeat(np.arange(len(b0)), z.shape[1])
    own = np.zeros(z.size, z.dtype)
    return glsl.power_transmittance(
        rules, b0, ray_of, z.ravel(), own, technique.overestimation
    ).reshape(z.shape)


@precisions
def test_scaled_absorbance_is_the_same_bits_in_glsl_and_good_to_the_last_digits(dtype, many):
    alpha = np.concatenate([many.alpha, np.geomspace(1e-12, 1, 1000), [0, 1]]).astype(dtype)
    found = glsl.scaled_absorbance(alpha, 0.5 / 256)
    one = moit.Fragments(np.arange(len(alpha) + 1), np.ones(len(alpha)), alpha, dtype=dtype)
    b0, _ = moit.moments.gather(one, MomentTransparency(), cull_opaque=False)
    np.testing.assert_array_equal(found, b0)
    with mp.workdps(40):
        truth = [-mp.log(1 - mp.mpf(float(a)) * (1 - mp.mpf(1) / 512)) for a in alpha]
    # two roundings more than that of a logarithm
    np.testing.assert_allclose(
        found.astype(float), np.array(truth, float), rtol=3 * np.finfo(dtype).eps
    )


@precisions
@pytest.mark.parametrize("storage", ["float32", "nlqm", "unorm16"])
def test_stored_moments_are_read_to_the_same_bits_in_glsl(many, storage, dtype):
    technique = MomentTransparency(1, storage, warp="none", overestimation=0.25)
    f = moit.Fragments(many.offsets, many.depth, many.alpha, dtype=dtype)
    b0, b = moit.moments.gather(f, technique)
    z = depths_of(f, 8, dtype)
    expected = moit.moments.transmittance(technique, b0, b, z)
    if storage != "float32":
        b0 = np.minimum(b0.astype(np.float16), np.float16(65504)).astype(dtype)
    if storage == "unorm16":
        words, moments = glsl.quantised_moments(b, symmetric=False)
        assert ((words >= 0) & (words <= 65535) & (words == np.round(words))).all()
        b = np.where(b.any(axis=1, keepdims=True), moments, 0).astype(dtype)
    found = told_in_glsl(technique, b0, b, z)
    np.testing.assert_array_equal(found, expected)


@precisions
def test_second_moments_are_read_to_the_same_bits_in_glsl(many, dtype):
    technique = unwarped(2)
    f = moit.Fragments(many.offsets, many.depth, many.alpha, dtype=dtype)
    state = moit.moments.gather(f, technique)
    z = depths_of(f, 8, dtype)
    (b0, _), second = state
    told = told_in_glsl(technique, *second, z)
    ray_of = np.repeat(np.arange(len(b0)), z.shape[1])
    found = glsl.two_moments(b0, second[0], ray_of, told.ravel()).reshape(z.shape)
    np.testing.assert_array_equal(found, moit.moments.transmittance(technique, *state, z))


def test_symmetric_words_are_the_same_bits_in_glsl_and_decode_to_the_moments(many):
    z = 2 * np.linspace(0, 1, 400)[:, None] - 1
    rng = np.random.default_rng(3)
    weights = rng.dirichlet(np.ones(6), 500)
    places = rng.uniform(-1, 1, (500, 6))
    mixed = np.stack([(weights * places**k).sum(axis=1) for k in (1, 2, 3, 4)], axis=1)
    for symmetric in (True, False):
        b = np.concatenate([np.hstack([z, z**2, z**3, z**4]), mixed])
        if not symmetric:
            y = np.concatenate([(z + 1) / 2])
            places01 = (places + 1) / 2
            more = np.stack([(weights * places01**k).sum(axis=1) for k in (1, 2, 3, 4)], axis=1)
            b = np.concatenate([np.hstack([y, y**2, y**3, y**4]), more])
        words, moments = glsl.quantised_moments(b, symmetric)
        assert words.min() >= 0 and words.max() <= 65535
        # a word is off by half; the decoding matrices' rows sum to at most 2.1 in absolute value
        assert np.abs(moments - b).max() <= 2.2 * 0.5 / 65535
