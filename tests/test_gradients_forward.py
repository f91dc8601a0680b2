"""Motions forwards are differences, and what pullbacks say of them."""

import numpy as np
import pytest

import moit
from moit import gradients

OFFSETS = np.array([0, 4, 4, 9, 12])


def numbers(coloured):
    rng = np.random.default_rng(11)
    found = {
        "depth": rng.uniform(1, 6, 12),
        "alpha": rng.uniform(0.1, 0.7, 12),
        "color": rng.uniform(0, 1, (12, 3)),
    }
    return found | ({"transmission": rng.uniform(0, 1, (12, 3))} if coloured else {})


def fragments(given):
    return moit.Fragments(OFFSETS, **given, shape=(2, 2), depth_range=(1, 6), dtype="float64")


@pytest.mark.parametrize("coloured", (False, True))
@pytest.mark.parametrize("technique", ("sorted", "weighted-sum", "power4(bias=1e-4)"))
def test_motions_are_differences(technique, coloured):
    given, rng = numbers(coloured), np.random.default_rng(2)
    motions = {name: rng.normal(size=one.shape) for name, one in given.items()}
    step, behind = 1e-6, rng.uniform(0, 1, (2, 2, 3))
    moved = rng.normal(size=behind.shape)

    def ends(ask):
        both = [
            ask({name: one + s * motions[name] for name, one in given.items()}, s)
            for s in (step, -step)
        ]
        return (both[0] - both[1]) / (2 * step)

    asked = {f"d_{name}": one for name, one in motions.items()}
    image, moves = gradients.composite_jvp(
        fragments(given), technique, background=behind, d_background=moved, **asked
    )
    f = fragments(given)
    np.testing.assert_array_equal(image, moit.composite(f, technique, background=behind))
    wanted = ends(
        lambda one, s: moit.composite(fragments(one), technique, background=behind + s * moved)
    )
    np.testing.assert_allclose(moves, wanted, rtol=1e-6, atol=1e-8)
    del asked["d_color"]
    total, moves = gradients.total_transmittance_jvp(f, technique, **asked)
    np.testing.assert_array_equal(total, moit.total_transmittance(f, technique))
    wanted = ends(lambda one, _: moit.total_transmittance(fragments(one), technique))
    np.testing.assert_allclose(moves, wanted, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("shape", ((0, 3), (2, 0), (2, 2)))
@pytest.mark.parametrize("coloured", (False, True))
def test_empty_images_stand_still(shape, coloured):
    none, three = np.zeros(0), np.zeros((0, 3))
    given = {"color": three, "transmission": three if coloured else None, "shape": shape}
    f = moit.Fragments(np.zeros(shape[0] * shape[1] + 1, int), none, none, **given)
    for jvp in (gradients.composite_jvp, gradients.total_transmittance_jvp):
        answer, moves = jvp(f, "power4", d_alpha=none, d_depth=none)
        assert moves.shape == answer.shape and not moves.any()


def test_motions_that_do_not_fit_are_refused():
    f = fragments(numbers(False))
    with pytest.raises(ValueError, match=r"d_alpha: expected shape \(12,\), got \(3,\)"):
        gradients.composite_jvp(f, "sorted", d_alpha=np.ones(3))
    with pytest.raises(ValueError, match="d_transmission: the fragments have no transmission"):
        gradients.composite_jvp(f, "sorted", d_transmission=np.ones((12, 3)))
    with pytest.raises(ValueError, match=r"d_background: expected shape \(3,\) or \(2, 2, 3\)"):
        gradients.composite_jvp(f, "sorted", d_background=np.ones(2))
    with pytest.raises(ValueError, match="d_depth"):
        gradients.total_transmittance_jvp(f, "sorted", d_depth=np.full(12, np.nan))
