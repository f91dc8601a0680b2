"""Texts for engines of techniques that blend colours or series, against the core."""

import numpy as np
import pytest
from gpu import software_device
from readings import engine

import moit
from moit.kit.networks import rows_of_moments

WEIGHTS = {"blog": 0, "phenomenological": 1, "eq7": 7, "eq8": 8, "eq9": 9, "eq10": 10}
SERIES = {"fourier7": 7, "fourier15": 15}


@pytest.fixture(scope="module", autouse=True)
def _device():
    software_device()  # or skip


def pixels(seed: int, depths: tuple[float, float], most: int = 9, opacities=(1e-3, 0.95)):
    """(P, K) depths and opacities, (P, K, 3) colours, and the same as Fragments."""
    rng = np.random.default_rng(seed)
    z = rng.uniform(*depths, (40, most)).astype(np.float32)
    alpha = rng.uniform(*opacities, z.shape).astype(np.float32)
    color = rng.uniform(0, 1, (*z.shape, 3)).astype(np.float32)
    f = moit.Fragments(
        np.arange(len(z) + 1) * most,
        z.ravel(),
        alpha.ravel(),
        color.reshape(-1, 3),
        depth_range=depths,
    )
    return z, alpha, color, f


def composed(text: str, z, alpha, color, second: str, **defines) -> np.ndarray:
    """(P, 4) premultiplied colour and coverage of one pass; its other target blends by `second`."""
    given = [color.reshape(-1, 3)[:, c] for c in range(3)] + [alpha.ravel(), z.ravel()]
    targets = engine.members(text, "sums")
    terms = engine._run(
        engine.text_of(text),
        defines,
        "sums",
        "accumulate_color(vec3(v0[i], v1[i], v2[i]), v3[i], v4[i])",
        given,
        targets,
    )
    kept = [terms[0].reshape(*z.shape, 4).sum(1)]
    if second == "add":
        kept.append(terms[1].reshape(z.shape).sum(1))
    elif second == "multiply-complement":
        kept.append(np.prod(1 - terms[1].reshape(z.shape), axis=1))
    names = ", ".join(f"v{k}[i]" for k in range(len(kept)))
    return engine._run(engine.text_of(text), defines, "vec4", f"resolve_color(sums({names}))", kept)


def composite(f: moit.Fragments, technique) -> np.ndarray:
    return moit.composite(f, technique).reshape(-1, 4)


@pytest.mark.parametrize("weight", WEIGHTS)
def test_weighted_blending_is_the_cores(weight):
    z, alpha, color, f = pixels(1, (0.5, 100.0))
    technique = moit.WeightedBlended(weight=weight, depth_scale=3.0)
    defines = {
        "WEIGHT": WEIGHTS[weight],
        "DEPTH_SCALE": 3.0,
        "DEPTH_NEAR": 0.5,
        "DEPTH_FAR": 100.0,
    }
    found = composed("weighted_blended", z, alpha, color, "multiply-complement", **defines)
    np.testing.assert_allclose(found, composite(f, technique), atol=3e-6)


def test_weighted_average_and_sum_are_the_cores():
    z, alpha, color, f = pixels(2, (0.5, 100.0), opacities=(1e-4, 0.4))
    alpha[::2] *= 0.01  # faint ones, too
    f = moit.Fragments(f.offsets, z.ravel(), alpha.ravel(), color.reshape(-1, 3))
    average = composed("weighted_average", z, alpha, color, "add")
    np.testing.assert_allclose(average, composite(f, "weighted-average"), atol=1e-6)
    sums = composed("weighted_sum", z, alpha, color, "")
    np.testing.assert_allclose(sums, composite(f, "weighted-sum"), atol=1e-6)


@pytest.mark.parametrize("name", SERIES)
@pytest.mark.parametrize("exclude_self", [False, True])
def test_fourier_opacity_is_the_cores(name, exclude_self):
    z, alpha, _, _ = pixels(3, (-1.0, 1.0))
    d = 0.5 * (z.astype(np.float64) + 1)
    technique = moit.FourierOpacity(
        SERIES[name], bits=32, warp="none", exclude_self=exclude_self, normalize=False
    )
    f = moit.Fragments(np.arange(len(z) + 1) * z.shape[1], d.ravel(), alpha.ravel().astype(float))
    sums = engine.sums_of(name, z, alpha)
    T = engine.transmittance_of(name, sums, z, alpha, fused=True, EXCLUDE_SELF=int(exclude_self))
    np.testing.assert_allclose(T.ravel(), moit.transmittance(f, technique), atol=5e-6)


