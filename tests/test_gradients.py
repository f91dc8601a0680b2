"""Derivatives against differences of pictures that 60 digits compute from the papers' formulas."""

import dataclasses

import numpy as np
import pytest
from mpmath import mp, mpf

import moit
from moit import gradients
from moit.gradients import composites
from tests.oracle import deep_fragments, front, states
from tests.oracle import foremost as layers
from tests.oracle.hard_rays import flat, hard_rays
from tests.oracle.states import product

NEAR, FAR = 1.0, 6.0
STEP = mpf(10) ** -25
BEHIND = (0.3, 0.5, 0.2)
KINDS = (
    "sorted",
    "unsorted",
    "weighted-sum",
    "weighted-sum(normalize=True)",
    "weighted-average",
    *(f"wboit(weight='{w}')" for w in ("blog", "eq7", "eq8", "eq9", "eq10", "phenomenological")),
    "wboit(bits=16)",  # moves as if it held all digits
    "power4",
    "power4(exclude_self=True, normalize=False)",
    "power6(exclude_self=True, depth_range='pixel')",
    "power8(overestimation=0.5, bias=1e-6, warp='linear')",
    "moment-transparency(passes=1)",
    "moment-transparency(passes=2, bias=1e-6)",
    "moment-transparency(passes=2, exclude_self=True, overestimation=0.25, bias=1e-6)",
    "trig2(bias=1e-6)",
    "trig3(exclude_self=True, normalize=False, bias=1e-6)",
    "trig4(overestimation=0.5, bias=1e-4)",
    "fourier7(bits=32)",
    "fourier15(bits=32, exclude_self=True)",
    "wavelet16",
    "wavelet8(exclude_self=True, projected='density')",
    "transmittance-function-map(bits=32)",
    "transmittance-function-map32(bits=32, exclude_self=True, normalize=False)",
    "slices64(bits=16, cells=64)",
    "neural-slices5(bits=16)",
    "neural",
    "neural(depth_range='image', normalize=False)",
    "dfa",
    "neural-bounded(bias=1e-6)",
    "neural-bounded6(bias=1e-5)",
    "neural-bounded(bias=1e-5, depth_range='pixel')",
    "front2",
    "front1(tail='power6(exclude_self=True, bias=1e-6)', normalize=False)",
    "front2(tail='trig2(bias=1e-6)')",
    "front2(tail='neural-bounded(bias=1e-6)')",
    "depth-peeling3",
    "depth-peeling3(normalize=True)",
    "kbuffer3",
    "hybrid2",
    "hybrid3(normalize=True, core_alpha=0.4)",
)
COLOURED = ("sorted", "unsorted", "weighted-average", "wboit", "power4", "wavelet16", "hybrid2")
COLOURED += ("depth-peeling3(normalize=True)", "front2")


# each channel an image of its own
BY_CHANNEL = ("sorted", "unsorted", *layers.KINDS)


class Ray:
    """A pixel's numbers, in 60 digits."""

    def __init__(self, depth, alpha, color, transmission=None):
        self.depth, self.alpha = depth, alpha
        self.color, self.transmission = color, transmission

    def opacities(self):
        """Of each channel, and their mean."""
        if self.transmission is None:
            return [self.alpha] * 3, self.alpha
        pairs = list(zip(self.alpha, self.transmission, strict=True))
        channels = [[a * (1 - t[c]) for a, t in pairs] for c in range(3)]
        return channels, [mp.fsum(three) / 3 for three in zip(*channels, strict=True)]


def weight(kind, z, alpha, bright):
    d = FAR / (FAR - NEAR) * (z - NEAR) / z
    fall = 0.03 / (mpf(1e-5) + (z / 200) ** 4)
    return {
        "blog": lambda: max(min(1, bright), alpha) * fall,
        "eq9": lambda: alpha * fall,
        "eq7": lambda: alpha * 10 / (mpf(1e-5) + (z / 5) ** 2 + (z / 200) ** 6),
        "eq8": lambda: alpha * 10 / (mpf(1e-5) + (z / 10) ** 3 + (z / 200) ** 6),
        "eq10": lambda: alpha * max(0.01, 3000 * (1 - d) ** 3),
        "phenomenological": lambda: max(
            0.01, min(3000, ((min(1, 10 * alpha) + mpf(0.01)) * (1 - mpf(0.9) * d)) ** 3 * 10**8)
        ),
    }[kind]()


