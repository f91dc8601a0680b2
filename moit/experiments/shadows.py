"""Shadows through transparent casters: maps of techniques beside rays that are cast."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from moit.comparing.report import Row
from moit.experiments.description import PICTURE, Array, Picture, Published, Section, Setting
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh
from moit.geometry.rasterizer import rasterize
from moit.questions import composite
from moit.scenes.scene_parts import MeshScene
from moit.shadows.shadow_map import ShadowMap

AMBIENT = 0.25
RESOLUTION = {"tiny": 64, "small": 512, "full": 1024}

# Which points are meant: of places (N, 3) and what reaches them (N,).
Where = Callable[[Array, Array], NDArray[np.bool_]]


@dataclass(frozen=True)
class Lit:
    """A scene with a light: what is seen, and what casts shadows."""

    scene: MeshScene
    casters: Sequence[Mesh]
    light: tuple[float, float, float]


@dataclass(frozen=True)
class Shadows:
    """Shadow maps of techniques on lit scenes.

    Columns: "bits_per_texel"; "rmse", of the share of light that reaches the fragments of a
    picture, held against rays cast through all casters; "rmse NAME" and "light NAME" (signed) of
    each of `where`; "first_ms" to draw and filter the map, "second_ms" to ask it for all fragments,
    and "ms", both.
    """

    title: str
    text: str
    scenes: Mapping[str, Callable[[], Lit]]
    techniques: Sequence[str]
    columns: tuple[str, ...]
    where: Mapping[str, Where] = field(default_factory=dict)
    pictures: bool = True
    published: Published | None = None
    base: str | None = None
    resolution: Mapping[str, int] = field(default_factory=lambda: RESOLUTION)
    size: Mapping[str, tuple[int, int]] = field(default_factory=lambda: PICTURE)

    def steps(self) -> int:
        return len(self.scenes) * (len(self.techniques) + 1)

    def run(self, setting: Setting) -> Section:
        rows: list[Row] = []
        gallery: list[list[Picture]] = []
        for name, make in self.scenes.items():
            lit = make()
            f = rasterize(lit.scene.meshes, lit.scene.camera, self.size[setting.size])
            points = places(f, lit.scene.camera)
            exact, _ = self._reached(lit, "sorted", points, setting)
            setting.done(f"{name} sorted")
            images = [self._picture(name, "exact", f, exact, lit)]
            own = []
            for one in self.techniques:
                reached, row = self._reached(lit, one, points, setting)
                row["scene"] = name
                off = reached - exact
                row["rmse"] = float(np.sqrt((off**2).mean()))
                for words, where in self.where.items():
                    some = where(points, exact)
                    inside = off[some] if some.any() else np.zeros(1)
                    row[f"rmse {words}"] = float(np.sqrt((inside**2).mean()))
                    row[f"light {words}"] = float(inside.mean())
                own.append(row)
                images.append(self._picture(name, one, f, reached, lit))
                setting.done(f"{name} {one}")
            self._beside(own)
            rows += own
            if self.pictures:
                gallery.append(images)
        published = () if self.published is None else tuple(self.published.columns)
        ratio = ("ratio", "paper_ratio") if self.base else ()
        columns = ("scene", "technique", *self.columns, *published, *ratio)
        return Section(self.title, self.text, columns, rows, gallery, (), self.published)

    def _reached(self, lit: Lit, name: str, points: Array, setting: Setting) -> tuple[Array, Row]:
        start = time.perf_counter()
        shadow = ShadowMap(
            list(lit.casters),
            name,
            light=lit.light,
            resolution=self.resolution[setting.size],
        )
        between = time.perf_counter()
        reached = np.asarray(shadow.transmittance(points), np.float64)
        row = Row(technique=name, bits_per_texel=shadow.bits_per_texel)
        row["first_ms"] = 1e3 * (between - start)
        row["second_ms"] = 1e3 * (time.perf_counter() - between)
        row["ms"] = row["first_ms"] + row["second_ms"]
        return reached, row

    def _beside(self, rows: Sequence[Row]) -> None:
        """Published numbers, and ratios to the base."""
        if self.published is not None:
            for row in rows:
                for column in self.published.columns:
                    row[column] = self.published.of(column, row["scene"], row["technique"])
        base = next((row for row in rows if row["technique"] == self.base), None)
        if base is None:
            return
        for row in rows:
            row["ratio"] = row["ms"] / base["ms"]
            paper, one = row.get("paper_ms"), base.get("paper_ms")
            row["paper_ratio"] = paper / one if paper is not None and one else None

    def _picture(self, name: str, label: str, f: Fragments, reached: Array, lit: Lit) -> Picture:
        """What is seen where the light comes through, composited in depth order."""
        assert f.color is not None
        shade = (AMBIENT + (1.25 - AMBIENT) * reached)[:, None]
        shaded = Fragments(
            f.offsets,
            f.depth,
            f.alpha,
            f.color * shade.astype(f.dtype),
            shape=f.shape,
            depth_range=f.depth_range,
        )
        image = composite(shaded, "sorted", background=lit.scene.background)
        return Picture(f"{name}-{label}", f"{name}, {label}", image[..., :3])


def places(f: Fragments, camera: Camera) -> Array:
    """(N, 3): where fragments are in the scene."""
    height, width = f.shape
    across, along = camera.scale((width, height))
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    x = (2 * (pixel % width) + 1 - width) / width / across
    y = (height - 1 - 2 * (pixel // width)) / height / along
    depth = f.depth.astype(np.float64)
    ray = np.stack([x * depth, y * depth, depth], axis=1)
    return np.asarray(np.array(camera.eye) + ray @ camera.axes)
