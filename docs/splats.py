"""Writes splats.md and its picture: what splats cost, and which of them pop where a camera turns.

    python docs/splats.py [--count 1000000] [--width 1280] [--threads 2] [--again 1] [--pairs 4]

Times are the least of `again`. Memory is the greatest that the process held while the picture was
made, less what it held before: Linux tells it.
"""

import argparse
import dataclasses
import math
import re
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import moit
from moit.reports.pictures import srgb8
from moit.scenes.splat_scenes import SplatScene
from moit.system.files import replacing, write_text

HERE = Path(__file__).parent
SCENE = "pot-splats"
MEBIBYTE = 1 << 20


def linear(depth, alpha, color):
    """Hou et al., "Sort-free Gaussian Splatting via Weighted Sum Rendering", 2025: max(0, 1 - depth
    / 10), with what it starts its training from, and nothing trained for single splats."""
    return np.maximum(0.0, 1.0 - depth / 10.0)


TECHNIQUES = (
    "sorted",
    "power4",
    "wboit",
    moit.WeightedBlended(weight=linear),
    "mlab4",
    "hybrid4",
    "adaptive8(merge='energy')",
)
SHOWN = ("sorted", "power4", "mlab4")

# Popping: pairs of pictures round the scene, so little apart that what moves smoothly changes less
# than JUMP of what a screen shows, which is also what of a splat's rim is cut off.
TURN = math.radians(0.002)
JUMP = 4 / 255
POPPING_COUNT, POPPING_SIZE = 50_000, (640, 360)


def name_of(technique) -> str:
    return "wboit, linear weight" if isinstance(technique, moit.Technique) else f"{technique}"


def held(name: str) -> int:
    """Bytes, by the system's account: VmRSS now, VmHWM at most."""
    status = Path("/proc/self/status").read_text()
    return 1024 * int(re.search(rf"{name}:\s+(\d+)", status)[1])


def forget_the_most() -> None:
    Path("/proc/self/clear_refs").write_text("5")


def cost(scene: SplatScene, technique, size: tuple[int, int], threads: int, again: int) -> str:
    """A row of the table."""
    found = []
    for _ in range(again):
        forget_the_most()
        before = held("VmRSS")
        made = moit.render(
            scene.splats,
            technique,
            size,
            camera=scene.camera,
            background=scene.background,
            threads=threads,
            progress=False,
            report=True,
        )
        found.append((made.seconds, made.timings, held("VmHWM") - before))
    seconds, timings, memory = min(found, key=lambda one: one[0])
    drawn, blended = timings["rasterize"], timings["composite"]
    return (
        f"| `{name_of(technique)}` | {drawn:.2f} | {blended:.2f} | {seconds:.2f} | "
        f"{memory / MEBIBYTE:.0f} |"
    )


def whole(scene: SplatScene, size: tuple[int, int], threads: int) -> tuple[int, int]:
    """Fragments of the picture, and bytes where all are held at once."""
    forget_the_most()
    before = held("VmRSS")
    f = moit.rasterize(scene.splats, scene.camera, size, threads=threads, progress=False)
    moit.composite(f, "sorted", threads=threads)
    return len(f), held("VmHWM") - before


def turned(camera: moit.Camera, angle: float) -> moit.Camera:
    """Round its target, about the vertical."""
    x, y, z = np.subtract(camera.eye, camera.target)
    c, s = math.cos(angle), math.sin(angle)
    eye = np.add(camera.target, (c * x + s * z, y, c * z - s * x))
    return dataclasses.replace(camera, eye=tuple(map(float, eye)))


def shown(scene: SplatScene, splats: moit.Splats, technique, angle: float) -> np.ndarray:
    """As a screen shows it, not rounded: these colours are the ones that screens are given."""
    image = moit.render(
        splats,
        technique,
        POPPING_SIZE,
        camera=turned(scene.camera, angle),
        background=scene.background,
        progress=False,
    )
    return np.clip(image[..., :3].astype(float), 0, 1)


