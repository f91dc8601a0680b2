"""Why kits that atomics gather for are as far from the core as they are: python tests/kit_causes.py

Of front2 what one unit in the last place of its sums does, of strong5 what one of a depth does to
the core itself, of anchors4 which fragments a word of depth ranks otherwise, of neural-slices8
which a word rounds otherwise.
"""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from readings import kit_cases, kit_programs, kits  # noqa: E402
from readings.kit_blocks import Picture  # noqa: E402

import moit  # noqa: E402

RANDOM = np.random.default_rng(5)


def said(what: str, error: np.ndarray) -> None:
    print(f"{what}: 99.9 % within {np.quantile(error, 0.999):.1e}, all within {error.max():.1e}")


def moved_sums(case: kit_cases.Case) -> None:
    technique = moit.technique("front2")
    found, _ = kit_programs.through(technique, "glsl", case)
    said("front2, where moments are sound", kit_cases.errors(technique, "glsl", case)[1])
    anywhere = kit_cases.gathered_errors(technique, "glsl", case, everywhere=True)
    said("front2, everywhere", anywhere)
    blended = kit_programs._blended

    def nudged(*given) -> np.ndarray:
        sums = blended(*given).astype(np.float32)
        up = RANDOM.random(sums.shape) < 0.5
        return np.nextafter(sums, np.where(up, np.inf, -np.inf).astype(np.float32))

    kit_programs._blended = nudged
    moved, _ = kit_programs.through(technique, "glsl", case)
    kit_programs._blended = blended
    said("front2, moved by a unit in the last place of each sum", np.abs(moved - found))


def places(depth: np.ndarray) -> np.ndarray:
    near, far = kit_cases.RANGE
    return np.log(depth.astype(np.float64) / near) / np.log(far / near)


def moved_depths(case: kit_cases.Case) -> None:
    technique = moit.technique("strong5")
    said("strong5", kit_cases.errors(technique, "glsl", case)[1])
    near, far = kit_cases.RANGE
    turns = RANDOM.uniform(-1, 1, len(case.depth)) * 2.0**-24 * np.log(far / near) / 2
    moved = dataclasses.replace(case, depth=case.depth * np.exp(turns))
    core, other = (
        moit.transmittance(Picture(one, 1).fragments(), technique) for one in (case, moved)
    )
    error = np.abs(other - core)
    said("strong5's core in double, moved by 2^-24 of each depth in [-1, 1]", error)


def other_words(case: kit_cases.Case, name: str, rounds: float) -> None:
    """rounds : what is added before a word's fraction is dropped."""
    technique = moit.technique(name)
    _, error = kit_cases.errors(technique, "glsl", case)
    said(name, error)
    n = len(error)
    z = kits.warped(technique, "glsl", case.depth[:n])
    inside = np.float32(0.5) * z + np.float32(0.5)
    words = np.floor(inside * np.float32(65535) + np.float32(rounds))
    others = np.floor(places(case.depth[:n]) * 65535 + rounds) != words
    pixels = np.unique(case.pixel[:n][others])
    print(f"{name}: {others.sum()} of {n} fragments have another word of depth in floats")
    said(f"{name}, other pixels", error[~np.isin(case.pixel[:n], pixels)])
    one, other = (
        moit.transmittance(Picture(case, 1).fragments(dtype), technique)
        for dtype in (np.float32, np.float64)
    )
    said(f"{name}, the core in floats and the core in double", np.abs(one - other))


if __name__ == "__main__":
    moved_sums(kit_cases.held_case())
    moved_depths(kit_cases.held_case())
    other_words(kit_cases.held_case(), "anchors4", 0.5)
    other_words(kit_cases.held_case(), "neural-slices8", 0.0)
