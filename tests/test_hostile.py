"""What nobody sends on purpose: numbers changed after they were checked, curves asked for far away,
what is hardly there and what hardly differs. Nothing ends the process, nothing spreads, and what is
promised of other fragments holds. tests/hostile.py draws such cases, for hours if one likes."""

import dataclasses
from itertools import pairwise

import gpu
import hostile
import hostile_pixels
import numpy as np
import pytest
from test_bounds import violations
from variants import EVERY, WAVELETS

import moit
from moit import _core

WAVELET = [moit.WaveletTransparency(count) for count in (4, 8, 16, 32)]
BEYOND = [-1e300, -1e38, -1e9, -1000.0, -1.0, -0.01, 0.0, 1e-300, 1e9, 3e9, 1e38, 1e300]
precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64])


# ---- Indices -------------------------------------------------------------------------------------


def several(dtype, seed=0) -> moit.Fragments:
    """Every count of fragments that lanes treat by themselves; depths as no warp would leave them,
    and arrays that stay the caller's."""
    rng = np.random.default_rng(seed)
    counts = [0, 1, 2, 3, 5, 9, 17, 40]
    n = sum(counts)
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        rng.uniform(0.01, 1, n).astype(dtype),
        rng.uniform(0, 1, n).astype(dtype),
        rng.uniform(0, 1, (n, 3)).astype(dtype),
    )


def changed(f: moit.Fragments, every: int, **numbers: float) -> moit.Fragments:
    """With each `every`-th number changed after the check."""
    held = {name: np.array(getattr(f, name)) for name in ("depth", "alpha", "color")}
    g = moit.Fragments(f.offsets, **held, depth_range=f.depth_range)
    with np.errstate(over="ignore"):
        for name, number in numbers.items():
            held[name][::every] = number
    assert g.depth is held["depth"] or np.shares_memory(g.depth, held["depth"])
    return g


@precisions
@pytest.mark.parametrize("technique", EVERY, ids=str)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_no_index_comes_from_numbers_that_were_changed_after_the_check(technique, dtype):
    f = several(dtype)
    for every in (1, 3):
        for number in (np.nan, np.inf, -np.inf, 1e300, -1e300, -1.0, 1e9):
            for name in ("depth", "alpha", "color"):
                g = changed(f, every, **{name: number})
                case = hostile.Case(g, technique, np.array(BEYOND), True)
                for _ in hostile.answers(case, hostile.CHANGED):
                    pass


@precisions
@pytest.mark.parametrize("technique", [t for t in EVERY if t.has_curve], ids=str)
def test_curves_are_known_as_far_as_numbers_go(technique, dtype):
    f = several(dtype)
    near, far = f.depth_range
    total = moit.total_transmittance(f, technique)
    for warp in ("log", "linear", "none"):
        t = technique
        if "warp" in vars(t):
            if warp == "none" and getattr(t, "depth_range", "image") == "pixel":
                continue
            t = dataclasses.replace(t, warp=warp)
            total = moit.total_transmittance(f, t)
        at = np.array([*BEYOND, *np.nextafter([near, far], [-np.inf, np.inf])])
        T = moit.transmittance(f, t, depth=at)
        assert ((0 <= T) & (T <= 1)).all()
        assert (T[..., at < near] == 1).all()
        if t.kind != "per-pixel":
            behind = T[..., at > far * (1 + 1e-6)]
            assert np.abs(behind - total[..., None]).max() <= 4 * np.finfo(dtype).eps


