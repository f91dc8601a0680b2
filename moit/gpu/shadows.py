"""What of lights reaches fragments on a device, by techniques' own passes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.exceptions import GpuError
from moit.geometry.light import Light
from moit.gpu.bindings import (
    ALPHAS,
    ANSWERS,
    ASKED,
    BUFFERS,
    DEPTHS,
    FACTOR,
    FACTORS,
    MAP_SUMS,
    POINT_ALPHAS,
    POINT_DEPTHS,
    POINT_RAYS,
    REACH,
    REACHED,
    READ_MAP,
    STATE,
    TOTALS,
    TRANSMITTANCE,
    group_counts,
)
from moit.gpu.described import Constants, Passes
from moit.gpu.passes import passes_of
from moit.shadows.reaching import points_of_pixels, reached
from moit.shadows.shadow_map import ShadowMap, Texels

if TYPE_CHECKING:
    from moit.geometry.camera import Camera
    from moit.gpu.device import Device

Array = NDArray[Any]

MOST_POINTS = 1 << 18  # that have a state at one time


@dataclasses.dataclass
class _Map:
    """A map's texels on the device, and what asks them."""

    texels: Texels
    passes: Passes
    constants: Constants
    to_map: NDArray[np.float64]
    buffer: Any
    exclude_self: bool


class Shadows:
    """What of a picture's lights, as `moit.shadows.reaching.with_maps` gives them, reaches points.

    Maps whose texels add up are read on the device, others by the core.
    """

    def __init__(
        self,
        device: Device,
        lights: Sequence[Any],
        camera: Camera,
        size: tuple[int, int],
        view: tuple[float, ...],
        threads: int | None,
    ) -> None:
        self.device, self.lights, self.camera = device, list(lights), camera
        self.size, self.view, self.threads = size, view, threads
        self.maps: dict[int, list[_Map]] = {}
        for k, light in enumerate(self.lights):
            shadows = light.shadows if isinstance(light, Light) else None
            layers = shadows.layers() if isinstance(shadows, ShadowMap) else None
            if layers is None or any(one.sums.nbytes > device.storage_bytes for one in layers):
                continue
            self.maps[k] = [self._map(one) for one in layers]
            self.lights[k] = (light.direction, light.color)

    def _map(self, texels: Texels) -> _Map:
        constants = Constants.of(texels.fields, False, (texels.near, texels.far))
        held = np.ascontiguousarray(texels.sums, np.float32)
        # state is that of numbers, whatever fragments were gathered in
        fields = {**texels.fields, "bits": 32}
        passes = passes_of(texels.technique, dataclasses.replace(constants, fields=fields))
        world = np.eye(4)
        world[:3, :3] = self.camera.axes.T
        world[:3, 3] = self.camera.eye
        return _Map(
            texels,
            passes,
            constants,
            texels.view.matrix @ world,
            self.device.buffer(max(held.nbytes, 16), held.reshape(-1) if held.size else None),
            texels.technique.excludes_self and not texels.opaque,
        )

    def reached(self, count: int, depth: Any, alpha: Any = None, rays: Any = None) -> Any:
        """A buffer (count, lights) of the shares that come to points.

        depth, alpha, rays : buffers (count,) of what is seen at pixels `rays`; without these of
            opaque surfaces, a pixel each, of depth 0 where there is none.
        """
        share = np.ones((count, len(self.lights)))
        if any(isinstance(light, Light) and light.shadows is not None for light in self.lights):
            share = self._by_core(count, depth, alpha, rays)
        if share.nbytes > self.device.storage_bytes:
            raise GpuError(
                f"lights: shadows take {share.nbytes} bytes, and a buffer of "
                f"{self.device.renderer} holds {self.device.storage_bytes}; use a smaller size or "
                "device='cpu'"
            )
        to = self.device.buffer(max(share.nbytes, 16), share.reshape(-1) if share.size else None)
        for light_index, maps in self.maps.items():
            for one in maps:
                for first in range(0, count, MOST_POINTS):
                    self._look_up(
                        one,
                        light_index,
                        first,
                        min(MOST_POINTS, count - first),
                        (depth, alpha, rays),
                        to,
                    )
        return to

    def _by_core(self, count: int, depth: Any, alpha: Any, rays: Any) -> NDArray[np.float64]:
        away = np.empty(count, np.float32)
        depth.read(away)
        pixel, opacity = np.arange(count), np.ones(count, np.float32)
        if rays is not None:
            found = np.empty(count, np.uint32)
            rays.read(found)
            alpha.read(opacity)
            pixel = found.astype(np.int64)
        share = np.ones((count, len(self.lights)))
        there = np.flatnonzero(away)
        points = points_of_pixels(pixel[there], away[there], self.camera, *self.size)
        share[there] = reached(self.lights, points, opacity[there], self.threads)
        return share

    def _look_up(
        self, one: _Map, light_index: int, first: int, count: int, points: tuple[Any, ...], to: Any
    ) -> None:
        depth, alpha, rays = points
        texels, passes, device = one.texels, one.passes, self.device
        none = device.buffer(16)
        state = 8 * max(passes.state, texels.sums.shape[2] + 1)
        buffers = {
            **dict.fromkeys(range(BUFFERS), none),
            STATE: device.buffer(state * count),
            FACTORS: device.buffer(8 * max(passes.factors, 1) * count),
            TOTALS: device.buffer(32 * count),
            DEPTHS: device.buffer(8 * count),
            ALPHAS: device.buffer(8 * count),
            ASKED: device.buffer(max(4 * count, 16)),
            ANSWERS: device.buffer(8 * count),
        }
        height, width = texels.sums.shape[:2]
        uniforms = {
            "count": count,
            "first_point": first,
            "of_pixels": int(rays is None),
            "picture": self.size,
            "view": self.view,
            "to_map": one.to_map.reshape(-1),
            "bias": texels.bias,
            "texels": (width, height),
            "map_near": texels.near,
            "map_far": texels.far,
            "lights": len(self.lights),
            "light_index": light_index,
        }
        defines = {
            "DOUBLE": 1,
            "NUMBERS": texels.sums.shape[2],
            "HARMONICS": passes.defines.get("HARMONICS", 0),
            "OPAQUE": int(texels.opaque),
        }
        seen = {POINT_DEPTHS: depth, POINT_RAYS: rays or none, POINT_ALPHAS: alpha or none}
        groups = group_counts(count)

        def own(number: int, more: dict[int, Any]) -> None:
            program = device.program("meshes/shadows.comp.glsl", PASS=number, **defines)
            given = {k: buffers[k] for k in (STATE, FACTORS, TOTALS, DEPTHS, ALPHAS, ASKED)}
            device.dispatch(
                program,
                groups,
                buffers={**given, ANSWERS: buffers[ANSWERS], **seen, **more},
                uniforms=uniforms,
            )

        own(READ_MAP, {MAP_SUMS: one.buffer})
        steps = {**one.constants.uniforms(passes), "exclude_self": int(one.exclude_self)}
        for number in (FACTOR, TRANSMITTANCE):
            program = device.program(
                f"techniques/{passes.shader}",
                **passes.defines,
                SCALAR="double",
                DOUBLE=1,
                PASS=number,
            )
            device.dispatch(program, groups, buffers=buffers, uniforms={"count": count, **steps})
        own(REACH, {REACHED: to})
