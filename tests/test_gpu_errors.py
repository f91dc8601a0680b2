"""What goes wrong on a GPU is a GpuError that says what to do, and nothing is lost with it."""

import gc
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from gpu import device
from small import ENVIRONMENT

import moit
from moit.gpu import texts as shaders
from moit.gpu.bindings import CAPTURE

ADD = """#version 450
layout(local_size_x = 1) in;
layout(std430, binding = 2) buffer Sum { uint sum; };
layout(binding = 3, r32ui) uniform uimage2D cells;
layout(binding = 4) uniform sampler2D picture;
uniform vec2 step;
uniform uint steps[3];
void main() {
    sum += imageLoad(cells, ivec2(0)).x + uint(texelFetch(picture, ivec2(0), 0).x);
    sum += uint(step.x) + steps[gl_WorkGroupID.x];
}
"""
COVER = """#version 450
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0.5, 1); }
"""
WHITE = """#version 450
layout(location = 0) out vec4 color;
void main() { color = vec4(1); }
"""
needs_proc = pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="no /proc to read memory from"
)


def opened_with(**variables: str) -> str:
    """What a process says that opens a device with these environment variables."""
    code = "import moit\ntry: print(moit.gpu.Device())\nexcept moit.GpuError as e: print(e)"
    run = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={**ENVIRONMENT, **variables},
    )
    return run.stdout.strip()


def in_another_thread(call) -> Exception | None:
    caught = []

    def run():
        try:
            call()
        except Exception as error:
            caught.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    return caught[0] if caught else None


# ---- What is missing -----------------------------------------------------------------------------


def test_without_libegl_the_packages_are_named():
    said = opened_with(MOIT_EGL="libEGL-of-nobody.so")
    assert "libEGL-of-nobody.so cannot be opened" in said
    assert "libegl1 and libgl1-mesa-dri" in said


def test_a_library_that_is_not_egl_is_refused():
    said = opened_with(MOIT_EGL="libc.so.6")
    assert "libc.so.6 has no function egl" in said
    assert "libegl1 and libgl1-mesa-dri" in said


def test_without_a_driver_the_packages_are_named():
    device()
    said = opened_with(__EGL_VENDOR_LIBRARY_FILENAMES="/nonexistent.json")
    assert "driver" in said
    assert "libgl1-mesa-dri" in said


def test_an_older_opengl_is_refused_with_what_was_found():
    device()
    said = opened_with(MESA_GL_VERSION_OVERRIDE="4.3", LIBGL_ALWAYS_SOFTWARE="1")
    assert "OpenGL 4.5" in said
    assert "device 0: " in said or "surfaceless: " in said


@pytest.mark.parametrize("index", [-1, 64, 2**70])
def test_an_index_that_is_no_device_is_refused(index):
    device()
    with pytest.raises(moit.GpuError, match="index: expected"):
        moit.gpu.Device(index)


def test_there_must_be_a_context_to_adopt():
    device()
    error = in_another_thread(moit.gpu.Device.current)  # nobody left one current there
    assert isinstance(error, moit.GpuError)
    assert "no context of EGL is current" in str(error)


# ---- Where and when ------------------------------------------------------------------------------


def test_a_device_belongs_to_the_thread_that_has_entered_it():
    with device() as d:
        buffer = d.buffer(4)
        for call in (d.__enter__, lambda: d.buffer(4), lambda: buffer.write(bytes(4)), d.close):
            error = in_another_thread(call)
            assert isinstance(error, moit.GpuError), call
            assert "another thread" in str(error)
        d.fill(buffer)  # and still works here


def test_threads_use_a_device_in_turn():
    with device() as d:
        buffer = d.buffer(4, np.uint32([7]))

    def read():
        got = np.empty(1, np.uint32)
        with device():
            buffer.read(got)
        assert got == 7

    assert in_another_thread(read) is None
    read()


