"""Shadow maps through transparent casters: what reaches points of a scene from a light."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.catalog import PowerMoments, Sorted, Technique
from moit.catalog import technique as technique_named
from moit.catalog.blocks import InBlocks
from moit.checks.arguments import whole
from moit.checks.arrays import as_array, finite
from moit.core.pieces import surfaces
from moit.core.questions import CoreQuestion
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera, vector
from moit.geometry.glass import as_shadows_see
from moit.geometry.meshes import Mesh, Meshes, meshes_of
from moit.geometry.rasterizer import MOST_SIDE
from moit.scenes.scene_parts import MeshScene
from moit.shadows.views import FromAfar, FromCamera, Itself, View, split
from moit.system.environment import thread_count
from moit.system.progress import Progress, steps

Array = NDArray[Any]

# What a technique's name has where it does not say otherwise (MBOIT sections 6 and 7.2).
DEFAULTS = {"warp": "linear", "overestimation": 0.0}
MOST_FILTER = 63
FILTER = 9
AT_ONCE = 1 << 21  # fragments that stand for points
CURVES = 64  # points whose curves are asked for together, each at the depths of all


@dataclasses.dataclass(frozen=True, eq=False)
class Texels:
    """What a map holds of casters whose texels add up.

    sums : (height, width, numbers), read-only.
    technique, fields : what reads them, and that as the core takes it.
    near, far : the range of depth that is warped.
    opaque : whether they are moments of opaque casters' depth.
    view : where points are on the map.
    bias : how far points are moved toward the light, in units of depth: the first, and depth times
        the second.
    """

    sums: Array
    technique: Technique
    fields: dict[str, Any]
    near: float
    far: float
    opaque: bool
    view: View
    bias: tuple[float, float]

    def reached(
        self, points: Array, alpha: NDArray[np.float64] | None, threads: int
    ) -> NDArray[np.float64]:
        """(N,) of what comes to points (N, 3), which leave out surfaces of these opacities."""
        place = moved(self.view, points, self.bias)
        return _core.shadow_at(
            self.sums, self.fields, self.near, self.far, self.opaque, threads, place, alpha
        )


class OpaqueShadowMap:
    """Shadows of opaque casters: four power moments of the nearest one's depth, in 16 bits each.

    bits_per_texel : 64.
    shape : (height, width).
    bias : that which is published for these bits, 6e-5.

    Depth is linear and texels without a caster are at the end of it, beyond the farthest; they are
    filtered and read as `ShadowMap` does. What is seen is 1 - the least share of casters that must
    be in front: light may leak, but nothing shadows itself by more than its map is uneven.

    Peters and Klein, "Moment Shadow Mapping", I3D 2015; words as in Muenstermann et al. 2018.
    """

    bits_per_texel = 64

    def __init__(
        self, f: Fragments, view: View, filter: int, depth_bias: float | None, threads: int
    ) -> None:
        technique = PowerMoments(4, bits=16, overestimation=0.0, warp="linear")
        fields = technique.fields_for_core(np.dtype(np.float32))
        self.bias = technique.bias_for(np.float32)
        self.shape = f.shape
        nearest = _nearest(f)
        present = np.isfinite(nearest)
        near, far = float(nearest[present].min()), float(nearest[present].max())
        # casters end well before the depth of texels without any
        end = far + max(0.05 * (far - near), 1e-3 * abs(far), 1e-30)
        z = np.where(present, (nearest - near) / (end - near) * 2 - 1, 1.0)
        moments = np.stack([z, z**2, z**3, z**4], axis=-1).reshape(*f.shape, 4)
        filtered = _core.filter_texels(moments.astype(np.float32), gaussian(filter), threads)
        held = _core.hold_texels(filtered, threads)
        held.flags.writeable = False
        bias = bias_of(view, depth_bias, filter // 2 + 1.0)
        self.texels = Texels(held, technique, fields, near, end, True, view, bias)

    def __repr__(self) -> str:
        height, width = self.shape
        return f"OpaqueShadowMap({width}x{height}, {self.bits_per_texel} bits a texel)"

    def transmittance(self, points: ArrayLike, *, threads: int | None = None) -> Array:
        """1 where a point (N, 3) sees the light, 0 where it does not; (N,)."""
        found = points_of(points)
        reached = self.texels.reached(found.astype(np.float64), None, thread_count(threads))
        return reached.astype(found.dtype)


class ShadowMap:
    """What casters let through of a light, for every point of the scene.

    scene : a Mesh, several, a scene of triangles or its name; or Fragments seen from the light, of
        which those of alpha 1 are opaque.
    technique : what a texel holds; a technique or its name. Names have warp="linear" and
        overestimation=0.0 unless they say otherwise, as a surface would shadow itself with more;
        techniques are taken as they are.
        Power and trigonometric moments and Fourier opacity are filtered, between texels too, as
        sums: b0 and b0 times the moments, those of 16 bits decoded before. "sorted" casts rays
        through the fragments. Others that have a curve (stochastic, deep-shadow, adaptive,
        transmittance-function-map, ..) are asked texel by texel, and what reaches these is
        filtered.
    light : where it comes from. A moit.Camera: from its eye, and casters that it does not see throw
        no shadow. (3,) a direction not 0: from far away, travelling there; each map is fitted to
        its casters. None, of Fragments only: points are places on the map, column and row in texels
        from its corner, y down, and depth.
    resolution : of maps of triangles, texels a side, 1 to 16,384; Fragments have their own.
    filter : texels a side of a Gaussian, odd, 1 to 63; its deviation is a quarter of what is
        between its outer texels. 1: none. None: 9, as published, where texels add up; else 1,
        which is the nearest texel alone.
    depth_bias : how far points are moved toward the light before they are asked for, in units of
        depth, at least 0. None: not at all where texels add up; for opaque casters and for other
        techniques by as many sides of texels as half a filter has, and one more.
    threads : at least 1; None: MOIT_THREADS, or as many as this process has processors.
    progress : True, False, or a callable (done, total, label).

    Opaque casters have a map of their own (`opaque`), which does not hide transparent ones: that
    would leak light at silhouettes. What reaches a point is the product of both.

    technique : as it is used.
    bits_per_texel : what a texel holds of transparent casters; 224 for power6. None: it grows.
    opaque : an OpaqueShadowMap; with "sorted" or without opaque casters None.
    view : where points are on the map. None where there are no transparent casters.

    Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent Transparency", I3D
    2018, section 6, which keeps all in floats as here; 16 bits are those that fragments are
    gathered in. Raises TypeError and ValueError that name the argument.

    >>> glass = moit.Mesh([[-1, 1, -1], [1, 1, -1], [0, 1, 1]], [[0, 1, 2]], alpha=0.5)
    >>> shadows = moit.ShadowMap(glass, "sorted", light=(0, -1, 0), resolution=16)
    >>> shadows.transmittance([[0, 0, 0]]).round(2).tolist()
    [0.5]
    """

    def __init__(
        self,
        scene: Meshes | MeshScene | str | Fragments,
        technique: str | Technique = "power6",
        *,
        light: Camera | ArrayLike | None = None,
        resolution: int = 1024,
        filter: int | None = None,
        depth_bias: float | None = None,
        threads: int | None = None,
        progress: Progress = True,
    ) -> None:
        self.technique = shadow_technique(technique)
        self.resolution = whole("resolution", resolution, 1, MOST_SIDE)
        adds_up = self.technique.adds_texels  # they are filtered before they are read
        if filter is None:
            self.filter = FILTER if adds_up else 1
        else:
            self.filter = whole("filter", filter, 1, MOST_FILTER)
            if self.filter % 2 == 0:
                raise ValueError(f"filter: expected an odd number, got {filter}")
        if depth_bias is not None:
            depth_bias = float(finite(as_array(depth_bias, "depth_bias"), "depth_bias", float))
            if depth_bias < 0:
                raise ValueError(f"depth_bias: expected at least 0, got {depth_bias}")
        self.depth_bias = depth_bias
        workers = thread_count(threads)
        self.opaque: OpaqueShadowMap | None = None
        self.texels: Texels | None = None
        self._occluders: tuple[View, Array] | None = None
        with steps(progress, 2, "ShadowMap", patient=True) as done:
            done.now("casters")
            self.view, clear, solid_view, solid = self._seen(scene, light, workers)
            done("casters")
            done.now(str(self.technique))
            self._keep(clear, solid_view, solid, workers)
            done(str(self.technique))

    def _keep(
        self,
        clear: Fragments | None,
        solid_view: View | None,
        solid: Fragments | None,
        threads: int,
    ) -> None:
        """Makes what it holds of casters, transparent ones and opaque ones."""
        if solid is not None and len(solid):
            assert solid_view is not None
            if isinstance(self.technique, Sorted):
                self._occluders = solid_view, _nearest(solid).reshape(solid.shape)
            else:
                self.opaque = OpaqueShadowMap(
                    solid, solid_view, self.filter, self.depth_bias, threads
                )
        self.fragments = clear
        if clear is not None and self.technique.adds_texels:
            assert self.view is not None
            fields = self.technique.fields_for(clear)
            sums = _core.texel_sums(clear, fields, threads)
            if self.filter > 1:
                sums = _core.filter_texels(sums, gaussian(self.filter), threads)
            sums.flags.writeable = False
            bias = bias_of(self.view, self.depth_bias, 0.0)
            self.texels = Texels(
                sums, self.technique, fields, *clear.depth_range, False, self.view, bias
            )
            self.fragments = None

    def _seen(
        self, scene: Any, light: Any, threads: int
    ) -> tuple[View | None, Fragments | None, View | None, Fragments | None]:
        """Views and fragments of transparent casters and of opaque ones."""
        if isinstance(scene, Fragments):
            return _parted(scene, light)
        if light is None:
            raise TypeError(
                "light: expected a Camera or a direction; None is for Fragments seen from a light"
            )
        clear, solid = split(as_shadows_see(_meshes(scene)))
        shape = (self.resolution, self.resolution)
        views: list[FromCamera | FromAfar | None] = []
        for part in (clear, solid):
            if not part:
                views.append(None)
            elif isinstance(light, Camera):
                views.append(FromCamera(light, shape))
            else:
                travels = np.array(vector(light, "light"))
                if not float(np.linalg.norm(travels)) > 0:
                    raise ValueError("light: expected a direction that is not 0")
                views.append(FromAfar.of(travels, part, self.resolution, self.filter // 2 + 1))
        if not isinstance(light, Camera):
            vector(light, "light")
        found = [
            None if view is None else view.fragments(part, threads)
            for view, part in zip(views, (clear, solid), strict=True)
        ]
        if found[0] is not None and (found[0].alpha == 1).any():  # cut-outs
            _, found[0], _, cut = _parted(found[0], None)
            if views[1] is None:
                views[1], found[1] = views[0], cut
        return views[0], found[0], views[1], found[1]

    def __repr__(self) -> str:
        if self.view is None:
            return f"ShadowMap({self.technique}, no transparent casters)"
        height, width = self.view.shape
        bits = self.bits_per_texel
        size = "" if bits is None else f", {bits:g} bits a texel"
        return f"ShadowMap({self.technique}, {width}x{height}, filter {self.filter}{size})"

    @property
    def bits_per_texel(self) -> float | None:
        return self.technique.bits_per_pixel

    def transmittance(
        self, points: ArrayLike, alpha: ArrayLike | None = None, *, threads: int | None = None
    ) -> Array:
        """What share of the light reaches points, (N,) in [0, 1].

        points : (N, 3) places in the scene, finite; float64 stay that, others become float32.
            A point that the map does not show is lit, one nearer than all casters too, and to one
            behind them all comes exp(-b0), whatever the technique makes of depth.
        alpha : (N,), or one number: the opacity of the surface that each point is on, in [0, 1].
            Its own absorbance is left out, wherever within the filter the map has it: of a
            surface alone on the map, of one alpha, nothing is in its shadow. One of alpha 1 is not
            on the map of transparent casters, and leaves out nothing. Used where texels add up;
            "sorted" and others count casters strictly in front. None: nothing is left out.

        Raises TypeError and ValueError for arguments that do not fit.
        """
        found = points_of(points)
        workers = thread_count(threads)
        own = _alphas(alpha, len(found))
        wide = found.astype(np.float64)
        reached = np.ones(len(found))
        if self.view is not None and len(found):
            if self.texels is not None:
                reached = self.texels.reached(wide, own, workers)
            else:
                bias = bias_of(self.view, self.depth_bias, self.filter // 2 + 1.0)
                reached = self._asked(moved(self.view, wide, bias), workers)
        if self.opaque is not None:
            reached = reached * self.opaque.texels.reached(wide, None, workers)
        if self._occluders is not None:
            view, nearest = self._occluders
            place = moved(view, wide, bias_of(view, self.depth_bias, self.filter // 2 + 1.0))
            inside, texel = _texels(place[:, 0], place[:, 1], view.shape)
            hidden = nearest.reshape(-1)[texel] < place[:, 2]
            reached = np.where(inside & hidden, 0.0, reached)
        return np.asarray(reached, found.dtype)

    def layers(self) -> list[Texels] | None:
        """Texels whose product it is; None where it is not one of such alone."""
        if self._occluders is not None or (self.view is not None and self.texels is None):
            return None
        opaque = None if self.opaque is None else self.opaque.texels
        return [one for one in (self.texels, opaque) if one is not None]

    def _asked(self, place: Array, threads: int) -> NDArray[np.float64]:
        """By what single texels let through."""
        assert self.fragments is not None
        f = self.fragments
        reached = np.ones(len(place))
        inside, texel = _texels(place[:, 0], place[:, 1], f.shape)
        at = np.flatnonzero(inside)
        if self.filter == 1:
            for some in _runs(at, AT_ONCE):
                reached[some] = self._in_texels(f, texel[some], place[some, 2], threads)
            return reached
        taps = self.filter + 1  # a filter between two texels
        for some in _runs(at, max(1, AT_ONCE // taps**2)):
            columns, across = self._taps(place[some, 0], f.shape[1])
            rows, along = self._taps(place[some, 1], f.shape[0])
            texels = rows[:, :, None] * f.shape[1] + columns[:, None, :]
            depth = np.broadcast_to(place[some, 2][:, None, None], texels.shape)
            seen = self._in_texels(f, texels.reshape(-1), depth.reshape(-1), threads)
            weights = along[:, :, None] * across[:, None, :]
            reached[some] = (seen.reshape(texels.shape) * weights).sum(axis=(1, 2))
        return reached

    def _taps(self, x: Array, end: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """(N, filter + 1): the texels round x and what they count, bilinear and filtered."""
        x = np.clip(x, 0.5, end - 0.5)
        first = np.floor(x - 0.5)
        share = (x - 0.5 - first)[:, None]
        weights = gaussian(self.filter)
        counts = (1 - share) * np.append(weights, 0) + share * np.append(0, weights)
        texels = first[:, None].astype(np.int64) + np.arange(self.filter + 1) - self.filter // 2
        return np.clip(texels, 0, end - 1), counts

    def _in_texels(
        self, f: Fragments, texel: NDArray[np.int64], depth: Array, threads: int
    ) -> NDArray[np.float64]:
        near, far = f.depth_range
        away = np.clip(depth, near, far).astype(f.dtype)
        # those that keep layers, or simplify, are asked for curves
        ask = self._by_points if self.technique.takes_points else self._by_curves
        reached = ask(f, texel, away, threads)
        behind = depth > far
        if behind.any():
            total = self._question(f, threads, blends=False).total_transmittance()
            reached = np.where(behind, total.reshape(-1)[texel], reached)
        return np.where(depth <= near, 1.0, np.clip(reached, 0, 1))

    def _by_points(
        self, f: Fragments, texel: NDArray[np.int64], away: Array, threads: int
    ) -> NDArray[np.float64]:
        own = np.repeat(np.arange(f.shape[0] * f.shape[1]), f.counts)
        casters, points = [own, f.depth, f.alpha], [texel, away, np.zeros(len(texel), f.dtype)]
        # what comes first at one depth is in front
        points_first = self.technique.ties_in_order
        first, last = (points, casters) if points_first else (casters, points)
        pixel, depths, alphas = (np.concatenate([first[k], last[k]]) for k in range(3))
        grouped = _core.group_by_pixel(pixel, f.shape[0] * f.shape[1])
        assert not isinstance(grouped, int)  # texels are on the map
        offsets, order = grouped
        asked = Fragments(
            offsets, depths[order], alphas[order], shape=f.shape, depth_range=f.depth_range
        )
        answers = np.empty(len(order))
        answers[order] = self._question(asked, threads).transmittance(None)
        return answers[: len(texel)] if points_first else answers[len(f) :]

    def _by_curves(
        self, f: Fragments, texel: NDArray[np.int64], away: Array, threads: int
    ) -> NDArray[np.float64]:
        found = []
        for some in _runs(np.arange(len(texel)), CURVES):
            offsets, depth, alpha, *_ = _core.take_pixels(f, texel[some], threads)
            copies = Fragments(offsets, depth, alpha, depth_range=f.depth_range)
            curves = self._question(copies, threads).transmittance(away[some].astype(np.float64))
            found.append(np.diagonal(curves[0]).astype(np.float64))
        return np.concatenate([np.zeros(0), *found])

    def _question(self, f: Fragments, threads: int, blends: bool = True) -> CoreQuestion:
        return CoreQuestion(f, self.technique, cull_opaque=False, threads=threads, blends=blends)


def shadow_technique(technique: str | Technique) -> Technique:
    """A technique with a curve; names have DEFAULTS."""
    found = technique_named(technique)
    if not (found.has_curve and found.engine == "core"):
        lacks = (
            "is none of the core's" if found.has_curve else "has no transmittance but at fragments"
        )
        raise ValueError(
            f"technique: {found} {lacks}; a shadow map needs one of the core's with a curve, such "
            "as power6, fourier15, deep-shadow or sorted"
        )
    if found.range_per_pixel and found.adds_texels:
        raise ValueError(
            f"technique: {found} has another range of depth in each texel, and such do not add up; "
            "use depth_range='image'"
        )
    if found.block_side > 1 and isinstance(found, InBlocks):
        raise ValueError(
            f"technique: {found} has states of blocks of neighbours, and a shadow map asks for "
            "texels one by one; use resolution=1, and fewer texels"
        )
    if isinstance(technique, str):
        given = technique.replace(" ", "")
        unsaid = {
            name: value
            for name, value in DEFAULTS.items()
            if hasattr(found, name) and f"{name}=" not in given
        }
        found = dataclasses.replace(found, **unsaid)
    return found


def gaussian(taps: int) -> NDArray[np.float64]:
    """(taps,) weights that sum to 1, of a deviation of a quarter of what is between the outer."""
    if taps == 1:
        return np.ones(1)
    deviation = (taps - 1) / 4
    weights = np.array([math.exp(-0.5 * ((i - taps // 2) / deviation) ** 2) for i in range(taps)])
    return np.asarray(weights / math.fsum(weights))


def bias_of(view: View, depth_bias: float | None, texels: float) -> tuple[float, float]:
    """How far points are moved toward a light: as asked, or by so many texels' sides."""
    if depth_bias is not None:
        return depth_bias, 0.0
    same, with_depth = view.texel
    return texels * same, texels * with_depth


