"""A good foreign: moderngl's textures are drawn to and read by their names, its state comes back.

moderngl is the other side here, through EGL as on a server.
"""

import ctypes
from itertools import product

import numpy as np
import pytest
from gpu import device as any_device

import moit

moderngl = pytest.importorskip("moderngl", reason="no moderngl to draw with")
LIBRARIES = {"libegl": "libEGL.so.1", "libgl": "libEGL.so.1"}

COVER = """#version 450
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0.5, 1);
}
"""
TINTED = """#version 450
layout(binding = 1) uniform sampler2D opaque;
uniform vec4 tint;
layout(location = 0) out vec4 color;
void main() { color = texelFetch(opaque, ivec2(gl_FragCoord.xy), 0) * tint; }
"""
DOUBLED = """#version 450
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba16f) uniform image2D image;
layout(std430, binding = 0) buffer Seen { uint seen; };
void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, imageSize(image)))) return;
    imageStore(image, at, 2.0 * imageLoad(image, at));
    atomicAdd(seen, 1u);
}
"""


@pytest.fixture
def theirs():
    """moderngl's own context, current in this thread."""
    any_device()  # skips where there is none
    ctx = moderngl.create_context(standalone=True, backend="egl", require=450, **LIBRARIES)
    yield ctx
    ctx.release()


@pytest.fixture
def foreign(theirs):
    """Our device in it."""
    device = moit.gpu.Device.current()
    yield device
    device.close()


def tint(device, opaque, target, by) -> None:
    program = device.compile(vertex=COVER, fragment=TINTED)
    device.draw(program, 3, targets=[target], textures={1: opaque}, uniforms={"tint": by})


GL_CLIP_DISTANCE0 = 0x3000  # and seven more


def test_what_their_shaders_clip_by_clips_nothing_of_ours(theirs, foreign):
    """Each of their eight planes: they stay on for them, and our shaders write no distances."""
    out = theirs.texture((5, 3), 4, dtype="f4")
    opaque = theirs.texture((5, 3), 4, np.ones((3, 5, 4), "f4").tobytes(), dtype="f4")
    egl = ctypes.CDLL(LIBRARIES["libgl"])
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    kind = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)
    is_on = kind(egl.eglGetProcAddress(b"glIsEnabled"))
    for k in range(8):
        theirs.enable_direct(GL_CLIP_DISTANCE0 + k)
        with foreign:
            given, target = map(foreign.wrap_texture, (opaque.glo, out.glo))
            tint(foreign, given, target, [k + 1] * 4)
            assert not is_on(GL_CLIP_DISTANCE0 + k)
        assert is_on(GL_CLIP_DISTANCE0 + k)
        theirs.disable_direct(GL_CLIP_DISTANCE0 + k)
        assert (np.frombuffer(out.read(), np.float32) == k + 1).all()


def test_an_adopted_context_says_whose_it_is(theirs, foreign):
    assert foreign.info["platform"] == "adopted"
    assert foreign.renderer == theirs.info["GL_RENDERER"]


@pytest.mark.parametrize("dtype", ["f1", "f2", "f4"])
def test_their_textures_are_read_and_drawn_to_by_name(theirs, foreign, dtype):
    data = np.arange(5 * 3 * 4, dtype=np.float32).reshape(3, 5, 4) / 64
    kind = {"f1": np.uint8, "f2": np.float16, "f4": np.float32}[dtype]
    stored = (data * 255).astype(kind) if dtype == "f1" else data.astype(kind)
    opaque = theirs.texture((5, 3), 4, stored.tobytes(), dtype=dtype)
    out = theirs.texture((5, 3), 4, dtype="f4")
    with foreign:
        wrapped = foreign.wrap_texture(opaque.glo)
        assert (wrapped.width, wrapped.height, wrapped.channels) == (5, 3, 4)
        assert wrapped.format == {"f1": "rgba8", "f2": "rgba16f", "f4": "rgba32f"}[dtype]
        tint(foreign, wrapped, foreign.wrap_texture(out.glo), [1, 2, 0.5, 1])
    got = np.frombuffer(out.read(), np.float32).reshape(3, 5, 4)
    seen = stored.astype(np.float32) / (np.float32(255) if dtype == "f1" else np.float32(1))
    np.testing.assert_allclose(got, seen * np.float32([1, 2, 0.5, 1]), rtol=1e-6)