def test_a_device_for_each_thread_works_at_once():
    device()
    failures = []

    def work(seed):
        try:
            numbers = np.random.default_rng(seed).integers(0, 1000, 4096, np.uint32)
            with moit.gpu.Device() as d:
                for _ in range(20):
                    got = np.empty_like(numbers)
                    d.buffer(numbers.nbytes, numbers).read(got)
                    np.testing.assert_array_equal(got, numbers)
            d.close()
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []


def test_the_default_device_lets_threads_wait():
    device()
    d = moit.gpu.default_device()
    assert moit.gpu.default_device() is d
    inside, most = [0], [0]

    def work():
        for _ in range(50):
            with moit.gpu.default_device() as got:
                assert got is d
                inside[0] += 1
                most[0] = max(most[0], inside[0])
                got.buffer(64).write(bytes(64))
                inside[0] -= 1

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1]


def test_a_context_current_elsewhere_is_said_to_be():
    """By way of somebody who made it current without us: EGL_BAD_ACCESS."""
    moderngl = pytest.importorskip("moderngl", reason="no moderngl to attach")
    d = moit.gpu.Device()
    d.__enter__()
    adopted = moit.gpu.Device.current()
    del moderngl
    error = in_another_thread(adopted.__enter__)
    assert isinstance(error, moit.GpuError)
    assert "not current in this thread" in str(error)
    adopted.close()
    d.__exit__()
    d.close()


def test_what_is_not_entered_or_closed_says_so():
    d = moit.gpu.Device() if device() else None
    with d:
        buffer, texture = d.buffer(4), d.texture("r8", 2, 2)
        program = d.compile(vertex=COVER, fragment=WHITE)
    calls = (
        lambda: d.buffer(4),
        lambda: buffer.write(bytes(4)),
        lambda: texture.read(np.zeros((2, 2, 1), np.float32)),
        lambda: d.draw(program, 3, targets=[texture]),
        lambda: d.clear(texture, [1]),
        lambda: d.fill(buffer),
        d.finish,
        d.begin_time,
        d.end_time,
        lambda: d.seconds(0),
        lambda: d.wrap_texture(1),
        d.__exit__,
    )
    for call in calls:
        with pytest.raises(moit.GpuError, match="enter"):
            call()
    d.close()
    d.close()
    for call in (*calls[:-1], d.__enter__, lambda: d.compile(compute=ADD)):
        with pytest.raises(moit.GpuError, match="was closed"):
            call()


def test_close_within_a_block_ends_well():
    device()
    with moit.gpu.Device() as d:
        d.texture("r8", 4, 4)
        d.close()
        with pytest.raises(moit.GpuError, match="was closed"):
            d.buffer(4)
    with device() as other:
        other.buffer(4)


def test_an_adopted_context_that_is_no_longer_current_is_missed():
    with device():
        adopted = moit.gpu.Device.current()
        with adopted:
            adopted.buffer(4)
    with pytest.raises(moit.GpuError, match="the adopted context is not current"):
        adopted.__enter__()
    with device(), adopted:
        adopted.buffer(4)
        adopted.close()


def test_a_context_that_others_take_away_within_a_block_is_missed():
    with device() as d:
        d.context.enter()
        with moit.gpu.Device() as other:
            with pytest.raises(moit.GpuError, match="no longer current"):
                d.buffer(4)
            other.buffer(4)
        d.buffer(4)
        d.context.exit()


def test_objects_stay_with_their_device():
    other = moit.gpu.Device() if device() else None
    with other:
        buffer, texture = other.buffer(64), other.texture("rgba8", 4, 4)
        program = other.compile(vertex=COVER, fragment=WHITE)
    with device() as d:
        mine = d.compile(vertex=COVER, fragment=WHITE)
        for call in (
            lambda: d.draw(program, 3, size=(4, 4)),
            lambda: d.draw(mine, 3, targets=[texture]),
            lambda: d.draw(mine, 3, size=(4, 4), buffers={1: buffer}),
            lambda: d.draw(mine, 3, size=(4, 4), textures={1: texture}),
            lambda: d.draw(mine, 3, size=(4, 4), images={1: texture}),
        ):
            with pytest.raises(moit.GpuError, match="another device"):
                call()
    other.close()


