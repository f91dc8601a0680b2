"""Pictures of triangles: by fragments on the CPU, by real passes on a GPU, and that they agree."""

import dataclasses
import re

import gpu
import numpy as np
import pytest
from readings.compilers import refused_by_glslang

import moit
from moit.gpu import texts as shaders
from moit.gpu.bindings import DRAW_ORDERED, INTERLOCK
from moit.scenes.mesh_scenes import MESH_SCENES

SIZE = (48, 30)


@pytest.fixture
def device():
    return gpu.device()


def panes(count=12, alpha=(0.1, 0.7), seed=0) -> list[moit.Mesh]:
    """Large slanted triangles, that many lie over each other in."""
    rng = np.random.default_rng(seed)
    return [
        moit.Mesh(
            rng.uniform(-1.6, 1.6, (3, 3)) * [1.5, 1.2, 0.6],
            [[0, 1, 2]],
            rng.random(3),
            rng.uniform(*alpha),
        )
        for _ in range(count)
    ]


SCENE = [
    *panes(),
    moit.Mesh([[-3, -2, -1], [3, -2, -1], [0, 3, -1.2]], [[0, 1, 2]], (0.5, 0.6, 0.7)),
]
CAMERA = moit.Camera(eye=(0.2, 0.1, 3.0), near=0.5, far=20.0)


def picture(technique, device="cpu", scene=SCENE, **options):
    options = {"camera": CAMERA, "background": (0.2, 0.3, 0.4), **options}
    return moit.render(scene, technique, SIZE, device=device, exact=True, **options)


def test_the_cpu_rasterizes_and_composites():
    f = moit.rasterize(SCENE, CAMERA, SIZE)
    for technique in ("sorted", "power6"):
        expected = moit.composite(f, technique, background=(0.2, 0.3, 0.4))
        np.testing.assert_array_equal(picture(technique), expected)


def test_scenes_have_a_camera_and_a_background_of_their_own():
    scene = moit.scenes.meshes("spheres-mesh")
    f = moit.rasterize(scene.meshes, scene.camera, SIZE)
    expected = moit.composite(f, "sorted", background=scene.background)
    for named in ("spheres-mesh", scene):
        np.testing.assert_array_equal(moit.render(named, "sorted", SIZE), expected)
    fitted = moit.render(SCENE, "sorted", SIZE)
    assert (fitted[..., 3] > 0.5).mean() > 0.05


@pytest.mark.parametrize("name", MESH_SCENES)
def test_sorted_pictures_agree(device, name):
    found = moit.render(name, "sorted", (96, 54), device=device, exact=True, target="rgba32f")
    # colours and sums are floats there, doubles here
    np.testing.assert_allclose(found, moit.render(name, "sorted", (96, 54)), atol=1e-6)


# How far a GPU's picture may be from the CPU's at the bias that a GPU takes. Moments are sums of
# floats there, off by some 1e-7, of doubles here; in a pixel with few surfaces, whose moments are
# near degenerate, published bias makes some 1e-3 of that.
TOLERANCES = {
    "sorted": 1e-6,
    "unsorted": 1e-6,
    "weighted-sum": 1e-5,
    "weighted-average": 1e-6,
    "wboit": 1e-6,
    "wboit-eq9": 1e-6,
    "power4": 5e-3,
    "power6": 5e-3,
    "trig2": 1e-2,
    "trig3": 1e-2,
    "power4-16": 1e-5,
    "trig2-16": 1e-5,
    "fourier7": 3e-3,  # half floats, that blending rounds as it likes
    "adaptive4": 1e-5,
    "mlab2": 1e-5,
    "hybrid4": 1e-6,
    "kbuffer4": 1e-6,
    "depth-peeling4": 1e-6,
    "wavelet8": 1e-5,
    "stochastic8": 1e-5,
    "neural-slices5(bits=6)": 1e-6,
    "anchors4": 1e-6,
    "moment-transparency": 2e-2,
    "moment-transparency-nlqm": 2e-2,
    "two-moments-pass": 2e-2,
    "neural": 5e-3,  # networks are steep where depths are close
    "neural(depth_range='image')": 5e-3,
    "dfa": 1e-6,
    "neural-bounded": 5e-3,
    "power2": 2e-2,  # blending rounds to half as it likes
    "power4(depth_range='pixel',storage='half')": 3e-2,
    "neural-bounded6(depth_range='pixel',storage='half')": 2e-2,
}