def test_a_texture_that_theirs_filters_is_read_as_it_is(theirs, foreign):
    """Their filter wants smaller levels, which are not there: to a sampler it would be black."""
    opaque = theirs.texture((4, 4), 4, np.full((4, 4, 4), 0.5, "f4").tobytes(), dtype="f4")
    opaque.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    with foreign:
        target = foreign.texture("rgba32f", 4, 4)
        tint(foreign, foreign.wrap_texture(opaque.glo), target, [1] * 4)
        got = np.empty((4, 4, 4), np.float32)
        target.read(got)
    assert (got == 0.5).all()


def test_their_depth_hides_what_is_behind(theirs, foreign):
    """moderngl draws opaque depth; ours is tested against it and leaves it."""
    size = (6, 4)
    depth = theirs.depth_texture(size)
    color = theirs.texture(size, 4, dtype="f2")
    scene = theirs.framebuffer([color], depth)
    scene.use()
    theirs.enable(moderngl.DEPTH_TEST)
    scene.clear(0.25, 0.5, 0.75, 1.0, depth=1.0)
    program = theirs.program(
        vertex_shader="""#version 330
        void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1,
                                         gl_VertexID == 1 ? 3 : -1, 1); }""",
        fragment_shader="""#version 330
        out vec4 color; void main() { color = vec4(1, 0, 0, 1); }""",
    )
    theirs.vertex_array(program, []).render(vertices=3)
    before = np.frombuffer(depth.read(), np.float32).reshape(4, 6)
    with foreign:
        # over what they drew, at depth 0.75
        over = """#version 450
        layout(location = 0) out vec4 color; void main() { color = vec4(0, 0.5, 0, 0.5); }"""
        foreign.draw(
            foreign.compile(vertex=COVER, fragment=over),
            3,
            targets=[foreign.wrap_texture(color.glo)],
            depth=foreign.wrap_texture(depth.glo),
            depth_test="less",
            blend=["over"],
        )
    got = np.frombuffer(color.read(), np.float16).reshape(4, 6, 4).astype(float)
    in_front = before > 0.75
    assert 0 < in_front.sum() < in_front.size
    np.testing.assert_allclose(
        got[in_front], np.broadcast_to([0.5, 0.5, 0, 1], got.shape)[in_front]
    )
    np.testing.assert_allclose(got[~in_front], np.broadcast_to([1, 0, 0, 1], got.shape)[~in_front])
    np.testing.assert_array_equal(np.frombuffer(depth.read(), np.float32).reshape(4, 6), before)


def test_moderngl_draws_in_our_context_and_reads_our_textures():
    with any_device():
        pass
    device = moit.gpu.Device()
    with device:
        ctx = moderngl.create_context(context=device)
        ours = device.texture("rgba16f", 9, 7)
        device.clear(ours, [1, 2, 3, 4])
        seen = device.buffer(4)
        device.fill(seen)
        device.dispatch(
            device.compile(compute=DOUBLED), (2, 1, 1), images={0: ours}, buffers={0: seen}
        )
        theirs = ctx.external_texture(ours.glo, (9, 7), 4, 0, "f2")
        got = np.frombuffer(ctx.framebuffer([theirs]).read(components=4, dtype="f4"), np.float32)
        np.testing.assert_array_equal(
            got.reshape(7, 9, 4), np.broadcast_to([2, 4, 6, 8], (7, 9, 4))
        )
        drawn = ctx.texture((9, 7), 4, dtype="f4")
        ctx.framebuffer([drawn]).clear(0.1, 0.2, 0.3, 0.4)
        back = np.empty((7, 9, 4), np.float32)
        device.wrap_texture(drawn.glo).read(back)
        np.testing.assert_array_equal(back[0, 0], np.float32([0.1, 0.2, 0.3, 0.4]))
        count = np.empty(1, np.uint32)
        seen.read(count)
        assert count == 63
    ctx.release()
    device.close()


# ---- State ---------------------------------------------------------------------------------------

