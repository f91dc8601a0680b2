"""Writes mixed-resolution.md and its picture: what drawing some meshes small costs, and where.

    python docs/mixed_resolution.py [--width 640]

Errors are differences of linear colour (root of the mean square) from the same technique's picture
in full. A silhouette is where the nearest opaque surface, or what is drawn small, ends between two
neighbouring pixels: pixels up to four from there are near it.
"""

import argparse
import dataclasses
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import moit
from moit.catalog.blocks import UPSAMPLINGS
from moit.reports.pictures import srgb8
from moit.scenes.mesh_scenes import MeshScene
from moit.system.files import replacing, write_text

HERE = Path(__file__).parent
NEAR = 4  # pixels
STEP = 0.05  # of depth, that ends an opaque surface
FACTORS = (2, 4, 8)
AGAIN = 3  # times that a picture is timed; the least counts
# The scene, and which of its meshes are drawn small; None: all that are transparent.
CASES: dict[str, tuple[str, tuple[int, ...] | None]] = {
    "smoke": ("smoke", None),
    "grass": ("grass", None),
    "foliage": ("foliage", None),
    "smoke among grass in full": ("grass-and-smoke", (-1,)),
}
SHOWN = ("smoke", 4, (0.28, 0.52, 0.40, 0.40))  # case, factor, and left, top, width, height


@dataclasses.dataclass
class Case:
    """A scene, and what of it is small: {mesh: 1 for each that is}."""

    scene: MeshScene
    small: tuple[int, ...]

    def factors(self, side: int) -> dict[int, int]:
        return dict.fromkeys(self.small, side)


def case_of(name: str) -> Case:
    scene_name, small = CASES[name]
    scene = moit.scenes.meshes(scene_name)
    return Case(scene, tuple(range(len(scene.meshes))) if small is None else small)


def ends(values: np.ndarray) -> np.ndarray:
    """(height, width) truths: whether a pixel differs from one beside or below it."""
    found = np.zeros(values.shape, bool)
    for axis in (0, 1):
        low, high = (np.take(values, range(*ends), axis) for ends in _neighbours(values, axis))
        with np.errstate(invalid="ignore"):
            apart = ~(np.abs(low - high) <= STEP * np.minimum(low, high)) & (low != high)
        found |= np.pad(apart, [(0, 1), (0, 0)] if axis == 0 else [(0, 0), (0, 1)])
    return found


def _neighbours(values: np.ndarray, axis: int) -> tuple[tuple[int, int], tuple[int, int]]:
    count = values.shape[axis]
    return (0, count - 1), (1, count)


def widened(mask: np.ndarray, pixels: int) -> np.ndarray:
    for axis in (0, 1):
        padded = np.pad(mask, [(pixels, pixels) if axis == i else (0, 0) for i in (0, 1)])
        count = mask.shape[axis]
        mask = np.any(
            [np.take(padded, range(i, i + count), axis) for i in range(2 * pixels + 1)], axis=0
        )
    return mask