def at_gpus_bias(technique, way) -> moit.Technique:
    technique = moit.technique(technique)
    if way == "add" and getattr(technique, "bias", 0) is None:
        return dataclasses.replace(technique, bias=technique.blended_bias)
    return technique


@pytest.mark.parametrize("technique", TOLERANCES)
def test_passes_make_the_picture_of_the_cpu(device, technique):
    report = picture(technique, device, target="rgba32f", report=True)
    found, expected = report.image, picture(at_gpus_bias(technique, report.way))
    tolerance = TOLERANCES[technique]
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found, expected, atol=tolerance)
    assert np.abs(found - expected).mean() < max(tolerance / 50, 1e-6)


@pytest.mark.parametrize("name", ["moment-transparency-lr8", "two-moments-pass-lr8"])
def test_moments_of_blocks_are_captured_at_low_resolution(device, name):
    # without opaque surfaces: behind these the CPU has no fragments, where the capture at low
    # resolution, before the farthest surface of a block, has some
    scene = panes()
    made = picture(name, device, scene, target="rgba32f", report=True)
    expected = picture(at_gpus_bias(name, made.way), "cpu", scene)
    np.testing.assert_allclose(made.image, expected, atol=5e-3)
    # what rounding does to the ray of a block, all of its pixels see
    assert np.abs(made.image - expected).mean() < 2e-4
    assert made.way == "add"
    assert "downsample" in made.timings
    blocks = -(-SIZE[0] // 8) * -(-SIZE[1] // 8)
    assert made.memory["targets"] == moit.technique(name).passes * 20 * blocks
    # with them it is near, and right where no block has two depths
    walled, culled = picture(name, device, target="rgba32f"), picture(name)
    assert np.abs(walled - culled).mean() < 5e-3


@pytest.mark.parametrize("technique", ["power4-16", "trig2-16", "adaptive4", "mlab2"])
def test_reading_targets_and_replay_give_the_same(device, technique):
    fetched, replayed = (
        picture(technique, device, target="rgba32f", ordered=way, report=True)
        for way in (None, "replay")
    )
    if fetched.way == "replay":
        pytest.skip(f"{device.renderer} has neither interlock nor framebuffer fetch")
    assert replayed.way == "replay"
    # colours add up as floats in one, as doubles in the other
    np.testing.assert_allclose(fetched.image, replayed.image, atol=2e-6)


@pytest.mark.parametrize("technique", ["wboit", "power4", "unsorted", "mlab2", "sorted"])
def test_half_float_targets_are_near(device, technique):
    full, half = (picture(technique, device, target=t) for t in ("rgba32f", "rgba16f"))
    assert not np.array_equal(full, half)
    # eleven bits, of sums of a dozen that stay below 2
    np.testing.assert_allclose(half, full, atol=12 * 2**-11)


@pytest.mark.parametrize("technique", ["sorted", "wboit", "weighted-average", "power4", "trig2"])
def test_the_order_of_triangles_is_not_seen(device, technique):
    backward = SCENE[::-1]
    one, same, other = (
        picture(technique, device, scene, target="rgba32f") for scene in (SCENE, SCENE, backward)
    )
    np.testing.assert_array_equal(one, same)
    # of float sums: see TOLERANCES
    rounding = {"power4": 5e-3, "trig2": 1e-2}.get(technique, 3e-6)
    np.testing.assert_allclose(one, other, atol=rounding)
    assert np.abs(one - other).mean() < max(rounding / 200, 1e-6)


def test_blending_from_back_to_front_is_exact_where_nothing_crosses(device):
    rng = np.random.default_rng(1)
    parallel = [
        moit.Mesh([[-2, -2, z], [2, -2, z + 0.01], [0, 2, z]], [[0, 1, 2]], rng.random(3), 0.4)
        for z in rng.permutation(np.linspace(-1, 1, 8))
    ]
    exact = picture("sorted", scene=parallel)
    for where in ("cpu", device):
        given, objects, triangles = (
            picture("unsorted", where, parallel, order=order, target="rgba32f")
            for order in ("given", "object", "triangle")
        )
        assert np.abs(given - exact).max() > 0.05
        np.testing.assert_allclose(objects, exact, atol=1e-6)
        np.testing.assert_allclose(triangles, exact, atol=1e-6)


def test_cut_outs_are_opaque_where_alpha_is_one(device):
    # a card that is opaque in its left half, glass before and behind it
    x, y = np.meshgrid([-1.5, -0.2, 0.2, 1.5], [-1.5, 1.5])
    place = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    faces = [[i, i + 1, i + 4] for i in range(3)] + [[i + 1, i + 5, i + 4] for i in range(3)]
    alpha = np.tile([1.0, 1.0, 0.3, 0.3], 2)
    card = moit.Mesh(place, faces, (0.2, 0.9, 0.1), alpha)
    square = np.array([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]])
    front, back = (
        moit.Mesh(square + np.array([0, 0, z]), [[0, 1, 2], [0, 2, 3]], paint, 0.5)
        for z, paint in ((0.7, (0, 0, 1)), (-0.7, (1, 0, 0)))
    )
    for scene in ([back, front, card], [card, front, back]):
        for technique in ("sorted", "wboit", "power4", "mlab2"):
            found = picture(technique, device, scene, target="rgba32f")
            expected = picture(technique, "cpu", scene)
            np.testing.assert_allclose(found, expected, atol=1e-4)
            assert (found[:, 8:20, 3] == 1).all()
        only_front = picture("sorted", device, [front, card], target="rgba32f")
        sealed = picture("sorted", device, scene, target="rgba32f")
        np.testing.assert_array_equal(sealed[:, 8:20], only_front[:, 8:20])