INT, FLOAT = ctypes.c_int, ctypes.c_float
SWITCHES = {
    "cull face": 0x0B44,
    "depth test": 0x0B71,
    "depth clamp": 0x864F,
    "stencil test": 0x0B90,
    "blend": 0x0BE2,
    "logic op": 0x0BF2,
    "scissor": 0x0C11,
    "sRGB": 0x8DB9,
    "multisample": 0x809D,
    "sample mask": 0x8E51,
    "alpha to coverage": 0x809E,
    "polygon offset": 0x8037,
    "discard": 0x8C89,
    "primitive restart": 0x8F9D,
    "fixed restart": 0x8D69,
    "clip distance 0": 0x3000,
    "clip distance 7": 0x3007,
    "seamless": 0x884F,
    "program point size": 0x8642,
    "dither": 0x0BD0,
}
# name: (constant, how many integers)
NUMBERS = {
    "draw framebuffer": (0x8CA6, 1),
    "read framebuffer": (0x8CAA, 1),
    "viewport": (0x0BA2, 4),
    "scissor box": (0x0C10, 4),
    "polygon mode": (0x0B40, 2),
    "depth function": (0x0B74, 1),
    "depth mask": (0x0B72, 1),
    "cull mode": (0x0B45, 1),
    "front face": (0x0B46, 1),
    "color mask": (0x0C23, 4),
    "program": (0x8B8D, 1),
    "vertex array": (0x85B5, 1),
    "array buffer": (0x8894, 1),
    "active texture": (0x84E0, 1),
    "storage buffer": (0x90D3, 1),
    "uniform buffer": (0x8A28, 1),
    "pack buffer": (0x88ED, 1),
    "unpack buffer": (0x88EF, 1),
    "clip origin": (0x935C, 1),
    "clip depth": (0x935D, 1),
    "provoking vertex": (0x8E4F, 1),
    "restart index": (0x8F9E, 1),
    "clear color": (0x0C22, 4),
    "renderbuffer": (0x8CA7, 1),
    **{f"pack {n:#x}": (n, 1) for n in (*range(0x0D00, 0x0D06), 0x806B, 0x806C)},
    **{f"unpack {n:#x}": (n, 1) for n in (*range(0x0CF0, 0x0CF6), 0x806D, 0x806E)},
}
# indexed: (constant, indices, how many integers)
INDEXED = {
    "blend source": (0x80C9, range(8), 1),
    "blend destination": (0x80C8, range(8), 1),
    "blend source alpha": (0x80CB, range(8), 1),
    "blend destination alpha": (0x80CA, range(8), 1),
    "blend equation": (0x8009, range(8), 1),
    "blend equation alpha": (0x883D, range(8), 1),
    "color mask of target": (0x0C23, range(8), 4),
    "viewports": (0x0BA2, range(16), 4),
    "scissor boxes": (0x0C10, range(16), 4),
    "storage": (0x90D3, range(16), 1),
    "storage start": (0x90D4, range(16), 1),
    "storage size": (0x90D5, range(16), 1),
    **{f"image {n:#x}": (n, range(8), 1) for n in (0x8F3A, 0x8F3B, 0x8F3C, 0x8F3D, 0x8F3E, 0x906E)},
}
DEPTH_RANGE = 0x0B70


