"""The C core: what the binding defines. The surface checks; these guard memory."""

from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from moit.fragments import Fragments

def check_fragments(
    offsets: NDArray[np.int64],
    depth: NDArray[Any],
    alpha: NDArray[Any],
    color: NDArray[Any] | None,
    transmission: NDArray[Any] | None,
    back: NDArray[Any] | None,
    emission: NDArray[Any] | None,
    deviation: NDArray[Any] | None,
    near: float,
    far: float,
    threads: int,
    /,
) -> tuple[NDArray[np.int64], tuple[str, int] | None, tuple[float, float, bool] | None]: ...
def frozen(offsets: NDArray[np.int64], /) -> NDArray[np.int64]: ...
def depth_order(
    offsets: NDArray[np.int64], key: NDArray[Any], threads: int, /
) -> NDArray[np.int64]: ...
def group_by_pixel(
    pixel: NDArray[np.int64], pixels: int, /
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | int: ...
def build_info() -> dict[str, str]: ...
def use_instruction_set(name: str, /) -> str: ...

# deep
def join_pixels(pixels: NDArray[Any], /) -> tuple[NDArray[np.int64], NDArray[Any]]: ...
def split_pixels(samples: NDArray[Any], offsets: NDArray[np.int64], /) -> NDArray[Any]: ...
def hold_out(
    offsets: NDArray[np.int64],
    front: NDArray[np.float32],
    back: NDArray[np.float32] | None,
    alpha: NDArray[np.float32],
    holds: NDArray[np.bool_],
    threads: int,
    /,
) -> tuple[
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float64],
    NDArray[np.float64],
]: ...
def simplify(
    offsets: NDArray[np.int64],
    front: NDArray[np.float32],
    back: NDArray[np.float32] | None,
    alpha: NDArray[np.float32],
    light: NDArray[np.float32],
    dimmed_by: NDArray[np.intc],
    light_is_half: NDArray[np.bool_],
    identity: NDArray[np.int64] | None,
    alpha_is_half: bool,
    depth_is_half: bool,
    volumes: bool,
    shortest: bool,
    error: float,
    depth_error: float,
    threads: int,
    /,
) -> tuple[
    NDArray[np.int64],
    NDArray[np.int64],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float64],
]: ...
def split_volumes(
    fragments: Fragments, tidy: bool, cuts: NDArray[np.float64], threads: int, /
) -> (
    tuple[
        NDArray[np.int64],
        NDArray[Any],
        NDArray[Any],
        NDArray[Any] | None,
        NDArray[Any] | None,
        NDArray[Any] | None,
        NDArray[Any] | None,
        NDArray[np.int64],
    ]
    | None
): ...
def thin(
    fragments: Fragments,
    volumes: bool,
    points: int,
    frequency: float,
    warp: int,
    range_per_pixel: bool,
    cells: int,
    step: float,
    threads: int,
    /,
) -> (
    tuple[
        NDArray[np.int64],
        NDArray[Any],
        NDArray[Any],
        NDArray[Any] | None,
        NDArray[Any] | None,
        NDArray[Any] | None,
        NDArray[Any] | None,
        NDArray[np.int64],
    ]
    | None
): ...

# errors of images
@overload
def image_error(
    metric: str,
    image: NDArray[Any],
    reference: NDArray[Any],
    wants_map: Literal[False],
    threads: int,
    /,
) -> float: ...
@overload
def image_error(
    metric: str,
    image: NDArray[Any],
    reference: NDArray[Any],
    wants_map: Literal[True],
    threads: int,
    /,
) -> NDArray[Any]: ...
def reference_of(reference: NDArray[Any], most_bytes: int, /) -> object: ...
def image_errors(
    metrics: tuple[str, ...], image: NDArray[Any], reference: object, threads: int, /
) -> tuple[float, ...]: ...

# questions; technique: the fields of moit_technique that are set
def composite(
    fragments: Fragments,
    technique: dict[str, Any],
    cull_opaque: bool,
    threads: int,
    background: NDArray[np.float64],
    /,
) -> tuple[NDArray[Any], int]: ...
def total_transmittance(
    fragments: Fragments, technique: dict[str, Any], cull_opaque: bool, threads: int, /
) -> NDArray[Any]: ...
def transmittance(
    fragments: Fragments,
    technique: dict[str, Any],
    cull_opaque: bool,
    threads: int,
    depth: NDArray[np.float64] | None,
    /,
) -> NDArray[Any]: ...
def network_features(
    fragments: Fragments, technique: dict[str, Any], cull_opaque: bool, threads: int, /
) -> NDArray[np.float64]: ...
def bounds(
    fragments: Fragments,
    technique: dict[str, Any],
    cull_opaque: bool,
    threads: int,
    depth: NDArray[np.float64] | None,
    /,
) -> tuple[NDArray[Any], NDArray[Any]]: ...