def test_backgrounds_may_differ_by_pixel(device):
    rng = np.random.default_rng(0)
    background = rng.random((SIZE[1], SIZE[0], 3)).astype(np.float32)
    for technique in ("wboit", "sorted"):
        found = picture(technique, device, background=background, target="rgba32f")
        expected = picture(technique, background=background)
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_lights_shine_on_both(device):
    lights = [((1, -1, -1), (0.9, 0.8, 0.1)), ((-1, 0, -1), (0, 0.2, 0.9))]
    found = picture("sorted", device, lights=lights, target="rgba32f")
    expected = picture("sorted", lights=lights)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert np.abs(expected - picture("sorted")).max() > 0.05


def test_nothing_shows_the_background(device):
    for scene in ([], [moit.Mesh([[0, 0, 9], [1, 0, 9], [0, 1, 9]], [[0, 1, 2]], alpha=0.5)]):
        for technique in ("power4", "sorted", "mlab2", "unsorted"):
            found = picture(technique, device, scene, target="rgba32f")
            expected = np.broadcast_to(np.float32([0.2, 0.3, 0.4, 0]), found.shape)
            np.testing.assert_allclose(found, expected, atol=1e-7)


@pytest.mark.parametrize(
    "technique",
    [
        moit.WeightedBlended(weight=lambda depth, alpha, color: 1 / depth),
        moit.PowerMoments(4, depth_range="pixel"),
        moit.PowerMoments(4, warp="linear", normalize=False, overestimation=0.0),
    ],
    ids=["callable", "pixel", "linear"],
)
def test_options_hold_on_a_gpu(device, technique):
    report = picture(technique, device, target="rgba32f", report=True)
    expected = picture(at_gpus_bias(technique, report.way))
    np.testing.assert_allclose(report.image, expected, atol=1e-2)
    assert np.abs(report.image - expected).mean() < 1e-4


def test_who_composited_is_said(device):
    made = picture("power4", device, report=True)
    assert (made.device, made.reason) == ("gpu", "")
    made = picture("power4", report=True)
    assert (made.device, made.reason, made.way) == ("cpu", "", "composite")
    made = picture(moit.PowerMoments(4, depth_range="pixel"), device, report=True)
    assert (made.device, made.reason) == ("gpu", "depth is warped by the core")
    assert made.way == "arrays"
    technique = moit.PythonTechnique("none", lambda fragments: np.ones(len(fragments.depth)))
    said = re.escape(f"device: {technique} is composited on the CPU, not by {device.renderer}: ")
    with pytest.warns(RuntimeWarning, match=f"^{said}it has no passes of its own; ") as found:
        made = picture(technique, device, report=True)
    assert found[0].filename == __file__
    assert (made.device, made.way) == ("cpu", "replay")
    assert made.reason.startswith("it has no passes of its own; over arrays: device: none is")


