"""One text means one thing: what C compiles of csrc/kernels, GLSL computes to the same bits.

Nothing below has a tolerance where GLSL meets C: llvmpipe rounds as C does, and `real`, being
precise in GLSL, keeps the order of operations.
"""

import math

import numpy as np
import pytest
from mpmath import mp
from oracle.hard_rays import flat, hard_rays
from oracle.power import BIAS_VECTOR, PUBLISHED_BIAS
from readings import c, glsl

import moit

SIZES = [np.float32, np.float64]
COUNTS = [4, 6, 8]
in_both_sizes = pytest.mark.parametrize("dtype", SIZES, ids=["float32", "float64"])
for_every_count = pytest.mark.parametrize("count", COUNTS)
by_every_compiler = pytest.mark.parametrize("compiler", c.COMPILERS)

# Below this a pivot is rounding alone (csrc/core/techniques/moments.c, at the published bias).
LEAST_PIVOT = 1e-15


def arguments(function: str, dtype) -> np.ndarray:
    """What a function of elementary.h takes, its ends included, in many sizes."""
    rng = np.random.default_rng(5)
    tiny, n = np.finfo(dtype).tiny, 20_000
    least = {np.float32: -90.0, np.float64: -720.0}[dtype]  # 0 from -87 and -708 on
    largest = np.finfo(dtype).max
    near_one = 1 + rng.choice([-1, 1], n) * 10 ** rng.uniform(-8, -1, n)
    found = {
        "exponential": [rng.uniform(least, 0, n), -(10 ** rng.uniform(-9, 1, n)), [0, -80, 1, 80]],
        "logarithm": [
            2 ** rng.uniform(np.log2(tiny), np.log2(largest), n),
            near_one,
            [tiny, 1, largest],
        ],
        "absorbance": [rng.uniform(0, 1, n), 10 ** rng.uniform(-12, 0, n), [0, 1 - 0.5 / 256]],
    }
    turns = [rng.uniform(-4, 4, n), np.arange(-32, 33) / 8, near_one, 2 ** rng.uniform(-40, 19, n)]
    found |= {"cosine_of_turns": turns, "sine_of_turns": turns}
    x = np.concatenate(found[function]).astype(dtype)
    return np.minimum(x, np.nextafter(dtype(1), dtype(0))) if function == "absorbance" else x


@in_both_sizes
@pytest.mark.parametrize(
    "function", ["exponential", "logarithm", "absorbance", "cosine_of_turns", "sine_of_turns"]
)
def test_elementary_functions_are_the_same_bits_in_glsl(function, dtype):
    x = arguments(function, dtype)
    np.testing.assert_array_equal(glsl.elementary(function, x), c.elementary(function, x))


def test_elementary_functions_are_good_to_an_ulp_in_float32():
    # Beside float64, which is exact here. The worst of four million: 1.24, 0.84 and 1.44. Where an
    # exponential's argument is large, ln(2) n takes half an ulp; an absorbance adds the rounding of
    # its correction to that of a logarithm.
    for function, exact, ulps in (
        ("exponential", np.exp, 1.3),
        ("logarithm", np.log, 0.9),
        ("absorbance", lambda x: -np.log1p(-x), 1.5),
    ):
        x = arguments(function, np.float32)
        x = x[x > -87] if function == "exponential" else x
        truth = exact(x.astype(np.float64))
        error = np.abs(c.elementary(function, x) - truth) / np.spacing(np.abs(truth).astype("f4"))
        assert error.max() <= ulps, function


def test_quarters_and_eighths_of_turns_are_where_they_are_on_the_circle():
    x = np.array([0, 0.25, 0.5, 0.75, 1, -0.25, -0.5, 1e5 + 0.25, 0.125, -0.375])
    cosine, sine = (c.elementary(f"{name}_of_turns", x) for name in ("cosine", "sine"))
    assert cosine[:8].tolist() == [1, 0, -1, 0, 1, 0, -1, 0]
    assert sine[:8].tolist() == [0, 1, 0, -1, 0, -1, 0, 1]
    np.testing.assert_allclose(cosine[8:], [0.5**0.5, -(0.5**0.5)], rtol=4e-16)
    np.testing.assert_allclose(sine[8:], [0.5**0.5, -(0.5**0.5)], rtol=4e-16)


