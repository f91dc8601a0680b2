"""Multi-layer alpha blending with buckets of depth, held to plain lists of layers."""

import itertools
import re

import numpy as np
import pytest
from gpu import software_device

import moit

EXACT = {"quantized": False, "buckets": True}


def over(front, behind):
    """Layers (depth, colour, transmittance) as one, at the front one's depth."""
    return front[0], front[1] + front[2] * behind[1], front[2] * behind[2]


def arrived(layers, one, most):
    """The list after a fragment has come: in front of its equals, the two last blended."""
    at = next((i for i, other in enumerate(layers) if one[0] <= other[0]), len(layers))
    layers = [*layers[:at], one, *layers[at:]]
    if len(layers) > most:
        layers = [*layers[: most - 1], over(*layers[most - 1 :])]
    return layers


def picture(f, own, count, front=0.25, back=0.98, least=0.001):
    depth, alpha, color = f.depth[own], f.alpha[own], f.color[own]
    first = depth[alpha >= front].min(initial=np.inf)
    last = depth[alpha >= back].min(initial=np.inf)
    foremost, others = [], []
    for z, a, c in zip(depth, alpha, color, strict=True):
        one = (z, a * c, 1 - a)
        if z > last or a < least:
            continue
        if z < first:
            foremost = arrived(foremost, one, 1)
        else:
            others = arrived(others, one, count - 1)
    seen, through = np.zeros(3), 1.0
    for _, light, passes in [*foremost, *others]:
        seen, through = seen + through * light, through * passes
    return np.append(seen, 1 - through)


def rays(dtype=np.float64, pixels=60, seed=0):
    """Faint fragments in any order, some that are clear, and a few that are nearly opaque."""
    rng = np.random.default_rng(seed)
    offsets = np.concatenate([[0], np.cumsum(rng.integers(0, 25, pixels))])
    n = offsets[-1]
    alpha = rng.choice([0.0005, 0.05, 0.24, 0.25, 0.6, 0.98, 0.99], n, p=[0.1, 0.4, *[0.1] * 5])
    depth = rng.integers(1, 40, n) / 4.0
    f = moit.Fragments(offsets, depth, alpha, rng.random((n, 3)), shape=(1, pixels), dtype=dtype)
    return f, [slice(a, b) for a, b in itertools.pairwise(offsets)]


@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_buckets_are_lists_of_layers(count, dtype):
    f, pixels = rays(dtype)
    found = moit.composite(f, moit.MultiLayerAlphaBlending(count, **EXACT), cull_opaque=False)
    expected = [picture(f, own, count) for own in pixels]
    np.testing.assert_allclose(found[0], expected, atol=1e-12 if dtype == np.float64 else 2e-6)


def test_ends_of_buckets_are_options():
    f, pixels = rays(seed=1)
    ends = {"front_alpha": 0.5, "back_alpha": 0.6}
    found = moit.composite(f, moit.MultiLayerAlphaBlending(4, **EXACT, **ends))
    expected = [picture(f, own, 4, 0.5, 0.6) for own in pixels]
    np.testing.assert_allclose(found[0], expected, atol=1e-12)
    whole = moit.MultiLayerAlphaBlending(4, **EXACT, front_alpha=0, back_alpha=1)
    rest = moit.MultiLayerAlphaBlending(3, quantized=False)  # the first layer has nothing
    assert np.array_equal(moit.composite(f, whole), moit.composite(f, rest))


def test_faint_fragments_in_front_push_nothing_together():
    """Where one layer takes all of them, clear ones behind come in any order."""
    rng = np.random.default_rng(4)
    depth = np.concatenate([rng.uniform(1, 2, 30), rng.permutation(4) + 3.0])
    alpha = np.concatenate([np.full(30, 0.02), [0.5, 0.6, 0.7, 0.4]])
    color = np.concatenate([np.full((30, 3), 0.5), np.eye(4)[:, :3]])
    f = moit.Fragments([0, 34], depth, alpha, color).shuffled(1)
    exact = moit.composite(f, "sorted")
    assert np.abs(moit.composite(f, "mlab4(quantized=False,buckets=True)") - exact).max() < 1e-12
    assert np.abs(moit.composite(f, "mlab4(quantized=False)") - exact).max() > 0.01


def test_a_curve_is_that_of_the_layers():
    f, _ = rays(seed=2)
    technique = moit.MultiLayerAlphaBlending(3, **EXACT)
    T = moit.transmittance(f, technique, np.array([0.1, 11.0]))
    image = moit.composite(f, technique)
    assert (T[..., 0] == 1).all()
    np.testing.assert_allclose(1 - T[..., 1], image[..., 3], atol=1e-12)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("quantized", [False, True])
def test_a_gpu_has_the_same_bits(dtype, quantized):
    f, _ = rays(dtype, seed=3)
    technique = moit.MultiLayerAlphaBlending(4, quantized=quantized, buckets=True)
    device = software_device()
    image = moit.composite(f, technique, device=device, exact=True)
    assert np.array_equal(image, moit.composite(f, technique))
    T = moit.transmittance(f, technique, device=device, exact=True)
    assert np.array_equal(T, moit.transmittance(f, technique))


def test_triangles_on_a_gpu_are_lists_of_fragments():
    """Where buckets end is known after all have come."""
    scene = moit.scenes.meshes("spheres-mesh")
    technique = moit.technique("mlab3(buckets=True)")
    how = {"size": (48, 32), "report": True}
    drawn = moit.render(scene, technique, device=software_device(), **how)
    mine = moit.render(scene, technique, **how)
    assert not drawn.reason
    np.testing.assert_allclose(drawn.image, mine.image, atol=1e-3)  # half floats


def test_facts_and_errors(tmp_path):
    technique = moit.technique("mlab4(buckets=True)")
    assert str(technique) == "mlab4(buckets=True)"
    assert technique.bits_per_pixel == 4 * 80 + 32 and technique.geometry_passes == 2
    assert technique.exact_up_to == 1 and technique.needs_order
    needed = re.escape("buckets: expected at least 2 layers and merge='last', got 1 and 'last'")
    with pytest.raises(ValueError, match=needed):
        moit.MultiLayerAlphaBlending(1, buckets=True)
    with pytest.raises(ValueError, match="got 4 and 'energy'"):
        moit.MultiLayerAlphaBlending(4, buckets=True, merge="energy")
    with pytest.raises(ValueError, match="back_alpha: expected a number from 0 to 1, got 2"):
        moit.MultiLayerAlphaBlending(4, buckets=True, back_alpha=2)
    with pytest.raises(ValueError, match="one more pass over geometry"):
        moit.export(technique, tmp_path)
