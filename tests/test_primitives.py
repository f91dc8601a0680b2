"""What gives fragments is no matter of triangles: another kind, as someone else would add it."""

import dataclasses
import os
import shutil
from pathlib import Path

import gpu
import numpy as np
import pytest

import moit
from moit import _core
from moit.geometry.drawing import Drawable
from moit.gpu.primitives import PRIMITIVES

SIZE = (24, 16)
CAMERA = moit.Camera(eye=(0, 0, 3), near=0.5, far=20)
SHADERS = Path(__file__).parents[1] / "shaders"


@dataclasses.dataclass(frozen=True, eq=False)
class Tile:
    """All pixels from `low` to `high`, (column, row), at one depth in front of CAMERA."""

    low: tuple
    high: tuple
    depth: float
    alpha: float
    color: tuple

    @property
    def points(self):
        return np.array([[0, 0, 3 - self.depth]])

    @property
    def transparent_points(self):
        return self.points if self.alpha < 1 else self.points[:0]

    @classmethod
    def emit(cls, several, frame):
        width, height = frame.size
        rows = np.arange(width * height).reshape(height, width)
        inside = [rows[t.low[1] : t.high[1], t.low[0] : t.high[0]].ravel() for t in several]
        which = np.repeat(np.arange(len(several)), [len(some) for some in inside])
        offsets, order = _core.group_by_pixel(np.concatenate(inside), width * height)
        drawn = which[order]
        of = [np.array([getattr(t, n) for t in several]) for n in ("depth", "alpha", "color")]
        return (offsets, *(array[drawn].astype(np.float32) for array in of))


RECORD = np.dtype(
    [
        (n, np.float32, (1,) if n == "alpha" else ())
        for n in ("depth", "alpha", "red", "green", "blue")
    ]
    + [(n, np.int32) for n in ("left", "top", "right", "bottom", "opaque")]
)


@dataclasses.dataclass(frozen=True)
class Tiles:
    vertex: str = "meshes/tiles.vert.glsl"
    surface: str = "meshes/tiles.glsl"
    corners: int = 6

    def records(self, several, camera, width, height, threads):
        rows = [(t.depth, (t.alpha,), *t.color, *t.low, *t.high, t.alpha == 1) for t in several]
        return np.array(rows, RECORD)


SURFACE = """
#include "arrays/bindings.glsl"
struct tile { float depth, alpha, red, green, blue; int left, top, right, bottom, opaque; };
layout(std430, binding = TRIANGLES) readonly restrict buffer Tiles { tile tiles[]; };
uniform ivec2 picture;
uniform int block_side;
uniform ivec2 blocks_there;
struct surface_point { float z; };
struct pixel_of_triangle { bool there; surface_point at; };
ivec2 asked_pixel(ivec2 pixel) { return pixel; }
pixel_of_triangle covered_by(int i, ivec2 pixel, bool asks) {
    return pixel_of_triangle(true, surface_point(tiles[i].depth));
}
float alpha_of(int i, surface_point p) { return tiles[i].alpha; }
vec3 lit_color(int i, surface_point p, ivec2 pixel, uint at) {
    return vec3(tiles[i].red, tiles[i].green, tiles[i].blue);
}
"""
VERTEX = """#version 450
#include "meshes/tiles.glsl"
flat out int triangle;
flat out int boxed;
void main() {
    int i = gl_VertexID / 6, k = gl_VertexID % 6;
    int right = int(k == 1 || k == 3 || k == 4), low = int(k == 2 || k == 4 || k == 5);
    triangle = i;
    boxed = 0;
    ivec2 at = ivec2(right == 1 ? tiles[i].right : tiles[i].left,
                     low == 1 ? tiles[i].bottom : tiles[i].top);
    gl_Position = vec4(2.0 * vec2(at) / vec2(picture) - 1.0, 0.0, 1.0);
}
"""

MESH = moit.Mesh([[-9, -9, 0], [9, -9, 0], [0, 9, 0]], [[0, 1, 2]], (0.2, 0.6, 0.3), 0.4)
SCENE = [
    Tile((2, 1), (14, 9), 4.0, 0.5, (0.9, 0.1, 0.1)),
    MESH,
    Tile((6, 3), (22, 14), 2.0, 0.25, (0.1, 0.2, 0.9)),
    Tile((0, 0), (9, 16), 3.5, 1.0, (0.3, 0.3, 0.3)),
    Tile((4, 5), (20, 12), 2.5, 0.75, (0.5, 0.9, 0.1)),
]
TECHNIQUES = ["sorted", "unsorted", "wboit", "power4", "mlab4", "fourier7"]