def test_a_forked_process_opens_its_own():
    """The child's use of the parent's is refused; a new one works there."""
    device()
    code = """if True:
        import os, moit
        d = moit.gpu.default_device()
        with d: buffer = d.buffer(4)
        child = os.fork()
        if child == 0:
            try:
                d.__enter__()
            except moit.GpuError as error:
                assert "forked" in str(error)
            else:
                os._exit(3)
            del buffer, d
            new = moit.gpu.default_device()
            with new: new.buffer(4)
            os._exit(0)
        assert os.waitpid(child, 0)[1] == 0
        with d: d.fill(buffer)
        print("well")
    """
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
    )
    assert run.stdout == "well\n", run.stderr


# ---- Shaders -------------------------------------------------------------------------------------


def test_a_compile_error_names_our_file_and_line():
    name, ours = "arrays/front_to_back.glsl", "state[i] = SCALAR(through);"
    text = shaders.source("techniques/sorted.glsl", SCALAR="float", DOUBLE=0, PASS=CAPTURE)
    lines = text.splitlines()
    [at] = [i for i, line in enumerate(lines) if ours in line]
    lines[at] += " undeclared = 1;"
    with device() as d, pytest.raises(moit.GpuError) as caught:
        d.compile(compute="\n".join(lines))
    said = str(caught.value)
    assert "the compute shader fails" in said
    found = re.search(rf"{re.escape(name)}:(\d+)", said)
    assert found and "undeclared" in said
    folder = Path(__file__).parents[1] / "shaders"
    assert ours in (folder / name).read_text().splitlines()[int(found[1]) - 1]


def test_the_stage_that_fails_is_named():
    with device() as d:
        for texts, said in (
            ({"vertex": "#version 450\nvoid main() { x }", "fragment": WHITE}, "the vertex shader"),
            ({"vertex": COVER, "fragment": "#version 450\nvoid main() { x }"}, "the fragment"),
            (
                {
                    "vertex": COVER,
                    "fragment": "#version 450\nin vec3 missing; out vec3 c;"
                    "void main() { c = missing; }",
                },
                "do not fit",
            ),
        ):
            with pytest.raises(moit.GpuError, match=said):
                d.compile(**texts)


@pytest.mark.parametrize("texts", [{}, {"vertex": COVER}, {"compute": ADD, "vertex": COVER}])
def test_programs_are_of_compute_or_of_vertex_and_fragment(texts):
    with device() as d, pytest.raises((moit.GpuError, ValueError), match="expected compute"):
        d.compile(**texts)


# ---- Passes --------------------------------------------------------------------------------------


@pytest.fixture
def add():
    """Everything that ADD needs, to be left out one by one."""
    with device() as d:
        needed = {
            "buffers": {2: d.buffer(4)},
            "images": {3: d.texture("r32ui", 1, 1)},
            "textures": {4: d.texture("r8", 1, 1)},
        }
        yield d, d.compile(compute=ADD), needed


@pytest.mark.parametrize(
    ("kind", "named"),
    [("buffers", "Sum at binding 2"), ("images", "cells at unit 3"), ("textures", "picture at")],
)
def test_what_a_pass_lacks_is_named(add, kind, named):
    d, program, needed = add
    d.dispatch(program, (1, 1, 1), **needed)
    with pytest.raises(moit.GpuError, match=named):
        d.dispatch(program, (1, 1, 1), **{**needed, kind: {}})