def seen(technique, depth, alpha, bright):
    """Transmittance in front of each fragment, and what a pixel lets through."""
    kind, n = technique.kind, len(alpha)
    if kind == "sorted":
        before = [[a for a, z in zip(alpha, depth, strict=True) if z < own] for own in depth]
        return [product(one) for one in before], product(alpha)
    if kind == "unsorted":
        return [product(alpha[i + 1 :]) for i in range(n)], product(alpha)
    if kind in layers.KINDS:
        return layers.seen(technique, depth, alpha)
    if kind == "front":
        return front.seen(technique, tuple(depth), tuple(alpha), NEAR, FAR)
    if kind == "dfa":
        return deep_fragments.seen(technique, tuple(depth), tuple(alpha), NEAR, FAR)
    total, sum_alpha = product(alpha), mp.fsum(alpha)
    if kind == "weighted-sum":
        if not technique.normalize:
            return [mpf(1)] * n, 1 - sum_alpha
        return [min((1 - total) / sum_alpha, 1)] * n, total
    if kind == "weighted-average":
        total = (1 - sum_alpha / n) ** n
        return [(1 - total) / sum_alpha] * n, total
    if kind == "wboit":
        each = [weight(technique.weight, *one) for one in zip(depth, alpha, bright, strict=True)]
        share = (1 - total) / mp.fsum(a * w for a, w in zip(alpha, each, strict=True))
        return [share * w for w in each], total
    return states.seen(technique, tuple(depth), tuple(alpha), NEAR, FAR)


def picture(technique, ray):
    """(r, g, b, alpha), and the transmittance of each fragment and the totals."""
    channels, net = ray.opacities()
    bright = [a * max(c) for a, c in zip(ray.alpha, ray.color, strict=True)]
    T, total = seen(technique, ray.depth, net, bright)
    if technique.kind in (*states.STATES, "front") and ray.transmission is not None:
        each = [(T, product(one)) for one in channels]
    else:
        each = [seen(technique, ray.depth, one, bright) for one in channels]
    totals = [one[1] for one in each]
    scale, seen_by = mpf(1), T
    if technique.kind == "front":
        parts = front.scale(technique, ray.depth, net, T, total)
        seen_by = [t * part for t, part in zip(T, parts, strict=True)]
    if getattr(technique, "normalize", False) and technique.kind in states.STATES:
        scale = (1 - total) / mp.fsum(a * t for a, t in zip(net, T, strict=True))
    out = []
    for c in range(3):
        through = each[c][0] if technique.kind in BY_CHANNEL else seen_by
        if technique.kind == "depth-peeling":
            drawn = layers.foremost(technique, ray.depth, channels[c])
            through = [t * (i in drawn) for i, t in enumerate(through)]
            if technique.normalize:
                cover = mp.fsum(a * t for a, t in zip(channels[c], through, strict=True))
                scale = (1 - totals[c]) / cover
        light = [a * t * k[c] for a, t, k in zip(ray.alpha, through, ray.color, strict=True)]
        out.append(totals[c] * mpf(BEHIND[c]) + scale * mp.fsum(light))
    out.append(1 - mp.fsum(totals) / 3)
    return out, T, totals if ray.transmission is not None else [total]


def difference(loss, ray, name, i, c=None):
    """Of the loss by one number."""
    found = []
    for step in (STEP, -STEP):
        numbers = list(getattr(ray, name))
        if c is None:
            numbers[i] += step
        else:
            numbers[i] = [x + step * (k == c) for k, x in enumerate(numbers[i])]
        arrays = {"depth": ray.depth, "alpha": ray.alpha, "color": ray.color}
        arrays |= {"transmission": ray.transmission, name: numbers}
        found.append(loss(Ray(**arrays)))
    return float((found[0] - found[1]) / (2 * STEP))


