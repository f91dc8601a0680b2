"""One text means one thing: what C compiles of csrc/kernels, GLSL computes to the same bits.

Nothing below has a tolerance where GLSL meets C: llvmpipe rounds as C does, and `real`, being
precise in GLSL, keeps the order of operations.
"""

import math

import numpy as np
import pytest
from gpu import needs_passes, software_device
from mpmath import mp
from oracle.hard_rays import flat, hard_rays
from oracle.power import BIAS_VECTOR, PUBLISHED_BIAS
from readings import c, glsl
from variants import EVERY

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
def test_sines_and_cosines_of_angles_are_good_to_their_last_bit_for_some_turns(dtype):
    x = np.random.default_rng(6).uniform(-12, 12, 400).astype(dtype)
    with mp.workdps(40):
        angles = [mp.mpf(float(one)) for one in x]
        truth = np.array([[float(mp.cos(one)), float(mp.sin(one))] for one in angles])
    assert np.abs(c.circle_points(x) - truth).max() <= np.finfo(dtype).eps  # measured: .6 of it


@in_both_sizes
def test_what_is_covered_by_little_has_all_its_digits(dtype):
    tail = (10 ** np.random.default_rng(7).uniform(-12, 1, 2000)).astype(dtype)
    exact = -np.expm1(-tail.astype(np.float64))
    off = np.abs(c.elementary("covered_by", tail) - exact) / exact
    # where the one form ends and the other begins, 1 - exp loses a factor of tail
    assert off.max() <= {np.float32: 1.2e-5, np.float64: 2.5e-11}[dtype]
    assert off[tail < {np.float32: 1e-2, np.float64: 1e-5}[dtype]].max() <= 4e-7


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
    # of more fragments llvmpipe would end some techniques' loops
    few = [ray for ray in hard_rays(seed=11, of_each_kind=20) if ray.depth.size <= 900]
    offsets, depth, alpha = flat(few)
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