@pytest.mark.parametrize("groups", [(65_536, 1, 1), (1, 65_536, 1), (1, 1, 2**40), (-1, 1, 1)])
def test_too_many_groups_are_refused(add, groups):
    """GL would do nothing, and that very fast."""
    d, program, needed = add
    assert d.info["groups"] == 65_535
    with pytest.raises(moit.GpuError, match=r"groups: expected 0 to 65535 in [xyz], got"):
        d.dispatch(program, groups, **needed)


@pytest.mark.parametrize(
    ("given", "error"),
    [
        ({"step": 1.0}, r"step: expected 2 number\(s\), got 1"),
        ({"step": [1, 2, 3]}, r"step: expected 2 number\(s\), got 3"),
        ({"step": "ab"}, "step: expected numbers"),
        ({"step": [1, None]}, "step: expected numbers"),
        ({"steps": 1.5}, "steps: expected integers"),
        ({"steps": -1}, "steps: expected 0 to 4294967295, got -1"),
        ({"steps": [2**32] * 3}, "steps: expected 0 to 4294967295"),
        ({"steps": []}, "steps: expected 1 number"),
        ({"step": [[1, 2], [3, 4]]}, r"step: expected 2 number\(s\), got 4"),
    ],
)
def test_uniforms_that_do_not_fit_are_named(add, given, error):
    d, program, needed = add
    with pytest.raises((TypeError, ValueError), match=error):
        d.dispatch(program, (1, 1, 1), **needed, uniforms=given)


@pytest.mark.parametrize(
    ("bound", "error"),
    [
        ((0, 128), "are not within its 64 bytes"),
        ((128, 0), "are not within its 64 bytes"),
        ((-16, 16), "are not within"),
        ((4, 4), "is not a multiple of"),
    ],
)
def test_parts_of_buffers_that_are_none_are_refused(add, bound, error):
    d, program, needed = add
    needed["buffers"][2] = (d.buffer(64), *bound)
    with pytest.raises(moit.GpuError, match=error):
        d.dispatch(program, (1, 1, 1), **needed)


def test_more_of_a_buffer_than_a_pass_sees_is_refused(add):
    d, program, needed = add
    if d.info["storage_bytes"] > 2**28:
        pytest.skip("this device sees more than a test should take")
    needed["buffers"][2] = d.buffer(d.info["storage_bytes"] + 4)
    with pytest.raises(moit.GpuError, match="more than the"):
        d.dispatch(program, (1, 1, 1), **needed)


@pytest.mark.parametrize(
    ("names", "options", "error"),
    [
        ([], {}, "size: expected"),
        ([], {"size": (1, 10**6)}, "size: expected"),
        (["rgba8", "r8-other-size"], {}, "of one size"),
        (["depth32f"], {}, "expected a texture of colour"),
        (["rgba8"], {"depth": "rgba8"}, "expected a texture of depth"),
        (["rgba8"], {"depth_test": "less"}, "depth: expected"),
        (["rgba8"], {"depth_write": True}, "depth: expected"),
        (["rgba32ui"], {"blend": ["add"]}, "whole numbers"),
        (["rgba8"], {"vertices": 2**31}, "draw parts"),
        (["rgba8"], {"vertices": -1}, "vertices: expected"),
    ],
)
def test_targets_that_cannot_be_drawn_to_are_refused(names, options, error):
    with device() as d:
        textures = [
            d.texture(name.split("-")[0], *((4, 5) if "-" in name else (4, 4))) for name in names
        ]
        options = {"vertices": 3, **options}
        if "depth" in options:
            options["depth"] = d.texture(options["depth"], 4, 4)
        program = d.compile(vertex=COVER, fragment=WHITE)
        with pytest.raises(moit.GpuError, match=error):
            d.draw(program, targets=textures, **options)
        d.draw(program, 3, targets=[d.texture("rgba8", 4, 4)])  # and it goes on


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"blend": ["plus"]}, "blend: expected one of None, add, over"),
        ({"blend": ["add", "add"]}, "as many"),
        ({"blend": "add"}, "expected a sequence"),
        ({"depth_test": "equal"}, "depth_test: expected one of None, less, lequal"),
        ({"buffers": {16: None}}, "buffers: expected bindings 0 to 15, got 16"),
        ({"buffers": {1: 3}}, "expected a Buffer at 1, got int"),
        ({"textures": {1: 3}}, "expected a Texture at 1, got int"),
        ({"size": (0, 1)}, "size: expected at least 1 x 1"),
        ({"size": 3}, "size: expected"),
        ({"targets": [3]}, "targets: expected a Texture, got int"),
    ],
)
def test_options_of_drawing_are_checked(options, error):
    with device() as d:
        program = d.compile(vertex=COVER, fragment=WHITE)
        options = {"targets": [d.texture("rgba8", 4, 4)], **options}
        with pytest.raises((TypeError, ValueError), match=error):
            d.draw(program, 3, **options)


