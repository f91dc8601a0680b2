"""Shadow maps: what filters and looks up against NumPy, exact cases, and the edges of maps."""

import math

import numpy as np
import pytest
from readings.compilers import refused_by_glslang

import moit
from moit import _core
from moit.gpu import texts as shaders
from moit.gpu.bindings import REACH, READ_MAP
from moit.shadows.shadow_map import shadow_technique
from moit.shadows.views import FromAfar

ADDING = ["power4", "power6", "power8", "power6-16", "trig2", "trig3", "fourier7", "fourier15"]
OTHERS = [
    str(technique)
    for technique in moit.techniques()
    if technique.has_curve and technique.engine == "core" and not technique.adds_texels
]
DOWN = (0.0, -1.0, 0.0)


def fragments(height=12, width=16, most=6, seed=0, dtype=np.float32, least=0):
    rng = np.random.default_rng(seed)
    counts = rng.integers(least, most + 1, height * width)
    n = counts.sum()
    return moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        rng.uniform(1, 5, n).astype(dtype),
        rng.uniform(0.05, 0.7, n).astype(dtype),
        shape=(height, width),
        depth_range=(1.0, 5.0),
    )


def places(f, count=400, seed=1, beyond=0.0):
    rng = np.random.default_rng(seed)
    height, width = f.shape
    return np.column_stack(
        [
            rng.uniform(-beyond, width + beyond, count),
            rng.uniform(-beyond, height + beyond, count),
            rng.uniform(0.5, 5.5, count),
        ]
    )


def pane(y, alpha, size=1.0, color=(0.5, 0.5, 0.5), slope=0.0):
    """A square that many units up, rising by `slope` to the right."""
    corners = [[x, y + slope * x, z] for z in (-size, size) for x in (-size, size)]
    return moit.Mesh(corners, [[0, 1, 2], [1, 3, 2]], color, alpha)


# ---- The filtered lookup against NumPy ----------------------------------------------------------


