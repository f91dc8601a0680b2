"""Calls into the core give back what they took, also those that fail.

Three instruments: tracemalloc sees what Python and NumPy hold, so it finds lost results; resident
memory sees what malloc holds, so it finds lost scratch of the core; reference counts of the
arguments tell whether something holds on to them.
"""

import gc
import itertools
import os
import sys
import tracemalloc
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small import some_fragments
from variants import EVERY

import moit
from moit import _core

PAGE = os.sysconf("SC_PAGE_SIZE")
F = some_fragments(height=12, width=13, most=6)
DOUBLE = some_fragments(height=12, width=13, most=6, dtype=np.float64)
WITHOUT_COLOR = some_fragments(height=12, width=13, color=False)
COLOURED = moit.Fragments(F.offsets, F.depth, F.alpha, F.color, transmission=F.color, shape=F.shape)
POWER = moit.PowerMoments(4, bias=1e-6, max_alpha=0.99).fields_for(F)
WORDS = moit.technique("power4-16").fields_for(F)
NODES = moit.technique("moment-transparency-nlqm").fields_for(F)
NEURAL = moit.technique("neural-bounded").fields_for(F)
SLICES = moit.technique("slices16").fields_for(F)
MERGING = moit.technique("mlab4").fields_for(F)
SORTED = moit.Sorted().fields_for(F)
BLENDED = moit.WeightedBlended("eq7").fields_for(F)
BYTES = moit.WeightedBlended("eq8", bits=16).fields_for(F)
WITHOUT_WEIGHTS = {**BLENDED, "weight": 6}
GIVEN = {**WITHOUT_WEIGHTS, "weights": np.ones(len(F), np.float32)}
BACKGROUND = np.zeros(3)
CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 3]], np.float32)
SPLATS = (
    CORNERS[:, :3], abs(CORNERS), np.ones((3, 4), np.float32) / 2, np.ones(3, np.float32) / 2,
    np.zeros((3, 4, 3), np.float32),
)  # fmt: skip
MESH = (CORNERS, CORNERS, abs(CORNERS), np.ones(3, np.float32) / 2, np.int32([[0, 1, 2]]))
CAMERA = ((0, 0, 2), (1, 0, 0), (0, 1, 0), (0, 0, -1), (2, 2), 0.1, 9)
RASTER = _core.begin_splats(SPLATS, 0, CAMERA, 40, 30, 1)[0]
DRAWN = _core.draw_splats(RASTER, 0, 30, False, 1)
ON_SCREEN = _core.pull_splat_fragments(RASTER, 0, 30, *DRAWN[1:], None, 1)
ALONG = _core.begin_splats(SPLATS, 1, CAMERA, 40, 30, 1)[0]
STROKES = (
    np.array([0, 2, 3]), CORNERS.astype(np.float64), np.ones(3, np.float32) / 9, abs(CORNERS),
    np.ones(3, np.float32) / 2,
)  # fmt: skip
TUBES = (True, False, True, 64)
STROKED = _core.begin_strokes(STROKES, TUBES, CAMERA, 40, 30, 1)[0]
GRID = (np.ones((2, 3, 2, 1), np.float32), (0, 0, 0), (1, 1, 1), np.ones((2, 4), np.float32), 0, 1)
DEPTH = np.linspace(1.0, 9.0, 5)
B0, B = _core.gather(F, POWER, True, 1, False)
Z = np.zeros((len(B0), 3), np.float32)
ROWS = np.vstack([B0.reshape(1, -1), B.reshape(len(B0), -1).T])
IMAGE = np.random.default_rng(0).random((12, 13, 3)).astype(np.float32)
PIXEL = np.array([1, 0, 1], np.int64)
SUMS = _core.texel_sums(F, POWER, 1)
TARGETS = (1, _core.target_sums(F, GIVEN, 1), np.ones((12, 13), np.float32))
SMALL = (2, np.zeros((6, 7, 5)), np.ones((6, 7), np.float32))
PLACES = np.array([[1.0, 2.0, 3.0], [-1.0, 2.0, 3.0]])
LAYERS = np.array([None, np.ones(2, np.float32), np.ones(1, np.float32)], dtype=object)
COUNTS = np.array([0, 0, 2, 3], np.int64)
FRONT, BACK = np.array([0, 1, 5], np.float32), np.array([2, 3, 5], np.float32)
HALF = np.full(3, 0.5, np.float32)
HELD = (COUNTS, FRONT, BACK, HALF[None], np.array([True, False, True]))
SAMPLES = (
    *(COUNTS, FRONT, BACK, HALF[None], HALF[None], np.zeros(1, np.intc), np.zeros(1, np.bool_)),
    *(None, False, False, False, True, 0.01, 0.0),
)
SPREAD = np.full((3, 3), 0.5, np.float32)
VOLUMES = moit.Fragments(
    COUNTS, FRONT, HALF, SPREAD, back=BACK, emission=SPREAD, transmission=SPREAD
)
GAUSSIANS = moit.Fragments(COUNTS, FRONT, HALF, SPREAD, deviation=HALF, transmission=SPREAD)
# Offsets that end elsewhere than the arrays do, and a shape of other pixels.
BROKEN = SimpleNamespace(
    offsets=np.array([0, 5], np.int64),
    depth=F.depth,
    alpha=F.alpha,
    color=F.color,
    transmission=None,
    back=None,
    emission=None,
    deviation=None,
    depth_range=F.depth_range,
    shape=(1, 1),
)
RANGELESS = SimpleNamespace(**{**vars(BROKEN), "depth_range": 3})
CHECKED = (F.offsets, F.depth, F.alpha, F.color, None, None, None, None)

