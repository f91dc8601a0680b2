"""The techniques as passes over arrays of fragments, against the core in the same precision.

On llvmpipe, which divides and takes roots exactly, bits are C's but where a sum runs in another
order: there a double may end differently, and the float it becomes with it.
"""

import gpu
import numpy as np
import pytest
from small import some_fragments
from variants import EVERY

import moit

# Half a unit in the last place of numbers around 1, and of what a picture may add up to.
ROUNDING = 2e-7
BACKGROUND = (0.2, 0.3, 0.4)


def hard(dtype=np.float32, seed=0, transmission=False) -> moit.Fragments:
    """Every count of fragments, thin and opaque ones, equal depths and a long range of them."""
    rng = np.random.default_rng(seed)
    counts = [0, 1, 2, 3, 4, 5, 8, 9, 17, 0, 33, 70]
    n = sum(counts)
    depth = np.exp(rng.uniform(0, np.log(1e4), n))
    depth[::5] = np.float32(7)
    depth[100:] = np.sort(rng.choice([2.0, 2.0 + 1e-6, 300.0], n - 100))
    alpha = rng.random(n)
    alpha[::7], alpha[1::11], alpha[2::13] = 0, 1e-6, 0.9999
    alpha[3::17] = 1
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return moit.Fragments(
        offsets,
        depth,
        alpha,
        rng.random((n, 3)) * 4,
        transmission=rng.random((n, 3)) if transmission else None,
        shape=(3, 4),
        depth_range=(1, 1e4),
        dtype=dtype,
    )


SCENES = {
    "random": lambda: some_fragments(height=12, width=13, most=24),
    "hard": hard,
    "level": lambda: moit.Fragments(
        [0, 0, 3, 4], [2, 2, 2, 2], [0.5, 0.2, 1e-3, 0.7], np.eye(4, 3)
    ),
}


def answers(f, technique, device, **same) -> dict:
    gpu.needs_passes(technique)
    found = {
        "composite": moit.composite(
            f, technique, device=device, exact=True, background=BACKGROUND, **same
        ),
        "transmittance": moit.transmittance(f, technique, device=device, exact=True, **same),
        "total": moit.total_transmittance(f, technique, device=device, exact=True, **same),
    }
    if technique.has_curve:
        near, far = f.depth_range
        at = f.depth[:3].astype(float)  # and a double's last digit before and behind
        beside = [np.nextafter(at, end) for end in (-np.inf, np.inf)]
        depth = np.concatenate([np.linspace(0.9 * near, 1.1 * far, 7), at, *beside])
        found["curve"] = moit.transmittance(f, technique, depth, device=device, exact=True, **same)
    return found


def agree(ours: dict, theirs: dict, tolerance: float) -> None:
    for question, answer in ours.items():
        expected = theirs[question]
        assert answer.shape == expected.shape
        assert answer.dtype == expected.dtype
        scale = np.maximum(1, abs(expected))
        worst = (abs(answer - expected) / scale).max(initial=0)
        assert worst <= tolerance, f"{question} differs by {worst}"


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_passes_answer_as_the_core_does(technique, name):
    device = gpu.device()
    f = SCENES[name]()
    agree(answers(f, technique, device), answers(f, technique, "cpu"), ROUNDING)


@pytest.mark.parametrize("technique", moit.techniques(), ids=str)
def test_opaque_fragments_may_stay(technique):
    device = gpu.device()
    f = hard()
    same = {"cull_opaque": False}
    agree(answers(f, technique, device, **same), answers(f, technique, "cpu", **same), ROUNDING)


@pytest.mark.parametrize(
    "technique", [t for t in moit.techniques() if t.supports_transmission], ids=str
)
def test_coloured_transmission_dims_each_channel(technique):
    device = gpu.device()
    f = hard(transmission=True)
    agree(answers(f, technique, device), answers(f, technique, "cpu"), ROUNDING)


@pytest.mark.parametrize("technique", moit.techniques(), ids=str)
def test_doubles_are_computed_in_double(technique):
    device = gpu.device()
    f = some_fragments(height=5, width=7, most=12, dtype=np.float64)
    agree(answers(f, technique, device), answers(f, technique, "cpu"), 1e-13)
