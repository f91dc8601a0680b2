"""Writes blocks.md: what states of blocks of pixels cost, and what they keep.

    python docs/blocks.py [--width 240]

FLIP and the root of the mean square of linear colours, means over the scenes without transmission
that no network was trained on, against sorted fragments.
"""

import argparse
from pathlib import Path

import numpy as np

import moit
from moit.system.files import write_text

HERE = Path(__file__).parent
SIDES = (1, 4, 8)
LEFT_OUT = "neural-training"

# What is asked of each technique: options, and those that are there with blocks alone.
FORMS: dict[str, tuple[str, str]] = {
    "as it is": ("", ""),
    "own share out": ("{own}", ""),
    "own total": ("", "total='full'"),
    "both": ("{own}", "total='full'"),
}
OWN = {
    "power4": "exclude_self=True,overestimation=0.4",
    "power6": "exclude_self=True,overestimation=0.4",
    "neural-bounded": "",  # it always is
    "wavelet16": "exclude_self=True,projected='density'",
}


def name_of(technique: str, side: int, form: str) -> str:
    """ "" where that is no form of its own."""
    own, total = FORMS[form]
    if (own and not OWN[technique]) or (total and side == 1):
        return ""
    blocks = f"resolution={side}" if side > 1 else ""
    options = [one for one in (own.format(own=OWN[technique]), blocks, total) if one]
    return f"{technique}({','.join(options)})" if options else technique


def scenes(width: int) -> list[tuple[moit.Fragments, np.ndarray]]:
    found = []
    for name in moit.scenes.names():
        f = moit.scenes.load(name, (width, width * 9 // 16))
        if f.transmission is None and name != LEFT_OUT:
            found.append((f, moit.composite(f, "sorted")[..., :3]))
    return found


def errors(name: str, among: list[tuple[moit.Fragments, np.ndarray]]) -> tuple[float, float]:
    found = []
    for f, exact in among:
        image = moit.composite(f, name)[..., :3]
        rmse = np.sqrt(np.mean((image - exact) ** 2, dtype=np.float64))
        found.append((moit.metrics.flip(image, exact), rmse))
    flip, rmse = np.mean(found, axis=0)
    return float(flip), float(rmse)


def page(width: int) -> str:
    among = scenes(width)
    lines = [
        "# States of blocks of pixels",
        "",
        f"Errors at {width} x {width * 9 // 16}, means over {len(among)} scenes: FLIP / RMSE of",
        "linear colours, and bits of a pixel. `python docs/blocks.py` makes this page.",
        "",
        "With `resolution=4` a block of 4 x 4 pixels has the state that is the mean of its",
        "pixels' own, and pixels read between the middles of blocks. *Own total*: `total='full'`,",
        "each pixel has its total absorbance beside, and what is read is scaled to it. *Own share",
        "out*: `exclude_self=True`, of moments with `overestimation=0.4`, of wavelets with",
        "`projected='density'`. Either helps little by itself where states are of blocks, and both",
        "together much.",
        "",
        "| technique | side | " + " | ".join(FORMS) + " |",
        "|---|---|" + "---|" * len(FORMS),
    ]
    for technique in OWN:
        for side in SIDES:
            cells = []
            for form in FORMS:
                name = name_of(technique, side, form)
                if not name:
                    cells.append("")
                    continue
                flip, rmse = errors(name, among)
                bits = moit.technique(name).bits_per_pixel
                cells.append(f"{flip:.4f} / {rmse:.4f}, {bits:g}")
            lines.append(f"| {technique} | {side} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--width", type=int, default=240)
    write_text(HERE / "blocks.md", page(parser.parse_args().width))