# Every function of the core, with arguments that are right and arguments that are wrong.
RIGHT = {
    "build_info": [()],
    "use_instruction_set": [(_core.build_info()["instruction set in use"],)],
    "numbers": [()],
    "technique_facts": [()],
    "check_fragments": [(*CHECKED, 1.0, 10.0, 2), (*CHECKED, 5.0, 6.0, 1)],
    "frozen": [(F.offsets,), (np.arange(3),), (np.arange(6)[::2],)],
    "depth_order": [(F.offsets, F.depth, 2), (DOUBLE.offsets, DOUBLE.depth, 1)],
    "group_by_pixel": [(PIXEL, 2), (PIXEL, 1)],
    "join_pixels": [(LAYERS,), (np.array([None, None], dtype=object),)],
    "split_pixels": [(np.arange(3, dtype=np.float32), COUNTS)],
    "hold_out": [(*HELD, 1), (*HELD[:2], None, *HELD[3:], 2)],
    "simplify": [(*SAMPLES, 1), (*SAMPLES[:2], None, *SAMPLES[3:], 2)],
    "begin_splats": [(SPLATS, 0, CAMERA, 40, 30, 1), (SPLATS, 1, CAMERA, 40, 30, 2)],
    "screen_splats": [(SPLATS, 0, CAMERA, 40, 30, 1), (SPLATS, 2, CAMERA, 40, 30, 2)],
    "draw_splats": [(RASTER, 0, 30, False, 1), (ALONG, 7, 19, True, 2)],
    "pull_splat_fragments": [
        (RASTER, 0, 30, *DRAWN[1:], None, 1),
        (RASTER, 0, 30, *DRAWN[1:], ON_SCREEN, 2),
    ],
    "pull_splat_projection": [(RASTER, SPLATS, ON_SCREEN, 1)],
    "thin": [
        (VOLUMES, True, 3, 0.0, 0, False, 0, 0.0, 1),
        (GAUSSIANS, False, 0, 9.0, 1, True, 0, 0.0, 2),
        (GAUSSIANS, True, 3, 0.0, 0, False, 64, 0.01, 2),
        (F, True, 3, 0.0, 0, False, 0, 0.0, 1),
    ],
    "begin_strokes": [
        (STROKES, TUBES, CAMERA, 40, 30, 1),
        (STROKES, (False, True, True, 1), CAMERA, 40, 30, 2, np.ones((1, 6))),
    ],
    "screen_strokes": [
        (STROKES, TUBES, CAMERA, 40, 30),
        (STROKES, (False, True, True, 1), CAMERA, 40, 30),
    ],
    "draw_strokes": [(STROKED, 0, 30, 1), (STROKED, 7, 19, 2, None)],
    "march_grid": [(*GRID, CAMERA, 0.5, 40, 30, 0, 30, 1), (*GRID, CAMERA, 9.0, 40, 30, 7, 19, 2)],
    "rasterize": [
        (MESH, CAMERA, 40, 30, 1),
        ((*MESH[:1], None, *MESH[2:]), CAMERA, 40, 30, 2),
        (MESH, CAMERA, 8, 8, 1, np.ones((2, 6))),
        (MESH, CAMERA, 8, 8, 1, np.ones((2, 6)), None, True),
        (MESH, CAMERA, 1, 1, 1, np.ones((2, 6)), np.ones((1, 2))),
    ],
    "screen_triangles": [(MESH, CAMERA, 40, 30, 1)],
    "texture_levels": [(np.ones((5, 3, 4), np.float32),)],
    "split_volumes": [
        (VOLUMES, False, np.zeros(0), 1),
        (VOLUMES, True, np.zeros(0), 2),
        (VOLUMES, False, np.array([1.5, 1.75]), 2),
        (F, False, np.zeros(0), 1),
        (GAUSSIANS, True, np.array([1.5]), 2),
    ],
    "image_error": [
        (name, IMAGE, IMAGE[::-1], wants_map, 2)
        for name in ("mse", "psnr", "ssim", "flip", "hdr_flip")
        for wants_map in (False, True)
    ],
    "reference_of": [(IMAGE, kept) for kept in (0, 1 << 24)],
    "image_errors": [
        (names, IMAGE, _core.reference_of(IMAGE[::-1], 1 << 24), 2)
        for names in ((), ("mse", "hdr_flip"), ("ssim", "flip"))
    ],
    "composite": [
        (F, SORTED, True, 2, BACKGROUND),
        (COLOURED, SORTED, True, 2, BACKGROUND),
        (COLOURED, POWER, True, 2, BACKGROUND),
        (F, GIVEN, True, 1, np.zeros((12, 13, 3))),
        (DOUBLE, POWER, False, 1, BACKGROUND),
    ],
    "composite_pullback": [
        (F, POWER, True, 2, BACKGROUND, np.ones((12, 13, 4), np.float32)),
        (COLOURED, SORTED, False, 1, BACKGROUND, np.ones((12, 13, 4), np.float32)),
    ],
    "transmittance_pullback": [(F, POWER, True, 2, np.ones(len(F), np.float32))],
    "curve_pullback": [
        (F, technique, True, 1, DEPTH, np.ones((12, 13, len(DEPTH)), np.float32))
        for technique in (SORTED, POWER, SLICES)
    ],
    "total_transmittance_pullback": [(F, SORTED, True, 1, np.ones((12, 13), np.float32))],
    "gradient_refusal": [(POWER,), (MERGING,)],
    "total_transmittance": [(COLOURED, POWER, True, 2), (F, POWER, True, 2), (F, SORTED, True, 1)],
    "transmittance": [(F, POWER, True, 1, None), (F, POWER, True, 1, DEPTH)],
    "network_features": [(F, NEURAL, True, 1), (DOUBLE, NEURAL, False, 2)],
    "bounds": [(F, POWER, True, 1, None), (F, SORTED, True, 2, DEPTH)],
    "gather": [(F, POWER, True, 1, False), (F, WORDS, True, 1, True)],
    "moment_words": [(NODES, 1, B), (NODES, 2, B.astype(np.float64))],
    "moments_absorbance": [(POWER, 1, B0, B, Z)],
    "numbers_within": [(1, ((B0, 0.0, 1.0), (B, -1.0, 1.0))), (2, ((Z, 5.0, 6.0),)), (1, ())],
    "moments_pullback": [(POWER, 1, B0, B, Z, False, Z), (POWER, 2, B0, B, Z, True, Z)],
    "moments_bounds_pullback": [(POWER, 1, B0, B, Z, None, Z, Z), (POWER, 1, B0, B, Z, Z, Z, Z)],
    "bound_of_rows": [(POWER, 1, ROWS, Z[:, 0], False, 1.0), (POWER, 2, ROWS, Z[:, 0], True, 0.1)],
    "moments_gradient_refusal": [(POWER,), (SORTED,)],
    "moments_transmittance": [(POWER, 1, B0, B, Z), (POWER, 1, B0.tolist(), B, Z)],
    "moments_pivots": [(POWER, 1, B0, B, False), (POWER, 1, B0, B, True)],
    "moments_bounds": [(POWER, 1, B0, B, Z, None), (POWER, 1, B0, B, Z, Z)],
    "bias": [(POWER, "float32"), (POWER, "published")],
    "pass_constants": [(POWER, True, 1.0, 2.0), (SORTED, False, 1.0, 2.0)],
    "warped": [(F, POWER, 2, None), (F, POWER, 1, DEPTH)],
    "surviving": [(F, True, 2), (COLOURED, True, 1)],
    "pixel_facts": [(F, True, 2), (COLOURED, False, 1)],
    "slice_tables": [(F, SLICES, True, 2), (COLOURED, SLICES, False, 1)],
    "take_pixels": [(F, PIXEL, 2), (COLOURED, PIXEL, 1), (WITHOUT_COLOR, PIXEL[:0], 1)],
    "color_bounds": [
        (F, True, 2, BACKGROUND[None], F.alpha, F.alpha),
        (COLOURED, True, 1, np.zeros((156, 3)), COLOURED.color, COLOURED.color),
    ],
    "target_sums": [(F, GIVEN, 2), (DOUBLE, BYTES, 1)],
    "join_targets": [
        (GIVEN, [TARGETS], False, np.zeros((12, 13, 3)), 2),
        (GIVEN, [TARGETS, SMALL, SMALL], True, np.zeros((12, 13, 3)), 1),
    ],
    "texel_sums": [(F, POWER, 2), (DOUBLE, POWER, 1)],
    "filter_texels": [(SUMS, np.ones(3), 2), (SUMS.astype(np.float64), np.ones(1), 1)],
    "hold_texels": [(SUMS[..., 1:], 1)],
    "shadow_at": [
        (SUMS, POWER, 1.0, 9.0, False, 2, PLACES, None),
        (SUMS, POWER, 1.0, 9.0, False, 1, PLACES, PLACES[:, 0]),
        (SUMS[..., 1:], POWER, 1.0, 9.0, True, 1, PLACES[:0], None),
    ],
}
WRONG_FRAGMENTS = [(BROKEN,), (RANGELESS,), (object(),)]
WRONG_TECHNIQUES = [
    (F, 3),
    (F, {"kind": 99}),
    (F, {}),
    (F, {"kind": "power"}),
    (F, {**POWER, "count": 5}),
    (F, {**POWER, "bias": "x"}),
    (F, {**POWER, "bais": 0.0}),
    (F, {**POWER, 3: 0.0}),
    (F, {name: value for name, value in POWER.items() if name != "max_alpha"}),
    (F, WITHOUT_WEIGHTS),
    (F, {**NEURAL, "network": HALF}),
    (F, {**NEURAL, "network": "x"}),
    (F, {name: value for name, value in NEURAL.items() if name != "network"}),
    (F, {**GIVEN, "weights": HALF}),
    (WITHOUT_COLOR, {**BLENDED, "weight": 0}),
]


