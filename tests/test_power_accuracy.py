"""How far power moments are from the 80-digit answer for the same moments, and from the truth.

Targets: 99.9 % of errors of T at most 1e-4 in float32 and 1e-7 in float64 at overestimation .25,
never a NaN. Published float32 code reaches 1.4e-2, 3.3e-2 and 2.9e-3 with 4, 6 and 8 moments.
`python -m tests.oracle` prints more.
"""

import math

import numpy as np
import pytest
from golden import golden
from mpmath import mp, mpf
from oracle import power, rays
from oracle.hard_rays import KINDS, MAX_ALPHA, HardRay, depths_to_ask, flat, hard_rays
from oracle.problems import power_problems
from variants import POWER, POWER_VARIANTS

import moit
from moit import PowerMoments

COUNTS = [4, 6, 8]
TARGET = {"float32": 1e-4, "float64": 1e-7}
precisions = pytest.mark.parametrize("dtype", ["float32", "float64"])
counts = pytest.mark.parametrize("m", COUNTS)


def allowed(evaluations: int) -> int:
    """How many of them may miss a target that 99.9 % must meet."""
    return math.ceil(0.001 * evaluations)


def unit_fragments(hard: list[HardRay], dtype="float32") -> moit.Fragments:
    """Rays as an image whose depth is z already, for warp="none"."""
    return moit.Fragments(*flat(hard), depth_range=(-1, 1), dtype=dtype)


def scene_fragments(hard: list[HardRay], dtype="float64") -> moit.Fragments:
    """The same with positive depths, which the log warp takes back to about z."""
    offsets, depth, alpha = flat(hard)
    return moit.Fragments(
        offsets, 10 ** (depth.astype(dtype) + 1), alpha, depth_range=(1, 100), dtype=dtype
    )


@pytest.mark.parametrize("exclude_self", [False, True])
@precisions
@counts
def test_golden_transmittance_is_met(m, dtype, exclude_self):
    problems, data = golden("problems"), golden(f"power{m}")
    # reconstruction alone does not know a fragment: exclude_self has nothing to leave out
    technique = PowerMoments(
        m, bias=float(data["bias"]), overestimation=0.25, exclude_self=exclude_self
    )
    arrays = (data["b0"], data["b"], problems["eval_depth"])
    T = moit.moments.transmittance(technique, *(a.astype(dtype) for a in arrays))
    assert T.dtype == dtype
    assert np.isfinite(T).all()
    share = data["truth_A_lower"] + 0.25 * data["truth_w0"]
    error = np.abs(T - np.exp(-data["b0"][:, None].astype(float) * share))
    assert np.quantile(error, 0.999) <= TARGET[dtype]


@pytest.mark.parametrize("dtype, beside", [("float32", 1e-3), ("float64", 1e-4)])
@counts
def test_beside_a_gauss_node_the_farthest_node_counts_however_far_it_is(m, dtype, beside):
    """The distribution through z has a node at about 1 / beside, of a share of about its square."""
    rng = np.random.default_rng(m)
    weights, places = rng.dirichlet(np.ones(8), 2), np.sort(rng.uniform(-0.9, 0.9, (2, 8)), axis=1)
    b = np.stack([(weights * places**k).sum(axis=1) for k in range(1, m + 1)], axis=1)
    b = b.astype(dtype).astype(float)
    n = m // 2
    for row in b:
        full = np.append(1, row)
        hankel = np.array([[full[i + j] for j in range(n)] for i in range(n)])
        nodes = np.roots(np.append(1, np.linalg.solve(hankel, -full[n : 2 * n])[::-1])).real
        z = np.sort(np.concatenate([nodes - beside, nodes + beside])).astype(dtype)
        T = moit.moments.transmittance(
            PowerMoments(m, bias=0.0, overestimation=0.25, warp="none"),
            np.ones(1, dtype),
            row[None].astype(dtype),
            z[None],
        )[0]
        with mp.workdps(80):
            ray = power.biased([mpf(x) for x in row], 0)
            exact = [float(power.transmittance(ray, mpf(1), mpf(float(x)), 0.25)) for x in z]
        np.testing.assert_allclose(T, exact, atol=TARGET[dtype] / 4)


