"""What moit.deep.simplify leaves of deep images: writes docs/deep.md.

    python docs/deep.py [FILE.exr ...]

moit's scenes are written as deep files of half floats, as renderers write them; files that are
named are taken as they are.
"""

import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from deep_rivals import Rays

import moit
from moit.deep.simplifying import USUAL_ERROR
from moit.formats.deep_output import deep_output
from moit.formats.deep_rows import DeepRows, offsets_of

SCENES = ("hair", "smoke", "mixed", "foliage", "cloud", "panes")
SIZE = (480, 270)
PAGE = Path(__file__).with_name("deep.md")
MARK = "<!-- what docs/deep.py measured -->\n"


KINDS = ("zstd", "zips")


def needed_depths(source: str, path: str, compression: str) -> int:
    """Writes a file of surfaces' depths alone, of those that any file has to have to the bit: what
    is seen changes there by more than twice the error. Returns how many there are."""
    rays = Rays(source)
    i = np.arange(len(rays.z)) + rays.pixel
    step = np.abs(rays.states[:, i + 1] - rays.states[:, i])
    last = rays.states[1:, rays.offsets[1:] + np.arange(len(rays.offsets) - 1)]
    step[1:] /= np.maximum(1, last.max(axis=0))[rays.pixel]
    needed = (step > 2 * USUAL_ERROR).any(axis=0)
    offsets = offsets_of(np.bincount(rays.pixel[needed], minlength=len(rays.offsets) - 1))
    kind = rays.types["Z"]
    with deep_output(path, rays.place, {"Z": kind}, compression) as out:
        out.put(DeepRows(rays.shape, rays.origin, offsets, {"Z": rays.z[needed].astype(kind)}))
    return int(offsets[-1])


def sizes_of(source: str, folder: str) -> tuple[dict[str, int], str]:
    """The bytes of the lossless file of each compression, and a row of the table of depths."""
    path, size, shares = os.path.join(folder, "whole.exr"), {}, []
    for kind in KINDS:
        moit.deep.merge([source], path, compression=kind)
        size[kind] = os.path.getsize(path)
        needed = needed_depths(source, path, kind)
        shares.append(f"{os.path.getsize(path) / size[kind]:.2f}")
    return size, f"{needed:,} | {' | '.join(shares)} |"


def rows_of(name: str, source: str, folder: str, size: dict[str, int]) -> list[str]:
    """A row of the table for each way to simplify."""
    path = {key: os.path.join(folder, f"{key}.exr") for key in ("less", "less_zips")}
    found = []
    for depth_error in (0.0, 1e-4, 1e-3):
        told = moit.deep.simplify(source, path["less"], depth_error=depth_error)
        moit.deep.merge([path["less"]], path["less_zips"], compression="zips")
        shares = [
            os.path.getsize(path[less]) / size[kind]
            for less, kind in (("less", "zstd"), ("less_zips", "zips"))
        ]
        each = told.samples_before / max(1, told.samples_after)
        found.append(
            f"| {name} | {depth_error:g} | {told.samples_before:,} | {each:.2f} | "
            f"{size['zstd'] / 1e6:.2f} | {shares[0]:.2f} | {shares[1]:.2f} | "
            f"{told.transmittance_error:.5f} | {told.light_error:.5f} |"
        )
    return found


def main() -> None:
    rows, depths = [], []
    with tempfile.TemporaryDirectory() as folder:
        sources = dict.fromkeys(SCENES, os.path.join(folder, "scene.exr"))
        for name, source in (sources | {Path(file).stem: file for file in sys.argv[1:]}).items():
            if name in SCENES:
                moit.write_deep(source, moit.scenes.load(name, SIZE), half=True)
            size, needed = sizes_of(source, folder)
            depths.append(f"| {name} | {needed}")
            rows += rows_of(name, source, folder, size)
    lines = [
        f"At an error of 1/255 = {USUAL_ERROR:.5f}. *Fewer* is how many samples become one; *zstd* "
        "and *zips* are the size of the simplified file by that of the lossless one, both in that "
        "compression; the last two columns are the certificate.",
        "",
        "| image | depth_error | samples | fewer | lossless zstd, MB | zstd | zips | T | C |",
        "|---|---|---|---|---|---|---|---|---|",
        *rows,
        "",
        "What a file of those depths alone, which any file has that is within the error, would be "
        "of the lossless one, without a colour or an alpha:",
        "",
        "| image | depths | zstd | zips |",
        "|---|---|---|---|",
        *depths,
    ]
    start = PAGE.read_text(encoding="utf-8").partition(MARK)[0]
    PAGE.write_text("\n".join([start + MARK, *lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