@precisions
@pytest.mark.parametrize("technique", [*WAVELET, *WAVELETS], ids=str)
def test_a_gpu_takes_no_index_from_changed_numbers_either(technique, dtype):
    f = several(dtype)
    for number in (np.nan, np.inf, 1e300, -1e9):
        g = changed(f, 2, depth=number)
        try:
            found = moit.transmittance(g, technique, device=gpu.device(), exact=True)
        except moit.FragmentsError as refused:  # by who looks at numbers once more
            assert "found" in str(refused)
            continue
        assert found.shape == (len(f),)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_meshes_changed_after_the_check_draw_what_is_left():
    position = np.array([[0, 0, 2], [1, 0, 2], [0, 1, 2], [1, 1, 2]], np.float32)
    mesh = moit.Mesh(position, [[0, 1, 2], [1, 2, 3]], [1, 1, 1], 0.5)
    camera = moit.Camera((0, 0, 0), (0, 0, 1))
    held = mesh.vertices
    held.flags.writeable = True
    for number in (np.nan, np.inf, -np.inf, 3e38, 1e-45):
        for corner in range(4):
            for axis in range(3):
                before = held[corner, axis]
                held[corner, axis] = number
                try:
                    assert len(moit.rasterize(mesh, camera, (16, 16))) <= 2 * 256
                except ValueError as refused:  # a range of depth that is none
                    assert "depth" in str(refused)
                held[corner, axis] = before


# ---- Hardly there --------------------------------------------------------------------------------


def smallest(dtype) -> list[float]:
    info = np.finfo(dtype)
    least = float(info.smallest_subnormal)
    return [least, 3 * least, float(info.tiny) / 3, float(info.tiny), 5e-309, 1e-38, 1e-30, 1e-45]


@precisions
@pytest.mark.parametrize("technique", EVERY, ids=str)
def test_what_is_hardly_there_lets_all_through_and_spoils_no_neighbour(technique, dtype):
    alphas = np.array([a for a in smallest(dtype) if dtype(a) > 0], dtype)
    n = len(alphas)
    rng = np.random.default_rng(0)
    # one alone, two of them, one before and one behind a surface; and a neighbour of each
    alpha = [[a] for a in alphas] + [[a, a] for a in alphas] + [[a, 0.5, a, 0.7] for a in alphas]
    alpha += [[0.5, 0.25]] * (3 * n)
    counts = [len(a) for a in alpha]
    depth = np.concatenate([np.sort(rng.uniform(1, 9, k)) for k in counts]).astype(dtype)
    f = moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        depth,
        np.concatenate(alpha).astype(dtype),
        np.ones((len(depth), 3), dtype),
        shape=(3, 2 * n),
        depth_range=(1, 9),
    )
    exact = moit.composite(f, "sorted")
    image = moit.composite(f, technique)
    T = moit.transmittance(f, technique)
    assert np.isfinite(image).all() and np.isfinite(T).all() and (T >= 0).all()
    if technique.kind not in ("wboit", "per-pixel"):  # whose weights share what is covered
        assert (T <= 1).all()
    if technique.stores_moments and getattr(technique, "moment_sets", 1) == 1:
        assert all(np.isfinite(x).all() for x in moit.moments.gather(f, technique))
    one, two = image.reshape(-1, 4)[:n], image.reshape(-1, 4)[n : 2 * n]
    assert np.abs(one).max() < 1e-25 and np.abs(two).max() < 1e-25
    if technique.local:
        neighbour = f[2:, :] if n % 2 else f[1:, :]
        assert (moit.composite(neighbour, technique) == image[-neighbour.shape[0] :]).all()
    assert np.abs(exact - image).max() <= 1.2


@pytest.mark.parametrize("technique", [moit.DeepFragments(), moit.DeepFragments(warp="linear")])
@precisions
def test_what_half_floats_do_not_hold_counts_with_no_more_than_1(technique, dtype):
    for seed in range(40):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(3, 12))
        alpha = rng.choice([0, 1e-45, 1e-38, 1e-30, 1e-8, 1e-7, 0.5, 0.998], n).astype(dtype)
        f = moit.Fragments([0, n], rng.integers(1, 4, n).astype(dtype), alpha, np.ones((n, 3)))
        T = moit.transmittance(f, technique, dtype=dtype)
        assert np.isfinite(T).all() and (T >= 0).all() and (T[alpha < 2.0**-24] <= 1).all()
        weights = (T.astype(float) * alpha).sum()
        total = moit.total_transmittance(f, technique, dtype=dtype)[0, 0]
        assert abs(weights - (1 - total)) <= n * 2.0**-11
        assert np.isfinite(moit.composite(f, technique, dtype=dtype)).all()


# Weights that are shares of what is covered; without them no transmittance is above 1.
OF_MEANS = [moit.WeightedAverage(), moit.HybridTransparency(4), moit.HybridTransparency(1)]