def wrong_questions(*rest):
    """Arguments of a question whose fragments or technique are no such thing."""
    return [
        *((f, SORTED, *rest) for (f,) in WRONG_FRAGMENTS),
        *((f, technique, *rest) for f, technique in WRONG_TECHNIQUES),
    ]


# Wrong for what begins to draw splats, on either device.
WRONG_SPLATS = [
    (SPLATS[:4], 0, CAMERA, 40, 30, 1),
    ((*SPLATS[:4], SPLATS[4][:, :3]), 0, CAMERA, 40, 30, 1),
    ((SPLATS[0][:2], *SPLATS[1:]), 0, CAMERA, 40, 30, 1),
    ((SPLATS[0], SPLATS[1], SPLATS[2][:, :3], *SPLATS[3:]), 1, CAMERA, 40, 30, 1),
    (SPLATS, 0, CAMERA[:6], 40, 30, 1),
    (SPLATS, 0, [*CAMERA], 40, 30, 1),
    (SPLATS, 0, CAMERA, 0, 30, 1),
    (SPLATS, 3, CAMERA, 40, 30, 1),
    (SPLATS, "exact", CAMERA, 40, 30, 1),
]
WRONG = {
    "pixel_facts": [(f, True, 1) for (f,) in WRONG_FRAGMENTS],
    "slice_tables": [
        *((f, SLICES, True, 1) for (f,) in WRONG_FRAGMENTS),
        (F, {**SLICES, "count": 1 << 20}, True, 1),
        (F, {"kind": 99}, True, 1),
    ],
    "take_pixels": [
        *((f, PIXEL, 1) for (f,) in WRONG_FRAGMENTS),
        (F, PIXEL - 1, 1),
        (F, PIXEL + 155, 1),
        (F, "x", 1),
    ],
    "color_bounds": [
        *((f, True, 1, BACKGROUND[None], F.alpha, F.alpha) for (f,) in WRONG_FRAGMENTS),
        (WITHOUT_COLOR, True, 1, BACKGROUND[None], WITHOUT_COLOR.alpha, WITHOUT_COLOR.alpha),
        (F, True, 1, BACKGROUND, F.alpha, F.alpha),
        (F, True, 1, np.zeros((2, 3)), F.alpha, F.alpha),
        (F, True, 1, BACKGROUND[None], F.alpha[1:], F.alpha),
        (F, True, 1, BACKGROUND[None], F.alpha, F.color),
    ],
    "check_fragments": [(), (F.offsets, F.depth, HALF, None, None, None, None, 0.0, 1.0, 1)],
    "frozen": [(), ("x",), (np.zeros((2, 2), np.int64),), (HALF,)],
    "depth_order": [(F.offsets, HALF, 1), (F.offsets, object(), 1), (COUNTS, F.depth, 1)],
    "group_by_pixel": [
        (PIXEL, -1),
        (PIXEL, sys.maxsize),
        (np.zeros((2, 2), np.int64), 2),
        ("x", 2),
    ],
    "join_pixels": [
        (np.array([HALF, "x"], dtype=object),),
        (np.array([HALF, PIXEL], dtype=object),),
    ],
    "split_pixels": [(HALF, COUNTS + 1), (HALF, "x"), (SPREAD, COUNTS)],
    "begin_splats": WRONG_SPLATS,
    "screen_splats": WRONG_SPLATS,
    "begin_strokes": [
        (STROKES[:4], TUBES, CAMERA, 40, 30, 1),
        ((STROKES[0][:2], *STROKES[1:]), TUBES, CAMERA, 40, 30, 1),
        ((STROKES[0][::-1].copy(), *STROKES[1:]), TUBES, CAMERA, 40, 30, 1),
        ((*STROKES[:3], STROKES[3][:, :2], STROKES[4]), TUBES, CAMERA, 40, 30, 1),
        (STROKES, TUBES[:3], CAMERA, 40, 30, 1),
        (STROKES, (True, False, True, 5), CAMERA, 40, 30, 1),
        (STROKES, TUBES, CAMERA[:6], 40, 30, 1),
        (STROKES, TUBES, CAMERA, 40, 0, 1),
    ],
    "screen_strokes": [
        (STROKES[:4], TUBES, CAMERA, 40, 30),
        ((*STROKES[:3], STROKES[3][:, :2], STROKES[4]), TUBES, CAMERA, 40, 30),
        (STROKES, (True, False, True, 5), CAMERA, 40, 30),
        (STROKES, TUBES, CAMERA[:6], 40, 30),
        (STROKES, TUBES, CAMERA, 40, 0),
    ],
    "draw_strokes": [
        (STROKED, 0, 31, 1),
        (STROKED, 3, 3, 1),
        (RASTER, 0, 3, 1),
        (STROKED, 0, 3, 1, np.ones((1, 1))),
    ],
    "march_grid": [
        (*GRID[:3], np.ones((2, 3), np.float32), 0, 1, CAMERA, 0.5, 40, 30, 0, 30, 1),
        (GRID[0][..., 0], *GRID[1:], CAMERA, 0.5, 40, 30, 0, 30, 1),
        (*GRID, CAMERA, 0.0, 40, 30, 0, 30, 1),
        (*GRID, CAMERA, 0.5, 0, 30, 0, 30, 1),
        (*GRID, CAMERA[:4], 0.5, 40, 30, 0, 30, 1),
        (*GRID, CAMERA, 0.5, 40, 30, 3, 31, 1),
    ],
    "draw_splats": [
        (RASTER, 0, 31, False, 1),
        (RASTER, -1, 3, False, 1),
        (RASTER, 3, 3, False, 1),
        (RASTER, 0, 3, True, 1),
        (None, 0, 3, False, 1),
        (SPLATS, 0, 3, False, 1),
    ],
    "pull_splat_fragments": [
        (RASTER, 0, 31, *DRAWN[1:], None, 1),
        (RASTER, 0, 15, *DRAWN[1:], None, 1),
        (SPLATS, 0, 30, *DRAWN[1:], None, 1),
        (RASTER, 0, 30, *DRAWN[1:3], DRAWN[3][:, :2], None, 1),
        (RASTER, 0, 30, *DRAWN[1:], ON_SCREEN[:2], 1),
        (RASTER, 0, 30, *DRAWN[1:], ON_SCREEN.astype("f"), 1),
        (RASTER, 0, 30, "x", *DRAWN[2:], None, 1),
    ],
    "pull_splat_projection": [
        (RASTER, tuple(one[:2] for one in SPLATS), ON_SCREEN, 1),
        (RASTER, SPLATS[:4], ON_SCREEN, 1),
        (RASTER, SPLATS, ON_SCREEN[:, :2], 1),
        (None, SPLATS, ON_SCREEN, 1),
    ],
    "rasterize": [
        (MESH[:4], CAMERA, 4, 4, 1),
        (MESH, CAMERA, 8, 8, 1, np.ones((2, 6)), np.ones((1, 2)), True),
        (3, CAMERA, 4, 4, 1),
        (MESH, CAMERA[:3], 4, 4, 1),
        (MESH, CAMERA, 0, 4, 1),
        ((*MESH[:4], MESH[4] + 9), CAMERA, 4, 4, 1),
        ((*MESH[:3], np.ones(2, np.float32), MESH[4]), CAMERA, 4, 4, 1),
        ((*MESH[:4], "x"), CAMERA, 4, 4, 1),
        (MESH, CAMERA, 4, 4, 1, np.ones((9, 6))),
        (MESH, CAMERA, 4, 4, 1, "x"),
        (MESH, CAMERA, 4, 4, 1, np.ones((2, 6)), np.ones((1, 3))),
        (MESH, CAMERA, 4, 4, 1, np.ones((2, 6)), "x"),
    ],
    "texture_levels": [
        (HALF,),
        (np.ones((5, 3, 3), np.float32),),
        (np.ones((0, 3, 4), np.float32),),
        (np.ones((5, 3, 4)),),
        ("x",),
    ],
    "screen_triangles": [(3, CAMERA, 4, 4, 1), (MESH, CAMERA, 0, 4, 1), (MESH,)],
    "composite_pullback": [
        *wrong_questions(True, 1, BACKGROUND, IMAGE),
        (F, POWER, True, 1, BACKGROUND, np.ones(3, np.float32)),
        (F, MERGING, True, 1, BACKGROUND, np.ones((12, 13, 4), np.float32)),
    ],
    "transmittance_pullback": [
        (F, POWER, True, 1, "x"),
        (F, POWER, True, 1, np.ones(3, np.float32)),
        (F, MERGING, True, 1, np.ones(len(F), np.float32)),
    ],
    "curve_pullback": [
        (F, POWER, True, 1, "x", np.ones((12, 13, 2), np.float32)),
        (F, POWER, True, 1, DEPTH, np.ones(3, np.float32)),
        (F, POWER, True, 1, np.zeros(0), np.ones((12, 13, 0), np.float32)),
    ],
    "total_transmittance_pullback": [
        *wrong_questions(True, 1, np.ones((12, 13), np.float32)),
        (F, POWER, True, 1, np.ones(3, np.float32)),
    ],
    "gradient_refusal": [({"kind": 99},), ("x",)],
    "hold_out": [
        *((*HELD[:i], wrong, *HELD[i + 1 :], 1) for i in range(5) for wrong in ("x", np.zeros(1))),
        (np.array([0, 5], np.int64), *HELD[1:], 1),
    ],
    "simplify": [
        *((*SAMPLES[:i], wrong, *SAMPLES[i + 1 :], 1) for i in range(7) for wrong in ("x", Z)),
        (np.array([0, 5], np.int64), *SAMPLES[1:], 1),
        (*SAMPLES[:-1], "x", 1),
    ],
    "split_volumes": [
        *((f, False, np.zeros(0), 1) for (f,) in WRONG_FRAGMENTS),
        (VOLUMES, False, "x", 1),
        (VOLUMES, True, np.zeros((2, 2)), 1),
    ],
    "thin": [
        *((f, True, 3, 0.0, 0, False, 0, 0.0, 1) for (f,) in WRONG_FRAGMENTS),
        (VOLUMES, True, 49, 0.0, 0, False, 0, 0.0, 1),
        (VOLUMES, True, 3, 0.0, 3, False, 0, 0.0, 1),
        (VOLUMES, True, 3, 0.0, 0, False, -1, 0.0, 1),
        (VOLUMES, True, 3, 0.0, 0, False, 64, 0.0, 1),
    ],
    "image_error": [
        ("nothing", IMAGE, IMAGE, False, 1),
        ("mse", IMAGE, IMAGE[:-1], False, 1),
        ("mse", IMAGE, "x", True, 1),
        ("mse", IMAGE[:3], IMAGE[:3], True, 1),
    ],
    "reference_of": [("x", 0), (IMAGE[:3], 1 << 24), (IMAGE[0], 0)],
    "image_errors": [
        (("nothing",), IMAGE, _core.reference_of(IMAGE, 0), 1),
        ((1,), IMAGE, _core.reference_of(IMAGE, 0), 1),
        (("mse",), IMAGE, "x", 1),
        (("mse",), "x", _core.reference_of(IMAGE, 0), 1),
        (("mse",), IMAGE[:-1], _core.reference_of(IMAGE, 0), 1),
    ],
    "composite": [
        *wrong_questions(True, 1, BACKGROUND),
        (F, SORTED, True, 1, np.zeros(4)),
        (F, SORTED, True, 1, "x"),
        (WITHOUT_COLOR, SORTED, True, 1, BACKGROUND),
    ],
    "total_transmittance": wrong_questions(True, 1),
    "network_features": [*wrong_questions(True, 1), (F, SORTED, True, 1)],
    "transmittance": [*wrong_questions(True, 1, None), (F, SORTED, True, 1, Z)],
    "bounds": [*wrong_questions(True, 1, None), (F, SORTED, True, 1, Z)],
    "gather": wrong_questions(True, 1, False),
    "moment_words": [(NODES, 1, B[:, :3]), (POWER, 1, B), (NODES, 1, B0), (NODES, 1, None)],
    "moments_absorbance": [(POWER, 1, B0[1:], B, Z), (POWER, 1, B0, "x", Z)],
    "numbers_within": [(1, ((B0, 0.0, 1.0),) * 5), (1, ((B0, 0.0),)), (1, (None,)), (1, [B0])],
    "moments_pullback": [
        (SORTED, 1, B0, B, Z, False, Z),
        (POWER, 1, B0, B, Z, False, Z[1:]),
        (POWER, 1, B0, B, None, False, Z),
        (POWER, 1, B0, "x", Z, False, Z),
    ],
    "moments_bounds_pullback": [
        (WORDS, 1, B0, B, Z, None, Z, Z),
        (POWER, 1, B0, B, Z, Z[1:], Z, Z),
        (POWER, 1, B0, B, Z, None, Z, "x"),
    ],
    "bound_of_rows": [
        (SORTED, 1, ROWS, Z[:, 0], True, 1.0),
        (POWER, 1, ROWS[1:], Z[:, 0], True, 1.0),
        (POWER, 1, ROWS, Z[1:, 0], True, 1.0),
        (POWER, 1, ROWS, "x", False, 1.0),
        (POWER, 1, ROWS, Z[:, 0], False, "x"),
    ],
    "moments_gradient_refusal": [({"kind": 99},), ("x",)],
    "moments_transmittance": [
        ({"kind": 99}, 1, B0, B, Z),
        (POWER, 1, B0[1:], B, Z),
        (POWER, 1, B0, B, Z[0]),
        (POWER, 1, B0, "x", Z),
    ],
    "moments_pivots": [
        ({"kind": 99}, 1, B0, B, True),
        (SORTED, 1, B0, B, True),
        (POWER, 1, B0[1:], B, False),
        (POWER, 1, B0, B[:, 1:], False),
        (POWER, 1, B0, "x", False),
    ],
    "moments_bounds": [
        ({"kind": 99}, 1, B0, B, Z, None),
        (POWER, 1, B0, B, Z, Z[1:]),
        (POWER, 1, B0, B, Z, "x"),
    ],
    "pass_constants": [("x", True, 1.0, 2.0), ({"kind": 99}, True, 1.0, 2.0)],
    "warped": [
        (F, SORTED, 1, None),
        (F, POWER, 1, "x"),
        *[(*f, POWER, 1, None) for f in WRONG_FRAGMENTS],
    ],
    "surviving": [(*f, True, 1) for f in WRONG_FRAGMENTS],
    "target_sums": [
        *wrong_questions(1),
        (F, SORTED, 1),
        (WITHOUT_COLOR, GIVEN, 1),
        (COLOURED, GIVEN, 1),
    ],
    "join_targets": [
        ({"kind": 99}, [TARGETS], False, np.zeros((12, 13, 3)), 1),
        (SORTED, [TARGETS], False, np.zeros((12, 13, 3)), 1),
        (GIVEN, [], False, np.zeros((12, 13, 3)), 1),
        (GIVEN, (TARGETS,), False, np.zeros((12, 13, 3)), 1),
        (GIVEN, [TARGETS, 3], False, np.zeros((12, 13, 3)), 1),
        (GIVEN, [TARGETS, (1, "x", SMALL[2])], False, np.zeros((12, 13, 3)), 1),
        (GIVEN, [TARGETS, (4, *SMALL[1:])], False, np.zeros((12, 13, 3)), 1),
        (GIVEN, [SMALL], False, np.zeros((6, 7, 3)), 1),
        (GIVEN, [TARGETS], False, "x", 1),
        (GIVEN, [TARGETS], False, np.zeros((12, 12, 3)), 1),
    ],
    "texel_sums": [*wrong_questions(1), (F, SORTED, 1)],
    "filter_texels": [(SUMS, np.ones(2), 1), (SUMS, "x", 1), (B, np.ones(3), 1)],
    "hold_texels": [(SUMS, 1), ("x", 1)],
    "shadow_at": [
        (SUMS, SORTED, 1.0, 9.0, False, 1, PLACES, None),
        (SUMS, POWER, 1.0, 9.0, True, 1, PLACES, None),
        (SUMS, POWER, 1.0, 9.0, False, 1, PLACES[:, :2], None),
        (SUMS, POWER, 1.0, 9.0, False, 1, PLACES, np.ones(3)),
        (SUMS[:0], POWER, 1.0, 9.0, False, 1, PLACES, None),
        ("x", POWER, 1.0, 9.0, False, 1, PLACES, None),
        (SUMS, {"kind": 99}, 1.0, 9.0, False, 1, PLACES, None),
    ],
    "use_instruction_set": [("sse9",), (3,)],
    "bias": [(SORTED, "float32"), ("x", "float32"), ({**POWER, "count": 5}, "float32")],
}


