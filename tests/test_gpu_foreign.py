"""What moderngl draws is opaque, what moit draws is transparent, in one picture."""

import gpu
import numpy as np
import pytest

import moit

moderngl = pytest.importorskip("moderngl", reason="no moderngl to draw with")
LIBRARIES = {"libegl": "libEGL.so.1", "libgl": "libEGL.so.1"}
SIZE = (60, 40)
CAMERA = moit.Camera(eye=(0.5, 0.8, 4), target=(0, 0, 0), near=0.5, far=20)
RED = (0.8, 0.1, 0.05)
BACKGROUND = (0.1, 0.2, 0.4)
SHADERS = {
    "vertex_shader": """#version 450
        uniform mat4 seen;
        in vec3 place;
        void main() { gl_Position = seen * vec4(place, 1); }""",
    "fragment_shader": """#version 450
        uniform vec3 tint;
        out vec4 color;
        void main() { color = vec4(tint, 1); }""",
}


def quad(z: float, side: float) -> np.ndarray:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * side
    return (corners + np.array([0, 0, z])).astype(np.float32)


GLASS = [
    moit.Mesh(quad(z, 1.2), [[0, 1, 2], [0, 2, 3]], color, alpha)
    for z, color, alpha in ((0.9, (0.2, 0.9, 0.3), 0.5), (-0.7, (0.9, 0.8, 0.1), 0.6))
]


@pytest.fixture
def theirs():
    gpu.device()  # skips where there is none
    ctx = moderngl.create_context(standalone=True, backend="egl", require=450, **LIBRARIES)
    yield ctx
    ctx.release()


def drawn_by_moderngl(ctx, depth_bits=None):
    """A red square at z = 0, on a background: textures of colour and depth."""
    color, depth = ctx.texture(SIZE, 4, dtype="f4"), ctx.depth_texture(SIZE)
    framebuffer = ctx.framebuffer([color], depth)
    framebuffer.use()
    ctx.enable(moderngl.DEPTH_TEST)
    framebuffer.clear(*BACKGROUND, 1.0, depth=1.0)
    program = ctx.program(**SHADERS)
    view, projection = CAMERA.matrices(SIZE)
    program["seen"].write((projection @ view).T.astype("f4").tobytes())
    program["tint"].value = RED
    corners = quad(0, 0.8)[[0, 1, 2, 0, 2, 3]]
    ctx.vertex_array(program, ctx.buffer(corners.tobytes()), "place").render()
    return color, depth


def by_the_cpu(technique) -> np.ndarray:
    square = moit.Mesh(quad(0, 0.8), [[0, 1, 2], [0, 2, 3]], RED, 1.0)
    # moderngl's square is not lit: so the exact picture has a light that changes nothing
    f = moit.rasterize([square, *GLASS], CAMERA, SIZE)
    color = np.where(f.alpha[:, None] == 1, np.float32(RED), f.color)
    f = moit.Fragments(f.offsets, f.depth, f.alpha, color, shape=f.shape, depth_range=f.depth_range)
    return moit.composite(f, technique, background=BACKGROUND)


def pixels_of(texture) -> np.ndarray:
    """(height, width, 4), first row on top."""
    return np.frombuffer(texture.read(), np.float32).reshape(SIZE[1], SIZE[0], 4)[::-1]


@pytest.mark.parametrize("technique", ["sorted", "wboit", "mlab4", "power4(bias=1e-4)"])
def test_glass_is_before_and_behind_what_they_drew(theirs, technique):
    color, depth = drawn_by_moderngl(theirs)
    out = theirs.texture(SIZE, 4, dtype="f4")
    device = moit.gpu.Device.current()
    same = {"camera": CAMERA, "device": device, "target": "rgba32f"}
    assert moit.render(GLASS, technique, SIZE, opaque=(color, depth), into=out, **same) is None
    found, expected = pixels_of(out), by_the_cpu(technique)
    # their edge and ours may differ where it passes within 1/256 of a pixel's middle
    apart = abs(found - expected).max(axis=2) > 2e-5
    assert apart.mean() < 0.003
    behind, before = found[20, 22, :3], found[2, 2, :3]
    assert abs(behind - RED).max() > 0.05  # through green glass
    np.testing.assert_allclose(before, BACKGROUND, atol=1e-6)
    image = moit.render(GLASS, technique, SIZE, opaque=(color.glo, depth.glo), **same)
    np.testing.assert_array_equal(image, found)
    device.close()


