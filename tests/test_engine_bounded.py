"""Bounded neural transmittance as a text for engines, against the same in float64."""

import re

import numpy as np
import pytest
from gpu import software_device
from readings import engine

import moit

BIAS, V = 2.5e-7, 0.375
LEAST = 2.0**-23 * (1 - BIAS / 5e-7)


@pytest.fixture(scope="module", autouse=True)
def _device():
    software_device()  # or skip


def pixels(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(P, K) depths and opacities."""
    rng = np.random.default_rng(seed)
    z = rng.uniform(-1, 1, (300, 8))
    z[:100] = rng.uniform(-1, 1, (100, 1)) + 0.05 * rng.normal(size=(100, 8))
    z[100:150, 2:] = z[100:150, :1]  # two surfaces
    alpha = rng.uniform(0.01, 0.95, z.shape)
    return np.clip(z, -1, 1).astype(np.float32), alpha.astype(np.float32)


def expected(sums: list[np.ndarray], z: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """By orthogonal polynomials in float64, which has digits enough here, and the network."""
    b0 = sums[1].astype(np.float64)
    b1, b2, b3, b4 = (sums[0].astype(np.float64) / b0[:, None]).T
    b1, b3 = (1 - BIAS) * b1, (1 - BIAS) * b3
    b2, b4 = b2 + BIAS * (V - b2), b4 + BIAS * (V - b4)
    s1 = b2 - b1**2
    one = s1 <= LEAST
    s1 = np.where(one, LEAST, s1)
    c21, c22 = b3 - b1 * b2, b4 - b2**2
    u = np.where(one, -b1, c21 / s1 - 2 * b1)
    s2 = np.where(one, 0.25, np.maximum(c22 - c21**2 / s1, LEAST) / s1)
    h = s1 * s2

    d = z.astype(np.float64) - b1[:, None]
    a1, v, e, f = (one_ray[:, None] for one_ray in (s1, u, s2, h))
    p = a1 - d * (d - v)
    at = f / (f + e * d * d + p * p)
    # the other nodes, from a0, and their weights by Christoffel's formula
    B = 0.5 * (v * p + e * d)
    R = np.sqrt(np.maximum(B * B + p * (p * a1 + f), 0))
    in_front = np.zeros_like(d)
    for sign in (-1, 1):
        x = (B + sign * R) / np.where(p == 0, 1e-300, p)
        q = a1 - x * (x - v)
        in_front += np.where(x < d, f / (f + e * x * x + q * q), 0)

    own = -np.log1p(-alpha.astype(np.float64))
    total = b0[:, None]
    least = np.clip(in_front, 0, 1 - own / total)
    room = np.maximum(np.minimum(at, 1 - least) - own / total, 0)
    dev = np.sqrt(np.maximum(s1, 1e-18))
    kurtosis = 1 + ((u / dev) ** 2 + s2 / s1)
    ray = [
        np.log(b0),
        np.log(dev),
        np.clip(u / dev, -6, 6),
        np.log(np.clip(kurtosis, 1, np.exp(6))),
    ]
    seen = [least, room, own, np.clip(d / dev[:, None], -8, 8)]
    seen += [np.broadcast_to(one_ray[:, None], z.shape) for one_ray in ray]
    features = np.stack(seen, -1).reshape(-1, 8)
    beta = 1 / (1 + np.exp(-moit.Network.shipped("neural-bounded").forward(features)))
    return np.exp(-total * (least + beta.reshape(z.shape) * room))


def test_transmittance_is_the_networks():
    z, alpha = pixels(1)
    sums = engine.sums_of("bounded", z, alpha)
    truth = expected(sums, z, alpha)
    error = np.abs(engine.transmittance_of("bounded", sums, z, alpha) - truth)
    assert np.quantile(error, 0.99) < 2e-5
    assert error.max() < 1e-3
    fused = engine.transmittance_of("bounded", sums, z, alpha, fused=True)
    assert np.abs(fused - truth).max() < 1e-3


def test_texts_have_the_weights_that_moit_ships():
    text = (engine.FOLDER / "bounded_network.glsl").read_text(encoding="utf-8")
    found = re.findall(r"-?\d+\.\d+(?:e-?\d+)?", text.split("float[153]")[1])
    packed = moit.Network.shipped("neural-bounded").packed()
    np.testing.assert_array_equal(np.array(found, np.float32), packed)


def test_an_empty_pixel_lets_all_through():
    sums = [np.zeros((2, 4), np.float32), np.zeros(2, np.float32)]
    z = np.array([[-1, 0.5], [0, 1]], np.float32)
    T = engine.transmittance_of("bounded", sums, z, np.zeros_like(z))
    assert (T == 1).all()