def test_programs_are_dispatched_or_drawn(add):
    d, program, needed = add
    with pytest.raises(moit.GpuError, match="expected a vertex and a fragment shader"):
        d.draw(program, 3, size=(1, 1), **needed)
    with pytest.raises(moit.GpuError, match="expected a compute shader"):
        d.dispatch(d.compile(vertex=COVER, fragment=WHITE), (1, 1, 1))


# ---- Memory, formats, sizes ----------------------------------------------------------------------


def test_exhausted_memory_says_so_and_passes():
    with device() as d:
        for _ in range(3):
            with pytest.raises(moit.GpuError, match="memory of the device is exhausted"):
                d.buffer(2**46)
        d.fill(d.buffer(64))


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("rgba8", 0, 4), "width, height: expected 1 to"),
        (("rgba8", 4, 10**6), "width, height: expected 1 to"),
        (("rgb5", 4, 4), "format: expected one of r8 rgba8"),
        (("depth24", 4, 4), "format: expected one of"),
        (("", 4, 4), "format: expected one of"),
    ],
)
def test_textures_that_cannot_be_made_are_refused(arguments, error):
    with device() as d, pytest.raises(moit.GpuError, match=error):
        d.texture(*arguments)


def test_buffers_of_bad_sizes_are_refused():
    with device() as d:
        with pytest.raises(moit.GpuError, match="size: expected at least 0"):
            d.buffer(-1)
        with pytest.raises(ValueError, match="at most 4 bytes, got 8"):
            d.buffer(4, bytes(8))
        buffer = d.buffer(8)
        for call in (
            lambda: buffer.write(bytes(9)),
            lambda: buffer.write(bytes(8), 1),
            lambda: buffer.read(bytearray(4), 5),
            lambda: buffer.read(bytearray(4), -1),
            lambda: buffer.read(bytearray(4), 2**62),
        ):
            with pytest.raises(moit.GpuError, match="a buffer of 8 bytes has no"):
                call()
        with pytest.raises(moit.GpuError, match="words of 4"):
            d.fill(d.buffer(7))
        with pytest.raises((BufferError, ValueError)):
            buffer.read(np.zeros(4, np.uint32)[::2])
        with pytest.raises((BufferError, TypeError)):
            buffer.read(bytes(8))
        assert d.buffer(0).size == 0


@pytest.mark.parametrize(
    ("format", "array", "error"),
    [
        ("rgba8", np.zeros((2, 3, 3), np.float32), "are 24 numbers, not 18"),
        ("rgba8", np.zeros((2, 3, 4), np.uint16), "are float32 or uint8, not uint16"),
        ("r32ui", np.zeros((2, 3), np.float32), "are uint32, not float32"),
        ("depth32f", np.zeros((2, 3), np.float16), "are float32, not float16"),
        ("r32f", np.zeros((2, 3), np.float64), "expected float32, float16"),
        ("r32f", np.zeros((2, 3), ">f4"), "expected float32, float16"),
    ],
)
def test_pixels_that_do_not_fit_are_refused(format, array, error):
    with device() as d:
        texture = d.texture(format, 3, 2)
        for call in (texture.read, texture.write):
            with pytest.raises((moit.GpuError, TypeError), match=error):
                call(array)