# moments by themselves
def gather(
    fragments: Fragments,
    technique: dict[str, Any],
    cull_opaque: bool,
    threads: int,
    raw: bool,
    /,
) -> tuple[NDArray[Any], NDArray[Any]]: ...
def moment_words(
    technique: dict[str, Any], threads: int, b: NDArray[Any], /
) -> NDArray[np.uint16]: ...
def numbers_within(
    threads: int, checks: tuple[tuple[NDArray[Any], float, float], ...], /
) -> bool: ...
def moments_absorbance(
    technique: dict[str, Any],
    threads: int,
    b0: NDArray[Any],
    b: NDArray[Any],
    z: NDArray[Any],
    /,
) -> NDArray[Any]: ...
def moments_transmittance(
    technique: dict[str, Any],
    threads: int,
    b0: NDArray[Any],
    b: NDArray[Any],
    z: NDArray[Any],
    /,
) -> NDArray[Any]: ...
def moments_bounds(
    technique: dict[str, Any],
    threads: int,
    b0: NDArray[Any],
    b: NDArray[Any],
    z: NDArray[Any],
    alpha: NDArray[Any] | None,
    /,
) -> tuple[NDArray[Any], NDArray[Any]]: ...
def moments_pivots(
    technique: dict[str, Any], threads: int, b0: NDArray[Any], b: NDArray[Any], needed: bool, /
) -> NDArray[np.float64]: ...
def bias(technique: dict[str, Any], which: str, /) -> float: ...

_Pulled = tuple[
    NDArray[Any],
    NDArray[Any],
    NDArray[Any] | None,
    NDArray[Any] | None,
    NDArray[np.float64] | None,
    NDArray[np.float64] | None,
]

def composite_pullback(
    fragments: Fragments,
    technique: dict[str, Any],
    cull_opaque: bool,
    threads: int,
    background: NDArray[np.float64],
    seed: NDArray[Any],
    /,
) -> _Pulled: ...
def transmittance_pullback(
    fragments: Fragments,
    technique: dict[str, Any],
    cull_opaque: bool,
    threads: int,
    seed: NDArray[Any],
    /,
) -> _Pulled: ...
def curve_pullback(
    fragments: Fragments,
    technique: dict[str, Any],
    cull_opaque: bool,
    threads: int,
    depth: NDArray[np.float64],
    seed: NDArray[Any],
    /,
) -> _Pulled: ...
def total_transmittance_pullback(
    fragments: Fragments,
    technique: dict[str, Any],
    cull_opaque: bool,
    threads: int,
    seed: NDArray[Any],
    /,
) -> _Pulled: ...
def moments_pullback(
    technique: dict[str, Any],
    threads: int,
    b0: NDArray[Any],
    b: NDArray[Any],
    z: NDArray[Any],
    absorbance: bool,
    seed: NDArray[Any],
    /,
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], None]: ...
def bound_of_rows(
    technique: dict[str, Any],
    threads: int,
    rows: NDArray[Any],
    z: NDArray[Any],
    slopes: bool,
    most: float,
    /,
) -> tuple[NDArray[Any], NDArray[Any] | None, NDArray[Any] | None, bool]: ...
def moments_bounds_pullback(
    technique: dict[str, Any],
    threads: int,
    b0: NDArray[Any],
    b: NDArray[Any],
    z: NDArray[Any],
    alpha: NDArray[Any] | None,
    lower: NDArray[Any],
    upper: NDArray[Any],
    /,
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any] | None]: ...
def moments_gradient_refusal(technique: dict[str, Any], /) -> str | None: ...
def gradient_refusal(technique: dict[str, Any], /) -> str | None: ...
def technique_facts() -> tuple[dict[str, Any], ...]: ...

# meshes; of a scene (vertices, normals, color, alpha, triangles), seen by (eye, right, up, forward,
# scale, near, far)
_Mesh = (
    tuple[
        NDArray[np.float32],
        NDArray[np.float32] | None,
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.int32],
    ]
    | tuple[
        NDArray[np.float32],
        NDArray[np.float32] | None,
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.int32],
        NDArray[np.float32],  # uv, of triangles the row of materials, these, texels of each
        NDArray[np.int32],
        NDArray[np.float64],
        tuple[NDArray[np.float32], ...],
    ]
)
_Camera = tuple[Any, ...]

