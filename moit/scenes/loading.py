"""Scenes by name, of formulas and of triangles."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from moit.checks.arguments import nearest
from moit.checks.randomness import seed_of
from moit.checks.windows import picture_size
from moit.fragments.fragments import Fragments
from moit.geometry.rasterizer import MOST_SIDE, rasterized
from moit.scenes.formulas import SCENES
from moit.scenes.line_scenes import LINE_SCENES, LineScene
from moit.scenes.mesh_scenes import MESH_SCENES
from moit.scenes.scene_parts import MeshScene
from moit.scenes.shapes import View
from moit.scenes.splat_scenes import SPLAT_SCENES, SplatScene
from moit.system.environment import thread_count

# What each scene shows, in the order in which they are listed: formulas, then triangles.
DESCRIPTIONS = {
    "panes": "tinted glass, some of it crossed, and an opaque frame; at most eight surfaces",
    "cloud": "particles, and in them a red disk of 94 % opacity (MBOIT, fig. 9)",
    "hair": "strands of one alpha in locks; more than a hundred fragments in one's middle",
    "spheres": "three spheres that intersect, in a range of twelve radii (MBOIT, fig. 8)",
    "neural-training": "unrelated pixels, each of 2 to 32 fragments of alpha .1 to .5 that span "
    ".3 to 1 of the depth range (NMT, section 3.2)",
    "stained-glass": "a bright sky through a leaded window of coloured transmission, and before it "
    "tinted discs and dust",
    "squares": "four squares of pure colours before a wall (WBOIT's post)",
    "mixed": "the first five side by side, as in a real picture: most pixels have few fragments, "
    "some none, some an opaque one",
    "teapots": "seventeen glass pots in a row, curtains, an opaque hall (MBOIT, fig. 6)",
    "spheres-mesh": "the three spheres as triangles (MBOIT, fig. 8)",
    "foliage": "leaves whose alpha changes within a pixel, and a red glass pot (MBOIT, fig. 7)",
    "smoke": "particles that face the camera",
    "grass": "blades of grass",
    "strands": "hair as ribbons",
    "ship-like": "a rigged ship in glass and clouds of particles (MBOIT, fig. 10)",
    "ship-in-clouds": "the same in much denser clouds (MBOIT, fig. 1)",
    "burning-house": "fire, smoke, and before them grass and glass bottles (MT, fig. 1)",
    "grass-and-smoke": "grass seen through the smoke that the eye is in (MT, fig. 3b)",
    "engine": "glass parts of an engine (WBOIT's post)",
    "chess": "glass pieces on a board (WBOIT's post)",
    "pond": "fog, water and leaves round a pond (WBOIT's post)",
    "cloud-with-disk": "particles and a disk that casts a shadow in them (MBOIT, fig. 9)",
}


def descriptions() -> dict[str, str]:
    """What each scene shows, by its name, in the order of `names()`.

    >>> moit.scenes.descriptions()["squares"]
    "four squares of pure colours before a wall (WBOIT's post)"
    """
    return {name: DESCRIPTIONS[name] for name in names()}


def names() -> list[str]:
    """The names of the scenes, as `load` takes them: first those of formulas, then of triangles.

    >>> "panes" in moit.scenes.names()
    True
    """
    return [*SCENES, *MESH_SCENES]


def load(
    name: str, size: tuple[int, int] = (640, 360), seed: int = 0, *, rng: Any = None
) -> Fragments:
    """The fragments of a scene: float32, depth above 0, in the order in which objects are drawn.

    name : one of `names()`; `descriptions()` says what each shows.
    size : (width, height), each at least 1. But for "neural-training", another size shows the same
        picture with more pixels or fewer.
    seed : an integer of at least 0. The same name, size and seed give the same bits.
    rng : in place of seed, as Scientific Python's SPEC 7 has it: an integer is that seed, of a
        `numpy.random.Generator` or what else `numpy.random.default_rng` takes one is drawn.

    Raises ValueError for an unknown name, with the nearest match, and for sizes and seeds out of
    range; TypeError for what is no name, size or seed.

    >>> moit.scenes.load("panes", (8, 6)).shape
    (6, 8)
    """
    if not isinstance(name, str):
        raise TypeError(f"name: expected the name of a scene, got {type(name).__name__}")
    if name in MESH_SCENES:
        drawn_size = picture_size(size, MOST_SIDE)
        scene_of_triangles = meshes(name, _seed(seed, rng))
        return rasterized(
            scene_of_triangles.meshes, scene_of_triangles.camera, drawn_size, thread_count(None)
        )
    if name not in SCENES:
        raise ValueError(f"name: there is no scene {name!r:.80}{nearest(name, names())}")
    width, height = picture_size(size)
    scene = SCENES[name]
    drawn = scene.draw(View(width, height), np.random.default_rng(_seed(seed, rng)))
    return Fragments.from_pixels(
        drawn.pixel,
        drawn.depth,
        drawn.alpha,
        drawn.color,
        transmission=drawn.transmission,
        shape=(height, width),
        depth_range=scene.depth_range,
        dtype=np.float32,
    )


def meshes(name: str, seed: int = 0, *, rng: Any = None) -> MeshScene:
    """The meshes of a scene of triangles, in draw order, with its camera and background.

    seed, rng : as of `load`.

    Raises ValueError for a name that is not one of these, and as `load` for a bad seed.

    >>> scene = moit.scenes.meshes("spheres-mesh")
    >>> len(scene.meshes), isinstance(scene.camera, moit.Camera)
    (5, True)
    """
    if not isinstance(name, str):
        raise TypeError(f"name: expected the name of a scene, got {type(name).__name__}")
    if name not in MESH_SCENES:
        hint = nearest(name, list(MESH_SCENES))
        raise ValueError(f"name: there is no scene of triangles {name!r:.80}{hint}")
    return MESH_SCENES[name](np.random.default_rng(_seed(seed, rng)))


def splats(name: str, count: int = 100_000, seed: int = 0, *, rng: Any = None) -> SplatScene:
    """A scene of Gaussian splats, with its camera and background.

    name : "pot-splats", discs on the surface of a pot and on the ground, as captured scenes have
        them; "fog-splats", wide and thin; "hair-splats", long ones in chains.
    count : how many, at least 1: more are smaller.
    seed, rng : as of `load`.

    Raises ValueError and TypeError that name the argument.

    >>> scene = moit.scenes.splats("hair-splats", 1000)
    >>> scene.splats
    Splats(1000, degree 0, convention '3dgs')
    >>> moit.render(scene.splats, "sorted", (32, 18), camera=scene.camera).shape
    (18, 32, 4)
    """
    if not isinstance(name, str):
        raise TypeError(f"name: expected the name of a scene, got {type(name).__name__}")
    if name not in SPLAT_SCENES:
        hint = nearest(name, list(SPLAT_SCENES))
        raise ValueError(f"name: there is no scene of splats {name!r:.80}{hint}")
    number = operator.index(count)
    if number < 1:
        raise ValueError(f"count: expected at least 1, got {number}")
    return SPLAT_SCENES[name](np.random.default_rng(_seed(seed, rng)), number)


def lines(name: str, count: int = 1000, seed: int = 0, *, rng: Any = None) -> LineScene:
    """A scene of streamlines, whose opacity tells an attribute, with its camera and background.

    name : "turbulence-lines", eddies of many sizes by vorticity; "convection-lines", rolls between
        plates by how fast things rise or sink.
    count : how many lines, at least 1.
    seed, rng : as of `load`.

    Raises ValueError and TypeError that name the argument.

    >>> scene = moit.scenes.lines("convection-lines", 20)
    >>> len(scene.lines)
    20
    >>> moit.render(scene.lines, "sorted", (32, 18), camera=scene.camera, antialias=True).shape
    (18, 32, 4)
    """
    if not isinstance(name, str):
        raise TypeError(f"name: expected the name of a scene, got {type(name).__name__}")
    if name not in LINE_SCENES:
        hint = nearest(name, list(LINE_SCENES))
        raise ValueError(f"name: there is no scene of lines {name!r:.80}{hint}")
    number = operator.index(count)
    if number < 1:
        raise ValueError(f"count: expected at least 1, got {number}")
    return LINE_SCENES[name](np.random.default_rng(_seed(seed, rng)), number)


def _seed(seed: Any, rng: Any) -> int:
    seed = seed_of(seed, rng)
    try:
        number = operator.index(seed)
    except TypeError:
        raise TypeError(f"seed: expected an integer, got {type(seed).__name__}") from None
    if number < 0:
        raise ValueError(f"seed: expected an integer of at least 0, got {number}")
    return number