def blurred(sums, taps):
    """As its docstring has it: a Gaussian of deviation (taps - 1) / 4, borders going on."""
    x = np.arange(taps) - taps // 2
    weights = np.exp(-0.5 * (x / ((taps - 1) / 4)) ** 2)
    weights /= weights.sum()
    for axis in (0, 1):
        wide = np.pad(sums, [(taps // 2,) * 2 if i == axis else (0, 0) for i in range(3)], "edge")
        sums = sum(
            w * np.take(wide, range(k, k + sums.shape[axis]), axis) for k, w in enumerate(weights)
        )
    return sums


def between(sums, x, y):
    """Bilinear, with samples at the middles of texels."""
    height, width = sums.shape[:2]
    x, y = x - 0.5, y - 0.5
    left, top = math.floor(x), math.floor(y)
    found = 0
    for i, along in ((top, 1 - (y - top)), (top + 1, y - top)):
        for j, across in ((left, 1 - (x - left)), (left + 1, x - left)):
            texel = sums[min(max(i, 0), height - 1), min(max(j, 0), width - 1)]
            found = found + along * across * texel
    return found


@pytest.mark.parametrize("filter", [1, 3, 9])
@pytest.mark.parametrize("name", ["power4", "power6", "power8", "trig2", "trig4", "power6-16"])
def test_moments_are_filtered_and_read_as_sums(name, filter):
    f = fragments(dtype=np.float64)
    technique = moit.technique(f"{name}(warp='linear',overestimation=0.0)")
    shadow = moit.ShadowMap(f, technique, filter=filter)
    b0, b = moit.moments.gather(f, technique, cull_opaque=False)
    sums = np.concatenate([b0[:, None], b0[:, None] * b], axis=1).reshape(*f.shape, -1)
    sums = blurred(sums, filter) if filter > 1 else sums
    at = places(f)
    state = np.array([between(sums, x, y) for x, y, _ in at])
    z = (np.clip(at[:, 2], 1, 5) - 3) / 2
    total = state[:, 0].real
    mean = np.where(total[:, None] > 0, state[:, 1:] / np.maximum(total, 1e-99)[:, None], 0)
    expected = moit.moments.transmittance(technique, total, mean, z[:, None])[:, 0]
    expected = np.where(at[:, 2] > 5, np.exp(-total), np.where(at[:, 2] <= 1, 1, expected))
    # float64 throughout, in another order of sums; words round where moments have 16 bits, alike
    np.testing.assert_allclose(shadow.transmittance(at), expected, atol=2e-6)


@pytest.mark.parametrize("filter", [1, 9])
def test_fourier_coefficients_are_filtered_and_read_as_sums(filter):
    f = fragments(dtype=np.float64)
    shadow = moit.ShadowMap(f, "fourier15(bits=32)", filter=filter)
    d = (f.depth - 1) / 4
    a = -np.log1p(-f.alpha)
    k = np.arange(1, 8)
    terms = np.concatenate(
        [
            np.ones((len(f), 1)),
            np.cos(2 * np.pi * np.outer(d, k)),
            np.sin(2 * np.pi * np.outer(d, k)),
        ],
        axis=1,
    )
    sums = np.zeros((f.shape[0] * f.shape[1], 15))
    np.add.at(sums, np.repeat(np.arange(len(sums)), f.counts), a[:, None] * terms)
    sums = sums.reshape(*f.shape, 15)
    sums = blurred(sums, filter) if filter > 1 else sums
    at = places(f)
    for (x, y, depth), found in zip(at, shadow.transmittance(at), strict=True):
        mean, cosines, sines = np.split(between(sums, x, y), [1, 8])
        d = (min(max(depth, 1), 5) - 1) / 4
        turn = 2 * np.pi * k * d
        in_front = (
            mean[0] * d
            + ((cosines * np.sin(turn) + sines * (1 - np.cos(turn))) / (np.pi * k)).sum()
        )
        in_front = mean[0] if depth > 5 else 0 if depth <= 1 else np.clip(in_front, 0, mean[0])
        assert found == pytest.approx(math.exp(-in_front), abs=1e-9)


def test_an_even_map_stays_what_it_is_under_any_filter():
    pixels = 8 * 9
    depth = np.tile([1.0, 2.0, 4.0, 5.0], pixels)
    alpha = np.tile([0.0, 0.3, 0.6, 0.0], pixels)
    f = moit.Fragments(np.arange(pixels + 1) * 4, depth, alpha, shape=(8, 9))
    at = places(f)
    at = at[(np.abs(at[:, 2] - 2) > 0.05) & (np.abs(at[:, 2] - 4) > 0.05)]
    expected = np.where(at[:, 2] > 2, 0.7, 1) * np.where(at[:, 2] > 4, 0.4, 1)
    for filter in (1, 3, 9, 63):  # 63 is wider than the map
        shadow = moit.ShadowMap(f, "power6(bias=0.0)", filter=filter)
        np.testing.assert_allclose(shadow.transmittance(at), expected, atol=1e-6)


# ---- Exact ---------------------------------------------------------------------------------------


def test_sorted_casts_rays_through_texels():
    f = fragments()
    at = places(f, beyond=2)
    found = moit.ShadowMap(f, "sorted").transmittance(at)
    for (x, y, depth), T in zip(at, found, strict=True):
        expected = 1.0
        if 0 <= x <= 16 and 0 <= y <= 12:
            texel = f[int(y), int(x)]
            expected = np.prod(1 - texel.alpha[texel.depth < np.float32(depth)].astype(float))
        assert T == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("name", OTHERS)
def test_other_techniques_answer_as_their_curves(name):
    f = fragments(6, 7)
    at = places(f, 120)
    found = moit.ShadowMap(f, name).transmittance(at)
    technique = shadow_technique(name)
    for (x, y, depth), T in zip(at, found, strict=True):
        depth = float(np.float32(depth)) if 1 < depth < 5 else depth
        curve = moit.transmittance(f, technique, [depth], cull_opaque=False)
        assert T == pytest.approx(curve[int(y), int(x), 0], abs=1e-6)


@pytest.mark.parametrize("name", ["sorted", "stochastic8", "deep-shadow"])
def test_what_reaches_texels_is_filtered_where_they_do_not_add_up(name):
    f = fragments(10, 11)
    at = places(f, 30)
    each = moit.ShadowMap(f, name)
    found = moit.ShadowMap(f, name, filter=3).transmittance(at)
    middles = np.stack(np.meshgrid(np.arange(11) + 0.5, np.arange(10) + 0.5), axis=-1).reshape(
        -1, 2
    )
    for (x, y, depth), T in zip(at, found, strict=True):
        seen = each.transmittance(np.column_stack([middles, np.full(110, depth)]))
        expected = between(blurred(seen.reshape(10, 11, 1), 3), x, y)[0]
        assert T == pytest.approx(expected, abs=1e-5)


def test_the_answer_is_the_same_bits_for_any_thread_count_and_instruction_set():
    f = fragments(40, 50)
    at = places(f, 1500)
    before = _core.use_instruction_set("base")
    try:
        for name in ("power6", "trig3", "fourier15"):
            answers = []
            for isa in ("base", "avx2", "avx512"):
                try:
                    _core.use_instruction_set(isa)
                except ValueError:
                    continue
                for threads in (1, 3):
                    shadow = moit.ShadowMap(f, name, threads=threads)
                    answers.append(shadow.transmittance(at, alpha=0.3, threads=threads))
            for answer in answers[1:]:
                np.testing.assert_array_equal(answer, answers[0])
    finally:
        _core.use_instruction_set(before)


# ---- Triangles -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sorted", *ADDING, "deep-shadow"])
@pytest.mark.parametrize("light", [DOWN, moit.Camera((0.0, 9.0, 0.0), (0.0, 0.0, 0.0), (0, 0, 1))])
def test_points_under_panes_get_what_these_let_through(name, light):
    panes = [pane(3.0, 0.5), pane(2.0, 0.2)]
    shadow = moit.ShadowMap(panes, name, light=light, resolution=64)
    under, above, beside = [0.1, 0.5, -0.2], [0.1, 3.5, 0.2], [5.0, 0.5, 0.0]
    # behind all casters b0 alone counts, whatever the technique: to the digits it is stored in
    found = shadow.transmittance([under, above, beside])
    digits = 2e-3 if "-16" in name or "fourier" in name else 1e-5
    np.testing.assert_allclose(found[::2], [0.4, 1], atol=digits)
    # in front of them all a series that was cut off may ring
    assert found[1] == pytest.approx(1, abs=0.02 if "fourier" in name else digits)


@pytest.mark.parametrize("name", ["power4", "power6", "trig2"])
def test_between_two_panes_light_has_passed_the_first(name):
    panes = [pane(3.0, 0.5), pane(2.0, 0.2)]
    shadow = moit.ShadowMap(panes, name, light=DOWN, resolution=32)
    # two surfaces are no more than four moments hold; bias costs what is left
    assert shadow.transmittance([[0.0, 2.5, 0.0]])[0] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("slope", [0.0, 0.5])
@pytest.mark.parametrize("name", ADDING)
def test_a_surface_alone_is_not_in_its_own_shadow_when_it_leaves_itself_out(name, slope):
    shadow = moit.ShadowMap(pane(1.0, 0.6, slope=slope), name, light=DOWN, resolution=64)
    x = np.linspace(-0.8, 0.8, 41)
    on = np.column_stack([x, 1 + slope * x, 0 * x])
    found = shadow.transmittance(on, alpha=0.6)
    # half floats hold the sum of its absorbance to 11 digits, words theirs through a half b0
    np.testing.assert_allclose(found, 1, atol=1e-3 if "16" in name or "fourier" in name else 1e-6)
    if slope:  # where the filter sees it in front of itself, as published
        assert shadow.transmittance(on).min() < 0.97


def test_opaque_surfaces_have_no_absorbance_to_leave_out():
    shadow = moit.ShadowMap([pane(1.0, 0.6), pane(0.0, 1.0)], light=DOWN, resolution=64)
    found = shadow.transmittance([[0.0, 0.0, 0.0]], alpha=1.0)
    assert found[0] == pytest.approx(0.4, abs=1e-3)


def test_a_level_surface_does_not_shadow_itself_as_published():
    """That is what an overestimation of 0 is for (section 7.2)."""
    on = [[0.2, 1.0, 0.1]]
    shadow = moit.ShadowMap(pane(1.0, 0.6), "power6", light=DOWN, resolution=64)
    assert shadow.transmittance(on)[0] == pytest.approx(1, abs=1e-6)
    half = moit.ShadowMap(pane(1.0, 0.6), "power6(overestimation=0.5)", light=DOWN, resolution=64)
    assert half.transmittance(on)[0] < 0.7


def test_casters_behind_a_point_do_not_shadow_it():
    for name in ADDING:
        shadow = moit.ShadowMap([pane(0.0, 0.9)], name, light=DOWN, resolution=16)
        assert shadow.transmittance([[0.0, 1.0, 0.0]])[0] == 1


def test_opaque_casters_have_a_map_of_their_own_and_hide_no_transparent_ones():
    scene = [pane(2.0, 1.0, size=0.5), pane(1.0, 0.5)]
    shadow = moit.ShadowMap(scene, light=DOWN, resolution=128)
    assert shadow.bits_per_texel == 224
    assert shadow.opaque.bits_per_texel == 64
    assert shadow.opaque.bias == 6e-5
    under_both, under_glass, beside = [0.0, 0.0, 0.0], [0.8, 0.0, 0.0], [3.0, 0.0, 0.0]
    between_both = [0.0, 1.5, 0.0]
    found = shadow.transmittance([under_both, under_glass, beside, between_both])
    np.testing.assert_allclose(found, [0, 0.5, 1, 0], atol=0.02)
    # the glass under the opaque square is on the map: at its rim nothing leaks
    sums = shadow.texels.sums
    assert sums[sums.shape[0] // 2, sums.shape[1] // 2, 0] > 0.6
    exact = moit.ShadowMap(scene, "sorted", light=DOWN, resolution=128)
    np.testing.assert_allclose(
        exact.transmittance([under_both, under_glass, beside, between_both]),
        [0, 0.5, 1, 0],
        atol=1e-6,
    )


def test_opaque_ground_is_lit_on_top():
    ground = pane(0.0, 1.0, size=5.0)
    shadow = moit.ShadowMap([ground], light=(1.0, -1.0, 0.3), resolution=256)
    x = np.linspace(-3, 4, 30)
    on = np.column_stack([x, 0 * x, 0.3 * x])
    assert shadow.transmittance(on).min() > 0.95
    assert shadow.transmittance(on - [0, 1, 0]).max() < 0.02


def test_alpha_1_within_a_transparent_triangle_is_opaque():
    corners = [[-1, 1, -1], [1, 1, -1], [-1, 1, 1], [1, 1, 1]]
    # each triangle has a corner that is clear, and alpha 1 along the diagonal's far side only
    card = moit.Mesh(corners, [[0, 1, 2], [1, 3, 2]], (0.5,) * 3, [1.0, 1.0, 1.0, 0.5])
    for name in ("sorted", "power6"):
        shadow = moit.ShadowMap(card, name, light=DOWN, resolution=64)
        assert shadow.transmittance([[-0.5, 0.0, -0.5]])[0] < 0.02
        assert 0.2 < shadow.transmittance([[0.9, 0.0, 0.9]])[0] < 0.6


def test_a_cameras_map_and_one_from_afar_agree_where_the_camera_is_far():
    rng = np.random.default_rng(3)
    scene = [moit.Mesh(rng.uniform(-1, 1, (3, 3)), [[0, 1, 2]], (0.5,) * 3, 0.4) for _ in range(6)]
    points = rng.uniform(-1, 1, (300, 3))
    far = moit.Camera((0, 400.0, 0), (0, 0, 0), (0, 0, 1), 0.01).fit(scene)
    near = moit.ShadowMap(scene, "sorted", light=DOWN, resolution=512).transmittance(points)
    other = moit.ShadowMap(scene, "sorted", light=far, resolution=512).transmittance(points)
    assert (np.abs(near - other) > 1e-3).mean() < 0.02  # at edges texels differ


# ---- Edges ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sorted", "power6", "trig3", "fourier7", "stochastic8"])
def test_empty_texels_and_what_the_map_does_not_show_are_lit(name):
    f = moit.Fragments([0, 0, 1, 1, 1], [2.0], [0.5], shape=(2, 2), depth_range=(1, 3))
    shadow = moit.ShadowMap(f, name, filter=1)
    found = shadow.transmittance([[0.5, 1.5, 2.5], [-0.1, 0.5, 9], [3, 1, 9], [1, 2.1, 9]])
    np.testing.assert_array_equal(found, 1)
    nothing = moit.Fragments(np.zeros(5, int), [], [], shape=(2, 2))
    for none in (nothing, moit.Fragments([0], [], [], shape=(0, 3))):
        assert moit.ShadowMap(none, name).transmittance([[0.5, 0.5, 1]])[0] == 1
    lit = moit.ShadowMap([], name, light=DOWN)
    assert lit.transmittance([[0.0, 0, 0], [1, 2, 3]]).tolist() == [1, 1]
    assert lit.transmittance(np.zeros((0, 3))).shape == (0,)


@pytest.mark.parametrize("name", ADDING)
def test_fragments_of_alpha_0_and_of_all_but_nothing_leave_it_lit(name):
    f = moit.Fragments([0, 2], [2.0, 3.0], [0.0, 1e-30], depth_range=(1, 4))
    assert moit.ShadowMap(f, name, filter=3).transmittance([[0.5, 0.5, 3.5]])[0] == 1
    thin = moit.Fragments([0, 1], [2.0], [1e-3], depth_range=(1, 4))
    found = moit.ShadowMap(thin, name, filter=3).transmittance([[0.5, 0.5, 4.5]])[0]
    assert found == pytest.approx(0.999, abs=2e-6)


def test_maps_borders_do_not_darken_or_brighten():
    f = moit.Fragments(np.arange(101), np.full(100, 2.0), np.full(100, 0.5), shape=(10, 10))
    shadow = moit.ShadowMap(f)
    corners = [[x, y, 3.0] for x in (0, 0.2, 5, 10) for y in (0, 5, 9.9, 10)]
    np.testing.assert_allclose(shadow.transmittance(corners), 0.5, atol=1e-6)


def test_a_light_within_a_cloud_reaches_what_is_before_its_eye_only_through_what_it_sees():
    panes = [pane(y, 0.5, size=20.0) for y in (3.0, 1.0, -1.0)]
    light = moit.Camera((0, 2.0, 0), (0, 0, 0), (0, 0, 1), fov_y=2.0, near=0.01, far=50)
    for name in ("sorted", "power6"):
        shadow = moit.ShadowMap(panes, name, light=light, resolution=64)
        below, between_two, behind = [0.1, -2, 0], [0, 0, 0.1], [0, 4.0, 0]
        found = shadow.transmittance([below, between_two, behind])
        np.testing.assert_allclose(found, [0.25, 0.5, 1], atol=1e-3)


def test_casters_edge_on_throw_no_shadow_and_harm_none():
    corners = [[0, 0, -1], [0, 0, 1], [0, 2, -1]]
    thin = moit.Mesh(corners, [[0, 1, 2]], (0.5,) * 3, 0.5)
    dot = moit.Mesh([[0.0, 1, 0]] * 3, [[0, 1, 2]], (0.5,) * 3, 0.5)
    for scene in (thin, dot):
        for name in ("sorted", "power6"):
            found = moit.ShadowMap(scene, name, light=DOWN, resolution=32).transmittance(
                [[0, -1, 0], [1, 0, 0], [0.0, 3, 0]]
            )
            assert np.isfinite(found).all()
            assert found[1] == 1


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"light": (0, 0, 0)}, "light"),
        ({"light": (0, 1)}, "light"),
        ({"light": (0, math.nan, 1)}, "light"),
        ({"light": None}, "light"),
        ({"light": "down"}, "light"),
        ({"resolution": 0}, "resolution"),
        ({"resolution": 20000}, "resolution"),
        ({"resolution": 3.5}, "resolution"),
        ({"filter": 4}, "filter"),
        ({"filter": -1}, "filter"),
        ({"filter": 65}, "filter"),
        ({"depth_bias": -1}, "depth_bias"),
        ({"depth_bias": math.inf}, "depth_bias"),
        ({"technique": "wboit"}, "technique"),
        ({"technique": "power5"}, "technique"),
        ({"technique": "power6(depth_range='pixel')"}, "technique"),
        ({"technique": "per-pixel"}, "technique"),
        ({"technique": 6}, "technique"),
    ],
)
def test_bad_arguments_are_named(options, named):
    options = {"light": DOWN, "resolution": 8, **options}
    with pytest.raises((TypeError, ValueError), match=f"^{named}"):
        moit.ShadowMap([pane(1.0, 0.5)], **options)


