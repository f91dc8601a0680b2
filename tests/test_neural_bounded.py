"""Bounded neural transmittance: against an evaluation in plain NumPy, and what holds whatever the
network says."""

import gpu
import numpy as np
import pytest
from oracle.hard_rays import flat, hard_rays
from oracle.power import BIAS_VECTOR
from small import some_fragments
from test_network import random_network

import moit
from moit import BoundedNeural, Network, PowerMoments
from moit.neural.features import features

counts = pytest.mark.parametrize("m", [4, 6])
precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def kind(m: int) -> str:
    return "neural-bounded" if m == 4 else "neural-bounded6"


def technique(m: int, network: Network | None = None, **options) -> BoundedNeural:
    options = {"warp": "none", **options}
    return BoundedNeural(f"power{m}", network, **options)


def constant_network(m: int, output: float) -> Network:
    inputs = m + 4
    weights = [np.zeros((8, inputs)), np.zeros((8, 8)), np.zeros((1, 8))]
    return Network(kind(m), weights, [np.zeros(8), np.zeros(8), np.full(1, output)])


def rays_of(seed: int, pixels: int, least: int, most: int, dtype, apart: float = 0.0):
    """Random surfaces in [-1, 1], no two of a pixel nearer than `apart`."""
    r = np.random.default_rng(seed)
    depth, alpha, counts = [], [], r.integers(least, most + 1, pixels)
    for n in counts:
        z = r.uniform(-1, 1, n)
        while n > 1 and np.diff(np.sort(z)).min() < apart:
            z = r.uniform(-1, 1, n)
        depth.append(z)
        alpha.append(r.uniform(0.05, 0.9, n))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    color = r.random((offsets[-1], 3))
    arrays = (np.concatenate(depth), np.concatenate(alpha), color)
    return moit.Fragments(offsets, *arrays, depth_range=(-1, 1), dtype=dtype)


# ---- In plain NumPy -----------------------------------------------------------------------------


def certain_and_possible(b: np.ndarray, z: float) -> tuple[float, float]:
    """The mass in front of z, and the mass at z, of the distribution with moments (1, b) through z:
    roots of the kernel polynomial and a Vandermonde system (MBOIT, algorithm 1)."""
    n = len(b) // 2
    mean = np.concatenate([[1.0], b])
    hankel = np.array([mean[i : i + n + 1] for i in range(n + 1)])
    kernel = np.linalg.solve(hankel, z ** np.arange(n + 1))
    others = np.roots(kernel[::-1]).real
    nodes = np.concatenate([[z], others])
    weights = np.linalg.solve(np.vander(nodes, increasing=True).T, mean[: n + 1])
    return weights[1:][others < z].sum(), weights[0]


def seen_in_numpy(b0: float, b: np.ndarray, z: float, own: float) -> np.ndarray:
    """The network's inputs, L and W, from the definitions."""
    front, at = certain_and_possible(b, z)
    least = b0 * front
    room = max(b0 * at - own, 0.0)
    mean = np.concatenate([[1.0], b])
    binomial = np.polynomial.polynomial.polypow
    central = [binomial([-b[0], 1.0], k) @ mean[: k + 1] for k in range(len(b) + 1)]
    sd = np.sqrt(central[2])
    standard = [c / sd**k for k, c in enumerate(central)]
    seen = [least / b0, room / b0, own, np.clip((z - b[0]) / sd, -8, 8)]
    seen += [np.log(b0), np.log(sd), np.clip(standard[3], -6, 6)]
    seen += [np.clip(np.log(standard[4]), 0, 6)]
    if len(b) == 6:
        seen += [np.sign(standard[5]) * np.log1p(abs(standard[5])), np.log(standard[6])]
    return np.array([*seen, least, room])