def moved(view: View, points: Array, bias: tuple[float, float]) -> Array:
    """Places of points on a map, nearer to the light by bias[0] + bias[1] depth."""
    place = np.ascontiguousarray(view.places(points))
    place[:, 2] -= bias[0] + bias[1] * place[:, 2]
    return place


def points_of(points: ArrayLike) -> Array:
    array = as_array(points, "points")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"points: expected real numbers, got {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"points: expected shape (N, 3), got {array.shape}")
    wide = array.dtype.kind == "f" and array.dtype.itemsize == 8
    return finite(array, "points", np.float64 if wide else np.float32)


def _alphas(alpha: ArrayLike | None, count: int) -> NDArray[np.float64] | None:
    if alpha is None:
        return None
    array = as_array(alpha, "alpha")
    if array.dtype.kind not in "fiu":
        raise TypeError(f"alpha: expected real numbers, got {array.dtype}")
    if array.shape not in ((), (count,)):
        raise ValueError(f"alpha: expected a number or shape ({count},), got {array.shape}")
    own = np.ascontiguousarray(np.broadcast_to(finite(array, "alpha", np.float64), (count,)))
    if own.size and not (own.min() >= 0 and own.max() <= 1):
        at = int(np.argmax((own < 0) | (own > 1)))
        raise ValueError(f"alpha[{at}]: found {own[at]}; needed a number in [0, 1]")
    return np.where(own == 1, 0, own)