def numbers_of(n, coloured=False, seed=7):
    rng = np.random.default_rng(seed)
    depth, alpha = rng.uniform(NEAR, FAR, n), rng.uniform(0.05, 0.8, n)
    color, transmission = rng.uniform(0, 1, (2, n, 3))
    return depth, alpha, color, transmission if coloured else None


def fragments(numbers, offsets=None, **options):
    depth, alpha, color, transmission = numbers
    return moit.Fragments(
        [0, len(depth)] if offsets is None else offsets,
        depth,
        alpha,
        color,
        transmission=transmission,
        depth_range=(NEAR, FAR),
        **{"dtype": "float64", **options},
    )


@pytest.mark.parametrize(
    ("name", "coloured"), [(k, False) for k in KINDS] + [(k, True) for k in COLOURED]
)
def test_pullbacks_are_differences(name, coloured):
    technique = moit.technique(name)
    numbers = numbers_of(6, coloured)
    f = fragments(numbers)
    with mp.workdps(60):
        ray = Ray(*(one if one is None else [*map(exactly, one)] for one in numbers))
        answers = {
            "image": gradients.composite(f, technique, background=BEHIND),
            "T": gradients.transmittance(f, technique),
            "total": gradients.total_transmittance(f, technique),
        }
        places = [("depth", 2), ("alpha", 0), ("alpha", 4), ("color", 3, 1)]
        places += [("depth", 1), ("depth", 3)] * (
            technique.kind in ("neural", "neural-slices", "dfa")
        )  # the pixel's ends
        places += [("depth", 5)] + [("transmission", 1, 2)] * coloured
        for at, (question, (answer, pullback)) in enumerate(answers.items()):
            seed = np.random.default_rng(3).normal(size=answer.shape)

            def loss(other, at=at, seed=seed):
                given = picture(technique, other)[at]
                return mp.fsum(mpf(s) * x for s, x in zip(seed.ravel(), given, strict=True))

            found = pullback(seed)
            exact = loss(ray)
            # colours of dfa are sums of half floats, too, and all that targets of 16 bits hold
            rounds = name == "wboit(bits=16)" or (question == "image" and name == "dfa")
            slack = 1e-2 if rounds else 1e-6
            assert float((answer * seed).sum()) == pytest.approx(float(exact), abs=slack), question
            for place in places if question == "image" else places[:2]:
                got = getattr(found, place[0])[place[1:]]
                wanted = difference(loss, ray, *place)
                # seven digits fewer than a double has: where two terms of 1e3 leave 1e-3
                assert got == pytest.approx(wanted, rel=1e-9, abs=1e-10), (question, place)


def exactly(one):
    return mpf(float(one)) if np.ndim(one) == 0 else [mpf(float(x)) for x in one]


def test_background_of_each_pixel_and_of_all():
    f = fragments(numbers_of(4), [0, 1, 4, 4])
    seed = np.random.default_rng(1).normal(size=(1, 3, 4))
    for technique in ("sorted", "power4"):
        through = moit.total_transmittance(f, technique)[..., None] * seed[..., :3]
        _, pullback = gradients.composite(f, technique, background=np.ones((1, 3, 3)))
        np.testing.assert_allclose(pullback(seed).background, through, rtol=1e-15)
        _, pullback = gradients.composite(f, technique, background=(1, 1, 1))
        np.testing.assert_allclose(
            pullback(seed).background, through.sum(axis=(0, 1)), rtol=1e-14, atol=1e-15
        )


# What may be asked of any technique at once: empty pixels, alpha 0 and 1, equal depths, the bound
# of alpha, one fragment, opaque ones.
KINKS = (
    [0, 0, 1, 4, 8, 11, 12],
    np.array([2, 3, 3, 3, 1, 6, 2, 2.5, 4, 4, 2, 5.0]),
    np.array([0, 0.5, 0.25, 0.5, 1, 0, 1 - 0.5 / 256, 1, 0.5, 1, 1, 1]),
    np.random.default_rng(0).uniform(0, 1, (12, 3)),
)