class Gl:
    """The functions of GL by which tests look at its state and disturb it."""

    def __init__(self, device) -> None:
        self._address = device.load_opengl_function

    def call(self, name, *arguments, result=None):
        """Integers are 32 bits wide, floats single; pointers are ctypes'."""
        kinds = [
            FLOAT if isinstance(a, float) else INT if isinstance(a, int) else ctypes.c_void_p
            for a in arguments
        ]
        plain = [ctypes.c_int(a & 0xFFFFFFFF).value if isinstance(a, int) else a for a in arguments]
        plain = [
            ctypes.cast(a, ctypes.c_void_p) if k is ctypes.c_void_p else a
            for a, k in zip(plain, kinds, strict=True)
        ]
        return ctypes.CFUNCTYPE(result, *kinds)(self._address(name))(*plain)

    def state(self) -> dict:
        found = {}
        enabled = ctypes.c_ubyte
        for name, constant in SWITCHES.items():
            found[name] = self.call("glIsEnabled", constant, result=enabled)
        for name, (constant, count) in NUMBERS.items():
            values = (INT * 16)()
            self.call("glGetIntegerv", constant, values)
            found[name] = values[:count]
        for i, (name, constant) in product(range(8), (("blend", 0x0BE2),)):
            found[name, i] = self.call("glIsEnabledi", constant, i, result=enabled)
        for i in range(16):
            found["scissor", i] = self.call("glIsEnabledi", 0x0C11, i, result=enabled)
            values = (ctypes.c_double * 2)()
            self.call("glGetDoublei_v", DEPTH_RANGE, i, values)
            found["depth range", i] = values[:]
        for name, (constant, indices, count) in INDEXED.items():
            for i in indices:
                values = (INT * 4)()
                self.call("glGetIntegeri_v", constant, i, values)
                found[name, i] = values[:count]
        for unit in range(24):
            self.call("glActiveTexture", 0x84C0 + unit)
            for name, constant in (("2D", 0x8069), ("sampler", 0x8919), ("cube", 0x8514)):
                values = (INT * 1)()
                self.call("glGetIntegerv", constant, values)
                found["texture", name, unit] = values[0]
        self.call("glActiveTexture", found["active texture"][0])
        assert self.call("glGetError", result=INT) == 0
        return found

    def disturb(self, ctx) -> list:
        """Sets everything to something unusual; what must live meanwhile."""
        textures = [ctx.texture((4, 4), 4, dtype="f2") for _ in range(4)]
        depth = ctx.depth_texture((4, 4))
        sampler = ctx.sampler(texture=textures[0])
        buffer = ctx.buffer(reserve=4096)
        framebuffer = ctx.framebuffer(textures[:2], depth)
        framebuffer.use()
        for name in set(SWITCHES) - {"logic op"}:
            self.call("glEnable", SWITCHES[name])
        for i in range(8):
            self.call("glBlendFuncSeparatei", i, 0x0302, 0x0303, 1, 0x0300 + i % 2)
            self.call("glBlendEquationSeparatei", i, 0x800A, 0x8007 + i % 2)
            self.call("glColorMaski", i, 1, 0, i % 2, 1)
            self.call(("glEnablei", "glDisablei")[i % 2], 0x0BE2, i)
        for i in range(16):
            self.call("glViewportIndexedf", i, 1.0 + i, 2.0, 3.0 + i, 4.0)
            self.call("glScissorIndexed", i, i, 1, 2, 3)
            self.call(
                "glBindBufferRange",
                0x90D2,
                i,
                buffer.glo,
                ctypes.c_void_p(256 * (i % 3)),
                ctypes.c_void_p(128 + 16 * i),
            )
        self.call("glBindBufferBase", 0x90D2, 5, buffer.glo)
        for i in range(24):
            self.call("glActiveTexture", 0x84C0 + i)
            self.call("glBindTexture", 0x0DE1, textures[i % 4].glo)
            if i % 2:
                sampler.use(i)
        for i in range(8):
            self.call("glBindImageTexture", i, textures[i % 4].glo, 0, 0, 0, 0x88B8 + i % 3, 0x881A)
        self.call("glActiveTexture", 0x84C0 + 17)
        self.call("glPolygonMode", 0x0408, 0x1B01)
        self.call("glDepthFunc", 0x0205)
        self.call("glDepthMask", 0)
        self.call("glClipControl", 0x8CA2, 0x935F)
        self.call("glProvokingVertex", 0x8E4D)
        self.call("glCullFace", 0x0404)
        for n in (*range(0x0D02, 0x0D05), 0x806B, 0x806C, *range(0x0CF2, 0x0CF5), 0x806D, 0x806E):
            self.call("glPixelStorei", n, 3)
        for n in (0x0D00, 0x0D01, 0x0CF0, 0x0CF1):
            self.call("glPixelStorei", n, 1)
        self.call("glPixelStorei", 0x0D05, 8)
        self.call("glPixelStorei", 0x0CF5, 2)
        self.call("glBindBuffer", 0x88EB, buffer.glo)
        self.call("glBindBuffer", 0x88EC, buffer.glo)
        self.call("glBindFramebuffer", 0x8CA8, 0)
        program = ctx.program(
            vertex_shader="#version 330\nvoid main() { gl_Position = vec4(0); }",
            fragment_shader="#version 330\nvoid main() {}",
        )
        self.call("glUseProgram", program.glo)
        vertices = ctx.vertex_array(program, [])
        self.call("glBindVertexArray", vertices.glo)
        return [textures, depth, sampler, buffer, framebuffer, program, vertices]


def everything_we_do(d) -> None:
    """Each kind of pass, transfer and failure; and that the results are right in their state."""
    one, two = d.texture("rgba16f", 5, 3), d.texture("rgba16f", 5, 3)
    values = np.float16(np.random.default_rng(0).integers(0, 64, (3, 5, 4)) / 64)  # 5 of it fits
    one.write(values)
    tint(d, one, two, [2] * 4)
    got = np.empty((3, 5, 4), np.float32)
    two.read(got)
    np.testing.assert_array_equal(got, 2 * values.astype(np.float32))
    seen = d.buffer(4)
    d.fill(seen)
    d.dispatch(d.compile(compute=DOUBLED), (1, 1, 1), images={0: two}, buffers={0: seen})
    two.read(got)
    np.testing.assert_array_equal(got, 4 * values.astype(np.float32))
    depth = d.texture("depth32f", 5, 3)
    d.clear(depth, [1])
    program = d.compile(vertex=COVER, fragment=TINTED)
    d.draw(
        program,
        3,
        targets=[two, d.texture("rgba32f", 5, 3)],
        blend=["add", "multiply"],
        depth=depth,
        depth_test="lequal",
        depth_write=True,
        textures={1: one},
        uniforms={"tint": [1] * 4},
    )
    two.read(got)
    np.testing.assert_array_equal(got, 5 * values.astype(np.float32))
    near = np.empty((3, 5, 1), np.float32)
    depth.read(near)
    assert (near == 0.75).all()
    d.begin_time()
    d.seconds(d.end_time())
    with pytest.raises(moit.GpuError):
        d.buffer(2**46)
    with pytest.raises(moit.GpuError):
        d.dispatch(program, (1, 1, 1))