def near_silhouettes(case: Case, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Pixels near the end of an opaque surface, and near that of what is small."""
    pixels = size[0] * size[1]
    f = moit.rasterize(case.scene.meshes, case.scene.camera, size)
    owner = np.repeat(np.arange(pixels), f.counts.ravel())
    solid = f.alpha == 1
    depth = np.full(pixels, np.inf)
    np.minimum.at(depth, owner[solid], f.depth[solid].astype(float))
    some = [case.scene.meshes[i] for i in case.small]
    covered = np.zeros(pixels)
    covers = moit.rasterize(some, case.scene.camera, size)
    owner = np.repeat(np.arange(pixels), covers.counts.ravel())
    seen = (covers.alpha != 1) & (covers.depth <= depth[owner])
    covered[owner[seen]] = 1
    shape = size[::-1]
    return tuple(widened(ends(of.reshape(shape)), NEAR) for of in (depth, covered))


def rmse(apart: np.ndarray, where: np.ndarray) -> str:
    return f"{np.sqrt(np.mean(apart[where] ** 2)):.4f}" if where.any() else "-"


def timed(case: Case, technique: str, size: tuple[int, int], device: object, **options: object):
    """The picture, and the least seconds of AGAIN."""
    reports = [
        moit.render(case.scene, technique, size, device=device, report=True, **options)
        for _ in range(AGAIN)
    ]
    return reports[0].image, min(report.seconds for report in reports)


def table(name: str, size: tuple[int, int], device: object) -> list[str]:
    case = case_of(name)
    opaque, small = near_silhouettes(case, size)
    places = (opaque, small & ~opaque, ~(small | opaque), np.ones_like(opaque))
    shares = ", ".join(
        f"{100 * place.mean():.0f} % {words}"
        for place, words in zip(
            places,
            ("near an opaque silhouette", "near an end of what is small alone", "elsewhere"),
            strict=False,
        )
    )
    lines = [
        f"## {name[0].upper()}{name[1:]}",
        "",
        f"Of the pixels are {shares}.",
        "",
        "| technique | side | upsampling | near opaque | near small | elsewhere | all "
        + ("| time, core | time, passes |" if device else "| time, core |"),
        "|---|---|---|---|---|---|---|---|" + ("---|" if device else ""),
    ]
    for technique in ("wboit", "moment-transparency"):
        full, seconds = timed(case, technique, size, "cpu")
        drawn = timed(case, technique, size, device)[1] if device else 1.0
        for side in FACTORS:
            for upsampling in UPSAMPLINGS:
                chosen, options = technique, {}
                if technique == "wboit":
                    options = {"resolution": case.factors(side), "upsampling": upsampling}
                elif upsampling == "bilinear":  # of all moments, whatever mesh they are of
                    chosen = f"{technique}(resolution={side})"
                else:
                    continue
                image, took = timed(case, chosen, size, "cpu", **options)
                apart = (image - full)[..., :3].astype(float)
                errors = " | ".join(rmse(apart, place) for place in places)
                line = (
                    f"| `{technique}` | {side} | {upsampling} | {errors} | {took / seconds:.2f} |"
                )
                if device:
                    line += f" {timed(case, chosen, size, device, **options)[1] / drawn:.2f} |"
                lines.append(line)
    return [*lines, ""]


def picture(size: tuple[int, int]) -> None:
    name, side, (left, top, wide, high) = SHOWN
    case = case_of(name)
    full = moit.render(case.scene, "wboit", size)
    shown = {"in full": full}
    for upsampling in UPSAMPLINGS:
        options = {"resolution": case.factors(side), "upsampling": upsampling}
        shown[f"side {side}, {upsampling}"] = moit.render(case.scene, "wboit", size, **options)
    x, y = int(left * size[0]), int(top * size[1])
    part = (slice(y, y + int(high * size[1])), slice(x, x + int(wide * size[0])))
    figure, axes = plt.subplots(2, 3, figsize=(12, 5.0), dpi=80, layout="constrained")
    for column, (title, image) in zip(axes.T, shown.items(), strict=True):
        apart = np.abs(image - full)[..., :3].max(axis=2)
        column[0].imshow(srgb8(image[part]), interpolation="nearest")
        column[0].set_title(title)
        column[1].imshow(apart[part], cmap="magma", vmin=0, vmax=0.3, interpolation="nearest")
        for ax in column:
            ax.set(xticks=[], yticks=[])
    axes[1, 0].set_ylabel("difference, 0 to 0.3")
    with replacing(HERE / "mixed-resolution.png") as part:
        figure.savefig(part)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--width", type=int, default=640)
    width = parser.parse_args().width
    size = (width, width * 9 // 16)
    try:
        device = moit.gpu.Device()
    except moit.GpuError:
        device = None
    lines = [
        "# Some meshes drawn small",
        "",
        f"Made by `python docs/mixed_resolution.py`: {size[0]} x {size[1]} pixels. Errors are RMSE "
        "of linear colour, against the same technique in full; times are shares of what that "
        f"takes, by the core{f' and by passes on {device.renderer}' if device else ''}, and hang "
        f"on the machine. Near: up to {NEAR} pixels from a silhouette.",
        "",
        "`wboit` draws meshes small (`moit.render(..., resolution=)`) and reads their targets "
        "between squares; `moment-transparency` captures moments of all meshes small (its own "
        "`resolution`) and shades in full.",
        "",
        "Smoke may be small: it has no edges of its own. Where it meets a chimney's edge, reading "
        "it depth-aware takes away most of what bilinear reading costs at side 2, half at 4 and "
        "nothing at 8, where chimneys are few squares wide. Blades and leaves are thinner than "
        "squares and lose their edges under any reading; among them depth-aware reading costs more "
        "than it gains from side 4 on, as squares have one surface each. Moments, which are of "
        "light's way and not of colour, can be smaller.",
        "",
        "![Smoke in full and small](mixed-resolution.png)",
        "",
    ]
    for name in CASES:
        lines += table(name, size, device)
    write_text(HERE / "mixed-resolution.md", "\n".join(lines).rstrip() + "\n")
    picture(size)


if __name__ == "__main__":
    main()