@pytest.mark.parametrize("name", (*KINDS, "stochastic8"))
def test_kinks_have_finite_derivatives(name):
    offsets, *numbers = KINKS
    for cull, dtype in ((True, "float32"), (False, "float64")):
        f = fragments((*numbers, None), offsets, dtype=dtype)
        image, pullback = gradients.composite(f, name, cull_opaque=cull, background=BEHIND)
        np.testing.assert_array_equal(
            image, moit.composite(f, name, cull_opaque=cull, background=BEHIND)
        )
        found = pullback(np.ones_like(image))
        for part in (found.depth, found.alpha, found.color, found.background):
            assert part.dtype == dtype
            assert np.isfinite(part).all()
        if moit.technique(name).supports_transmission:
            tinted = fragments(
                (*numbers, np.full((12, 3), [0.0, 0.5, 0]) * [[i % 2] for i in range(12)]),
                offsets,
                dtype=dtype,
            )
            parts = gradients.composite(tinted, name, cull_opaque=cull)[1](image)
            for part in (parts.depth, parts.alpha, parts.color, parts.transmission):
                assert np.isfinite(part).all()
        if cull:  # behind what is opaque, and its own alpha; its colour is seen
            assert not found.alpha[[4, 5, 9, 10, 11]].any()
            assert not found.color[[5]].any()
            assert found.color[4].tolist() == [1, 1, 1]


def test_alpha_one_is_on_the_side_of_less():
    numbers = np.array([2, 1, 3.0]), np.array([1, 0.5, 0.5]), np.eye(3)
    seed = np.array([[[1, 2, 3, 4.0]]])

    def loss(less):
        f = fragments((numbers[0], numbers[1] - [less, 0, 0], numbers[2], None))
        return (seed * moit.composite(f, "sorted", background=BEHIND, cull_opaque=False)).sum()

    f = fragments((*numbers, None))
    _, pullback = gradients.composite(f, "sorted", background=BEHIND, cull_opaque=False)
    assert pullback(seed).alpha[0] == pytest.approx((loss(0) - loss(0.25)) / 0.25, rel=1e-14)


@pytest.mark.parametrize(
    "name",
    ("sorted", "wboit", "power4(bias=1e-6)", "power8(bias=1e-6)", "neural-bounded(bias=1e-6)"),
)
def test_any_number_of_threads_gives_the_same_bits(name):
    rng = np.random.default_rng(4)
    offsets = np.concatenate([[0], np.cumsum(rng.integers(0, 6, 7000))])
    f = fragments(numbers_of(offsets[-1], coloured=True), offsets, dtype="float32")
    seed = rng.normal(size=(*f.shape, 4))
    results = []
    for threads in (1, 3):
        _, pullback = gradients.composite(f, name, threads=threads)
        results.append(pullback(seed))
    for part in ("depth", "alpha", "color", "transmission", "background", "network"):
        np.testing.assert_array_equal(getattr(results[0], part), getattr(results[1], part))
    double = gradients.composite(f, moit.technique(name), dtype="float64")[1](seed)
    # all is double within: there is rounding of what comes out only
    for part in ("alpha", "color"):
        np.testing.assert_allclose(
            getattr(results[0], part), getattr(double, part), rtol=1e-6, atol=1e-6
        )


@pytest.mark.parametrize("count", [4, 6, 8])
def test_hard_rays_have_finite_derivatives(count):
    offsets, depth, alpha = flat(hard_rays(1, 6))
    for dtype in ("float32", "float64"):
        f = moit.Fragments(offsets, depth, alpha, depth_range=(-1, 1), dtype=dtype)
        technique = moit.PowerMoments(count, warp="none")
        T, pullback = gradients.transmittance(f, technique)
        found = pullback(np.ones_like(T))
        assert np.isfinite(found.depth).all()
        assert np.isfinite(found.alpha).all()