def test_sines_and_cosines_are_good_to_two_ulps():
    # of the larger of both: small ones near a quarter of a turn are as good as their angle, too
    for dtype, ulp in ((np.float32, 2.0**-24), (np.float64, 2.0**-53)):
        x = arguments("sine_of_turns", dtype)
        with mp.workdps(40):
            angles = [2 * mp.pi * mp.mpf(float(one)) for one in x[::40]]
            for name, function in (("cosine_of_turns", mp.cos), ("sine_of_turns", mp.sin)):
                truth = np.array([float(function(angle)) for angle in angles])
                error = np.abs(c.elementary(name, x)[::40].astype(np.float64) - truth)
                # float64's truth has an error of half an ulp of its own
                assert error.max() <= 2 * ulp, (dtype, name)


@in_both_sizes
@pytest.mark.parametrize("kind", range(6))
def test_blend_weights_are_the_same_bits_in_glsl(kind, dtype):
    rng = np.random.default_rng(kind)
    n = 10_000
    fragments = np.stack(
        [10 ** rng.uniform(-3, 5, n), rng.random(n), rng.random(n), rng.uniform(0, 3, n)], axis=1
    ).astype(dtype)
    fragments[:4, 1:3] = [[0, 0], [0, 1], [1, 0], [1, 1]]
    got = glsl.blend_weights(kind, fragments)
    np.testing.assert_array_equal(got, c.blend_weights(kind, fragments))
    assert np.ptp(got) > 0


@pytest.fixture(scope="module")
def rays() -> moit.Fragments:
    """Hard rays of every kind, ordinary ones, and an empty one, with depths in [-1, 1]."""
    offsets, depth, alpha = flat(hard_rays(seed=11, of_each_kind=20))
    rng = np.random.default_rng(12)
    counts = np.append(rng.integers(1, 30, 500), 0)
    more = int(counts.sum())
    return moit.Fragments(
        np.concatenate([offsets, offsets[-1] + np.cumsum(counts)]),
        np.concatenate([depth, rng.uniform(-1, 1, more)]),
        np.concatenate([alpha, rng.uniform(0, 0.99, more)]),
    )


def published(count: int, **options) -> moit.PowerMoments:
    return moit.PowerMoments(count, bias=PUBLISHED_BIAS[count], warp="none", **options)


def rules_in_glsl(b: np.ndarray) -> np.ndarray:
    """Rules of moments in both parts, in the moments' own dtype."""
    count = b.shape[1]
    given = PUBLISHED_BIAS[count], BIAS_VECTOR[count], LEAST_PIVOT
    return glsl.power_rules(b, *given, stored=b.dtype)