def states(b0: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(P, m + 1) as shaders have them, of moments (P, m), or complex (P, m / 2)."""
    return np.column_stack([b.view(b0.dtype), b0])


def rules_in_glsl(b: np.ndarray) -> np.ndarray:
    """(P, 3 nodes + 1) rules of moments in both parts, in the moments' own dtype."""
    count = b.shape[1]
    return glsl.factors_of(published(count), states(np.ones(len(b), b.dtype), b))[:, :-1]


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
    single, wide = rules_in_glsl(b), b.astype(np.float64)
    double = c.power_rules(wide, PUBLISHED_BIAS[count], BIAS_VECTOR[count], LEAST_PIVOT, True)
    nodes = count // 2
    np.testing.assert_array_equal(single[:, :nodes], double[:, :nodes].astype(np.float32))
    np.testing.assert_array_equal(single[:, 2 * nodes :], double[:, 2 * nodes :].astype(np.float32))
    both = single[:, :nodes].astype(np.float64) + single[:, nodes : 2 * nodes]
    # twice 24 bits, of nodes that lie in [-2, 2]
    np.testing.assert_allclose(both, double[:, :nodes], rtol=0, atol=2.0**-47)


@for_every_count
def test_rules_of_floats_need_no_pairs_of_numbers(rays, count):
    """With the default bias of floats, a tenth of what covers their rounding, and the least pivot
    that goes with it, single numbers give the rules of pairs to far below a float's digits."""
    _, b = moit.moments.gather(rays, published(count), dtype=np.float32)
    given = b.astype(np.float64), 5e-8, BIAS_VECTOR[count], 2.0**-24
    plain, pairs = (c.power_rules(*given, floats) for floats in (True, False))
    nodes = count // 2
    np.testing.assert_allclose(plain[:, :nodes], pairs[:, :nodes], rtol=0, atol=2e-8)
    np.testing.assert_allclose(plain[:, 2 * nodes :], pairs[:, 2 * nodes :], rtol=2e-6)


@in_both_sizes
@for_every_count
@pytest.mark.parametrize("beta", [0.0, 0.25])
def test_transmittance_of_moments_is_the_same_bits_in_glsl(rays, count, dtype, beta):
    technique = published(count, overestimation=beta)
    b0, b = moit.moments.gather(rays, technique, dtype=dtype)
    _, z = asked(rays, each=12)
    z = z.astype(dtype).reshape(len(b0), -1)
    got = glsl.curves_of_state(technique, states(b0, b), z)
    np.testing.assert_array_equal(got, moit.moments.transmittance(technique, b0, b, z))


# In a technique's own range of depth, which nothing is lost of by warping.
UNWARPED = [
    *(published(count, exclude_self=True) for count in COUNTS),
    *(
        moit.TrigonometricMoments(
            count, bias="published", wrapping_zone=theta, exclude_self=own, warp="none"
        )
        for count in (2, 3, 4)
        for theta in (math.pi / 10, 0.0)
        for own in (False, True)
    ),
    *(
        moit.WaveletTransparency(
            coefficients, bits, projected=projected, exclude_self=own, warp="none"
        )
        for coefficients in (4, 8, 16, 32)
        for bits in (16, 32)
        for projected in ("absorbance", "density")
        for own in (False, True)
    ),
]


# C adds up or multiplies doubles of these in another order, which float32 does not show.
IN_ANOTHER_ORDER = {"unsorted", "weighted-average", "hybrid", "transmittance-function-map"}
CURVE_IN_ANOTHER_ORDER = {"sorted"}


def same_bits(technique, f: moit.Fragments, questions) -> None:
    for ask in questions:
        got, expected = ask(f, technique, device=software_device(), exact=True), ask(f, technique)
        kinds = IN_ANOTHER_ORDER | (CURVE_IN_ANOTHER_ORDER if ask is curve else set())
        inside = getattr(technique, "inside", None)  # of bounds by another exp in double
        if f.depth.dtype == np.float64 and (inside or technique.kind in kinds):
            np.testing.assert_allclose(got, expected, rtol=1e-13, atol=1e-13)
        else:
            np.testing.assert_array_equal(got, expected)


def of_one_count(f: moit.Fragments) -> moit.Fragments:
    """The pixels that have as many fragments as most have, a few of these."""
    of_pixel = f.counts.ravel()
    count = np.bincount(of_pixel[of_pixel > 2]).argmax()
    pixel = np.flatnonzero(of_pixel == count)[:100]
    at = (f.offsets[pixel][:, None] + np.arange(count)).ravel()
    offsets = count * np.arange(len(pixel) + 1)
    return moit.Fragments(offsets, f.depth[at], f.alpha[at], f.color[at], dtype=f.depth.dtype)


def curve(f: moit.Fragments, technique, **where) -> np.ndarray:
    near, far = f.depth_range
    at = np.random.default_rng(14).choice(f.depth, 20).astype(np.float64)
    return moit.transmittance(f, technique, np.append(at, [0.99 * near, 1.01 * far]), **where)


@in_both_sizes
@pytest.mark.parametrize("technique", EVERY, ids=str)
@pytest.mark.filterwarnings("ignore:.*keep sums beyond 65504")
def test_techniques_answer_with_the_same_bits_in_glsl(rays, technique, dtype):
    if technique.engine != "core":
        pytest.skip("per-pixel asks techniques whose loops on llvmpipe end before these rays do")
    needs_passes(technique)
    f = moit.Fragments(
        rays.offsets,
        rays.depth + 1.5,
        rays.alpha,
        np.random.default_rng(15).uniform(0, 2, (len(rays), 3)),
        dtype=dtype,
    )
    if getattr(technique, "inside", None):
        # C's bounds by moments allow for the roundings of a tile's longest pixel, passes for those
        # of each
        f = of_one_count(f)
    questions = [moit.transmittance, moit.total_transmittance, moit.composite]
    same_bits(technique, f, [*questions, curve] if technique.has_curve else questions)


@in_both_sizes
@pytest.mark.parametrize("technique", UNWARPED, ids=str)
def test_unwarped_depth_gives_the_same_bits_in_glsl(rays, technique, dtype):
    low, high = technique.unit_range
    depth = low + (high - low) * ((rays.depth + 1) / 2)
    f = moit.Fragments(rays.offsets, depth, rays.alpha, dtype=dtype, depth_range=(low, high))
    same_bits(technique, f, [moit.transmittance, moit.total_transmittance, curve])


@for_every_count
def test_bounds_are_the_same_bits_in_glsl(rays, count):
    _, b = moit.moments.gather(rays, published(count), dtype=np.float64)
    rules = c.power_rules(b, PUBLISHED_BIAS[count], BIAS_VECTOR[count], LEAST_PIVOT)
    ray_of, z = asked(rays, each=8)
    given = rules, b, ray_of, z.astype(np.float64), 1e-15, 1e-14
    got = glsl.power_bounds(*given)
    np.testing.assert_array_equal(got, c.power_bounds(*given))
    assert (got[:, 0] <= got[:, 1]).all()


@pytest.mark.parametrize("tolerance", [0.0, 0.02, 0.3])
def test_deep_shadow_maps_are_the_same_bits_in_glsl(rays, tolerance):
    f, technique = rays.sorted(), moit.DeepShadowMap(tolerance)
    _, z = asked(f, each=12)
    z = z.astype(np.float64).reshape(len(f.counts), -1)
    expected = [
        moit.transmittance(f[0, p], technique, depth=z[p])[0, 0] for p in range(len(f.counts))
    ]
    np.testing.assert_array_equal(glsl.curves(f, technique, z), expected)


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