@pytest.mark.parametrize("count", [4, 6, 8])
def test_where_moments_areexactly_they_are_sorted_ones(count):
    """Nodes that all but coincide with z, and with those of the rule."""
    rng = np.random.default_rng(5)
    offsets = np.concatenate([[0], np.cumsum(rng.integers(0, count // 2 + 1, 3000))])
    f = fragments(numbers_of(offsets[-1]), offsets)
    seed = rng.normal(size=(*f.shape, 4))
    technique = moit.PowerMoments(count, exclude_self=True)
    _, pullback = gradients.composite(f, technique, background=BEHIND)
    _, exact = gradients.composite(f, "sorted", background=BEHIND)
    found, wanted = pullback(seed), exact(seed)
    # bias, 1e-15 or 1e-14, over powers of gaps between depths, some of 1e-3
    for part, usual, most in (("depth", 1e-5, 0.05), ("alpha", 1e-7, 1e-2), ("color", 1e-7, 1e-2)):
        error = np.abs(getattr(found, part) - getattr(wanted, part))
        assert np.quantile(error, 0.995) < usual
        assert error.max() < most


def test_rays_that_moments_determine_hardly_hang_on_depth():
    """By what bias leaves, 1e-14; and without bias, where no rule tells more, not at all."""
    f = fragments(numbers_of(4), dtype="float64")
    for exclude in (False, True):
        technique = moit.PowerMoments(8, exclude_self=exclude)
        T, pullback = gradients.transmittance(f, technique)
        assert np.abs(pullback(np.ones_like(T)).depth).max() < 1e-10
        none = dataclasses.replace(technique, bias=0)
        assert not gradients.transmittance(f, none)[1](np.ones_like(T)).depth.any()
        curve, pullback = gradients.transmittance(f, technique, [2.0])
        assert not pullback(np.ones_like(curve)).depth.any()


def test_descent_finds_the_opacities_of_a_picture():
    wanted = fragments(numbers_of(5))
    target = moit.composite(wanted, "power6", background=BEHIND)
    depth, alpha, color, _ = numbers_of(5)
    alpha = np.full(5, 0.4)
    losses = []
    for _ in range(200):
        f = fragments((depth, alpha, color, None))
        image, pullback = gradients.composite(f, "power6", background=BEHIND)
        losses.append(float(((image - target) ** 2).sum()))
        alpha = np.clip(alpha - 0.5 * pullback(image - target).alpha, 0.01, 0.99)
    assert losses[-1] < 1e-2 * losses[0]


def test_what_has_no_derivatives_is_refused():
    f = fragments(numbers_of(3))
    with pytest.raises(ValueError, match=r"mlab4 has no .* nearest that has is hybrid4 \(all"):
        gradients.composite(f, "mlab4")
    reasons = composites.REASONS
    without = {t.kind for t in moit.techniques() if not t.has_gradient}
    assert without - {"per-pixel", "python"} == set(reasons)
    assert all(moit.technique(nearest).has_gradient for _, nearest in reasons.values())
    for name, why in (
        ("moment-transparency-lr8", "at its middle"),
        ("moment-transparency(resolution=8, low_resolution='average')", "do not see"),
        ("slices64(resolution=2, total='full', inside='power4')", "block"),
        (moit.WeightedBlended(weight=lambda depth, alpha, color: alpha), "function"),
    ):
        with pytest.raises(ValueError, match=why):
            gradients.transmittance(f, name)
    thick = moit.Fragments([0, 1], [1.0], [0.5], back=[2.0])
    with pytest.raises(moit.FragmentsError, match="back"):
        gradients.total_transmittance(thick, "power4")
    with pytest.raises(moit.FragmentsError, match="color"):
        gradients.composite(moit.Fragments([0, 1], [1.0], [0.5]), "sorted")


def test_seeds_that_do_not_fit_are_refused():
    _, pullback = gradients.composite(fragments(numbers_of(3)), "sorted")
    with pytest.raises(ValueError, match=r"d_image: expected shape \(1, 1, 4\), got \(4,\)"):
        pullback(np.ones(4))
    with pytest.raises(ValueError, match="d_image"):
        pullback(np.full((1, 1, 4), np.nan))
    with pytest.raises(TypeError, match="d_image: expected real numbers"):
        pullback(np.full((1, 1, 4), 1j))


def test_the_catalog_says_which_have_derivatives():
    able = {t.kind for t in moit.techniques() if t.has_gradient}
    drawn = "stochastic"  # which tests/test_gradients_stochastic.py knows on average
    assert able == {moit.technique(name).kind for name in KINDS} | {drawn}
