"""A leaded window with tinted discs and dust before it: glass with coloured transmission."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.scenes.shapes import (
    Drawn,
    Hit,
    View,
    facing_disc,
    joined,
    paint,
    rectangle,
    rotation,
)

if TYPE_CHECKING:
    from numpy.random import Generator

Array = NDArray[Any]

ARCH = 1.5  # half the width of the window, and the radius of its arch
RINGS = ((0.0, 1), (0.52, 7), (1.1, 12), (1.75, 17), (2.5, 21))  # radius, pieces of glass
DISCS = 7
DUST = 90


def stained_glass(view: View, rng: Generator) -> Drawn:
    """The sky, the wall with its window, and then discs and dust in any order."""
    front = [_disc(view, rng, i) for i in range(DISCS)]
    for _ in range(DUST):
        center = np.append(rng.normal((0, -0.3), (0.7, 0.6)), rng.uniform(2.4, 4.6))
        grain = facing_disc(view, center, rng.uniform(0.1, 0.3))
        soft = (1 - grain.p**2 - grain.q**2) ** 2
        front.append(grain.drawn(0.07 * soft, rng.uniform(0.1, 0.6) * np.array([1, 0.92, 0.75])))
    order = rng.permutation(len(front))
    return joined([_sky(view), *_window(view, rng), *(front[i] for i in order)])


def _backdrop(view: View, z: float) -> Hit:
    """A plane across the whole view; p and q are x and y."""
    side = 40.0
    hit = rectangle(view, np.array([0, 0, z]), np.array([side, 0, 0]), np.array([0, side, 0]))
    return Hit(hit.pixel, hit.depth, side * hit.p, side * hit.q)


def _sky(view: View) -> Drawn:
    """Blue above and light below, with a low sun."""
    sky = _backdrop(view, 9.0)
    height = np.clip(sky.q / 9 + 0.5, 0, 1)[:, None]
    glow = np.exp(-((sky.p + 1.2) ** 2 + (sky.q - 0.4) ** 2) / 2.5)[:, None]
    low, high = np.array([1.0, 0.9, 0.75]), np.array([0.45, 0.7, 1.0])
    return sky.drawn(1.0, (1 - height) * low + height * high + glow * np.array([1.6, 1.3, 0.8]))


def _window(view: View, rng: Generator) -> list[Drawn]:
    """A stone wall, and in its arch pieces of glass in rings, each of one colour, between lead."""
    wall = _backdrop(view, 5.0)
    x, y = wall.p, wall.q
    hole = (y > -2.1) & (x**2 + np.maximum(y - 0.6, 0) ** 2 < ARCH**2)
    course = np.floor((y + 3) / 0.35)
    joint = np.minimum(np.mod(y + 3, 0.35), np.mod(x + 0.3 * np.mod(course, 2), 0.6)) < 0.025
    stone = np.where(joint, 0.02, 0.05)[~hole, None] * np.array([1.0, 0.95, 0.9])

    pane = wall.where(hole)
    first, second = np.full((2, len(pane.pixel)), np.inf)  # how far its nearest middles are
    tint, hue = np.zeros((len(pane.pixel), 3)), rng.random()
    for radius, count in RINGS:
        hue += 0.381966
        for turn in (np.arange(count) + rng.random()) * (2 * np.pi / count):
            from_middle = radius + rng.normal(0, 0.03)
            color = paint(hue + rng.uniform(-0.1, 0.1), 0.75, rng.uniform(0.8, 1.0))
            away = np.hypot(
                pane.p - from_middle * np.cos(turn), pane.q - 0.4 - from_middle * np.sin(turn)
            )
            tint[away < first] = color
            first, second = np.minimum(first, away), np.minimum(second, np.maximum(first, away))
    lead = second - first < 0.035
    return [
        wall.where(~hole).drawn(1.0, stone),
        pane.where(lead).drawn(1.0, np.array([0.015, 0.015, 0.018])),
        pane.where(~lead).drawn(1.0, 0.02 * tint[~lead], tint[~lead]),
    ]


def _disc(view: View, rng: Generator, place: int) -> Drawn:
    """A tilted disc of tinted glass with a reflection, in a brass rim that lets nothing through."""
    right, up = rotation(rng.uniform(-0.9, 0.9), rng.uniform(-0.6, 0.6))
    turn = 2 * np.pi * place / DISCS
    center = np.array([0.6 * np.cos(turn), 0.48 * np.sin(turn) - 0.1, 3.0])
    center += rng.normal(0, (0.08, 0.08, 0.12))
    square = rectangle(view, center, 0.42 * right, 0.42 * up)
    disc = square.where(square.p**2 + square.q**2 <= 1)
    rim = (disc.p**2 + disc.q**2 > 0.93)[:, None]
    shine = np.exp(-(((disc.p + disc.q - 0.5) / 0.12) ** 2))[:, None]
    tint = paint(place / 3 + 1 / 6 + rng.uniform(-0.05, 0.05), 0.6, 1.0)  # yellow, cyan, magenta
    color = np.where(rim, np.array([0.5, 0.35, 0.1]), 0.03 + 0.5 * shine)
    return disc.drawn(np.where(rim[:, 0], 1.0, 0.9), color, np.where(rim, 0.0, tint))