def hardly_opaque(dtype) -> moit.Fragments:
    """Pixels whose sums of opacity have few digits, or none to spare, or many."""
    rng = np.random.default_rng(9)
    least = float(np.finfo(dtype).smallest_subnormal)
    counts = rng.integers(1, 60, 300)
    alpha = [rng.integers(0, 2 ** rng.integers(1, 30), n) * least for n in counts]
    alpha += [10.0 ** rng.uniform(-45, 0, n) for n in counts]
    alpha += [np.full(n, rng.random() * 1e-9) for n in counts]
    n = 3 * int(counts.sum())
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(np.tile(counts, 3))]),
        rng.uniform(1, 9, n),
        np.concatenate(alpha),
        rng.random((n, 3)),
        depth_range=(1, 9),
        dtype=dtype,
    )


@precisions
@pytest.mark.parametrize("technique", OF_MEANS, ids=str)
@pytest.mark.parametrize("device", ["cpu", "gpu"])
def test_what_layers_of_the_mean_opacity_let_through_is_no_more_than_all(technique, dtype, device):
    if device == "gpu":
        device = gpu.software_device()
    f = hardly_opaque(dtype)
    T = moit.transmittance(f, technique, device=device)
    assert (T <= 1).all()
    total = moit.total_transmittance(f, technique, device=device)
    assert ((total >= 0) & (total <= 1)).all()
    # what is so thin that nothing overlaps counts whole
    thin = np.add.reduceat(f.alpha.astype(float), f.offsets[:-1]) < 1e-9
    np.testing.assert_allclose(T[np.repeat(thin, f.counts)], 1, rtol=0, atol=1e-8)


@precisions
@pytest.mark.parametrize("device", ["cpu", "gpu"])
def test_what_weighs_next_to_nothing_beside_what_weighs_nothing_is_no_infinity(dtype, device):
    """Its share is what is covered over next to nothing, which no number may hold."""
    if device == "gpu":
        device = gpu.software_device()
    least = float(np.finfo(dtype).smallest_subnormal)
    f = moit.Fragments(
        [0, 3, 6],
        [1, 2, 3, 1, 2, 3],
        [0.5, 0.25, least, 0.5, 0.25, 1e-20],
        np.tile([1.0, 0.5, 0.25], (6, 1)),
        dtype=dtype,
    )
    technique = moit.WeightedBlended(weight=lambda depth, alpha, color: np.where(depth > 2, 1, 0))
    T = moit.transmittance(f, technique, device=device)
    image = moit.composite(f, technique, device=device)
    assert np.isfinite(T).all() and (T >= 0).all()
    assert np.isfinite(image).all() and (image[0, 0, :3] <= [1, 0.5, 0.25]).all()
    covered = 1 - 0.5 * 0.75
    np.testing.assert_allclose(image[0, 1], covered * np.array([1, 0.5, 0.25, 1]), rtol=1e-6)


@precisions
def test_facts_of_pixels_are_numbers_whatever_their_depths(dtype):
    """What is chosen for a pixel hangs on moments of depth, up to the fourth power."""
    rng = np.random.default_rng(5)
    depth, alpha, color = rng.uniform(1, 9, 40), rng.random(40), rng.random((40, 3))
    usual = None
    for scale in (1.0, 2.0**90, 2.0**-90, 2.0**900, 2.0**-900):
        if not 1e-30 < scale < 1e30 and dtype is np.float32:
            continue
        f = moit.Fragments([0, 20, 40], depth.astype(dtype) * scale, alpha, color, dtype=dtype)
        facts = _core.pixel_facts(f, True, 1)
        assert np.isfinite(facts).all()
        usual = facts if usual is None else usual
        assert (facts == usual).all()  # of depth they are shares, and moments by deviations


# ---- Order ---------------------------------------------------------------------------------------


def close_together(pixels: int, n: int, apart: float, seed: int) -> moit.Fragments:
    rng = np.random.default_rng(seed)
    depth = 1 + apart * rng.random(n * pixels)
    depth[:n] = np.linspace(1, 1 + apart, n)
    return moit.Fragments(
        np.arange(pixels + 1) * n,
        depth,
        rng.random(n * pixels) * 0.1,
        rng.random((n * pixels, 3)),
        depth_range=(0.5, 200),
    )


