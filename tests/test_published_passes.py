"""The published passes are what was published: yardsticks that answer as the papers' code does."""

import gpu
import numpy as np
import pytest
from golden import golden

from moit.gpu_costs.published import published_texts

# What the authors' float32 code is off by, 99.9 % of evaluations (the golden data's reference).
PUBLISHED = {
    "power4": 1.4e-2,
    "power6": 3.3e-2,
    "power8": 2.9e-3,
    "trig2": 9.3e-3,
    "trig3": 7.4e-3,
    "trig4": 4.1e-3,
}
TEXTS = published_texts()
BETA = 0.25


def answers(text, buffers, count):
    """What a yardstick gives for `count` fragments, and its state; buffers by binding."""
    with gpu.device() as device:
        held = {
            binding: device.context.buffer(one.nbytes, np.ascontiguousarray(one, np.float32))
            for binding, one in buffers.items()
        }
        held[2] = device.context.buffer(4 * (count + 64))
        program = device.compile(compute=text)
        groups = ((count + 63) // 64, 1, 1)
        device.context.dispatch(program, groups, buffers=held, uniforms={})
        found = np.empty(count + 64, np.float32)
        held[2].read(found)
        state = np.empty(buffers[1].shape, np.float32)
        held[1].read(state)
        return found[:count], state


@pytest.mark.parametrize("name", PUBLISHED)
def test_moments_are_read_as_well_as_published(name):
    z, given = golden("problems")["eval_depth"], golden(name)
    b = given["b"].view(np.float32)  # real and imaginary in turn
    state = np.hstack([given["b0"][:, None], b * given["b0"][:, None]]).astype(np.float32)
    fragments = np.stack([z.ravel(), np.zeros(z.size)], axis=1).astype(np.float32)
    buffers = {0: fragments, 1: np.repeat(state, z.shape[1], axis=0)}
    found, _ = answers(TEXTS[name, "transmittance"], buffers, z.size)
    absorbance = given["truth_A_lower"] + BETA * given["truth_w0"]
    off = np.abs(found.reshape(z.shape) - np.exp(-given["b0"][:, None] * absorbance))
    assert np.isfinite(off).all()
    assert np.median(off) < 1e-6
    assert np.quantile(off, 0.999) < 3 * PUBLISHED[name]  # another sample, another compiler


@pytest.mark.parametrize("count", [4, 6, 8])
def test_power_moments_are_what_pass_1_adds(count):
    random = np.random.default_rng(count)
    z, alpha = random.uniform(-1, 1, 64), random.uniform(0, 0.9, 64)
    buffers = {0: np.stack([z, alpha], axis=1), 1: np.zeros((64, count + 1))}
    buffers = {binding: one.astype(np.float32) for binding, one in buffers.items()}
    _, found = answers(TEXTS[f"power{count}", "accumulate"], buffers, 64)
    expected = -np.log1p(-alpha)[:, None] * z[:, None] ** np.arange(count + 1)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6)


def test_few_nodes_of_adaptive_transparency_are_exact():
    """Four fragments fill four nodes; each sees what lies in front of it."""
    depth = np.array([0.3, -0.5, 0.8, 0.1], np.float32)
    alpha = np.array([0.5, 0.25, 0.4, 0.2], np.float32)
    state = np.tile(np.float32([3.4e38, 1.0]), 64 * 4).reshape(64, 8)
    for z, a in zip(depth, alpha, strict=True):
        fragments = np.tile(np.float32([z, a]), 64).reshape(64, 2)
        _, state = answers(TEXTS["adaptive4", "accumulate"], {0: fragments, 1: state}, 64)
    order = np.argsort(depth)
    np.testing.assert_allclose(state[0, 0::2], depth[order])
    past = np.cumprod(1 - alpha[order])
    np.testing.assert_allclose(state[0, 1::2], past, rtol=1e-6)
    fragments = np.stack([np.resize(depth, 64), np.zeros(64)], axis=1).astype(np.float32)
    found, _ = answers(TEXTS["adaptive4", "transmittance"], {0: fragments, 1: state}, 64)
    seen = np.concatenate([[1], past[:-1]])[np.argsort(order)]
    np.testing.assert_allclose(found[:4], seen, rtol=1e-6)