def rasterize(
    mesh: _Mesh,
    camera: _Camera,
    width: int,
    height: int,
    threads: int,
    lights: NDArray[np.float64] | tuple[()] = ...,
    reached: NDArray[np.float64] | None = ...,
    by_area: bool = ...,
    /,
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]: ...
def begin_splats(
    splats: tuple[NDArray[np.float32], ...],
    splatting: int,
    camera: _Camera,
    width: int,
    height: int,
    threads: int,
    /,
) -> tuple[object, NDArray[np.int64], float, float]: ...
def draw_splats(
    raster: object, top: int, bottom: int, thick: bool, threads: int, /
) -> tuple[NDArray[Any], ...]: ...
def pull_splat_fragments(
    raster: object,
    top: int,
    bottom: int,
    depth: NDArray[np.float32],
    alpha: NDArray[np.float32],
    color: NDArray[np.float32],
    sums: NDArray[np.float64] | None,
    threads: int,
    /,
) -> NDArray[np.float64]: ...
def pull_splat_projection(
    raster: object,
    splats: tuple[NDArray[np.float32], ...],
    sums: NDArray[np.float64],
    threads: int,
    /,
) -> tuple[
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
    NDArray[np.float32],
]: ...
def screen_splats(
    splats: tuple[NDArray[np.float32], ...],
    splatting: int,
    camera: _Camera,
    width: int,
    height: int,
    threads: int,
    /,
) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.int32] | None]: ...
def screen_strokes(
    strokes: tuple[NDArray[Any], ...],
    how: tuple[bool, bool, bool, int],
    camera: _Camera,
    width: int,
    height: int,
    /,
) -> NDArray[np.uint8]: ...
def begin_strokes(
    strokes: tuple[NDArray[Any], ...],
    how: tuple[bool, bool, bool, int],
    camera: _Camera,
    width: int,
    height: int,
    threads: int,
    lights: NDArray[np.float64] | tuple[()] = ...,
    /,
) -> tuple[object, NDArray[np.int64], float, float]: ...
def draw_strokes(
    raster: object,
    top: int,
    bottom: int,
    threads: int,
    reached: NDArray[np.float64] | None = ...,
    /,
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]: ...
def march_grid(
    values: NDArray[np.float32],
    origin: tuple[float, float, float],
    spacing: tuple[float, float, float],
    table: NDArray[np.float32],
    low: float,
    high: float,
    camera: _Camera,
    step: float,
    width: int,
    height: int,
    top: int,
    bottom: int,
    threads: int,
    /,
) -> tuple[NDArray[np.int64], NDArray[np.float32]]: ...
def screen_triangles(
    mesh: _Mesh, camera: _Camera, width: int, height: int, threads: int, /
) -> NDArray[np.uint8]: ...
def texture_levels(texels: NDArray[np.float32], /) -> NDArray[np.float32]: ...

# what passes on a GPU are given
def numbers() -> dict[str, int]: ...
def pass_constants(
    technique: dict[str, Any], is_double: bool, near: float, far: float, /
) -> tuple[
    str,
    tuple[float, float, float, float, float],
    float,
    tuple[float, float, tuple[float, ...], tuple[float, float, float], tuple[float, ...]] | None,
]: ...
def warped(
    fragments: Fragments,
    technique: dict[str, Any],
    threads: int,
    depth: NDArray[np.float64] | None,
    /,
) -> NDArray[Any]: ...
def surviving(
    fragments: Fragments, cull_opaque: bool, threads: int, /
) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[Any] | None, NDArray[Any] | None]: ...
def slice_tables(
    fragments: Fragments, technique: dict[str, Any], cull_opaque: bool, threads: int, /
) -> tuple[NDArray[np.float32], int, int, int, int, int]: ...

# pixels one by one
def pixel_facts(
    fragments: Fragments, cull_opaque: bool, threads: int, /
) -> NDArray[np.float64]: ...
def take_pixels(
    fragments: Fragments, pixel: NDArray[np.int64], threads: int, /
) -> tuple[
    NDArray[np.int64], NDArray[Any], NDArray[Any], NDArray[Any] | None, NDArray[Any] | None
]: ...
def color_bounds(
    fragments: Fragments,
    cull_opaque: bool,
    threads: int,
    background: NDArray[np.float64],
    lower: NDArray[Any],
    upper: NDArray[Any],
    /,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...

# mixed resolution
def target_sums(
    fragments: Fragments, technique: dict[str, Any], threads: int, /
) -> NDArray[np.float64]: ...
def join_targets(
    technique: dict[str, Any],
    pictures: list[tuple[int, NDArray[np.float64], NDArray[np.float32]]],
    depth_aware: bool,
    behind: NDArray[np.float64],
    threads: int,
    /,
) -> NDArray[np.float32]: ...

# shadow maps
def texel_sums(
    fragments: Fragments, technique: dict[str, Any], threads: int, /
) -> NDArray[Any]: ...
def filter_texels(
    sums: NDArray[Any], weights: NDArray[np.float64], threads: int, /
) -> NDArray[Any]: ...
def hold_texels(moments: NDArray[Any], threads: int, /) -> NDArray[Any]: ...
def shadow_at(
    sums: NDArray[Any],
    technique: dict[str, Any],
    near: float,
    far: float,
    opaque: bool,
    threads: int,
    place: NDArray[np.float64],
    alpha: NDArray[np.float64] | None,
    /,
) -> NDArray[np.float64]: ...