@dataclasses.dataclass
class Popping:
    """share : of pixels that jump in a turn, on average; greatest : change of a pixel's channel;
    map : (height, width) each pixel's greatest over all turns."""

    share: float
    greatest: float
    map: np.ndarray

    @classmethod
    def of(cls, scene: SplatScene, convention: str, technique, pairs: int) -> "Popping":
        splats = scene.splats.seen_by(convention)
        changes = []
        for i in range(pairs):
            angle = 2 * math.pi * i / pairs
            pair = [shown(scene, splats, technique, angle + by) for by in (0.0, TURN)]
            changes.append(np.abs(pair[1] - pair[0]).max(axis=2))
        array = np.array(changes)
        return cls(float((array > JUMP).mean()), float(array.max()), array.max(axis=0))


def picture(scene: SplatScene, found: dict[tuple[str, str], Popping]) -> None:
    figure, axes = plt.subplots(2, 4, figsize=(14, 4.4), dpi=80, layout="constrained")
    for row, convention in zip(axes, ("3dgs", "exact"), strict=True):
        image = shown(scene, scene.splats.seen_by(convention), "sorted", 0.0)
        row[0].imshow(srgb8(image))
        row[0].set_ylabel(f'"{convention}"')
        for ax, technique in zip(row[1:], SHOWN, strict=True):
            of_all = found[convention, technique].map
            drawn = ax.imshow(of_all, cmap="magma", vmin=0, vmax=0.1, interpolation="nearest")
            ax.set_title(technique)
    axes[0, 0].set_title("sorted")
    for ax in axes.flat:
        ax.set(xticks=[], yticks=[])
    figure.colorbar(drawn, ax=axes, label="greatest change", shrink=0.8)
    with replacing(HERE / "splats.png") as part:
        figure.savefig(part)


def popping_lines(pairs: int) -> list[str]:
    scene = moit.scenes.splats(SCENE, POPPING_COUNT)
    found = {
        (convention, name_of(technique)): Popping.of(scene, convention, technique, pairs)
        for technique in TECHNIQUES
        for convention in ("3dgs", "exact")
    }
    picture(scene, found)
    lines = [
        "## Popping",
        "",
        f"{POPPING_COUNT:,} splats at {POPPING_SIZE[0]} x {POPPING_SIZE[1]}; {pairs} pairs of "
        f"pictures round the scene, {math.degrees(TURN):g} degrees apart: nothing moves by more "
        "than a hundredth of a pixel, so a pixel that changes visibly has jumped. Pixels of a "
        f"million in which a channel changes by more than {JUMP * 255:.0f}/255, and the greatest "
        "change of any.",
        "",
        '| technique | jumps, "3dgs" | greatest | jumps, "exact" | greatest |',
        "|---|---|---|---|---|",
    ]
    for technique in map(name_of, TECHNIQUES):
        both = [found[convention, technique] for convention in ("3dgs", "exact")]
        cells = " | ".join(f"{1e6 * one.share:.1f} | {one.greatest:.3f}" for one in both)
        lines.append(f"| `{technique}` | {cells} |")
    return [*lines, "", "![Where pixels jump](splats.png)", ""]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--again", type=int, default=1)
    parser.add_argument("--pairs", type=int, default=4)
    given = parser.parse_args()
    size = (given.width, given.width * 9 // 16)
    scene = moit.scenes.splats(SCENE, given.count)
    rows = [cost(scene, technique, size, given.threads, given.again) for technique in TECHNIQUES]
    fragments, memory = whole(scene, size, given.threads)
    lines = [
        "# Gaussian splats",
        "",
        f"Made by `python docs/splats.py`: `moit.scenes.splats({SCENE!r})`, seen as the reference "
        'rasteriser has it ("3dgs").',
        "",
        "## Time and memory",
        "",
        f"{given.count:,} splats at {size[0]} x {size[1]}: {fragments:,} fragments, on "
        f"{given.threads} threads, in seconds that hang on the machine. `moit.render` draws and "
        "composites a band of rows at a time, for techniques whose pixels do not hang on one "
        f"another; `moit.rasterize` and `moit.composite` hold all fragments at once, "
        f"{memory / MEBIBYTE:.0f} MiB.",
        "",
        "| technique | rasterising | compositing | seconds | MiB |",
        "|---|---|---|---|---|",
        *rows,
        "",
        *popping_lines(given.pairs),
    ]
    write_text(HERE / "splats.md", "\n".join(lines))


if __name__ == "__main__":
    main()