def _meshes(scene: Any) -> list[Mesh]:
    if isinstance(scene, str):
        from moit.scenes import meshes

        scene = meshes(scene)
    return meshes_of(scene.meshes if isinstance(scene, MeshScene) else scene)


def _parted(
    f: Fragments, light: Any
) -> tuple[View | None, Fragments | None, View | None, Fragments | None]:
    """Fragments as transparent and as opaque ones, each seen by a view."""
    if light is not None and not isinstance(light, Camera):
        raise TypeError(
            f"light: Fragments are seen from a Camera or are the map itself (None), got "
            f"{type(light).__name__}"
        )
    if f.transmission is not None:
        raise ValueError("scene: expected fragments without transmission, found some with it")
    if f.shape[0] * f.shape[1] == 0:
        return None, None, None, None
    f, _ = surfaces(f)
    view: View = Itself(f.shape) if light is None else FromCamera(light, f.shape)
    solid = f.alpha == 1
    if not solid.any():
        return (view, f, None, None) if len(f) else (None, None, None, None)
    parts: list[Fragments | None] = []
    for kept in (~solid, solid):
        ends = np.concatenate([[0], np.cumsum(kept)])[f.offsets]
        depth = f.depth[kept]
        span = None if kept is solid else f.depth_range
        parts.append(
            Fragments(ends, depth, f.alpha[kept], shape=f.shape, depth_range=span)
            if len(depth)
            else None
        )
    return view if parts[0] else None, parts[0], view, parts[1]


def _nearest(f: Fragments) -> NDArray[np.float64]:
    """(height, width): the least depth of each pixel, infinite where it has no fragment."""
    nearest = np.full(f.shape[0] * f.shape[1], np.inf)
    filled = np.flatnonzero(f.counts)
    if len(filled):
        nearest[filled] = np.minimum.reduceat(f.depth, f.offsets[filled])
    return nearest.reshape(f.shape)


def _texels(column: Array, row: Array, shape: tuple[int, int]) -> tuple[Array, NDArray[np.int64]]:
    """Whether places are on a map, and the texel that each is in."""
    height, width = shape
    inside = (column >= 0) & (row >= 0) & (column <= width) & (row <= height)
    x = np.where(inside, column, 0).astype(np.int64)
    y = np.where(inside, row, 0).astype(np.int64)
    return inside, np.minimum(y, height - 1) * width + np.minimum(x, width - 1)


def _runs(at: NDArray[np.int64], length: int) -> list[NDArray[np.int64]]:
    return [at[i : i + length] for i in range(0, len(at), length)]
