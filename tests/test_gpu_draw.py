"""Drawing passes: where triangles land, how they blend, what depth lets through."""

import numpy as np
import pytest
from gpu import device

# A triangle that covers everything, per instance of three vertices at a depth and in a colour.
COVER = """#version 450
uniform float depths[4];
flat out int layer;
void main() {
    int corner = gl_VertexID % 3;
    layer = gl_VertexID / 3;
    vec2 at = vec2(corner == 1 ? 3.0 : -1.0, corner == 2 ? 3.0 : -1.0);
    gl_Position = vec4(at, depths[layer], 1.0);
}
"""
COLOR = """#version 450
uniform vec4 colors[4];
flat in int layer;
layout(location = 0) out vec4 color;
void main() { color = colors[layer]; }
"""
DST = np.array([0.5, 0.25, 0.125, 0.75])
SRC = np.array([0.25, 0.5, 0.0625, 0.5])
BLENDED = {
    None: SRC,
    "add": SRC + DST,
    "over": SRC + (1 - SRC[3]) * DST,
    "under": DST + (1 - DST[3]) * SRC,
    "multiply": SRC * DST,
    "multiply-complement": (1 - SRC) * DST,
    "max": np.maximum(SRC, DST),
    "min": np.minimum(SRC, DST),
}


def pixels(texture) -> np.ndarray:
    got = np.empty((texture.height, texture.width, texture.channels), np.float32)
    texture.read(got)
    return got


@pytest.mark.parametrize("blend", BLENDED)
@pytest.mark.parametrize("format", ["rgba32f", "rgba16f"])
def test_blending_is_what_its_name_says(blend, format):
    with device() as d:
        target = d.texture(format, 5, 3)
        d.clear(target, DST)
        d.draw(
            d.compile(vertex=COVER, fragment=COLOR),
            3,
            targets=[target],
            blend=[blend],
            uniforms={"colors": SRC, "depths": 0.0},
        )
        np.testing.assert_array_equal(pixels(target), np.broadcast_to(BLENDED[blend], (3, 5, 4)))


def test_each_target_blends_in_its_own_way():
    text = """#version 450
    flat in int layer;
    layout(location = 0) out vec4 sum;
    layout(location = 1) out float product;
    layout(location = 2) out uvec4 last;
    void main() { sum = vec4(1, 2, 3, 4); product = 0.5; last = uvec4(layer + 7); }
    """
    with device() as d:
        targets = [d.texture(name, 4, 4) for name in ("rgba32f", "r16", "rgba32ui")]
        for target, value in zip(targets, ([0] * 4, [1.0], [0] * 4), strict=True):
            d.clear(target, value)
        d.draw(
            d.compile(vertex=COVER, fragment=text),
            9,
            targets=targets,
            blend=["add", "multiply", None],
            uniforms={"depths": [0, 0, 0]},
        )
        assert (pixels(targets[0]) == [3, 6, 9, 12]).all()
        # 0.5^3 in 16 bits, rounded three times
        np.testing.assert_allclose(pixels(targets[1]), 0.125, atol=2 / 65535)
        words = np.empty((4, 4, 4), np.uint32)
        targets[2].read(words)
        assert (words == 9).all()


@pytest.mark.parametrize(("test", "seen"), [("less", 1), ("lequal", 2), (None, 3)])
def test_depth_lets_through_what_its_test_says(test, seen):
    """Layers at 0, -0.5, -0.5 and 0.9; the last that passes is seen."""
    with device() as d:
        target, depth = d.texture("rgba32f", 3, 3), d.texture("depth32f", 3, 3)
        d.clear(target, [0] * 4)
        d.clear(depth, [1.0])
        colors = [[0] * 4, [1] * 4, [2] * 4, [3] * 4]
        d.draw(
            d.compile(vertex=COVER, fragment=COLOR),
            12,
            targets=[target],
            depth=depth,
            depth_test=test,
            depth_write=True,
            uniforms={"colors": colors, "depths": [0.0, -0.5, -0.5, 0.9]},
        )
        assert (pixels(target) == seen).all()
        expected = 0.25 if test else 0.95  # from [-1, 1] to [0, 1]
        np.testing.assert_allclose(pixels(depth), expected, rtol=1e-6)


def test_depth_that_is_not_written_stays():
    with device() as d:
        depth = d.texture("depth32f", 2, 2)
        d.clear(depth, [0.5])
        program = d.compile(vertex=COVER, fragment=COLOR)
        d.draw(program, 3, depth=depth, depth_test="less", uniforms={"depths": -1.0})
        assert (pixels(depth) == 0.5).all()


