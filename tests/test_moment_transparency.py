"""Moment Transparency as published, against golden data and a model in NumPy."""

import numpy as np
import pytest
from golden import golden
from readings import c

import moit
from moit import MomentTransparency

precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])
SCALE = 1 - 0.5 / 256


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