def test_absorbance_alone_is_spread_evenly():
    z, alpha, _, _ = pixels(4, (-1.0, 1.0))
    sums = engine.sums_of("absorbance", z, alpha)
    T = engine.transmittance_of("absorbance", sums, z, alpha, fused=True)
    total = -np.log1p(-alpha.astype(np.float64)).sum(1)
    np.testing.assert_allclose(T, np.exp(-total[:, None] * (z + 1) / 2), atol=2e-6)


def test_depth_is_warped_as_the_core_does():
    depth = np.geomspace(0.5, 100, 300).astype(np.float32)
    scale = float(2 / np.log2(200))
    defines = {"WARP_SCALE": repr(scale), "WARP_OFFSET": repr(-1 + scale)}
    text = engine.text_of("absorbance")
    z = engine._run(text, defines, "float", "warped(v0[i])", [depth])
    np.testing.assert_allclose(z, 2 * np.log(depth / 0.5) / np.log(200) - 1, atol=6e-7)
    linear = {"WARP_LOG": 0, "WARP_SCALE": repr(2 / 99.5), "WARP_OFFSET": repr(-1 - 1 / 99.5)}
    z = engine._run(text, linear, "float", "warped(v0[i])", [depth])
    np.testing.assert_allclose(z, 2 * (depth - 0.5) / 99.5 - 1, atol=3e-7)


def test_what_is_resolved_covers_what_the_total_absorbs():
    shaded = np.array([[0.2, 0.1, 0.0, 0.4], [0, 0, 0, 0]], np.float32)
    total = np.array([1.5, 0], np.float32)
    found = engine._run(
        engine.text_of("absorbance"), {}, "vec4", "resolve(v0[i], sums(v1[i]))", [shaded, total]
    )
    coverage = 1 - np.exp(-1.5)
    expected = [[0.5 * coverage, 0.25 * coverage, 0, coverage], [0, 0, 0, 0]]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_moment_transparency_is_the_cores():
    z, alpha, _, _ = pixels(5, (-1.0, 1.0))
    d = 0.5 * (z.astype(np.float64) + 1)
    technique = moit.MomentTransparency(warp="none")
    f = moit.Fragments(np.arange(len(z) + 1) * z.shape[1], d.ravel(), alpha.ravel().astype(float))
    b0, b = (one.astype(np.float32) for one in moit.moments.gather(f, technique))
    kept = engine.sums_of("moment_transparency", z, alpha)
    np.testing.assert_allclose(kept[1], b0, rtol=2e-6)
    np.testing.assert_allclose(kept[0] / kept[1][:, None], b, atol=4e-7)
    # totals that are powers of two keep the means' bits
    b0 = 2.0 ** np.round(np.log2(b0))
    sums = [b * b0[:, None], b0, np.ones_like(b0)]
    T = engine.transmittance_of("moment_transparency", sums, z)
    truth = moit.moments.transmittance(technique, b0.astype(np.float64), b.astype(np.float64), d)
    np.testing.assert_allclose(T, truth, atol=1e-4)
    found = engine._run(
        engine.text_of("moment_transparency"),
        engine._with_probe({}),
        "vec4",
        "resolve(vec4(0.2, 0.1, 0.0, 0.4), sums(v0[i], v1[i], v2[i]))",
        [sums[0][:1], sums[1][:1], np.array([0.75], np.float32)],
    )
    np.testing.assert_allclose(found, [[0.125, 0.0625, 0, 0.25]], atol=1e-7)


def test_neural_moments_are_the_cores():
    z, alpha, _, _ = pixels(6, (-1.0, 1.0))
    z = np.float16(z).astype(np.float32)  # extents that half floats hold
    technique = moit.NeuralMoments(warp="none", depth_range="image")
    f = moit.Fragments(np.arange(len(z) + 1) * z.shape[1], z.ravel(), alpha.ravel())
    rows = rows_of_moments(moit.Network.shipped("neural-image"))
    made = ", ".join(f"vec4({', '.join(map(str, row))})" for row in rows)
    # a define that has a declaration behind it
    weights = {"NETWORK": f"WEIGHTS\nconst vec4 WEIGHTS[201] = vec4[201]({made});"}
    kept = engine.sums_of("neural", z, alpha, **weights)
    kept[2] = np.stack([-z.min(1), z.max(1)], axis=1)  # which blends by the greatest
    T = engine.transmittance_of("neural", kept, z, alpha, fused=True, **weights)
    np.testing.assert_allclose(T.ravel(), moit.transmittance(f, technique), atol=2e-5)
    beyond = np.stack([kept[2][:, 1] + 0.01, -kept[2][:, 0] - 0.01], axis=1)
    T = engine.transmittance_of("neural", kept, beyond, fused=True, **weights)
    np.testing.assert_allclose(T[:, 0], np.exp(-kept[1][:, 0]), atol=1e-6)
    assert (T[:, 1] == 1).all()
