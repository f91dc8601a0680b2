"""Things of glass that a CAD program or a game shows: an engine, a chess set (WBOIT's post)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from moit.geometry.camera import Camera
from moit.geometry.meshes import Mesh
from moit.geometry.solids import ball, box, lathe, moved, sheet, tube
from moit.scenes.scene_parts import MeshScene, ground, hue, smooth

if TYPE_CHECKING:
    from numpy.random import Generator

CYLINDERS = 4
GEAR = 18  # teeth


def engine(rng: Generator) -> MeshScene:
    """The parts of an engine of four cylinders, each kind of one colour, drawn in any order."""
    turn = rng.uniform(0, 2 * np.pi)
    parts: list[Mesh] = [
        box((0, 0.62, 0), (3.3, 0.75, 0.95), (0.55, 0.60, 0.68), 0.16, 6),
        box((0, 1.12, 0), (3.2, 0.22, 0.85), (0.30, 0.45, 0.75), 0.18, 6),
        box((0, 0.10, 0), (3.1, 0.30, 0.80), (0.25, 0.28, 0.30), 0.2, 6),
        tube([(-1.9, 0.25, 0), (0, 0.25, 0), (1.9, 0.25, 0)], 0.07, (0.75, 0.55, 0.2), 0.45, 20),
    ]
    for i in range(CYLINDERS):
        parts += _cylinder(0.78 * (i - (CYLINDERS - 1) / 2), turn + np.pi * (i in (1, 2)))
    for x, radius, color in ((-1.85, 0.42, 0.02), (1.85, 0.34, 0.12), (1.98, 0.2, 0.6)):
        parts += [moved(one, (x, 0.25, 0)) for one in _gear(radius, hue(color, 0.7))]
    for side in (-1, 1):
        for i in range(CYLINDERS):
            parts.append(
                _pipe(side, 0.78 * (i - (CYLINDERS - 1) / 2), hue(0.06 if side > 0 else 0.5))
            )
        parts.append(
            tube([(-1.4, 0.55, 1.15 * side), (0, 0.5, 1.2 * side), (1.9, 0.5, 1.1 * side)], 0.14,
                 hue(0.06 if side > 0 else 0.5, 0.6), 0.25, 24)
        )  # fmt: skip
    for x in np.linspace(-1.5, 1.5, 9):
        for z in (-0.36, 0.36):
            bolt = lathe([(0, 0), (0.05, 0), (0.05, 0.07), (0.025, 0.08), (0.025, 0.3)],
                         (0.8, 0.8, 0.85), 0.5, 8)  # fmt: skip
            parts.append(moved(bolt, (x, 1.2, z)))
    order = rng.permutation(len(parts))
    floor = ground(8.0, (0.80, 0.80, 0.82), (0.72, 0.72, 0.75), 16, -0.25)
    camera = Camera((2.6, 2.3, 4.0), (0, 0.55, 0), fov_y=0.62, near=0.5, far=30.0)
    return MeshScene([floor, *(parts[i] for i in order)], camera, (0.85, 0.87, 0.9))


def _cylinder(x: float, turn: float) -> list[Mesh]:
    """A liner, its piston with rings, rod and crank, two valves with springs."""
    lift = 0.14 * np.cos(turn)
    top = 0.82 + lift
    liner = lathe([(0.31, 0.35), (0.31, 1.02), (0.28, 1.02), (0.28, 0.35)], hue(0.58, 0.5), 0.2, 32)
    outline = [(0, 0), (0.26, 0), (0.26, -0.24), (0.2, -0.24), (0.2, -0.05)]
    piston = moved(lathe(outline, hue(0.0, 0.75), 0.4, 32), (0, top, 0))
    parts = [moved(one, (x, 0, 0)) for one in (liner, piston)]
    for i in range(3):
        ring = lathe([(0.265, 0), (0.275, 0.015), (0.265, 0.03)], (0.2, 0.2, 0.22), 0.6, 24)
        parts.append(moved(ring, (x, top - 0.06 - 0.06 * i, 0)))
    pin = (x, 0.25 + lift, 0.14 * np.sin(turn))
    parts.append(tube([pin, (x, 0.5 + lift, 0), (x, top - 0.12, 0)], (0.07, 0.045, 0.06),
                      hue(0.12, 0.6), 0.45, 12))  # fmt: skip
    parts.append(ball(pin, 0.12, hue(0.12, 0.8), 0.4, 16))
    for side in (-1, 1):
        z = 0.13 * side
        stem = lathe([(0, 1.0), (0.1, 1.0), (0.02, 1.06), (0.02, 1.45), (0.06, 1.45)],
                     hue(0.33, 0.6), 0.5, 16)  # fmt: skip
        parts.append(moved(stem, (x, 0, z)))
        t = np.linspace(0, 5 * 2 * np.pi, 60)
        coil = np.stack([0.06 * np.cos(t), 1.2 + 0.2 * t / t[-1], 0.06 * np.sin(t)], axis=1)
        parts.append(moved(tube(coil, 0.012, (0.7, 0.7, 0.75), 0.6, 6), (x, 0, z)))
    return parts


def _gear(radius: float, color: Any) -> list[Mesh]:
    """A toothed wheel that turns about x, and its hub."""
    angle = np.linspace(0, 2 * np.pi, 4 * GEAR, endpoint=False)
    tooth = radius * (1 + 0.07 * np.sign(np.sin(GEAR * angle)))
    rims = [
        np.stack([np.full(len(angle), x), r * np.cos(angle), r * np.sin(angle)], axis=1)
        for x, r in ((-0.05, 0.3 * tooth), (-0.05, tooth), (0.05, tooth), (0.05, 0.3 * tooth))
    ]
    wheel = sheet(np.stack(rims), color, 0.35, closed=True)
    hub = tube([(-0.1, 0, 0), (0, 0, 0), (0.1, 0, 0)], 0.3 * radius, color, 0.5, 16)
    return [wheel, hub]


def _pipe(side: int, x: float, color: Any) -> Mesh:
    t = np.linspace(0, 1, 10)
    path = np.stack([x + 0.15 * t, 0.95 - 0.45 * t**2, side * (0.45 + 0.72 * t)], axis=1)
    return tube(path, 0.1, color, 0.25, 20)


# Radii and heights of chess pieces on a board of squares of side 1.
PAWN = ((0, 0), (0.30, 0), (0.30, 0.08), (0.20, 0.16), (0.12, 0.45), (0.20, 0.52), (0.10, 0.56))
TALL = ((0, 0), (0.36, 0), (0.36, 0.1), (0.24, 0.2), (0.14, 0.8), (0.26, 0.9), (0.16, 0.98))
ROOK = ((0, 0), (0.36, 0), (0.36, 0.1), (0.24, 0.2), (0.20, 0.75), (0.30, 0.8), (0.30, 1.0),
        (0.22, 1.0), (0.22, 0.9), (0, 0.9))  # fmt: skip
BACK_RANK = ("rook", "knight", "bishop", "queen", "king", "bishop", "knight", "rook")


def chess(rng: Generator) -> MeshScene:
    """A chess set of glass after some moves, on an opaque board."""
    meshes = [ground(4.0, (0.70, 0.66, 0.58), (0.16, 0.11, 0.08), 8)]
    meshes.append(ground(30.0, (0.10, 0.12, 0.14), (0.10, 0.12, 0.14), 2, -0.02))
    pieces = []
    for color, rank, ahead in (((0.85, 0.88, 0.80), 0, 1), ((0.05, 0.16, 0.10), 7, -1)):
        steps = rng.integers(0, 3, 8)
        for file in range(8):
            pieces.append((BACK_RANK[file], color, file, rank, ahead))
            pieces.append(("pawn", color, file, rank + ahead * (1 + int(steps[file])), ahead))
    for i in rng.permutation(len(pieces)):
        kind, color, file, rank, ahead = pieces[i]
        place = (file - 3.5, 0.0, 3.5 - rank)
        meshes += [
            moved(part, place, 1.0, 0.0 if ahead > 0 else np.pi) for part in _piece(kind, color)
        ]
    camera = Camera((3.6, 4.2, 8.6), (0.0, 0.2, 0.3), fov_y=0.62, near=0.5, far=60.0)
    return MeshScene(meshes, camera, (0.45, 0.5, 0.58))


def _piece(kind: str, color: Any) -> list[Mesh]:
    alpha = 0.42
    if kind == "pawn":
        return [
            lathe(smooth(PAWN, 24), color, alpha, 28),
            ball((0, 0.7, 0), 0.19, color, alpha, 20),
        ]
    if kind == "rook":
        return [lathe(ROOK, color, alpha, 28)]
    body = lathe(smooth(TALL, 28), color, alpha, 28)
    if kind == "bishop":
        head = lathe(
            [(0.12, 0.95), (0.2, 1.1), (0.14, 1.3), (0.04, 1.42), (0, 1.45)], color, alpha, 24
        )
        return [body, head]
    if kind == "knight":
        neck = tube([(0, 0.18, 0), (0, 0.7, -0.12), (0, 1.05, -0.1), (0, 1.2, 0.06),
                     (0, 1.1, 0.3)], (0.24, 0.2, 0.19, 0.16, 0.09), color, alpha, 16)  # fmt: skip
        return [lathe(TALL[:4], color, alpha, 28), neck]
    high = 0.35 if kind == "king" else 0.2
    rim = [(0.27, 1.15 + high), (0.1, 1.2 + high), (0, 1.25 + high)]
    crown = lathe([(0.14, 0.98), (0.2, 1.15), *rim], color, alpha, 24)
    top = ball((0, 1.3 + high, 0), 0.07, color, alpha, 12)
    return [body, crown, top]
