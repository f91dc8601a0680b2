"""Techniques on scenes, as pictures, errors and times: the part that most figures are made of."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from moit import moments, scenes
from moit.catalog import MomentTechnique, Technique, technique
from moit.comparing.comparison import compare
from moit.comparing.error_maps import error_maps, map_range
from moit.comparing.report import Report
from moit.comparing.rows import Result, Row, Scene
from moit.experiments.description import PICTURE, Array, Published, Section, Setting
from moit.fragments.fragments import Fragments
from moit.geometry.meshes import Mesh, altered
from moit.questions import composite, transmittance
from moit.rendering.rasterizing import rasterize
from moit.reports.blocks import Picture
from moit.scenes.mesh_scenes import MESH_SCENES

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
REPEATS = {"tiny": 1, "small": 5, "full": 5}

# Which pixels of a picture are meant: (H, W) of fragments.
Region = Callable[[Fragments], NDArray[np.bool_]]
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Timing:
    """What times are put in ratio to.

    base : the technique whose time is 1. column : of which column the ratio is taken.
    blend : what a differential time has subtracted, as MBOIT's table 1.
    """

    base: str
    column: str = "ms"
    blend: str = "unsorted"


@dataclass(frozen=True)
class Comparison:
    """Techniques on scenes.

    columns : shown; beside those of `moit.compare` "coverage" (the greatest error of what is
        covered), "outside" (how far colours go beyond those of the pixel's fragments and its
        background), "shuffle" (the greatest change by another order of arrival), "bytes" (as
        the paper `bytes_of` counts), "rmse NAME" and "light NAME" (mean error of luminance: above 0
        too bright) of each of `regions`, with `front` "front" (how much more than it should the
        nearest fragment of a pixel is seen, on the mean, where there are two or more) and
        "front NAME", with `timing` "first_ms", "second_ms", "ms", "diff_ms", "ratio", and what
        `published` has.
    background : behind everything; None: the scene's own.
    alphas : by scene, what the opacity of each transparent mesh is scaled to, at its greatest; of
        scenes of formulas, that of all fragments that are not opaque.
    shown : whose pictures are shown; None: all. crop : what part of them: left, top, right and
        bottom as shares.
    """

    title: str
    text: str
    scenes: Sequence[str]
    techniques: Sequence[str]
    columns: tuple[str, ...] = ("bits_per_pixel", "flip", "ssim", "rmse", "T_mae", "T_p99")
    shown: Sequence[str] | None = None
    crop: tuple[float, float, float, float] = (0, 0, 1, 1)
    regions: Mapping[str, Region] = field(default_factory=dict)
    front: bool = False
    bytes_of: str | None = None
    timing: Timing | None = None
    published: Published | None = None
    background: Colour | None = None
    alphas: Mapping[str, float] = field(default_factory=dict)
    size: Mapping[str, tuple[int, int]] = field(default_factory=lambda: PICTURE)

    def steps(self) -> int:
        return len(self.scenes) * (len(self.techniques) + 1)

    def run(self, setting: Setting) -> Section:
        rows: list[Row] = []
        gallery: list[list[Picture]] = []
        for name in self.scenes:
            f, background = drawn(name, self.size[setting.size], self.alphas.get(name))
            background = self.background or background
            report = compare(
                {name: f},
                list(self.techniques),
                devices=setting.device,
                metrics=("flip", "ssim", "psnr", "rmse"),
                repeat=REPEATS[setting.size] if self.timing else 1,
                background=background,
                progress=lambda done, _, label: setting.done(label) if done else None,
                out=setting.folder,
            )
            for result in report.results:
                self._more(result, report.scenes[name], f, background)
            if self.timing:
                _add_times(self.timing, report, name, f, setting)
            self._add_published(report.rows)
            rows += report.rows
            gallery += self._pictures(report, name)
        return Section(self.title, self.text, self._columns(), rows, gallery, (), self.published)

    def _columns(self) -> tuple[str, ...]:
        published = () if self.published is None else tuple(self.published.columns)
        ratio: tuple[str, ...] = ()
        if self.timing and self.published and f"paper_{self.timing.column}" in published:
            ratio = ("paper_ratio",)
        return ("scene", "technique", *self.columns, *published, *ratio)

    def _more(self, result: Result, scene: Scene, f: Fragments, background: Colour) -> None:
        row, image = result.row, result.image
        masks = {name: region(f) for name, region in self.regions.items()}
        if image is not None and scene.reference is not None:
            off = (image - scene.reference)[..., :3]
            row["coverage"] = float(np.abs(image - scene.reference)[..., 3].max())
            row["outside"] = outside(f, image, background)
            if "shuffle" in self.columns:
                other = composite(f.shuffled(1), row["technique"], background=background)
                row["shuffle"] = float(np.abs(other - image).max())
            for name, mask in masks.items():
                inside = off[mask] if mask.any() else np.zeros((1, 3))
                row[f"rmse {name}"] = float(np.sqrt((inside**2).mean()))
                row[f"light {name}"] = float((inside @ LUMINANCE).mean())
        if self.bytes_of is not None:
            bits = technique(row["technique"]).published_bits.get(self.bytes_of)
            row["bytes"] = None if bits is None else bits / 8
        if self.front:
            errors = front_errors(f, row["technique"])
            row["front"] = _mean(errors)
            for name, mask in masks.items():
                row[f"front {name}"] = None if errors is None else _mean(errors[mask])

    def _add_published(self, rows: Sequence[Row]) -> None:
        if self.published is None:
            return
        for row in rows:
            for column in self.published.columns:
                row[column] = self.published.of(column, row["scene"], row["technique"])
        if self.timing and f"paper_{self.timing.column}" in self.published.columns:
            column = f"paper_{self.timing.column}"
            base = next((r[column] for r in rows if r["technique"] == self.timing.base), None)
            for row in rows:
                known = row[column] is not None and base
                row["paper_ratio"] = row[column] / base if known else None

    def _pictures(self, report: Report, name: str) -> list[list[Picture]]:
        shown = self.techniques if self.shown is None else self.shown
        results = [
            one
            for one in report.of_scene(name)
            if one.row["technique"] in shown and one.image is not None
        ]
        reference = report.scenes[name].reference
        if reference is None or not results:
            return []
        maps, what = error_maps(reference, results)
        most = map_range(maps)
        images = [Picture(f"{name}-exact", f"{name}, exact", self._cropped(reference))]
        errors: list[Picture] = []
        for result, errors_of in zip(results, maps, strict=True):
            label = result.row["technique"]
            flip = result.row.get("flip")
            note = "" if flip is None else f", FLIP {flip:.3f}"
            assert result.image is not None
            image = self._cropped(result.image)
            images.append(Picture(f"{name}-{label}", f"{label}{note}", image))
            caption = f"{label}: {what} 0 to {most:g}".replace("::", ":")
            scaled = np.clip(errors_of / most, 0, 1)
            errors.append(Picture(f"{name}-{label}-error", caption, self._cropped(scaled)))
        return [images, errors]

    def _cropped(self, image: Array) -> Array:
        left, top, right, bottom = self.crop
        height, width = image.shape[:2]
        rows = slice(round(top * height), max(round(bottom * height), 1))
        columns = slice(round(left * width), max(round(right * width), 1))
        return image[rows, columns] if image.ndim == 2 else image[rows, columns, :3]


def drawn(name: str, size: tuple[int, int], alpha: float | None = None) -> tuple[Fragments, Colour]:
    """A scene's fragments and what is behind them.

    alpha : what the opacity of each transparent mesh is scaled to, at its greatest.
    """
    if name not in MESH_SCENES:
        f = scenes.load(name, size)
        return (f if alpha is None else _scaled(f, alpha)), (0.0, 0.0, 0.0)
    scene = scenes.meshes(name)
    red, green, blue = (float(one) for one in scene.background)
    meshes = scene.meshes if alpha is None else [_of_alpha(one, alpha) for one in scene.meshes]
    return rasterize(meshes, scene.camera, size), (red, green, blue)


def _scaled(f: Fragments, alpha: float) -> Fragments:
    clear = f.alpha < 1
    scaled = np.where(clear, f.alpha * (alpha / f.alpha[clear].max(initial=1e-30)), 1)
    return Fragments(
        f.offsets,
        f.depth,
        scaled.astype(f.dtype),
        f.color,
        shape=f.shape,
        depth_range=f.depth_range,
    )


def _of_alpha(mesh: Mesh, alpha: float) -> Mesh:
    if not mesh.transparent.any():
        return mesh
    scaled = mesh.alpha * np.float32(alpha / mesh.alpha.max())
    return altered(mesh, alpha=scaled)


def _mean(errors: Array | None) -> float | None:
    """Of those that are known."""
    if errors is None or not np.isfinite(errors).any():
        return None
    return float(np.nanmean(errors))


def front_errors(f: Fragments, name: str | Technique) -> Array | None:
    """(H, W): how much more than it should a pixel's nearest fragment is seen: its share of the
    picture less its exact one; NaN where there are fewer than two. None where the technique gives
    no shares."""
    try:
        held = shares(f, name)
    except (ValueError, TypeError):
        return None
    filled = f.counts > 0
    begin = f.offsets[:-1][filled]
    first = _filled(np.minimum.reduceat(f.depth, begin), f.counts) if len(f) else 0.0
    off = np.where(np.repeat(first, f.counts) == f.depth, held - shares(f, "sorted"), 0.0)
    found = _filled(np.add.reduceat(off, begin), f.counts) if len(f) else np.zeros(len(f.counts))
    return np.where(f.counts > 1, found, np.nan).reshape(f.shape)


def outside(f: Fragments, image: Array, background: Colour) -> float:
    """How far a picture's colours go at most beyond those of its fragments and background."""
    assert f.color is not None
    least = np.tile(np.asarray(background, np.float32), (len(f.counts), 1))
    most = least.copy()
    if len(f):
        begin, filled = f.offsets[:-1][f.counts > 0], f.counts > 0
        least[filled] = np.minimum(least[filled], np.minimum.reduceat(f.color, begin))
        most[filled] = np.maximum(most[filled], np.maximum.reduceat(f.color, begin))
    seen = image[..., :3].reshape(-1, 3)
    return float(np.maximum(least - seen, seen - most).max(initial=0.0))


