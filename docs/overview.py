"""Draws overview.png, the picture at the head of README: `python docs/overview.py`."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import moit
from moit.pictures import srgb8

SCENES = ("panes", "spheres", "cloud")
TECHNIQUES = ("sorted", "wboit", "power4", "power6", "trig3", "mlab4")
SIZE = (360, 270)
BACKGROUND = (0.05, 0.055, 0.07)


def main() -> None:
    figure, axes = plt.subplots(len(SCENES), len(TECHNIQUES), figsize=(12.5, 5.5), dpi=80)
    for place, (row, scene) in enumerate(zip(axes, SCENES, strict=True)):
        fragments = moit.scenes.load(scene, SIZE)
        exact = moit.composite(fragments, "sorted", background=BACKGROUND)
        for ax, technique in zip(row, TECHNIQUES, strict=True):
            image = moit.composite(fragments, technique, background=BACKGROUND)
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
    figure.savefig(Path(__file__).with_name("overview.png"))


if __name__ == "__main__":
    main()