@precisions
@counts
def test_hard_rays_are_met_at_every_overestimation(m, dtype):
    problems = power_problems(m, seed=m, of_each_kind=4, depths=5)
    missed = 0
    for beta in (0.0, 0.25, 1.0):
        technique = PowerMoments(m, bias=power.PUBLISHED_BIAS[m], overestimation=beta)
        arrays = (a.astype(dtype) for a in (problems.b0, problems.b, problems.z))
        T = moit.moments.transmittance(technique, *arrays)
        assert np.isfinite(T).all()
        missed += int((problems.error(T, beta) > TARGET[dtype]).sum())
    assert missed <= allowed(3 * problems.z.size)


@precisions
@counts
def test_no_transmittance_is_far_from_the_golden_one(m, dtype):
    # 99.9 % leave four evaluations free; those too stay within what no eye sees
    problems, data = golden("problems"), golden(f"power{m}")
    technique = PowerMoments(m, bias=float(data["bias"]), overestimation=0.25)
    arrays = (data["b0"], data["b"], problems["eval_depth"])
    T = moit.moments.transmittance(technique, *(a.astype(dtype) for a in arrays))
    share = data["truth_A_lower"] + 0.25 * data["truth_w0"]
    error = np.abs(T - np.exp(-data["b0"][:, None].astype(float) * share))
    assert error.max() <= 1e-3


# Two clusters at the ends of the range, found by `python -m tests.oracle 30 10 77` (and 78, 79)
# when float32 missed them by 3e-4 to 4e-2: seed, number among rays of this kind, depths.
FAR_CLUSTERS = [
    (77, 4, [0.96895665, 0.9680447]),
    (78, 20, [0.9681667, 0.9689067]),
    (79, 3, [0.97004336]),
]


@pytest.mark.parametrize(("seed", "number", "z"), FAR_CLUSTERS)
@precisions
@counts
def test_two_far_clusters_are_met(m, dtype, seed, number, z):
    hard = hard_rays(seed, number + 1, kinds=["two far clusters"])[number]
    exact0, exact = rays.moments(hard.depth, hard.alpha, m)
    b0, b = np.float32([float(exact0)]), np.float32([[float(one) for one in exact]])
    z = np.float32([z])
    technique = PowerMoments(m, bias=power.PUBLISHED_BIAS[m], overestimation=0.25)
    T = moit.moments.transmittance(technique, *(a.astype(dtype) for a in (b0, b, z)))
    ray = power.biased(b[0].tolist(), technique.bias)
    truth = [float(power.transmittance(ray, float(b0[0]), float(one), 0.25)) for one in z[0]]
    assert np.abs(T[0] - truth).max() <= TARGET[dtype]


@counts
def test_moments_are_gathered_to_the_last_digits(m):
    # one absorbance in float32 is good to a few units in the last place; sums run in double
    hard = hard_rays(seed=20 + m, of_each_kind=2)
    for dtype, digits in (("float32", 4), ("float64", 40)):
        f = unit_fragments(hard, dtype)
        b0, b = moit.moments.gather(f, PowerMoments(m, warp="none"))
        assert b0.shape == (len(hard),) and b.shape == (len(hard), m)
        assert b0.dtype == dtype and b.dtype == dtype
        epsilon = np.finfo(dtype).eps
        for pixel, ray in enumerate(hard):
            alpha = np.minimum(ray.alpha, np.asarray(MAX_ALPHA, dtype))
            exact0, exact = rays.moments(ray.depth, alpha, m)
            assert abs(b0[pixel] - float(exact0)) <= digits * epsilon * float(exact0)
            assert np.abs(b[pixel] - np.array(exact, float)).max() <= digits * epsilon


