"""Draws README's pictures, overview.png and meshes.png: `python docs/overview.py`."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import moit
from moit.reports.pictures import srgb8
from moit.system.files import replacing

Row = tuple[moit.Fragments, tuple[float, ...]]  # and what is behind

BACKGROUND = (0.05, 0.055, 0.07)
# Rows and columns of overview.png, and of meshes.png.
SCENES, TECHNIQUES, SIZE = (
    ("panes", "spheres", "cloud"),
    ("sorted", "wboit", "power4", "power6", "trig3", "mlab4"),
    (360, 270),
)
MESHES, MESH_TECHNIQUES, MESH_SIZE = (
    ("teapots", "foliage", "ship-like"),
    ("sorted", "wboit", "power6", "trig3"),
    (640, 360),
)


def draw(name: str, rows: dict[str, Row], techniques: tuple[str, ...], height: float) -> None:
    """A picture of each technique beside the exact one, and how far it is from that."""
    figure, axes = plt.subplots(len(rows), len(techniques), figsize=(12.5, height), dpi=80)
    for place, (row, (scene, (fragments, background))) in enumerate(
        zip(axes, rows.items(), strict=True)
    ):
        exact = moit.composite(fragments, "sorted", background=background)
        for ax, technique in zip(row, techniques, strict=True):
            image = moit.composite(fragments, technique, background=background)
            ax.imshow(srgb8(image))
            ax.set(xticks=[], yticks=[])
            ax.spines[:].set_visible(False)
            if ax is row[0]:
                ax.set_ylabel(scene, fontsize=12)
            error = moit.metrics.flip(image, exact)
            note = "exact" if technique == "sorted" else f"FLIP {error:.3f}"
            ax.set_xlabel(note, fontsize=11, labelpad=3)
            if place == 0:
                bits = moit.technique(technique).bits_per_pixel
                ax.set_title(
                    technique if bits is None else f"{technique}, {bits:g} bits", fontsize=12
                )
    figure.subplots_adjust(
        left=0.025, right=0.995, top=0.955, bottom=0.045, wspace=0.02, hspace=0.12
    )
    with replacing(Path(__file__).with_name(name)) as part:
        figure.savefig(part)


def of_triangles(name: str) -> Row:
    scene = moit.scenes.meshes(name)
    return moit.rasterize(scene.meshes, scene.camera, MESH_SIZE), scene.background


def main() -> None:
    scenes = {name: (moit.scenes.load(name, SIZE), BACKGROUND) for name in SCENES}
    draw("overview.png", scenes, TECHNIQUES, 5.5)
    draw("meshes.png", {name: of_triangles(name) for name in MESHES}, MESH_TECHNIQUES, 6.2)


if __name__ == "__main__":
    main()