def test_a_report_names_passes_and_memory(device):
    for technique, way, passes in (
        ("power4", "add", ["opaque", "capture", "collect", "factor", "shade", "resolve"]),
        ("wboit", "add", ["opaque", "shade", "resolve"]),
        ("sorted", "replay", ["opaque", "list"]),
    ):
        made = picture(technique, device, report=True)
        assert isinstance(made, moit.Rendering)
        assert made.way == way
        assert list(made.timings)[: len(passes)] == passes
        assert all(seconds >= 0 for seconds in made.timings.values())
        assert made.seconds > 0
        np.testing.assert_array_equal(made.image, picture(technique, device))
        assert made.bits_per_pixel == moit.technique(technique).bits_per_pixel
    power = picture("power4", device, report=True)
    assert power.memory["targets"] == 20 * SIZE[0] * SIZE[1]  # the published 160 bits
    assert power.memory["colour"] == 8 * SIZE[0] * SIZE[1]
    assert 100 < power.bytes_per_pixel < 1000
    assert "capture" in repr(power)
    assert list(picture("power4", report=True).timings) == ["rasterize", "composite"]


def test_an_extension_that_is_missing_is_named(device):
    if "GL_ARB_fragment_shader_interlock" in device.info["extensions"]:
        pytest.skip(f"{device.renderer} has interlock")
    with pytest.raises(moit.GpuError, match=r"ordered: .*GL_ARB_fragment_shader_interlock.*use"):
        picture("mlab2", device, ordered="interlock")


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"scene": "teapot"}, ValueError, "no scene of triangles 'teapot'; did you mean"),
        (
            {"scene": 3},
            TypeError,
            "scene: expected a Mesh, Splats, Points, Lines or a Volume or several",
        ),
        ({"camera": 3}, TypeError, "camera: expected a Camera or None, got int"),
        ({"target": "rgba8"}, ValueError, "target: expected 'rgba16f', 'rgba32f'"),
        ({"order": "back"}, ValueError, "order: expected 'given', 'object', 'triangle'"),
        ({"ordered": "no"}, ValueError, "ordered: expected None, 'interlock'"),
        ({"background": (1, 2)}, ValueError, r"background: expected \(3,\) or \(30, 48, 3\)"),
        ({"background": (1, 2, np.nan)}, ValueError, r"background\[2\]: found nan"),
        ({"lights": 3}, TypeError, "lights: expected a sequence"),
        ({"device": "gpus"}, ValueError, "device: expected 'cpu', 'gpu'"),
        ({"report": 1}, TypeError, "report: expected True or False"),
    ],
)
def test_bad_calls_say_what_was_needed(options, error, words):
    with pytest.raises(error, match=words):
        picture("sorted", **options)


def test_bad_sizes_and_techniques_say_what_was_needed():
    with pytest.raises(ValueError, match="technique"):
        moit.render(SCENE, "power5", SIZE)
    with pytest.raises(ValueError, match="size: expected"):
        moit.render(SCENE, "sorted", (0, 5))


DRAWN = ["unsorted", "wboit", "weighted-average", "power4", "trig2", "fourier7", "sorted"]
DRAWN += [
    "two-moments-pass",
    "moment-transparency-nlqm",
    "power4-16",
    "trig2-16",
    "adaptive4",
    "mlab2",
    "neural",
    "neural-slices4",
    "anchors2",
    "slices8(cells=64,resolution=2,total='half')",
    "dfa",
]


@pytest.mark.parametrize("technique", DRAWN)
def test_glslang_takes_passes_over_triangles(device, technique, monkeypatch):
    used = {}

    def program(name, **defines):
        used[(name, *sorted(defines.items()))] = ("comp", name, defines)
        return compiled(name, **defines)

    def drawing(vertex, fragment, **defines):
        used[vertex] = ("vert", vertex, {})
        if defines.get("PASS") == DRAW_ORDERED:  # framebuffer fetch glslang does not know
            read = {**defines, "ORDERED": INTERLOCK}
        else:
            read = defines
        used[(fragment, *sorted(read.items()))] = ("frag", fragment, read)
        return drawn_program(vertex, fragment, **defines)

    compiled, drawn_program = device.program, device.drawing
    monkeypatch.setattr(device, "program", program)
    monkeypatch.setattr(device, "drawing", drawing)
    picture(technique, device)
    assert len(used) > 3
    texts = {shaders.source(name, **defines): stage for stage, name, defines in used.values()}
    assert refused_by_glslang(texts) == []