def all_in_numpy(f: moit.Fragments, t: BoundedNeural) -> np.ndarray:
    """(N, columns), of the moments that pixels store in the fragments' precision."""
    b0, b = (array.astype(np.float64) for array in moit.moments.gather(f, t))
    bias, safe = (
        t.bias_for(f.depth.dtype),
        np.array([float(x) for x in BIAS_VECTOR[t.moment_count]]),
    )
    b = (1 - bias) * b + bias * safe
    a = -np.log1p(-np.minimum(f.alpha.astype(np.float64), t.max_alpha))
    pixel = np.repeat(np.arange(len(b0)), f.counts)
    return np.array(
        [
            seen_in_numpy(b0[p], b[p], z, own)
            for p, z, own in zip(pixel, f.depth.astype(np.float64), a, strict=True)
        ]
    )


@counts
@precisions
def test_the_core_answers_as_numpy_does(m, dtype):
    network = random_network(kind(m), seed=1)
    f = rays_of(2, 40, 8, 30, dtype)
    t = technique(m, network)
    seen = all_in_numpy(f, t)
    *inputs, least, room = seen.T
    share = 1 / (1 + np.exp(-network.forward(np.stack(inputs, 1))[:, 0]))
    expected = np.exp(-(least + share * room))
    # what is asked of float32; NumPy's Hankel systems lose some nine of float64's sixteen digits
    tolerance = 1e-5 if dtype is np.float32 else 1e-7
    np.testing.assert_allclose(moit.transmittance(f, t), expected, rtol=0, atol=tolerance)
    found = features(f, t)
    assert found.dtype == np.float64
    # b0 up to 60, and depths in units of a deviation of a tenth
    tolerance = 2e-4 if dtype is np.float32 else 1e-7
    np.testing.assert_allclose(found, seen, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("depth_range", ["image", "pixel"])
@counts
@precisions
def test_features_and_weights_make_the_answer(m, dtype, depth_range):
    network = Network.shipped(kind(m))
    f = some_fragments(height=9, width=11, most=40, dtype=dtype)
    t = technique(m, None, warp="log", depth_range=depth_range)
    *inputs, least, room = features(f, t, cull_opaque=False).T
    share = 1 / (1 + np.exp(-network.forward(np.stack(inputs, 1))[:, 0]))
    expected = np.exp(-(least + share * room))
    found = moit.transmittance(f, t, cull_opaque=False)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5)


# ---- Whatever the network says ------------------------------------------------------------------


@counts
@precisions
@pytest.mark.parametrize("output", [-200.0, 200.0])
def test_a_certain_network_gives_the_bounds_of_the_moments(m, dtype, output):
    f = rays_of(3, 200, 1, 40, dtype)
    found = moit.transmittance(f, technique(m, constant_network(m, output)))
    bias = technique(m).bias_for(dtype)
    beta = float(output > 0)
    bound = PowerMoments(m, warp="none", bias=bias, exclude_self=True, overestimation=beta)
    # L + (L + W - L) against L + W, of up to 60, and the same exponential
    np.testing.assert_allclose(found, moit.transmittance(f, bound), rtol=60e-7, atol=1e-30)


