"""What moit.deep.simplify leaves of deep images: writes docs/deep.md.

    python docs/deep.py [FILE.exr ...]

moit's scenes are written as deep files of half floats, as renderers write them; files that are
named are taken as they are.
"""

import os
import sys
import tempfile
from pathlib import Path

import moit
from moit.deep.simplifying import USUAL_ERROR

SCENES = ("hair", "smoke", "mixed", "foliage", "cloud", "panes")
SIZE = (480, 270)
PAGE = Path(__file__).with_name("deep.md")
MARK = "<!-- what docs/deep.py measured -->\n"


def rows_of(name: str, source: str, folder: str) -> list[str]:
    """A row of the table for each way to simplify."""
    path = {
        key: os.path.join(folder, f"{key}.exr") for key in ("zstd", "zips", "less", "less_zips")
    }
    for kind in ("zstd", "zips"):
        moit.deep.merge([source], path[kind], compression=kind)
    size = {kind: os.path.getsize(path[kind]) for kind in ("zstd", "zips")}
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
    lines = [
        f"At an error of 1/255 = {USUAL_ERROR:.5f}. *Fewer* is how many samples become one; *zstd* "
        "and *zips* are the size of the simplified file by that of the lossless one, both in that "
        "compression; the last two columns are the certificate.",
        "",
        "| image | depth_error | samples | fewer | lossless zstd, MB | zstd | zips | T | C |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for scene in SCENES:
            source = os.path.join(folder, "scene.exr")
            moit.write_deep(source, moit.scenes.load(scene, SIZE), half=True)
            lines += rows_of(scene, source, folder)
        for file in sys.argv[1:]:
            lines += rows_of(Path(file).stem, file, folder)
    start = PAGE.read_text(encoding="utf-8").partition(MARK)[0]
    PAGE.write_text("\n".join([start + MARK, *lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