def test_textures_of_others_are_looked_at():
    moderngl = pytest.importorskip("moderngl", reason="no moderngl to make textures")
    d = moit.gpu.Device() if device() else None
    with d:
        ctx = moderngl.create_context(context=d)
        cases = {
            "there is none": 4711,
            "two-dimensional": ctx.texture_array((4, 4, 2), 4).glo,
            "one sample": ctx.texture((4, 4), 4, samples=4).glo,
            "its format 0x": ctx.texture((4, 4), 4, dtype="i1").glo,
        }
        for said, name in cases.items():
            with pytest.raises(moit.GpuError, match=said):
                d.wrap_texture(name)
        with pytest.raises(moit.GpuError, match="there is none"):
            d.wrap_texture(0)
        d.wrap_texture(ctx.texture((4, 4), 4).glo)
    d.close()


# ---- Leaks ---------------------------------------------------------------------------------------


def resident() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def open_files() -> int:
    return len(os.listdir("/proc/self/fd"))


def use_and_fail(d) -> None:
    """Makes one of each, and fails in several ways."""
    numbers = np.arange(16, dtype=np.uint32)
    buffer, texture = d.buffer(64, numbers), d.texture("rgba8", 16, 16)
    program = d.compile(vertex=COVER, fragment=WHITE)
    d.draw(program, 3, targets=[texture], buffers={0: buffer})
    d.begin_time()
    d.end_time()
    for call in (
        lambda: d.compile(compute="#version 450\nvoid main() { undeclared; }"),
        lambda: d.buffer(2**46),
        lambda: d.texture("none", 4, 4),
        lambda: d.dispatch(program, (1, 1, 1)),
        lambda: d.wrap_texture(999),
    ):
        with pytest.raises(moit.GpuError):
            call()


def opened_and_closed(closes: bool) -> None:
    d = moit.gpu.Device()
    with d:
        use_and_fail(d)
    if closes:
        d.close()


def dropped_elsewhere(d) -> None:
    """Objects that another thread drops go when the device is next entered."""
    with d:
        dropped = [d.buffer(2**16, bytes(2**16)), d.texture("rgba32f", 64, 64)]
        d.clear(dropped[1], [1] * 4)
    thread = threading.Thread(target=dropped.clear)
    thread.start()
    thread.join()


def failing_to_open() -> None:
    for index in (99, -1):
        with pytest.raises(moit.GpuError):
            moit.gpu.Device(index)
    assert in_another_thread(moit.gpu.Device.current)


def adopted() -> None:
    with device():
        d = moit.gpu.Device.current()
        with d:
            use_and_fail(d)
        d.close()


@needs_proc
@pytest.mark.parametrize(
    ("call", "times", "most"),
    [
        # llvmpipe keeps some of what it compiled; a context that is lost holds a megabyte
        (lambda: opened_and_closed(True), 100, 20_000),
        (lambda: opened_and_closed(False), 100, 20_000),
        (lambda: dropped_elsewhere(device()), 100, 2_000),
        (failing_to_open, 200, 500),
        (adopted, 100, 2_000),
    ],
    ids=["closed", "dropped", "elsewhere", "failing", "adopted"],
)
def test_nothing_is_kept(call, times, most):
    device()
    for _ in range(10):
        call()
    gc.collect()
    rounds = []
    for _ in range(2):  # the least of two, as allocators grow in steps
        before, files = resident(), open_files()
        for _ in range(times):
            call()
        gc.collect()
        rounds.append((resident() - before) / times)
        assert open_files() <= files
    assert min(rounds) < most