@pytest.fixture
def tiles_on_a_device(monkeypatch, tmp_path):
    folder = tmp_path / "shaders"
    shutil.copytree(SHADERS, folder, symlinks=False)
    (folder / "meshes/tiles.glsl").write_text(SURFACE)
    (folder / "meshes/tiles.vert.glsl").write_text(VERTEX)
    monkeypatch.setitem(os.environ, "MOIT_SHADER_DIR", str(folder))
    monkeypatch.setitem(PRIMITIVES, Tile, Tiles())
    return gpu.device()


def test_tiles_are_drawable():
    assert isinstance(SCENE[0], Drawable)
    assert isinstance(MESH, Drawable)


def test_fragments_stand_in_draw_order_whatever_gives_them():
    f = moit.rasterize(SCENE, CAMERA, SIZE)
    pixel = 6 * SIZE[0] + 8  # where all of them are
    some = slice(f.offsets[pixel], f.offsets[pixel + 1])
    np.testing.assert_allclose(f.depth[some], [4, 3, 2, 3.5, 2.5], rtol=1e-6)
    np.testing.assert_allclose(f.alpha[some], [0.5, 0.4, 0.25, 1, 0.75], rtol=1e-6)
    assert f.depth_range[0] <= 2
    assert f.depth_range[1] >= 4


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_pictures_are_those_of_the_fragments(technique):
    f = moit.rasterize(SCENE, CAMERA, SIZE)
    found = moit.render(SCENE, technique, SIZE, camera=CAMERA, background=(0.2, 0.3, 0.4))
    expected = moit.composite(f, technique, background=(0.2, 0.3, 0.4))
    np.testing.assert_array_equal(found, expected)
    tiles = [one for one in SCENE if one is not MESH]
    away = np.abs(found - moit.render(tiles, technique, SIZE, camera=CAMERA))
    assert away.max() > 0.05


def test_objects_are_sorted_whatever_they_are():
    ordered = moit.render(SCENE, "unsorted", SIZE, camera=CAMERA, order="object")
    expected = moit.render(SCENE, "sorted", SIZE, camera=CAMERA)
    np.testing.assert_allclose(ordered, expected, atol=1e-6)


def test_what_asks_for_triangles_says_so():
    for options in ({"order": "triangle"}, {"resolution": 2}):
        with pytest.raises(TypeError, match=r"scene\[0\]: expected a Mesh, got Tile"):
            moit.render(SCENE, "wboit", SIZE, camera=CAMERA, **options)


def test_a_device_without_passes_for_a_kind_composites_what_the_cpu_draws():
    device = gpu.device()
    with pytest.raises(moit.GpuError, match="scene: Tile has no passes"):
        moit.rasterize(SCENE, CAMERA, SIZE, device=device)
    made = moit.render(SCENE, "power4", SIZE, camera=CAMERA, device=device, exact=True, report=True)
    assert (made.device, made.way, made.reason) == ("gpu", "arrays", "Tile has no passes")
    expected = moit.render(SCENE, "power4", SIZE, camera=CAMERA)
    np.testing.assert_allclose(made.image, expected, atol=0 if device.software else 1e-5)


@pytest.mark.parametrize("technique", TECHNIQUES)
def test_a_device_draws_what_it_has_passes_for(tiles_on_a_device, technique):
    options = {"camera": CAMERA, "target": "rgba32f", "report": True}
    made = moit.render(SCENE, technique, SIZE, device=tiles_on_a_device, exact=True, **options)
    assert made.device == "gpu"
    technique = moit.technique(technique)
    if made.way == "add" and hasattr(technique, "bias"):
        bias = _core.bias(technique.fields_for_core(np.dtype(np.float32)), "published")
        technique = dataclasses.replace(technique, bias=bias)
    expected = moit.render(SCENE, technique, SIZE, camera=CAMERA)
    # Fourier coefficients are held in half floats
    atol = 1e-3 if technique.kind == "fourier" else 2e-5
    np.testing.assert_allclose(made.image, expected, atol=atol)