def resident() -> int:
    """Bytes of memory this process occupies."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


# Python's cache of attributes keeps a string for each of its 4096 places, filled by chance: a new
# name that C asks for takes another place each time, which looks like a leak for a long while.
forget_names = getattr(sys, "_clear_internal_caches", getattr(sys, "_clear_type_cache", None))


def growth(call, times: int) -> tuple[int, int]:
    """Bytes by which Python and the process grow in `times` calls: the least of three rounds."""
    gc.freeze()  # else each collection looks at all that pytest holds
    tracemalloc.start()
    try:
        held = []
        for _ in range(4):
            for _ in range(times):
                call()
            gc.collect()
            forget_names()
            held.append((tracemalloc.get_traced_memory()[0], resident()))
    finally:
        tracemalloc.stop()
    python, process = np.diff(held, axis=0).min(axis=0)
    return int(python), int(process)


def expect_no_growth(call, times: int = 150) -> None:
    # A leak grows in every round; what Python resizes and specialises settles after some.
    for _ in range(10):
        python, process = growth(call, times)
        # A lost object is at least 16 bytes a call, a lost array over 100; without a leak the least
        # round is about 120 bytes. Lost scratch of the core is at least a kilobyte a call; a warm
        # allocator stays within pages.
        if python < 8 * times + 240 and process < 512 * times:
            return
    pytest.fail(f"{times} calls keep {python} bytes of Python's and {process} of the process")


needs_proc = pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="no /proc to read memory from"
)


def test_every_function_of_the_core_is_listed():
    functions = {name for name in dir(_core) if callable(getattr(_core, name)) and name[0] != "_"}
    assert functions == set(RIGHT)
    assert set(WRONG) == functions - {"build_info", "numbers", "technique_facts"}


def references(calls: list[tuple]) -> list[int]:
    """How often each argument of the calls, and each member of one that has members, is held."""
    found = []
    for argument in itertools.chain.from_iterable(calls):
        members = argument.values() if isinstance(argument, dict) else ()
        for held in (argument, *members, *getattr(argument, "__dict__", {}).values()):
            if isinstance(held, np.ndarray | dict):
                found.append(sys.getrefcount(held))
    return found


@needs_proc
@pytest.mark.parametrize("name", RIGHT)
def test_calls_keep_no_memory(name):
    function = getattr(_core, name)

    def call():
        for arguments in RIGHT[name]:
            function(*arguments)

    held = references(RIGHT[name])
    expect_no_growth(call)
    assert references(RIGHT[name]) == held


@needs_proc
@pytest.mark.parametrize("name", WRONG)
def test_calls_that_fail_keep_no_memory(name):
    function = getattr(_core, name)

    def call():
        for arguments in WRONG[name]:
            try:  # pytest.raises would hold memory of its own
                function(*arguments)
            except (TypeError, ValueError, AttributeError):
                continue
            pytest.fail(f"{name} takes {arguments}")

    held = references(WRONG[name])
    expect_no_growth(call)
    assert references(WRONG[name]) == held


@needs_proc
def test_questions_of_the_surface_keep_no_memory():
    def call():
        for technique in EVERY:
            moit.composite(F, technique)
            moit.bounds(F, technique)

    expect_no_growth(call, times=8)


def test_results_do_not_keep_their_fragments_alive():
    f = some_fragments(height=12, width=13)
    depth = f.depth
    holders = sys.getrefcount(depth)
    results = [
        moit.composite(f, "power4"),
        moit.bounds(f, "power4"),
        moit.moments.gather(f, "power4"),
    ]
    assert sys.getrefcount(depth) == holders
    assert len(results) == 3