def test_bad_points_and_alphas_are_named():
    shadow = moit.ShadowMap([pane(1.0, 0.5)], light=DOWN, resolution=8)
    for points in ([0, 0, 0], [[1, 2]], [["a", "b", "c"]], [[math.nan, 0, 0]], 3):
        with pytest.raises((TypeError, ValueError), match=r"^points"):
            shadow.transmittance(points)
    for alpha in ([0.1, 0.2], 1.5, [-0.1], math.nan, "a"):
        with pytest.raises((TypeError, ValueError), match=r"^alpha"):
            shadow.transmittance([[0, 0, 0]], alpha)
    f = fragments()
    with pytest.raises(TypeError, match=r"^light"):
        moit.ShadowMap(f, light=DOWN)
    with pytest.raises(TypeError, match=r"^scene"):
        moit.ShadowMap(3, light=DOWN)


def test_names_have_the_defaults_of_shadows_and_techniques_are_as_they_are():
    f = fragments()
    assert str(moit.ShadowMap(f).technique) == "power6(overestimation=0.0,warp='linear')"
    named = moit.ShadowMap(f, "power4(overestimation=0.5)").technique
    assert (named.overestimation, named.warp) == (0.5, "linear")
    as_is = moit.ShadowMap(f, moit.PowerMoments(4)).technique
    assert (as_is.overestimation, as_is.warp) == (0.25, "log")
    for name, bits in {"power4": 160, "power6": 224, "fourier7": 112, "fourier15": 240}.items():
        shadow = moit.ShadowMap(f, name)
        assert shadow.bits_per_texel == bits
        assert f"{bits} bits a texel" in repr(shadow)
    assert moit.ShadowMap(f, "sorted").bits_per_texel is None


