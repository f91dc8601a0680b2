"""How fast triangles become fragments, beside what memory and another rasteriser allow.

    python benchmarks/rasterizer.py     # a million small triangles, and ten that fill the screen

One thread. moit lists each fragment's depth, colour and opacity, which is 20 bytes to write; beside
its rate stands that at which a thread reads memory. Where moderngl is installed, OpenGL draws the
same triangles too, with whatever device EGL has (Mesa's llvmpipe on a machine without a GPU): it
adds up colours in a target of floats and lists nothing, so that it does less with each fragment.
Times are of processors, the best of rounds that ask all in turn.
"""

from __future__ import annotations

import argparse
import importlib
import os
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("LP_NUM_THREADS", "1")  # before Mesa is loaded

import numpy as np

import moit
from moit.benching import rivals

SIZE = (1280, 720)
LIST_BYTES = 20
CAMERA = moit.Camera(eye=(0, 0, 2), near=0.5, far=10)
VERTEX = """#version 330
uniform mat4 view;
in vec3 at;
in vec4 own;
out vec4 color;
void main() { gl_Position = view * vec4(at, 1.0); color = own; }"""
FRAGMENT = """#version 330
in vec4 color;
out vec4 seen;
void main() { seen = vec4(color.rgb * color.a, color.a); }"""


def triangles(count: int, size: float, spread: float) -> moit.Mesh:
    """So many, each in a plane of its own, of random corners about random middles."""
    rng = np.random.default_rng(7)
    middles = rng.uniform(-1, 1, (count, 1, 3)) * (spread * SIZE[0] / SIZE[1], spread, 0.3)
    corners = middles + size * rng.uniform(-1, 1, (count, 3, 3)) * (1, 1, 0)
    return moit.Mesh(
        corners.reshape(-1, 3),
        np.arange(3 * count).reshape(-1, 3),
        color=rng.uniform(0, 1, (3 * count, 3)),
        alpha=0.5,
        lit=False,
    )


def filling(count: int) -> moit.Mesh:
    """So many, one behind the other, that each cover all of the picture."""
    z = np.linspace(-0.3, 0.3, count)[:, None]
    outline = np.array([[-9, -3], [9, -3], [0, 9]])
    corners = np.concatenate([np.tile(outline, (count, 1)), np.repeat(z, 3, 0)], axis=1)
    return moit.Mesh(corners, np.arange(3 * count).reshape(-1, 3), alpha=0.5, lit=False)


SCENES: dict[str, Callable[[], moit.Mesh]] = {
    "a million small": lambda: triangles(1_000_000, 0.004, 0.8),
    "ten that fill the screen": lambda: filling(10),
}


def listing(mesh: moit.Mesh) -> Callable[[], int]:
    """Draws them as moit does; gives how many fragments there are."""
    return lambda: len(moit.rasterize(mesh, CAMERA, SIZE, threads=1, progress=False))


def blending(mesh: moit.Mesh) -> Callable[[], str]:
    """Draws them with OpenGL; gives what by. Raises ImportError or what moderngl raises."""
    moderngl: Any = importlib.import_module("moderngl")
    gl = moderngl.create_standalone_context(backend="egl")
    program = gl.program(VERTEX, FRAGMENT)
    right, up, forward = CAMERA.axes
    turn = np.eye(4)
    turn[:3, :3] = right, up, -forward
    turn[:3, 3] = -turn[:3, :3] @ np.array(CAMERA.eye)
    scale = 1 / np.tan(CAMERA.fov_y / 2)
    near, far = CAMERA.near, CAMERA.far
    lens = np.zeros((4, 4))
    lens[0, 0], lens[1, 1] = scale * SIZE[1] / SIZE[0], scale
    lens[2, 2:] = (near + far) / (near - far), 2 * near * far / (near - far)
    lens[3, 2] = -1
    program["view"].write(np.asarray(lens @ turn, "f4").T.tobytes())
    count = len(mesh.points)
    color = np.column_stack([np.broadcast_to(mesh.color, (count, 3)), np.full(count, 0.5)])
    rows = np.column_stack([mesh.points, color]).astype(np.float32)
    drawn = gl.vertex_array(program, [(gl.buffer(rows.tobytes()), "3f 4f", "at", "own")])
    target = gl.framebuffer([gl.texture(SIZE, 4, dtype="f4")])
    target.use()
    gl.enable(moderngl.BLEND)
    gl.blend_func = moderngl.ONE, moderngl.ONE

    def draw() -> str:
        target.clear()
        drawn.render()
        gl.finish()
        return str(gl.info["GL_RENDERER"])

    return draw


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=5)
    args = parser.parse_args()
    calls: dict[str, Callable[[], Any]] = {}
    for name, scene in SCENES.items():
        mesh = scene()
        calls[f"{name}, moit"] = listing(mesh)
        try:
            calls[f"{name}, OpenGL"] = blending(mesh)
        except Exception as error:  # what is missing may be moderngl, EGL, or a driver
            print(f"{name}: no OpenGL ({error})")
    try:
        calls["memory"] = rivals.bytes_read()
    except rivals.Missing as missing:
        print(f"memory: {missing}")
    best: dict[str, float] = {}
    found: dict[str, Any] = {}
    for _ in range(args.rounds + 1):  # the first warms up
        for name, call in calls.items():
            start = time.process_time()
            found[name] = call()
            best[name] = min(best.get(name, np.inf), time.process_time() - start)
    memory = found["memory"] / best["memory"] if "memory" in best else np.nan
    print("| what | fragments | million a second | ns each | of memory's rate |")
    print("|---|---|---|---|---|")
    for name in calls:
        if name == "memory":
            continue
        count = found[name.rsplit(",", 1)[0] + ", moit"]
        each = best[name] / count
        share, by = f"{LIST_BYTES / each / memory:.0%}", ""
        if isinstance(found[name], str):
            share, by = "-", f" ({found[name]})"
        print(f"| {name}{by} | {count:,} | {1e-6 / each:.1f} | {1e9 * each:.1f} | {share} |")


if __name__ == "__main__":
    main()
