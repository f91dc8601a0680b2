"""Reports for tests: of all techniques, and of rows that are given."""

from small import some_fragments

import moit
from moit.comparing.report import Report
from moit.comparing.rows import Result, Row

NASTY = "<script>alert('1 & 2')</script>\"x"


def failing(depth, alpha, color):
    raise RuntimeError(NASTY)


def of_everything():
    """Of all techniques and one that fails, on two scenes."""
    scenes = {"one": some_fragments(), NASTY: some_fragments(20, 16, seed=2)}
    techniques = [*moit.techniques(), moit.WeightedBlended(failing)]
    return moit.compare(scenes, techniques, repeat=1, progress=False)


def made(rows):
    """A report of rows given as (scene, technique, seconds, bits, flip)."""
    names = ("scene", "technique", "seconds", "bits_per_pixel", "flip")
    filled = [
        Row(dict(zip(names, row, strict=True)), device="cpu", note="", seconds_iqr=0.0, psnr=1.0)
        for row in rows
    ]
    return Report([Result(row) for row in filled], metrics=("flip", "psnr"))