def test_a_pass_without_targets_writes_images_and_buffers():
    text = """#version 450
    layout(r32ui, binding = 1) uniform uimage2D counts;
    layout(std430, binding = 2) buffer Total { uint total; };
    void main() {
        imageAtomicAdd(counts, ivec2(gl_FragCoord.xy), 1u);
        atomicAdd(total, 1u);
    }
    """
    with device() as d:
        counts, total = d.texture("r32ui", 7, 6), d.buffer(4)
        d.clear(counts, [0])
        d.fill(total, 5)
        d.draw(
            d.compile(vertex=COVER, fragment=text),
            6,
            size=(7, 6),
            images={1: counts},
            buffers={2: total},
            uniforms={"depths": [0, 0]},
        )
        words, sum_of_all = np.empty((6, 7, 1), np.uint32), np.empty(1, np.uint32)
        counts.read(words)
        total.read(sum_of_all)
    assert (words == 2).all()
    assert sum_of_all == 5 + 2 * 42


def test_rows_of_textures_begin_at_the_bottom_of_what_is_drawn():
    text = """#version 450
    layout(location = 0) out vec2 at;
    void main() { at = gl_FragCoord.xy; }
    """
    with device() as d:
        target = d.texture("rg32f", 4, 3)
        d.draw(d.compile(vertex=COVER, fragment=text), 3, targets=[target], uniforms={})
        y, x = np.mgrid[:3, :4] + 0.5
        np.testing.assert_array_equal(pixels(target), np.stack([x, y], axis=-1))


def test_a_pass_sees_what_the_one_before_wrote():
    sampled = """#version 450
    layout(binding = 3) uniform sampler2D before;
    layout(location = 0) out vec4 color;
    void main() { color = 2.0 * texelFetch(before, ivec2(gl_FragCoord.xy), 0); }
    """
    uniforms = {"depths": 0.0}
    with device() as d:
        one, two = d.texture("rgba32f", 8, 8), d.texture("rgba32f", 8, 8)
        random = np.random.default_rng(1).random((8, 8, 4), np.float32)
        one.write(random)
        program = d.compile(vertex=COVER, fragment=sampled)
        for _ in range(5):
            d.draw(program, 3, targets=[two], textures={3: one}, uniforms=uniforms)
            one, two = two, one
        np.testing.assert_array_equal(pixels(one), 32 * random)


@pytest.mark.parametrize("format", ["r8", "rgba8", "r16", "rg16", "rgba16"])
def test_normalised_pixels_go_in_and_out_as_they_are_stored(format):
    with device() as d:
        texture = d.texture(format, 5, 3)
        dtype = np.uint8 if format.endswith("8") else np.uint16
        shape = (3, 5, texture.channels)
        words = np.random.default_rng(2).integers(0, np.iinfo(dtype).max, shape, dtype, True)
        texture.write(words)
        got = np.empty_like(words)
        texture.read(got)
        np.testing.assert_array_equal(got, words)
        np.testing.assert_allclose(pixels(texture), words / np.iinfo(dtype).max, rtol=1e-6)


@pytest.mark.parametrize("format", ["r16f", "rg16f", "rgba16f", "r32f", "rg32f", "rgba32f"])
def test_floats_go_in_and_out_as_they_are_stored(format):
    with device() as d:
        texture = d.texture(format, 5, 3)
        shape = (3, 5, texture.channels)
        values = np.random.default_rng(2).random(shape, np.float32)
        stored = values.astype(np.float16) if format.endswith("16f") else values
        texture.write(stored)
        np.testing.assert_array_equal(pixels(texture), stored)


@pytest.mark.parametrize("format", ["r32ui", "rg32ui", "rgba32ui", "rgba16ui"])
def test_whole_numbers_go_in_and_out_as_they_are_stored(format):
    with device() as d:
        texture = d.texture(format, 5, 3)
        shape = (3, 5, texture.channels)
        words = np.random.default_rng(2).integers(0, 2**16, shape, np.uint32)
        texture.write(words)
        got = np.empty_like(words)
        texture.read(got)
        np.testing.assert_array_equal(got, words)


def test_times_nest_and_are_good_once():
    with device() as d:
        d.begin_time()
        d.begin_time()
        inner = d.end_time()
        outer = d.end_time()
        assert 0 <= d.seconds(inner) <= d.seconds(outer) < 60
        with pytest.raises(RuntimeError, match="was used"):
            d.seconds(inner)
        with pytest.raises(RuntimeError, match="no begin_time"):
            d.end_time()