FREE_OF_ORDER = [
    t
    for t in [
        *EVERY,
        *(
            moit.TrigonometricMoments(count, depth_range="pixel", wrapping_zone=zone)
            for count in (2, 3, 4)
            for zone in (0.0, 1e-12)
        ),
        *(moit.PowerMoments(count, depth_range="pixel", bias=0.0) for count in (4, 6, 8)),
    ]
    if t.order_independent and not hostile.rounds_each(t)
]


@pytest.mark.parametrize("technique", FREE_OF_ORDER, ids=str)
def test_float64_does_not_show_who_came_first(technique):
    """Moments of surfaces a thousandth apart show their last digits in the third of a picture."""
    for apart, n in ((1e-3, 12), (1e-6, 5), (1e-1, 40)):
        f = close_together(60, n, apart, seed=2)
        first = moit.composite(f, technique)
        T = moit.transmittance(f, technique)
        for seed in range(4):
            g = f.shuffled(seed)
            np.testing.assert_allclose(moit.composite(g, technique), first, rtol=0, atol=1e-12)
            # the same depths, so their place among themselves
            order = np.concatenate(
                [
                    np.searchsorted(f.depth[s:e], g.depth[s:e], sorter=np.argsort(f.depth[s:e]))
                    for s, e in pairwise(f.offsets)
                ]
            )
            ranked = np.concatenate(
                [T[s:e][np.argsort(f.depth[s:e])] for s, e in pairwise(f.offsets)]
            )
            start = np.repeat(f.offsets[:-1], f.counts)
            np.testing.assert_allclose(
                moit.transmittance(g, technique), ranked[start + order], rtol=0, atol=1e-12
            )


