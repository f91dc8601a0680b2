"""Passes that take a pixel's fragments one after the other: what other fragments than some show.

test_gpu_arrays.py asks all techniques about some fragments; here are those that only such passes
could get wrong. Where llvmpipe computes in C's order, bits are C's, and there is no tolerance.
"""

import gpu
import numpy as np
import pytest

import moit
from moit.gpu import passes
from moit.gpu.bindings import SOFTWARE_ITERATIONS
from moit.gpu.questions import Question

# Those that compare depths and multiply, in the order that C does.
BY_ORDER = ["sorted", "depth-peeling4", "depth-peeling32", "kbuffer4", "kbuffer32", "deep-shadow"]
BY_LAYERS = ["adaptive4", "adaptive32", "mlab4", "mlab32(quantized=False,min_alpha=0)"]
BY_LAYERS += ["adaptive8(merge='energy',normalize=True)", "adaptive32(merge='energy')"]
BY_LAYERS += ["mlab4(merge='energy')", "mlab16(merge='energy',quantized=False)"]
BY_SAMPLES = ["stochastic8", "stochastic64(stratified=False)", "hashed-alpha"]
IN_SUMS = ["wavelet8", "wavelet32(bits=16)", "transmittance-function-map32", "fourier31"]
# Means of opacity take functions that C has of its library.
IN_THE_MEAN = ["hybrid4", "hybrid32", "weighted-average"]


def pixels(counts, dtype=np.float32, **made) -> moit.Fragments:
    """Pixels of so many fragments, some at one depth, in any order."""
    rng = np.random.default_rng(3)
    n = int(np.sum(counts))
    depth = rng.uniform(1, 100, n)
    depth[::3] = np.round(depth[::3])
    thin = np.repeat(np.minimum(1, 30 / np.maximum(counts, 1)), counts)
    given = {"alpha": rng.random(n) ** 2 * thin, "color": rng.random((n, 3))} | made
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return moit.Fragments(offsets, depth, depth_range=(1, 100), dtype=dtype, **given)


def answers(f, technique, device, depth=None) -> list[np.ndarray]:
    found = [
        moit.composite(f, technique, device=device, exact=True, background=(0.2, 0.3, 0.4)),
        moit.transmittance(f, technique, device=device, exact=True),
        moit.total_transmittance(f, technique, device=device, exact=True),
    ]
    if depth is not None and moit.technique(technique).has_curve:
        found.append(moit.transmittance(f, technique, depth, device=device, exact=True))
    return found


def most_fragments(technique: str) -> int:
    t, f = moit.technique(technique), pixels([1])
    return (
        SOFTWARE_ITERATIONS
        // Question(gpu.device(), f, t, t.fields_for(f), True, 1).passes.iterations
    )


def test_a_least_number_becomes_the_least_float_that_is_not_below_it():
    rng = np.random.default_rng(0)
    # of halves and whole steps between floats, and of anything
    floats = np.float32(np.append(rng.random(50), [0.001, 0.25, 1 - 2**-24, 2**-140]))
    after = np.nextafter(floats, np.float32(2))
    wide = floats.astype(float)
    step = after.astype(float) - wide
    for x, least in (
        (wide, floats),
        (wide + 1e-9 * step, after),
        (wide + 0.5 * step, after),
        (wide + 0.75 * step, after),
    ):
        assert [passes._at_least(float(one)) for one in x] == [float(one) for one in least]
    assert passes._at_least(0.0) == 0


@pytest.mark.parametrize("technique", [*BY_ORDER, *BY_LAYERS, *BY_SAMPLES])
@pytest.mark.parametrize("dtype", [np.float32, np.float64], ids=["float32", "float64"])
def test_pixels_are_taken_in_cs_order(technique, dtype):
    f = pixels([0, 1, 40, 2, 300, 3, 0, 5, 9], dtype)
    for ours, theirs in zip(
        answers(f, technique, gpu.device()), answers(f, technique, "cpu"), strict=True
    ):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("technique", [*BY_ORDER[:3], BY_ORDER[-1], *BY_LAYERS, *BY_SAMPLES])
def test_a_depth_just_beside_a_fragments_is_no_fragments(technique):
    # Curves are asked in double, between one float and the next.
    f = pixels([3, 7, 0, 20])
    own = f.depth.astype(np.float64)
    depth = np.concatenate([own, own * (1 + 1e-9), own * (1 - 1e-9), np.nextafter(own, 0), [1e300]])
    ours = moit.transmittance(f, technique, depth, device=gpu.device(), exact=True)
    np.testing.assert_array_equal(ours, moit.transmittance(f, technique, depth))


@pytest.mark.parametrize("technique", IN_THE_MEAN)
def test_fragments_that_hardly_cover_lose_no_digits_in_the_mean(technique):
    # 1 - (1 - 1e-12) has 4 digits in double; T, a quotient of such, is held to all of a float's.
    f = pixels([40, 1, 6, 17], alpha=np.random.default_rng(0).random(64) * 1e-12)
    ours = moit.transmittance(f, technique, device=gpu.device(), exact=True)
    np.testing.assert_allclose(ours, moit.transmittance(f, technique), rtol=2e-7)


@pytest.mark.parametrize("technique", [*BY_ORDER, *BY_LAYERS, *BY_SAMPLES, *IN_SUMS, *IN_THE_MEAN])
def test_software_renderers_take_as_many_fragments_as_their_loops_reach(technique):
    device = gpu.device()
    if not device.software:
        pytest.skip("loops of a GPU have no end")
    most = most_fragments(technique)
    f = pixels([most, 3])
    for ours, theirs in zip(
        answers(f, technique, device), answers(f, technique, "cpu"), strict=True
    ):
        np.testing.assert_allclose(ours, theirs, rtol=2e-7, atol=2e-7)
    with pytest.raises(moit.GpuError, match=rf"pixel 1 has {most + 1} fragments"):
        moit.composite(pixels([3, most + 1]), technique, device=device, exact=True)


def test_samples_are_those_of_a_pixels_place_in_the_display():
    f = pixels([9, 4, 17, 6, 0, 30], shape=(2, 3), origin=(-5, 2**31 - 2))
    for technique in BY_SAMPLES:
        ours = moit.transmittance(f, technique, device=gpu.device(), exact=True)
        np.testing.assert_array_equal(ours, moit.transmittance(f, technique))
        assert (ours != moit.transmittance(pixels([9, 4, 17, 6, 0, 30]), technique)).any()


def test_layers_without_colour_answer_as_those_with_it():
    f = pixels([9, 4, 17, 6])
    bare = moit.Fragments(f.offsets, f.depth, f.alpha, depth_range=f.depth_range)
    for technique in BY_LAYERS:
        ours = moit.transmittance(bare, technique, device=gpu.device(), exact=True)
        np.testing.assert_array_equal(ours, moit.transmittance(f, technique))


def test_every_kind_says_how_long_its_loops_are():
    # What is refused on llvmpipe is far from what pictures have.
    for technique in moit.techniques():
        if technique.kind in passes.kinds():
            assert most_fragments(str(technique)) >= 1000