@pytest.mark.parametrize("warp", ["log", "linear", "none"])
@precisions
def test_depth_is_warped_as_the_paper_says(warp, dtype):
    # a lone fragment's first moment is its warped depth
    rng = np.random.default_rng(5)
    near, far = (-1, 1) if warp == "none" else (0.25, 4000)
    depth = np.exp(rng.uniform(np.log(0.25), np.log(4000), 200))
    if warp == "none":
        depth = rng.uniform(-1, 1, 200)
    depth = np.array([near, far, *depth], dtype)
    f = moit.Fragments(
        np.arange(len(depth) + 1), depth, np.full(len(depth), 0.5, dtype), depth_range=(near, far)
    )
    _, b = moit.moments.gather(f, PowerMoments(4, warp=warp))
    exact = np.array([float(rays.warped(z, near, far, warp)) for z in depth])
    assert np.abs(b[:, 0] - exact).max() <= 4 * np.finfo(dtype).eps
    assert np.abs(b[:, 0]).max() <= 1


@precisions
@pytest.mark.parametrize("technique", [*POWER, *POWER_VARIANTS], ids=str)
def test_arrival_order_changes_moments_by_at_most_n_epsilons(technique, dtype):
    hard = hard_rays(seed=31, of_each_kind=3)
    f = scene_fragments(hard, dtype)
    b0, b = moit.moments.gather(f, technique)
    allowed_change = f.counts * np.finfo(dtype).eps
    for seed in range(3):
        other0, other = moit.moments.gather(f.shuffled(seed), technique)
        assert (np.abs(other0 - b0) <= allowed_change * b0).all()
        assert (np.abs(other - b) <= allowed_change[:, None]).all()


