"""Meshes, splats, points, lines and volumes that nobody draws on purpose, and command lines.

`tried_scene(number)` draws something random with hostile numbers in it, `tried_words(number)` gives
the shell random words. Each says in words what was broken: an error that is not moit's own, a
picture that is not finite, coverage outside [0, 1]. `python -m tests.fuzz` tries them for long.
"""

import contextlib
import io
import os
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import moit
from moit.__main__ import main

Rng = np.random.Generator
Array = np.ndarray
SIZE = (17, 13)
HOSTILE = (0.0, -0.0, 1e-45, 1e-30, 1e30, 3e38, -3e38, 1e300, np.nan, np.inf, -np.inf, 0.5)
TECHNIQUES = ("sorted", "wboit", "power4", "mlab2", "slices16", "stochastic4", "anchors2")


def numbers(rng: Rng, *shape: int) -> Array:
    """Mostly ordinary; some hostile ones now and then."""
    found = rng.normal(0, 10.0 ** rng.uniform(-1, 1), shape)
    if rng.random() < 0.5 and found.size:
        at = rng.integers(0, found.size, rng.integers(1, 4))
        found.reshape(-1)[at] = rng.choice(HOSTILE, len(at))
    return found


def mesh(rng: Rng) -> moit.Mesh:
    count = int(rng.integers(1, 12))
    corners = rng.integers(-1 if rng.random() < 0.1 else 0, count + (rng.random() < 0.1), (9, 3))
    shares = np.abs(numbers(rng, count))
    alpha: Any = rng.choice([0.0, 0.5, 1.0]) if rng.random() < 0.7 else shares
    return moit.Mesh(numbers(rng, count, 3), corners, rng.random((count, 3)), alpha)


def splats(rng: Rng) -> moit.Splats:
    count = int(rng.integers(1, 9))
    turns = numbers(rng, count, 4)
    sizes = np.abs(numbers(rng, count, 3))
    return moit.Splats(numbers(rng, count, 3), sizes, turns, rng.random(count))


def points(rng: Rng) -> moit.Points:
    count = int(rng.integers(1, 9))
    return moit.Points(numbers(rng, count, 3), pixels=float(np.abs(numbers(rng, 1))[0]), alpha=0.5)


def lines(rng: Rng) -> moit.Lines:
    count = int(rng.integers(2, 12))
    cut = int(rng.integers(0, count + 1))
    radius = float(np.abs(numbers(rng, 1))[0])
    return moit.Lines(numbers(rng, count, 3), [0, cut, count], radius=radius, alpha=0.4)


def volume(rng: Rng) -> moit.Volume:
    grid = np.abs(numbers(rng, *rng.integers(2, 6, 3)))
    return moit.Volume(grid, spacing=float(10.0 ** rng.uniform(-2, 1)), origin=(-1, -1, -1))


DRAWN: tuple[Callable[[Rng], Any], ...] = (mesh, splats, points, lines, volume)
OWN = (moit.MoitError, ValueError, TypeError, MemoryError)


def tried_scene(number: int) -> list[str]:
    """What drawing this scene breaks."""
    rng = np.random.default_rng(number)
    kind = DRAWN[number % len(DRAWN)]
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            scene = [kind(rng)]
            if rng.random() < 0.4:
                scene.append(DRAWN[int(rng.integers(len(DRAWN)))](rng))
            camera = moit.Camera(eye=tuple(rng.normal(0, 4, 3)))
            smooth = bool(rng.random() < 0.3)
            f = moit.rasterize(scene, camera, SIZE, antialias=smooth)
            technique = str(rng.choice(TECHNIQUES))
            image = moit.composite(f, technique)
    except OWN:
        return []
    except Exception as error:
        return [f"{kind.__name__}: {error!r} is not moit's own"]
    found = []
    if not np.isfinite(image).all():
        found.append(f"{kind.__name__} by {technique}: a picture that is not finite")
    elif not ((image[..., 3] > -1e-3) & (image[..., 3] < 1 + 1e-3)).all():
        found.append(f"{kind.__name__} by {technique}: it covers {image[..., 3].max()!r}")
    return found


# ---- Command lines -------------------------------------------------------------------------------

VERBS = (
    *("composite", "curve", "compare", "recommend", "inspect", "techniques", "scenes", "cite"),
    *("merge", "holdout", "crop", "flatten", "recolor", "simplify", "export", "info"),
)
WORDS = (
    *("a.npz", "a.exr", "gone.exr", "a.txt", ".", "", "power4", "wboit,power6", "nobody"),
    *("-t", "-o", "-f", "--pixel", "--window", "--memory", "--error", "--max-error", "--threads"),
    *("out.png", "out.exr", "out", "1", "0", "-1", "1e999", "nan", "0,0", "-1,-1,3x3", "9" * 30),
    *("--language", "glsl", "--repeat", "--size", "8x6", "\N{SNOWMAN}", "a" * 500, "--", "--help"),
)


def files_into(folder: Path) -> None:
    f = moit.scenes.load("panes", (12, 12))
    moit.save(folder / "a.npz", f)
    moit.write_deep(folder / "a.exr", f)
    (folder / "a.txt").write_text("nothing\n")


def tried_words(number: int) -> list[str]:
    """What these words break: an exit that is none of 0, 1, 2, or an error that nobody explains."""
    rng = np.random.default_rng(number)
    verb = VERBS[number % len(VERBS)]
    words = [verb, *(str(w) for w in rng.choice(WORDS, int(rng.integers(0, 7))))]
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        files_into(Path(folder))
        os.chdir(folder)
        said, complained = io.StringIO(), io.StringIO()
        try:
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
                status = main(words)
        except SystemExit as left:  # argparse's
            status = left.code if isinstance(left.code, int) else 1
        except Exception as error:
            return [f"{words}: {error!r} is not explained"]
        finally:
            os.chdir(here)
    if status not in (0, 1, 2):
        return [f"{words}: exit status {status}"]
    if status == 1 and not complained.getvalue().startswith("moit: "):
        return [f"{words}: failed, and said {complained.getvalue()[:100]!r}"]
    return []