def shares(f: Fragments, name: str | Technique) -> Array:
    """(N,) what share of its pixel each fragment's colour has: alpha T, scaled as the picture is
    where the technique normalises."""
    chosen = technique(name)
    weight = f.alpha * transmittance(f, chosen).astype(np.float64)
    if not getattr(chosen, "normalize", False) or not len(f):
        return np.asarray(weight)
    filled = f.counts > 0
    begin = f.offsets[:-1][filled]
    covered = 1 - np.multiply.reduceat(1 - f.alpha.astype(np.float64), begin)
    total = np.add.reduceat(weight, begin)
    scale = np.divide(covered, total, out=np.ones_like(total), where=total > 0)
    return np.asarray(weight * np.repeat(_filled(scale, f.counts), f.counts))


def _filled(values: Array, counts: Array) -> Array:
    """(P,) of values of the pixels that are not empty; 0 in the others."""
    found = np.zeros(len(counts))
    found[counts > 0] = values
    return found


def _add_times(timing: Timing, report: Report, name: str, f: Fragments, setting: Setting) -> None:
    """Milliseconds of the passes of each technique, and ratios."""
    found = (
        _gpu_times(report, name, setting)
        if setting.device == "gpu" and name in MESH_SCENES
        else _cpu_times(report, f, REPEATS[setting.size])
    )
    blend = found.get(timing.blend)
    for row in report.rows:
        first, second = found.get(row["technique"], (None, None))
        row["first_ms"] = first
        row["second_ms"] = second
        row["ms"] = None if second is None else second + (first or 0.0)
        row["diff_ms"] = None
        if row["ms"] is not None and blend is not None and blend[1] is not None:
            row["diff_ms"] = row["ms"] - blend[1] - (blend[0] or 0.0)
    base = next((r[timing.column] for r in report.rows if r["technique"] == timing.base), None)
    for row in report.rows:
        known = row[timing.column] is not None and base
        row["ratio"] = row[timing.column] / base if known else None


Passes = dict[str, tuple[float | None, float | None]]


def _cpu_times(report: Report, f: Fragments, repeat: int) -> Passes:
    """The first pass is what `moments.gather` takes; the second what the picture takes beyond."""
    found: Passes = {}
    for row in report.rows:
        if row["seconds"] is None:
            continue
        first = None
        chosen = technique(row["technique"])
        if isinstance(chosen, MomentTechnique):
            spent = []
            for _ in range(repeat):
                start = time.perf_counter()
                moments.gather(f, chosen)
                spent.append(time.perf_counter() - start)
            first = 1e3 * min(float(np.median(spent)), row["seconds"])
        found[row["technique"]] = first, 1e3 * row["seconds"] - (first or 0.0)
    return found


def _gpu_times(report: Report, name: str, setting: Setting) -> Passes:
    """Of the passes that draw the triangles."""
    from moit.benching.passes import raster_times
    from moit.gpu import default_device

    names = [row["technique"] for row in report.rows]
    size = next(iter(report.scenes.values())).shape[::-1]
    times = raster_times(default_device(), name, size, names, REPEATS[setting.size], progress=False)
    return {one.technique: (one.first, one.second) for one in times}