def far_apart(seed: int) -> moit.Fragments:
    """Depths of all sizes, of which a range sees little but the greatest; and some so thick that
    hardly anything is seen."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(2, 60, 40)
    n = int(counts.sum())
    ulps = rng.choice(np.unique((2.0 ** rng.uniform(0, 50, 9 * n)).astype(int)), n, replace=False)
    depth = 10.0 ** rng.uniform(-300, 300, n) if seed % 2 else 1 + 2.0**-52 * ulps
    alpha = rng.random(n) if seed < 4 else rng.choice([0.25, 0.5, 1 - 2.0**-50], n)
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]), depth, alpha, rng.random((n, 3))
    )


@pytest.mark.parametrize(
    "technique",
    [
        *FREE_OF_ORDER,
        *(
            moit.TransmittanceFunctionMap(
                count, bits=32, warp=warp, depth_range=depth_range, exclude_self=excluded
            )
            for count in (1, 2, 8, 32)
            for warp in ("log", "linear")
            for depth_range in ("image", "pixel")
            for excluded in (False, True)
        ),
    ],
    ids=str,
)
def test_nor_do_depths_of_all_sizes(technique):
    """Where most of a pixel lies at one end of its range, weights relative to their sum show what
    was rounded off; and numbers beyond those of single precision are other numbers, too."""
    for seed in range(8):
        f = far_apart(seed)
        how = {"background": (0.5, 0, 1), "cull_opaque": False}
        first = moit.composite(f, technique, **how)
        for order in range(2):
            moved = moit.composite(f.shuffled(order), technique, **how)
            np.testing.assert_allclose(moved, first, rtol=0, atol=1e-12)


# ---- Bounds --------------------------------------------------------------------------------------


@precisions
@pytest.mark.parametrize("max_alpha", [1e-2, 0.9999, 1 - 1e-9])
@pytest.mark.parametrize(
    "technique", ["moment-transparency", "two-moments-pass", "power4", "power8"]
)
def test_bounds_count_what_max_alpha_took_to_the_last_digit(technique, max_alpha, dtype):
    rng = np.random.default_rng(3)
    counts = [1, 1, 1, 2, 5, 5, 9, 14]
    n = sum(counts)
    alpha = 1 - 10 ** rng.uniform(-6.5, -1, n)
    depth = 1 + 10 ** rng.uniform(-6, 0, n)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    f = moit.Fragments(offsets, depth.astype(dtype), alpha.astype(dtype))
    at = np.array([0.5, 1.1, 3.0])
    for depth_range in ("image", "pixel"):
        t = dataclasses.replace(
            moit.technique(technique), max_alpha=max_alpha, bias=0.0, depth_range=depth_range
        )
        assert violations(f, *moit.bounds(f, t)) == []
        assert violations(f, *moit.bounds(f, t, depth=at), depth=at) == []


# ---- The technique of each pixel's own -----------------------------------------------------------


@pytest.mark.parametrize("shape", [(4, 1), (2, 2), (1, 4)])
@pytest.mark.parametrize("certify", [False, True])
@pytest.mark.parametrize("coloured", [False, True])
def test_each_pixel_has_a_total_of_its_own(shape, certify, coloured):
    rng = np.random.default_rng(0)
    transmission = rng.random((12, 3)) * 0.2 if coloured else None
    f = moit.Fragments(
        np.arange(5) * 3,
        rng.uniform(1, 2, 12),
        rng.random(12),
        rng.random((12, 3)),
        shape=shape,
        transmission=transmission,
    )
    found = moit.total_transmittance(f, moit.PerPixel(1e-9, certify=certify))
    exact = moit.total_transmittance(f, "sorted")
    assert found.shape == exact.shape == (*shape, *((3,) if coloured else ()))
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-8)


# ---- Cases drawn at random -----------------------------------------------------------------------


@pytest.mark.parametrize("first", range(0, 1000, 100))
def test_no_case_breaks_a_promise(first):
    broken = {number: hostile.tried(number) for number in range(first, first + 100)}
    assert {number: words for number, words in broken.items() if words} == {}


@pytest.mark.parametrize("first", range(0, 2 * len(EVERY), 50))
def test_no_image_of_many_pixels_breaks_a_promise(first):
    """In small; `python -m tests.fuzz --target pixels` tries them in full."""
    broken = {number: hostile_pixels.tried(number, 150) for number in range(first, first + 50)}
    assert {number: words for number, words in broken.items() if words} == {}


@pytest.mark.parametrize(
    ("name", "wrong", "said"),
    [
        ("bounds", lambda a, _: (a[0], a[1] * (1 - 1e-7)), "bounds["),
        ("bounds", lambda a, _: ((a[0] + a[1]) / 2, a[1]), "bounds["),
        ("total_transmittance", lambda a, how: a * (how.get("threads") != 2), "two threads differ"),
        ("composite", lambda a, _: a + 0.01 * (a.shape[1] == 7), "differ alone"),
        ("composite", lambda a, _: a + 0.01 * (a.dtype == np.float64), "from those in double"),
        ("transmittance", lambda a, _: a * 1.01, "is not in [0.0, 1.0]"),
    ],
)
def test_broken_promises_of_many_pixels_are_seen(monkeypatch, name, wrong, said):
    """A case of floats, whole but for what is made wrong."""
    cases = (hostile_pixels.case_of(number, 2_000) for number in range(10**5))
    case = next(
        case
        for case in cases
        if case.fragments.depth.dtype == np.float32
        and len(case.fragments) > 6_000
        and case.fragments.transmission is None
    )
    case = case._replace(technique=moit.technique("sorted" if name != "bounds" else "deep-shadow"))
    assert list(hostile_pixels.broken(case)) == []
    right = getattr(moit, name)
    monkeypatch.setattr(moit, name, lambda *a, **how: wrong(right(*a, **how), how))
    assert any(said in what for what in hostile_pixels.broken(case))


def test_cases_are_the_same_for_the_same_number():
    one, other = hostile.case_of(5), hostile.case_of(5)
    assert one.technique == other.technique and (one.depths == other.depths).all()
    assert (one.fragments.alpha == other.fragments.alpha).all()


@pytest.mark.parametrize("number", [906376, 910175])
def test_weights_of_next_to_nothing_make_no_infinite_colour(number):
    """Of steps that fall by what one nearly opaque fragment leaves, denormal numbers are left."""
    assert hostile.tried(number) == []