def test_results_have_the_dtype_of_points():
    shadow = moit.ShadowMap(fragments())
    assert shadow.transmittance(np.zeros((2, 3), np.float32)).dtype == np.float32
    assert shadow.transmittance(np.zeros((2, 3))).dtype == np.float64


@pytest.mark.parametrize("name", ["sorted", "stochastic8", "adaptive8"])
def test_a_point_at_the_depth_of_the_last_caster_is_before_it(name):
    f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    shadow = moit.ShadowMap(f, name, depth_bias=0.0)
    depths = [0.5, 1.0, 1.5, 2.0, 2.5]
    reached = shadow.transmittance([[0.5, 0.5, z] for z in depths])
    if name == "stochastic8":
        assert reached[0] == reached[1] == 1 and reached[2] == reached[3] > reached[4]
    else:
        np.testing.assert_allclose(reached, [1, 1, 0.5, 0.5, 0.25], atol=1e-3)


def test_glslang_takes_the_passes():
    texts = [
        shaders.source("meshes/shadows.comp.glsl", DOUBLE=1, PASS=number, **defines)
        for number in (READ_MAP, REACH)
        for defines in (
            {"NUMBERS": 7, "HARMONICS": 0, "OPAQUE": 0},
            {"NUMBERS": 4, "HARMONICS": 0, "OPAQUE": 1},
            {"NUMBERS": 15, "HARMONICS": 7, "OPAQUE": 0},
        )
    ]
    assert refused_by_glslang(dict.fromkeys(texts, "comp")) == []


def test_texels_without_an_opaque_caster_are_well_beyond_the_farthest():
    # 4 of depth between two casters: 5 % of it is free behind the farther one
    scene = [pane(2.0, 1.0, size=0.5), pane(-2.0, 1.0, size=2.0)]
    texels = moit.ShadowMap(scene, light=DOWN, resolution=64).opaque.texels
    assert texels.far - texels.near == pytest.approx(4 * 1.05, rel=1e-3)


@pytest.mark.parametrize("direction", [DOWN, (0.3, 0.99, -0.1), (-0.3, -1.0, 0.2), (1.0, 0, 0)])
def test_a_map_from_afar_has_room_for_its_filter_round_its_casters(direction):
    scene = [pane(0.3, 0.5, slope=0.4), pane(-1.0, 1.0, size=0.7)]
    view = FromAfar.of(np.array(direction), scene, 64, 5)
    seen = view.places(np.concatenate([mesh.points for mesh in scene]))
    np.testing.assert_allclose(seen[:, :2].min(axis=0), 5, atol=1e-4)
    np.testing.assert_allclose(seen[:, :2].max(axis=0), 59, atol=1e-4)
    np.testing.assert_allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-12)