def test_the_lower_bound_of_moment_transparency_is_exact_for_two_surfaces():
    z, absorbance = np.array([-0.4, 0.3]), np.array([0.7, 1.1])
    moments = (absorbance * z ** np.arange(1, 5)[:, None]).sum(1)
    buffers = {
        0: np.stack([np.linspace(-0.9, 0.9, 64), np.zeros(64)], axis=1),
        1: np.tile(moments, (64, 1)),
        3: np.tile([absorbance.sum(), 0], (64, 1)),
    }
    buffers = {binding: one.astype(np.float32) for binding, one in buffers.items()}
    found, _ = answers(TEXTS["moment-transparency", "transmittance"], buffers, 64)
    at = buffers[0][:, 0]
    exact = np.exp(-(absorbance * (z < at[:, None])).sum(1))
    far = np.abs(at[:, None] - z).min(1) > 0.1  # the bias moves surfaces a little
    np.testing.assert_allclose(found[far], exact[far], atol=2e-2)


def test_a_fourier_series_of_an_even_spread_is_its_depth():
    buffers = {
        0: np.stack([np.linspace(-1, 1, 64), np.zeros(64)], axis=1).astype(np.float32),
        1: np.tile(np.float32([2 * 1.5, 0, 0, 0, 0, 0, 0]), (64, 1)),
    }
    found, _ = answers(TEXTS["fourier7", "transmittance"], buffers, 64)
    np.testing.assert_allclose(found, np.exp(-1.5 * np.linspace(0, 1, 64)), rtol=1e-5)


def test_the_network_is_that_of_the_paper():
    random = np.random.default_rng(3)
    shapes = [(7, 32), (32, 16), (16, 1)]
    layers = [(random.normal(0, 0.3, (n, m)), random.normal(0, 0.1, n)) for m, n in shapes]
    weights = np.concatenate([np.hstack([w, b[:, None]]).ravel() for w, b in layers])
    assert weights.size == 801
    z, moments = random.uniform(-0.8, 0.8, 64), random.normal(0, 0.5, (64, 4))
    rest = np.tile([1.3, 5, -0.8, 0.8], (64, 1))
    buffers = {0: np.stack([z, 0 * z], axis=1), 1: moments, 3: rest, 4: weights}
    buffers = {binding: one.astype(np.float32) for binding, one in buffers.items()}
    found, _ = answers(TEXTS["neural", "transmittance"], buffers, 64)
    relative = (np.exp(z) - np.exp(-0.8)) / (np.exp(0.8) - np.exp(-0.8))
    x = np.column_stack([relative, np.full(64, 5), np.full(64, 1.3), moments])
    for w, b in layers[:-1]:
        x = np.maximum(x @ w.T + b, 0)
    said = x @ layers[-1][0].T + layers[-1][1]
    np.testing.assert_allclose(found, 1 / (1 + np.exp(-said[:, 0])), rtol=1e-4)


def test_layers_are_blended_as_published():
    random = np.random.default_rng(7)
    layers = np.concatenate([random.uniform(0, 1, (64, 2, 3)), random.uniform(0, 1, (64, 2, 1))], 2)
    depths = np.sort(random.uniform(-1, 1, (64, 2)), axis=1)
    fragments, colours = random.uniform([-1, 0], 1, (64, 2)), random.uniform(0, 1, (64, 4))
    buffers = {0: fragments, 1: layers.reshape(-1, 4), 3: depths, 4: colours}
    _, found = answers(TEXTS["mlab2", "accumulate"], buffers, 64)
    for p in range(64):
        own = np.append(colours[p, :3] * colours[p, 3], 1 - colours[p, 3])
        place = np.searchsorted(depths[p], fragments[p, 0])
        first, second, third = np.insert(layers[p], place, own, axis=0)
        over = np.append(second[:3] + second[3] * third[:3], second[3] * third[3])
        np.testing.assert_allclose(found.reshape(64, 2, 4)[p], [first, over], atol=1e-6)