@counts
@pytest.mark.parametrize("seed", range(3))
def test_few_surfaces_are_exact(m, seed):
    network = random_network(kind(m), seed)
    f = rays_of(seed, 300, 1, m // 2 + 1, np.float64, apart=0.1)
    t = technique(m, network, max_alpha=1 - 1e-9)
    exact = moit.transmittance(f, "sorted")
    # bias 1e-15, at gaps of .1 multiplied by some 1e6 where three or four surfaces are
    np.testing.assert_allclose(moit.transmittance(f, t), exact, rtol=0, atol=1e-7)
    bare = moit.composite(f, t, background=(0.3, 0.2, 0.1))
    full = moit.composite(f, "sorted", background=(0.3, 0.2, 0.1))
    np.testing.assert_allclose(bare, full, atol=1e-7)
    single = moit.Fragments(f.offsets, f.depth, f.alpha, depth_range=(-1, 1), dtype=np.float32)
    two = np.repeat(f.counts, f.counts) <= m // 2
    found = moit.transmittance(single, technique(m, network))
    np.testing.assert_allclose(found[two], exact[two], rtol=0, atol=5e-3)  # bias 2.5e-7


@counts
@precisions
@pytest.mark.parametrize("seed", range(3))
def test_answers_never_leave_the_bounds(m, dtype, seed):
    offsets, depth, alpha = flat(hard_rays(seed=seed, of_each_kind=12))
    few = rays_of(10 + seed, 3000, 1, 5, dtype)
    hard = moit.Fragments(offsets, depth, alpha, depth_range=(-1, 1), dtype=dtype)
    t = technique(m, random_network(kind(m), 20 + seed))
    for f in (hard, few):
        found = moit.transmittance(f, t, cull_opaque=False)
        lower, upper = moit.bounds(f, t, cull_opaque=False)
        assert ((lower <= found) & (found <= upper)).all()
        lower, upper = moit.bounds(f, PowerMoments(m, warp="none"), cull_opaque=False)
        outside = np.maximum(lower - found, found - upper)
        if dtype is np.float64 or m == 4:  # bias 1e-15 moves moments by as much
            assert outside.max() <= (1e-12 if dtype is np.float64 else 0)
        else:  # surfaces that float32 does not tell apart
            assert outside.max() < 0.05 and (outside > 0).mean() < 2e-3
        z = np.linspace(-1, 1, 11)
        curve = moit.transmittance(f, t, z, cull_opaque=False)
        lower, upper = moit.bounds(f, t, z, cull_opaque=False)
        assert ((lower <= curve) & (curve <= upper)).all()
        assert np.isfinite(curve).all()


@counts
@precisions
@pytest.mark.parametrize("seed", range(2))
def test_every_ray_has_an_answer(m, dtype, seed):
    least = float(np.finfo(dtype).tiny)
    r = np.random.default_rng(seed)
    many = r.uniform(-1, 1, 10_000), r.uniform(0, 1, 10_000)
    rays = [
        ([], []),
        ([0.25], [0.5]),
        ([0.25], [1e-3]),
        ([0.25], [0.0]),
        ([0.25], [1.0]),
        ([0.1, 0.1, 0.1], [1.0, 0.0, 0.4]),
        ([-1.0, 1.0], [least, least]),
        ([-1.0, 1.0, 0.0], [1.0, 1.0, 1.0]),
        ([-1.0, -0.9, 1.0], [0.0, 0.0, 0.0]),
        ([0.3] * 500, [0.999] * 500),
        many,
    ]
    offsets = np.concatenate([[0], np.cumsum([len(z) for z, _ in rays])])
    depth, alpha = (np.concatenate([ray[i] for ray in rays]) for i in (0, 1))
    f = moit.Fragments(offsets, depth, alpha, depth_range=(-1, 1), dtype=dtype)
    for bias in (None, 0.0, "published", 1.0):
        t = technique(m, random_network(kind(m), seed), bias=bias)
        T = moit.transmittance(f, t, cull_opaque=False)
        total = np.exp(-moit.moments.gather(f, t, cull_opaque=False)[0].astype(float))
        assert np.isfinite(T).all() and (T <= 1).all()
        assert (T >= np.repeat(total, f.counts) * (1 - 1e-3)).all()
        assert np.isfinite(features(f, t, cull_opaque=False)).all()
        assert (T[:4] == 1).all()  # a lone surface, however faint
        curve = moit.transmittance(f, t, [-2.0, -1.0, 0.0, 1.0, 2.0], cull_opaque=False)
        assert np.isfinite(curve).all() and (curve[..., 0] == 1).all()
        np.testing.assert_allclose(curve[0, :, 4], total, rtol=1e-6, atol=1e-37)
        assert (curve[0, 0] == 1).all()


@counts
@precisions
def test_a_curve_is_what_a_surface_of_alpha_0_sees(m, dtype):
    f = rays_of(4, 30, 1, 9, dtype)
    t = technique(m, random_network(kind(m), 3))
    z = np.array([-0.8, -0.3, 0.1, 0.7])
    curve = moit.transmittance(f, t, z)[0]
    for k, depth in enumerate(z):
        offsets = f.offsets + np.arange(len(f.offsets))
        place = f.offsets[1:]
        more = moit.Fragments(
            offsets,
            np.insert(f.depth, place, depth),
            np.insert(f.alpha, place, 0.0),
            depth_range=(-1, 1),
            dtype=dtype,
        )
        found = moit.transmittance(more, t)[offsets[1:] - 1]
        np.testing.assert_array_equal(found, curve[:, k])
    b0, b = moit.moments.gather(f, t)
    alone = moit.moments.transmittance(t, b0, b, np.tile(z, (len(b0), 1)).astype(dtype))
    np.testing.assert_array_equal(alone, curve)


@counts
def test_warps_and_ranges_are_those_of_moments(m):
    """Of depth in [1, 1]'s range or a pixel's own, warped: the same as warping before."""
    f = rays_of(5, 50, 2, 20, np.float64)
    network = random_network(kind(m), 4)
    moved = moit.Fragments(f.offsets, 3 * f.depth + 7, f.alpha, depth_range=(4, 10))
    by_range = moit.transmittance(moved, technique(m, network, warp="linear"))
    # float64 rounds 3 z + 7, and bias is 1e-15
    np.testing.assert_allclose(by_range, moit.transmittance(f, technique(m, network)), atol=1e-6)
    assert technique(m, depth_range="pixel", warp="log").bits_per_pixel == 32 * (m + 1) + 64
    assert technique(m).bits_per_pixel == {4: 160, 6: 224}[m]


# ---- What comes with moit -----------------------------------------------------------------------


def paper_like(seed: int, pixels: int) -> moit.Fragments:
    r = np.random.default_rng(seed)
    counts = r.integers(2, 33, pixels)
    width = np.repeat(r.uniform(0.3, 1, pixels), counts)
    start = np.repeat(r.random(pixels), counts) * (1 - width)
    u = start + width * r.random(counts.sum())
    offsets = np.concatenate([[0], np.cumsum(counts)])
    alpha, color = r.uniform(0.1, 0.5, len(u)), r.random((len(u), 3))
    return moit.Fragments(offsets, 2 * u - 1, alpha, color, depth_range=(-1, 1), dtype=np.float32)


@counts
def test_shipped_networks_beat_one_beta_for_all(m):
    f = paper_like(6, 3000)
    background = np.random.default_rng(7).random((1, 3000, 3))
    exact = moit.composite(f, "sorted", background=background)

    def error(t) -> float:
        return float(np.sqrt(np.mean((moit.composite(f, t, background=background) - exact) ** 2)))

    ours = error(technique(m))
    alone = min(
        error(PowerMoments(m, warp="none", exclude_self=True, overestimation=beta))
        for beta in (0.25, 0.3, 0.4, 0.5)
    )
    assert ours < 0.97 * alone
    assert ours < 0.7 * error(PowerMoments(m, warp="none", bias="published"))


def test_features_are_of_what_is_seen():
    f = moit.Fragments([0, 3], [1.0, 2.0, 3.0], [0.5, 1.0, 0.5], depth_range=(1, 3))
    seen = features(f, "neural-bounded")
    assert seen.shape == (3, 10) and (seen[1:] == 0).all() and seen[0, 2] == -np.log(0.5)
    assert (features(f, "neural-bounded", cull_opaque=False) != 0).any(axis=1).all()
    assert features(f, "neural-bounded6").shape == (3, 12)
    with pytest.raises(ValueError, match="technique: expected one that has a network"):
        features(f, "power4")


def test_options_are_checked():
    with pytest.raises(ValueError, match="moments: expected 'power4', 'power6', got 'power8'"):
        BoundedNeural("power8")
    with pytest.raises(ValueError, match="there is no option 'overestimation'"):
        moit.technique("neural-bounded(overestimation=0.5)")
    with pytest.raises(ValueError, match="bias: expected a number from 0 to 1"):
        BoundedNeural(bias=2)


@pytest.mark.parametrize("name", ["neural-bounded", "neural-bounded6"])
def test_a_gpu_draws_what_the_core_renders(name):
    device = gpu.device()
    ours = moit.render("teapots", name, (48, 32), device=device, exact=True)
    theirs = moit.render("teapots", name, (48, 32))
    # blending adds up in float32, for which passes have the published bias; as for power moments
    assert np.abs(ours - theirs).mean() < 2e-3