@pytest.mark.parametrize("upsampling", ["bilinear", "depth-aware"])
def test_what_is_small_is_before_and_behind_what_they_drew(theirs, upsampling):
    small = {"camera": CAMERA, "background": BACKGROUND, "upsampling": upsampling}
    textures = drawn_by_moderngl(theirs)
    found = moit.render(
        GLASS,
        "wboit",
        SIZE,
        device=moit.gpu.Device.current(),
        exact=True,
        target="rgba32f",
        opaque=textures,
        resolution=4,
        **small,
    )
    white = moit.Mesh(quad(0, 0.8), [[0, 1, 2], [0, 2, 3]], (1, 1, 1), 1.0)
    lit = moit.rasterize(white, CAMERA, SIZE).color.max(axis=0)  # theirs is not
    square = moit.Mesh(white.vertices, white.triangles, RED / lit, 1.0)
    expected = moit.render([square, *GLASS], "wboit", SIZE, resolution=[1, 4, 4], **small)
    # a pixel of their edge that is not of ours hides what is behind in its square
    apart = abs(found - expected).max(axis=2) > 2e-5
    assert apart.mean() < 0.01
    assert abs(found[20, 22, :3] - RED).max() > 0.05  # through green glass


def test_their_state_is_as_it_was(theirs):
    color, depth = drawn_by_moderngl(theirs)
    out = theirs.texture(SIZE, 4, dtype="f4")
    theirs.viewport = (1, 2, 30, 20)
    theirs.blend_func = moderngl.ONE, moderngl.ZERO
    device = moit.gpu.Device.current()
    moit.render(
        GLASS,
        "power6",
        SIZE,
        camera=CAMERA,
        device=device,
        exact=True,
        opaque=(color, depth),
        into=out,
    )
    assert theirs.viewport == (1, 2, 30, 20)
    assert theirs.error == "GL_NO_ERROR"
    again = np.frombuffer(color.read(), np.float32)
    fresh = np.frombuffer(drawn_by_moderngl(theirs)[0].read(), np.float32)
    np.testing.assert_array_equal(again, fresh)
    device.close()


def test_a_report_of_a_picture_that_went_into_a_texture_has_none(theirs):
    out = theirs.texture(SIZE, 4, dtype="f2")
    device = moit.gpu.Device.current()
    found = moit.render(
        GLASS, "wboit", SIZE, camera=CAMERA, device=device, exact=True, into=out, report=True
    )
    assert found.image is None
    assert found.size == SIZE
    assert found.bytes_per_pixel > 0
    device.close()


def test_textures_that_do_not_fit_are_named(theirs):
    color, depth = drawn_by_moderngl(theirs)
    small = theirs.texture((8, 8), 4)
    device = moit.gpu.Device.current()

    def render(technique="wboit", **textures):
        moit.render(GLASS, technique, SIZE, camera=CAMERA, device=device, exact=True, **textures)

    with pytest.raises(moit.GpuError, match=r"into: expected a texture of 60 x 40.*8 x 8"):
        render(into=small)
    with pytest.raises(moit.GpuError, match=r"opaque\[1\]: expected a depth texture, got rgba32f"):
        render(opaque=(color, color))
    with pytest.raises(moit.GpuError, match=r"opaque\[0\]: expected a colour"):
        render(opaque=(depth, depth))
    with pytest.raises(moit.GpuError, match="into: expected a colour"):
        render(into=depth)
    with pytest.raises(moit.GpuError, match="99999"):
        render(into=99999)
    with pytest.raises(TypeError, match="opaque: expected two textures"):
        render(opaque=color)
    with pytest.raises(TypeError, match="into: expected a texture's GL name"):
        render(into="screen")
    with pytest.raises(moit.GpuError, match="fragments that the host reads"):
        render("power4(depth_range='pixel')", into=color)
    device.close()
    with pytest.raises(ValueError, match="opaque, into"):
        moit.render(GLASS, "wboit", SIZE, into=color)


def test_matrices_show_a_point_where_the_rasteriser_has_it():
    view, projection = CAMERA.matrices(SIZE)
    point = np.array([0.3, -0.2, 0.5, 1])
    clip = projection @ view @ point
    away = (point[:3] - CAMERA.eye) @ CAMERA.axes.T
    assert clip[3] == pytest.approx(away[2])
    np.testing.assert_allclose(
        clip[:2] / clip[3], np.array(CAMERA.scale(SIZE)) * away[:2] / away[2]
    )
    for z, depth in ((CAMERA.near, -1), (CAMERA.far, 1)):
        at = projection @ np.array([0, 0, -z, 1])
        assert at[2] / at[3] == pytest.approx(depth)


def test_textures_have_no_place_beside_fragments_that_the_host_reads(theirs):
    color, depth = drawn_by_moderngl(theirs)
    given = {"device": moit.gpu.Device.current(), "camera": CAMERA, "opaque": (color, depth)}
    with pytest.raises(moit.GpuError, match=r"opaque, into: power4.* that the host reads"):
        moit.render(GLASS, "power4(depth_range='pixel')", SIZE, **given)