def differences(before: dict, after: dict) -> dict:
    return {key: (before[key], after[key]) for key in before if before[key] != after[key]}


@pytest.mark.parametrize("disturbed", [False, True])
def test_their_state_is_as_it_was(theirs, foreign, disturbed):
    gl = Gl(foreign)
    alive = gl.disturb(theirs) if disturbed else []
    before = gl.state()
    with foreign:
        everything_we_do(foreign)
        with foreign:
            everything_we_do(foreign)
    assert differences(before, gl.state()) == {}
    assert len(alive) == (7 if disturbed else 0)


def test_state_comes_back_after_an_error_and_after_close(theirs):
    foreign = moit.gpu.Device.current()
    gl = Gl(foreign)
    alive = gl.disturb(theirs)
    before = gl.state()
    with pytest.raises(moit.GpuError, match="expected 0 to"), foreign:
        everything_we_do(foreign)
        foreign.dispatch(foreign.compile(compute=DOUBLED), (70_000, 1, 1))
    assert differences(before, gl.state()) == {}
    with foreign:
        everything_we_do(foreign)
        foreign.close()
    assert differences(before, gl.state()) == {}
    assert alive


def test_state_comes_back_where_moderngl_draws_in_our_context():
    with any_device():
        pass
    device = moit.gpu.Device()
    gl = Gl(device)
    with device:
        ctx = moderngl.create_context(context=device)
        alive = gl.disturb(ctx)
        before = gl.state()
        with device:
            everything_we_do(device)
        assert differences(before, gl.state()) == {}
    assert alive
    device.close()


def test_errors_of_theirs_are_not_taken_for_ours(theirs, foreign):
    gl = Gl(foreign)
    gl.call("glEnable", 0x1234)
    with foreign:
        everything_we_do(foreign)


def test_their_pixels_are_read_rightly_afterwards(theirs, foreign):
    """A row length left behind would make moderngl write past its memory."""
    texture = theirs.texture((5, 3), 4, np.arange(60, dtype="u1").tobytes())
    with foreign:
        everything_we_do(foreign)
    assert texture.read() == bytes(range(60))


def test_close_deletes_ours_and_leaves_theirs(theirs):
    foreign = moit.gpu.Device.current()
    gl = Gl(foreign)
    texture = theirs.texture((5, 3), 4)
    with foreign:
        wrapped, ours, buffer = (
            foreign.wrap_texture(texture.glo),
            foreign.texture("r8", 4, 4),
            foreign.buffer(9),
        )
        names = ours.glo, buffer.glo
    foreign.close()
    byte = ctypes.c_ubyte
    assert gl.call("glIsTexture", texture.glo, result=byte)
    assert not gl.call("glIsTexture", names[0], result=byte)
    assert not gl.call("glIsBuffer", names[1], result=byte)
    del wrapped, ours, buffer
    assert gl.call("glIsTexture", texture.glo, result=byte)


def test_what_was_current_is_current_again(theirs):
    """Our own context beside theirs, in one thread."""
    texture = theirs.texture((2, 2), 4, bytes(range(16)))
    device = moit.gpu.Device()
    with device:
        mine = device.texture("r8", 1, 1)
        with moit.gpu.Device() as other:
            other.texture("r8", 1, 1)
        mine.write(np.uint8([7]))
        with device:
            pass
        back = np.empty(1, np.uint8)
        mine.read(back)
        assert back == 7
    assert texture.read() == bytes(range(16))
    device.close()
    assert texture.read() == bytes(range(16))


def test_a_context_that_was_destroyed_while_it_was_current_is_not_missed():
    """moderngl releases a context and leaves it current; ours must not stay in its place."""
    device = moit.gpu.Device() if any_device() else None
    ctx = moderngl.create_context(standalone=True, backend="egl", require=450, **LIBRARIES)
    ctx.release()
    with device:
        device.buffer(4)
    with pytest.raises(moit.GpuError, match="no context"):
        moit.gpu.Device.current()
    device.close()