def asked(f: moit.Fragments, each: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays and depths to ask of them: at, beside and between fragments; (n,) each."""
    rng = np.random.default_rng(13)
    z = np.empty((len(f.counts), each), np.float32)
    for p, (start, end) in enumerate(zip(f.offsets, f.offsets[1:], strict=False)):
        there = f.depth[start:end] if end > start else np.zeros(1)
        at = rng.choice(there, each) + rng.choice([0, 0, 1], each) * rng.normal(size=each) * 1e-4
        z[p] = np.where(rng.random(each) < 0.3, rng.uniform(-1, 1, each), at)
    return np.repeat(np.arange(len(z)), each), np.clip(z, -1, 1).ravel()


@for_every_count
def test_gauss_rules_are_the_same_bits_in_glsl(rays, count):
    _, b = moit.moments.gather(rays, published(count), dtype=np.float64)
    expected = c.power_rules(b, PUBLISHED_BIAS[count], BIAS_VECTOR[count], LEAST_PIVOT)
    np.testing.assert_array_equal(rules_in_glsl(b), expected)


@for_every_count
def test_rules_stored_as_float_keep_what_rounding_took(rays, count):
    _, b = moit.moments.gather(rays, published(count), dtype=np.float32)
    single, double = rules_in_glsl(b), rules_in_glsl(b.astype(np.float64))
    nodes = count // 2
    np.testing.assert_array_equal(single[:, :nodes], double[:, :nodes].astype(np.float32))
    both = single[:, :nodes].astype(np.float64) + single[:, nodes : 2 * nodes]
    # twice 24 bits, of nodes that lie in [-2, 2]
    np.testing.assert_allclose(both, double[:, :nodes], rtol=0, atol=2.0**-47)


@in_both_sizes
@for_every_count
@pytest.mark.parametrize("beta", [0.0, 0.25])
def test_transmittance_is_the_same_bits_in_glsl(rays, count, dtype, beta):
    technique = published(count, overestimation=beta)
    b0, b = moit.moments.gather(rays, technique, dtype=dtype)
    each = 12
    ray_of, z = asked(rays, each)
    z = z.astype(dtype)
    got = glsl.power_transmittance(rules_in_glsl(b), b0, ray_of, z, np.zeros_like(z), beta)
    expected = moit.moments.transmittance(technique, b0, b, z.reshape(-1, each))
    np.testing.assert_array_equal(got, expected.ravel())


@in_both_sizes
@for_every_count
def test_fragments_that_exclude_themselves_are_the_same_bits_in_glsl(rays, count, dtype):
    technique = published(count, exclude_self=True)
    f = moit.Fragments(rays.offsets, rays.depth.astype(dtype), rays.alpha.astype(dtype))
    b0, b = moit.moments.gather(f, technique)
    own = glsl.elementary("absorbance", np.minimum(f.alpha, dtype(technique.max_alpha)))
    ray_of = np.repeat(np.arange(len(b0)), f.counts)
    got = glsl.power_transmittance(
        rules_in_glsl(b), b0, ray_of, f.depth, own, technique.overestimation
    )
    np.testing.assert_array_equal(got, moit.transmittance(f, technique))


def zone_of(theta: float) -> tuple[float, float, float]:
    """turns, edge and scale of trigonometric_moments.h."""
    k = max(math.tan(theta / 4), 1e-30)
    return 0.25 - theta / (8 * math.pi), k, (1 + k * k) / (2 * k * (1 + 2 * k - k * k))


@in_both_sizes
@pytest.mark.parametrize("exclude_self", [False, True])
@pytest.mark.parametrize("theta", [math.pi / 10, 0.0])
@pytest.mark.parametrize("count", [2, 3, 4])
def test_trigonometric_moments_are_the_same_bits_in_glsl(rays, count, theta, exclude_self, dtype):
    # both passes, against the core
    f = moit.Fragments(rays.offsets, rays.depth.astype(dtype), rays.alpha.astype(dtype))
    technique = moit.TrigonometricMoments(
        count, bias="published", wrapping_zone=theta, exclude_self=exclude_self, warp="none"
    )
    b0, b = moit.moments.gather(f, technique)
    given = zone_of(theta), technique.bias_for(dtype), LEAST_PIVOT
    rules = glsl.trigonometric_rules(b, *given, stored=dtype)
    own = glsl.elementary("absorbance", np.minimum(f.alpha, dtype(technique.max_alpha)))
    ray_of = np.repeat(np.arange(len(b0)), f.counts)
    got = glsl.trigonometric_transmittance(
        rules, zone_of(theta), b0, ray_of, f.depth, own * dtype(exclude_self), 0.25
    )
    np.testing.assert_array_equal(got, moit.transmittance(f, technique))


@for_every_count
def test_bounds_are_the_same_bits_in_glsl(rays, count):
    _, b = moit.moments.gather(rays, published(count), dtype=np.float64)
    rules = rules_in_glsl(b)
    ray_of, z = asked(rays, each=8)
    given = rules, b, ray_of, z.astype(np.float64), 1e-15, 1e-14
    got = glsl.power_bounds(*given)
    np.testing.assert_array_equal(got, c.power_bounds(*given))
    assert (got[:, 0] <= got[:, 1]).all()


@in_both_sizes
@pytest.mark.parametrize("bits", [32, 16])
@pytest.mark.parametrize("coefficients", [4, 8, 16, 32])
def test_wavelets_are_the_same_bits_in_glsl(rays, coefficients, bits, dtype):
    z = ((rays.depth + 1) / 2).astype(dtype)
    f = moit.Fragments(rays.offsets, z, rays.alpha.astype(dtype))
    ray_of = np.repeat(np.arange(len(f.counts)), f.counts)
    for density, exclude_self in [(0, False), (0, True), (1, True)]:
        technique = moit.WaveletTransparency(
            coefficients,
            bits,
            projected=("absorbance", "density")[density],
            warp="none",
            exclude_self=exclude_self,
        )
        held = np.minimum(f.alpha, dtype(technique.max_alpha))
        own = glsl.elementary("absorbance", held)
        levels = coefficients.bit_length() - 1
        cells = glsl.haar_cells(levels, density, bits, f.offsets, f.depth, own)
        asking = own if exclude_self else np.zeros_like(own)
        got = glsl.haar_transmittance(density, cells, ray_of, f.depth, asking)
        np.testing.assert_array_equal(got, moit.transmittance(f, technique))


@pytest.mark.parametrize("tolerance", [0.0, 0.02, 0.3])
def test_deep_shadow_maps_are_the_same_bits_in_glsl(rays, tolerance):
    f = rays.sorted()
    maps = glsl.deep_shadow_maps(f.offsets, f.depth, f.alpha, tolerance)
    each = 12
    ray_of, z = asked(f, each)
    z = z.astype(np.float64)
    got = glsl.deep_shadow(f.offsets, maps, ray_of, z)
    technique = moit.DeepShadowMap(tolerance)
    expected = [
        moit.transmittance(f[0, p], technique, depth=z[p * each : (p + 1) * each])[0, 0]
        for p in range(len(f.counts))
    ]
    np.testing.assert_array_equal(got, np.concatenate(expected))
    ray_of = np.repeat(np.arange(len(f.counts)), f.counts)
    got = glsl.deep_shadow(f.offsets, maps, ray_of, f.depth)
    np.testing.assert_array_equal(got, moit.transmittance(f, technique))


# clang takes vectors of other numbers but the same size for each other unless told not to
STRICT = ["-fsyntax-only", "-fno-lax-vector-conversions"]


def in_dialect(body: str) -> str:
    """A C unit with one function of the dialect."""
    return (
        '#define SCALAR float\n#define LANES 4\n#include "kernels/dialect.h"\n'
        "STRUCT(pair) { real low, high; };\n"
        f"FN real f(real x) {{ {body} }}\nvoid g(real *x) {{ *x = f(*x); }}\n"
    )


@by_every_compiler
@pytest.mark.parametrize(
    "text",
    [
        "return select(x < 0.0, K(0.1), 0.5 * abs(x));",
        "truth t = BOTH(x > 0.0, x < 1.0); return select(t, K(BY_PRECISION(0.1, 0.01)), x);",
        "pair p; p.low = min(x, K(0.3)); p.high = sqrt(max(x, K(0.0))); return p.low + p.high;",
        "real y[3]; for (int i = 0; i < 3; ++i) y[i] = K(1.0 / (i + 1)) * x; return y[0] - y[2];",
        "uint h = (low_bits(x) ^ U(7u)) * 0x9e3779b9u; return share_of(h >> 16);",
        "uint m = U(0u); for (int s = 0; s < 3; ++s) m = m | (one_where(x > 0.5) << s);"
        " return share_of(m);",
        "PRECISE real y = (x - 1.0) + K(1e-9); return clamp(y, K(-1.0), K(1.0));",
    ],
)
def test_a_compiler_accepts_the_dialect(compiler, text):
    build = c.compile_text(in_dialect(text), compiler, *STRICT)
    assert build.returncode == 0, build.stderr


@by_every_compiler
@pytest.mark.parametrize(
    "breach",
    [
        "return x * 0.1;",  # a constant that float cannot hold
        "real y = 0.5; return y + x;",  # a constant standing alone
        "if (x < 0.0) return -x; return x;",  # branches on data
        "return x < 0.0 ? -x : x;",
        "while (x > 1.0) x = 0.5 * x; return x;",
        "return select(x > -1.0 && x < 1.0, x, -x);",
        "int n = x; return K(n);",  # data as a count
        "uint h = 7u; return share_of(h);",  # a whole constant standing alone
        "return x + low_bits(x);",  # a whole number for a number
        "uint h = x; return share_of(h);",
        "return share_of(select(x > 0.5, U(1u), U(0u)));",  # numbers alone are selected
        "return float(x);",  # a cast
        "return x.x;",  # a swizzle
        "return sinf(x);",  # functions that the dialect lacks
        "return mix(x, x, x);",
        "vec2 y; return x;",  # a type that it lacks
    ],
)
def test_a_compiler_rejects_a_breach_of_the_dialect(compiler, breach):
    assert c.compile_text(in_dialect(breach), compiler, *STRICT).returncode != 0