def separated_surfaces(rng, pixels: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the range, at least .05 apart, and alphas; (pixels, n) in random order."""
    gaps = np.sort(rng.uniform(0, 1 - 0.05 * (n - 1), (pixels, n)), axis=1)
    share = rng.permuted(gaps + 0.05 * np.arange(n), axis=1)
    return share, rng.uniform(0.02, 0.98, (pixels, n))


@pytest.mark.parametrize("beta", [0.0, 0.25, 1.0])
@pytest.mark.parametrize("warp", ["log", "linear", "none"])
@counts
def test_few_surfaces_come_back_when_a_surface_does_not_occlude_itself(m, warp, beta):
    technique = PowerMoments(m, exclude_self=True, bias=0.0, overestimation=beta, warp=warp)
    for n in range(1, m // 2 + 2):
        rng = np.random.default_rng([m, n])
        share, alpha = separated_surfaces(rng, 2000, n)
        depth, depth_range = {
            "log": (np.exp(share * np.log(1000)), (1, 1000)),
            "linear": (10 + 90 * share, (10, 100)),
            "none": (2 * share - 1, (-1, 1)),
        }[warp]
        depth = np.clip(depth, *depth_range)
        f = moit.Fragments(
            np.arange(len(depth) + 1) * n, depth.ravel(), alpha.ravel(), depth_range=depth_range
        )
        T = moit.transmittance(f, technique, dtype=np.float64)
        nearer = depth[:, None, :] < depth[:, :, None]
        exact = np.where(nearer, 1 - alpha[:, None, :], 1.0).prod(axis=2).ravel()
        assert np.isfinite(T).all()
        # what 99 % meet; the rest lies so close that eight moments in double do not hold it
        assert np.quantile(np.abs(T - exact), 0.99) <= 1e-6


@pytest.mark.parametrize("depth_range", [None, (1e-3, 1e6)])
@pytest.mark.parametrize("warp", ["log", "linear", "none"])
@precisions
@counts
def test_one_surface_never_occludes_itself(m, dtype, warp, depth_range):
    rng = np.random.default_rng(m)
    alpha = np.concatenate([rng.uniform(0, MAX_ALPHA, 300), 10 ** rng.uniform(-6, 0, 300)])
    alpha = np.concatenate([alpha, [0, 1e-3, 1e-30, MAX_ALPHA, 0.999, 1 - 1e-6]]).astype(dtype)
    depth = np.exp(rng.uniform(np.log(0.1), np.log(1e5), alpha.size)).astype(dtype)
    if warp == "none":
        depth, depth_range = rng.uniform(-1, 1, alpha.size).astype(dtype), None
    offsets = np.arange(alpha.size + 1)
    f = moit.Fragments(offsets, depth, alpha, depth_range=depth_range)
    T = moit.transmittance(f, PowerMoments(m, exclude_self=True, warp=warp))
    assert T.dtype == dtype
    assert (T == 1).all()
    alone = moit.Fragments([0, 1], depth[:1], alpha[:1])
    assert moit.transmittance(alone, PowerMoments(m, exclude_self=True, warp=warp))[0] == 1


@counts
def test_excluding_oneself_is_what_the_oracle_says(m):
    # moments of the hard rays themselves, gathered in double; the published bias keeps them tame
    hard = hard_rays(seed=40 + m, of_each_kind=2)
    f = unit_fragments(hard, "float64")
    technique = PowerMoments(
        m, exclude_self=True, bias=power.PUBLISHED_BIAS[m], overestimation=0.4, warp="none"
    )
    T = moit.transmittance(f, technique)
    b0, b = moit.moments.gather(f, technique)
    rng = np.random.default_rng(m)
    error = []
    for pixel in range(len(hard)):
        ray = power.biased(b[pixel].tolist(), technique.bias)
        start, end = f.offsets[pixel : pixel + 2]
        for i in rng.choice(np.arange(start, end), min(4, end - start), replace=False):
            own = -math.log1p(-min(f.alpha[i], MAX_ALPHA))
            z = float(f.depth[i])
            exact = power.transmittance_but_self(ray, b0[pixel], z, own, 0.4)
            error.append(abs(T[i] - float(exact)))
    assert (np.array(error) > TARGET["float64"]).sum() <= allowed(len(error))


@precisions
@pytest.mark.parametrize("technique", [*POWER, *POWER_VARIANTS], ids=str)
def test_an_empty_pixel_lets_all_light_through(technique, dtype):
    depth = np.array([2, 3, 4], dtype)
    for alpha in ([0.5, 0.5, 0.5], [0, 0, 0]):
        f = moit.Fragments([0, 0, 0, 3, 3], depth, np.array(alpha, dtype), shape=(2, 2))
        T = moit.transmittance(f, technique, depth=[1, 2, 3, 5])
        assert (T[0] == 1).all() and (T[1, 1] == 1).all()
        if not any(alpha):
            assert (T == 1).all() and (moit.transmittance(f, technique) == 1).all()


@precisions
@pytest.mark.parametrize("technique", [*POWER, *POWER_VARIANTS], ids=str)
def test_a_lone_faint_fragment_counts(technique, dtype):
    for alpha in (1e-3, 1e-6):
        f = moit.Fragments([0, 1], [5], [alpha], [[1, 1, 1]], depth_range=(1, 10), dtype=dtype)
        behind = moit.transmittance(f, technique, depth=[9.5])[0, 0, 0]
        # the bias puts some of the absorbance elsewhere, at most a tenth here
        assert behind == pytest.approx(1 - alpha, abs=0.1 * alpha + float(np.finfo(dtype).eps))
        color = moit.composite(f, technique)[0, 0]
        assert color[0] > 0.7 * alpha
        assert color[3] == pytest.approx(alpha, rel=1e-3 if alpha < 1e-5 else 1e-4)


@precisions
@pytest.mark.parametrize("technique", [*POWER, *POWER_VARIANTS], ids=str)
def test_transmittance_lies_between_that_of_the_ray_and_1(technique, dtype):
    hard = hard_rays(seed=50, of_each_kind=4)
    f = scene_fragments(hard, dtype)
    b0, _ = moit.moments.gather(f, technique)
    # exp in the core and in NumPy may differ in the last place or two, and underflow to 0
    least = np.exp(-b0.astype(float)) * (1 - 64 * np.finfo(dtype).eps)
    least = np.where(least < 2 * np.finfo(dtype).tiny, 0, least)
    T = moit.transmittance(f, technique)
    assert (np.repeat(least, f.counts) <= T).all() and (T <= 1).all()
    curve = moit.transmittance(f, technique, depth=np.geomspace(0.5, 200, 99))[0]
    assert (least[:, None] <= curve).all() and (curve <= 1).all()


@precisions
@pytest.mark.parametrize("technique", [*POWER, *POWER_VARIANTS], ids=str)
def test_curves_never_rise_with_depth(technique, dtype):
    hard = hard_rays(seed=60, of_each_kind=3)
    f = scene_fragments(hard, dtype)
    curve = moit.transmittance(f, technique, depth=np.geomspace(1, 100, 400))[0].astype(float)
    # each point is good to the accuracy that the golden data asks for, no better
    assert np.diff(curve, axis=1).max() <= 2 * TARGET[dtype]


@counts
def test_overestimation_moves_from_the_lower_bound_of_absorbance_to_the_upper(m):
    f = scene_fragments(hard_rays(seed=70, of_each_kind=2))
    depth = np.geomspace(1, 100, 50)
    T = [
        moit.transmittance(f, PowerMoments(m, overestimation=beta), depth=depth)
        for beta in (0, 0.25, 0.5, 0.75, 1)
    ]
    absorbance = -np.log(np.maximum(T, 1e-300))
    assert (np.diff(absorbance, axis=0) >= -1e-12).all()
    known = np.array(T[-1]) > 1e-290
    straight = absorbance[0] + 0.25 * (absorbance[4] - absorbance[0])
    assert np.abs(absorbance[1] - straight)[known].max() <= 1e-10 * (1 + straight[known].max())


@counts
def test_moving_and_stretching_depth_changes_nothing(m):
    # the range moves along, so z is the same but for rounding, which bias keeps small
    hard = hard_rays(seed=80, of_each_kind=2, kinds=["random", "few surfaces", "equally spaced"])
    offsets, depth, alpha = flat(hard)
    depth = depth.astype(float)
    technique = PowerMoments(m, warp="linear", bias=power.PUBLISHED_BIAS[m])
    at = np.linspace(-1, 1, 21)
    here = moit.Fragments(offsets, depth, alpha, depth_range=(-1, 1), dtype="float64")
    there = moit.Fragments(
        offsets, 1000 + 7 * depth, alpha, depth_range=(993, 1007), dtype="float64"
    )
    T = moit.transmittance(here, technique, depth=at)
    moved = moit.transmittance(there, technique, depth=1000 + 7 * at)
    assert np.abs(T - moved).max() <= 1e-6


@counts
def test_a_range_per_pixel_does_not_depend_on_the_image(m):
    hard = hard_rays(seed=90, of_each_kind=1, kinds=["random", "clusters", "smoke and surfaces"])
    f = scene_fragments(hard)
    technique = PowerMoments(m, depth_range="pixel")
    wide = moit.Fragments(f.offsets, f.depth, f.alpha, depth_range=(1e-3, 1e6))
    assert (moit.transmittance(wide, technique) == moit.transmittance(f, technique)).all()


@pytest.mark.parametrize("kind", KINDS)
@counts
def test_moments_of_one_pixel_do_not_touch_the_next(m, kind):
    hard = hard_rays(seed=100, of_each_kind=3, kinds=[kind])
    z = np.stack([depths_to_ask(ray, 0, 7) for ray in hard])
    b0, b = moit.moments.gather(unit_fragments(hard), PowerMoments(m, warp="none"))
    T = moit.moments.transmittance(PowerMoments(m), b0, b, z)
    for pixel in range(3):
        one = slice(pixel, pixel + 1)
        alone = moit.moments.transmittance(PowerMoments(m), b0[one], b[one], z[one])
        assert (alone == T[one]).all()


@counts
def test_a_depth_alone_is_answered_as_among_others(m):
    """Of one depth a pixel lanes are pixels, whose last vector is not full; of more, fragments. An
    empty pixel is one in both."""
    data, problems = golden(f"power{m}"), golden("problems")
    many = np.arange(1100) % len(data["b0"])
    arrays = (data["b0"], data["b"], problems["eval_depth"][:, :2])
    b0, b, z = (a[many].astype(np.float32) for a in arrays)
    b0[::7], b[::7] = 0, 0
    technique = PowerMoments(m, overestimation=0.25)
    among = moit.moments.transmittance(technique, b0, b, z)
    assert (among[::7] == 1).all() and (among[1::7] < 1).any()
    for n in (1, 15, 16, 17, 1025, 1100):
        alone = moit.moments.transmittance(technique, b0[:n], b[:n], z[:n, :1])
        assert alone.tobytes() == np.ascontiguousarray(among[:n, :1]).tobytes()
