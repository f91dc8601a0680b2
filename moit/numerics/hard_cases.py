"""Families of rays that are hard on techniques, each with one dial.

All numbers are float32 ones, held in float64: what differs between precisions is then what
techniques make of them. A family's cases share their random numbers, so that only the dial changes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.fragments.fragments import Fragments

Array = NDArray[Any]
Rng = np.random.Generator

SQUARE = 8
COLOR = 0.5  # of all fragments: some weights look at it
MOST_FRAGMENTS = 65_536  # of a case; a case of many layers has fewer rays


@dataclass(frozen=True)
class Case:
    """Rays at one setting of a dial.

    steps : where the rays come in runs of that many which show the same fragments, in another
        order or with one moved: how many; else 1.
    place : (N,) which of its ray's fragments each is, the same in all rays of a run.
    apart : rays of a run are not neighbours: all first ones come first, then all second ones.
    """

    f: Fragments
    steps: int = 1
    place: Array | None = None
    apart: bool = False

    def runs(self, values: Array) -> Array:
        """(N,) numbers of fragments as (runs, steps, fragments of a ray)."""
        n = int(self.f.counts[0])
        if self.apart:
            return values.reshape(self.steps, -1, n).swapaxes(0, 1)
        return values.reshape(-1, self.steps, n)


@dataclass(frozen=True)
class Family:
    """A kind of hard rays. `dial` says what its values are; they go from easy to hard."""

    name: str
    dial: str
    about: str
    values: tuple[float, ...]
    make: Callable[[Rng, float, int], Case]

    def case(self, value: float, rays: int, seed: int) -> Case:
        """About `rays` rays at one of the values; the same for the same seed."""
        return self.make(
            np.random.default_rng([seed, list(FAMILIES).index(self.name)]), value, rays
        )


def _case(
    depth: Array,
    alpha: Array,
    near: float,
    far: float,
    steps: int = 1,
    shape: tuple[int, int] | None = None,
) -> Case:
    """Rays of n fragments each, (P, n); shape : of the picture, None: one row."""
    depth = _held(np.clip(_held(depth), np.float32(near), np.float32(far)))
    alpha = _held(np.broadcast_to(alpha, depth.shape))
    n = depth.shape[1]
    f = Fragments(
        np.arange(len(depth) + 1) * n,
        depth.ravel(),
        alpha.ravel(),
        np.full((depth.size, 3), COLOR),
        shape=shape,
        depth_range=(near, far),
    )
    return Case(f, steps, np.tile(np.arange(n), len(depth)) if steps > 1 else None)


def _held(numbers: Array) -> Array:
    """What float32 keeps of numbers, in float64."""
    return np.asarray(numbers, np.float32).astype(np.float64)


def _alphas(rng: Rng, rays: int, n: int, total: float) -> Array:
    """(rays, n) of random shares in a total absorbance."""
    share = rng.uniform(0.5, 1.5, (rays, n))
    return np.asarray(-np.expm1(-total * share / share.sum(axis=1, keepdims=True)))


def _fewer(rays: int, n: int) -> int:
    return max(min(rays, MOST_FRAGMENTS // n), 1)


def _distance(rng: Rng, value: float, rays: int) -> Case:
    front = _held(rng.uniform(1.1, 1.8, rays))
    alpha = rng.uniform(0.1, 0.95, (rays, 2))
    return _case(np.stack([front, front + value], axis=1), alpha, 1, 2)


def _opaque(rng: Rng, value: float, rays: int) -> Case:
    return _case(rng.uniform(1, 2, (rays, 4)), np.array(1 - value), 1, 2)


def _clear(rng: Rng, value: float, rays: int) -> Case:
    return _case(rng.uniform(1, 2, (rays, 8)), value * rng.uniform(0.5, 1, (rays, 8)), 1, 2)


def _layers(rng: Rng, value: float, rays: int) -> Case:
    n = int(value)
    rays = _fewer(rays, n)
    return _case(rng.uniform(1, 2, (rays, n)), _alphas(rng, rays, n, 3.0), 1, 2)


def _range(rng: Rng, value: float, rays: int) -> Case:
    depth = value ** rng.random((rays, 6))
    return _case(depth, rng.uniform(0.1, 0.7, (rays, 6)), 1, value)


def _one_depth(rng: Rng, value: float, rays: int) -> Case:
    n = int(value)
    rays = _fewer(rays, n + 1)
    at = rng.uniform(1, 1.75, (rays, 1))
    depth = np.concatenate([np.repeat(at, n, axis=1), at + 0.25], axis=1)
    alpha = np.concatenate([_alphas(rng, rays, n, 2.0), np.full((rays, 1), 0.5)], axis=1)
    return _case(depth, alpha, 1, 2)


def _symmetric(rng: Rng, value: float, rays: int) -> Case:
    # In the logarithm of depth, which is what is warped to the unit range by default.
    far = value * np.stack([np.ones(rays), rng.uniform(0.2, 0.8, rays)], axis=1)
    depth = 2.0 ** np.concatenate([far, -far, np.zeros((rays, 1))], axis=1)
    alpha = rng.uniform(0.2, 0.8, (rays, 2))
    middle = np.where(np.arange(rays) % 2, 0.3, 0.0)[:, None]  # in every other ray
    return _case(depth, np.concatenate([alpha, alpha, middle], axis=1), 0.5, 2)


def _ends(rng: Rng, value: float, rays: int) -> Case:
    away = value * rng.uniform(0.5, 1, (rays, 2))
    inside = rng.uniform(1.2, 1.8, (rays, 2))
    depth = np.stack([1 + away[:, 0], inside[:, 0], 2 - away[:, 1], inside[:, 1]], axis=1)
    return _case(depth, rng.uniform(0.2, 0.9, (rays, 4)), 1, 2)


def _order(rng: Rng, value: float, rays: int) -> Case:
    n, orders = int(value), 8
    # Some techniques round by where a pixel lies among 8 x 8: the orders are so many rows apart.
    runs = SQUARE * max(_fewer(rays, n) // orders // SQUARE, 1)
    # No two at one depth: of such, the order of arrival says which is in front.
    depth = 1 + (rng.permuted(np.tile(np.arange(n), (runs, 1)), axis=1) + rng.random((runs, n))) / n
    alpha = _alphas(rng, runs, n, 3.0)
    place = np.tile(np.arange(n), (orders, runs, 1))
    place[1:] = rng.permuted(place[1:], axis=2)
    run = np.arange(runs)[None, :, None]
    in_order = (orders * runs, n)
    depth, alpha = (one[run, place].reshape(in_order) for one in (depth, alpha))
    case = _case(depth, alpha, 1, 2, shape=(orders * SQUARE, runs // SQUARE))
    return Case(case.f, orders, place.ravel(), apart=True)


def _moving(rng: Rng, value: float, rays: int) -> Case:
    steps = 16
    runs = max(rays // steps, 1)
    still = _held(rng.uniform(1.2, 1.8, (runs, 4)))
    # Half way through it passes the first of the others.
    way = value * (np.arange(steps) - (steps - 1) / 2)
    moved = still[:, :1, None] + way[None, None, :]  # (runs, 1, steps)
    depth = np.concatenate([moved, np.repeat(still[:, :, None], steps, axis=2)], axis=1)
    depth = depth.transpose(0, 2, 1).reshape(runs * steps, 5)
    alpha = np.repeat(rng.uniform(0.1, 0.7, (runs, 5)), steps, axis=0)
    return _case(depth, alpha, 0.1, 3, steps)


def _thin(rng: Rng, value: float, rays: int) -> Case:
    n = round(2 / value)
    rays = _fewer(rays, n)
    return _case(rng.uniform(1, 2, (rays, n)), _alphas(rng, rays, n, 2.0), 1, 2)


def _adjacent(rng: Rng, value: float, rays: int) -> Case:
    # At the same depths in all rays: what lies between has nothing in it anywhere.
    depth = rng.uniform(1.2, 1.6) + np.array([0, value, 0.3])
    return _case(np.tile(depth, (rays, 1)), rng.uniform(0.3, 0.9, (rays, 3)), 1, 2)


def _overflow(rng: Rng, value: float, rays: int) -> Case:
    at = np.repeat(rng.uniform(1, 1.7, (rays, 1)), 4, axis=1)
    depth = np.concatenate([at, np.full((rays, 1), 1.9)], axis=1)
    alpha = np.concatenate([_alphas(rng, rays, 4, value), np.full((rays, 1), 0.5)], axis=1)
    return _case(depth, alpha, 1, 2)


def _screen(rng: Rng, value: float, rays: int) -> Case:
    side = _side(rays)
    front = 0.5 * (1 + value * rng.uniform(-1, 1, side * side))
    alpha = np.stack([front, np.full(side * side, 0.5)], axis=1)
    depth = np.tile(rng.uniform(1.1, 1.4) + np.array([0, 0.4]), (side * side, 1))
    return _case(depth, alpha, 1, 2, shape=(side, side))


def _tilted(rng: Rng, value: float, rays: int) -> Case:
    side = _side(rays)
    column = np.arange(side) - side / 2
    depth = np.tile(rng.uniform(1.45, 1.55) + value / SQUARE * column, side)[:, None]
    return _case(depth, np.array(rng.uniform(0.3, 0.9)), 1, 2, shape=(side, side))


def _side(rays: int) -> int:
    """Of a square picture, in pixels, of whole squares."""
    return SQUARE * min(max(int(rays**0.5) // SQUARE, 1), 8)


def _tens(first: int, last: int) -> tuple[float, ...]:
    return tuple(float(f"1e{k}") for k in range(first, last - 1, -1))


FAMILIES = {
    family.name: family
    for family in (
        Family(
            "distance",
            "distance, share of the depth range",
            "Two surfaces, one close behind the other.",
            _tens(-1, -7),
            _distance,
        ),
        Family(
            "opaque",
            "1 - alpha",
            "Four surfaces that let less and less through, at last nothing; none is taken for the "
            "opaque surface of its pixel.",
            (*_tens(-1, -7), 0),
            _opaque,
        ),
        Family("clear", "alpha", "Eight surfaces, clearer and clearer.", _tens(-1, -7), _clear),
        Family(
            "layers",
            "surfaces of a ray",
            "More and more surfaces of the same total absorbance, 3.",
            (1, 2, 3, 4, 5, 8, 16, 32, 100, 1000, 10_000),
            _layers,
        ),
        Family(
            "range",
            "far / near",
            "Six surfaces, evenly spread over the logarithm of an ever greater range of depth.",
            (10, 100, 1e3, 1e4, 1e5, 1e6),
            _range,
        ),
        Family(
            "one-depth",
            "fragments at that depth",
            "All fragments at one depth, but for one behind them. Those at one depth may be taken "
            "to hide one another or not: both are right.",
            (1, 2, 4, 16, 64, 256, 1024),
            _one_depth,
        ),
        Family(
            "symmetric",
            "distance from the middle, share of half the range",
            "Two pairs of equal surfaces on both sides of the middle of the range, and one in the "
            "middle of every other ray.",
            (1, *_tens(-1, -6)),
            _symmetric,
        ),
        Family(
            "ends",
            "distance from the ends, share of the range",
            "A surface at either end of the range and two between.",
            (*_tens(-1, -7), 0),
            _ends,
        ),
        Family(
            "order",
            "surfaces of a ray",
            "The same surfaces in eight orders of arrival. Jump: how far one order's "
            "transmittance is from the next one's.",
            (2, 4, 8, 16, 64, 256, 1024),
            _order,
        ),
        Family(
            "moving",
            "step, share of half the range",
            "A surface moves through another in small steps. Jump: how far a step changes the "
            "transmittance to any fragment, less what it changes the exact one.",
            (0.03, *_tens(-2, -6)),
            _moving,
        ),
        Family(
            "thin",
            "mean optical depth of a surface",
            "More and more surfaces, ever thinner, of the same optical depth in all, 2. Slices of "
            "8 bits have steps of 0.022, and a surface is split between two: as published, what is "
            "less than half a step is lost.",
            (0.5, 0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.003, 0.001),
            _thin,
        ),
        Family(
            "adjacent",
            "distance, share of the depth range",
            "Two surfaces, one close behind the other, and a third, at the same depths in all "
            "rays. What is read some slices nearer, as published, passes the neighbour over.",
            (0.1, 0.03, 0.01, 3e-3, 1e-3, 5e-4, 2e-4, 1e-4),
            _adjacent,
        ),
        Family(
            "overflow",
            "optical depth at one place",
            "Four surfaces at one depth and one behind them. A slice of 8 bits holds 5.5 at most: "
            "as published, what is behind more gets nothing. Of those at one depth the earlier may "
            "hide the later.",
            (1, 3, 5, 6, 8, 11, 16, 24),
            _overflow,
        ),
        Family(
            "screen",
            "how far opacity varies, share of its mean",
            "A picture of two surfaces; the front one's opacity is another in each pixel, so that "
            "a smaller picture of it shows another surface.",
            (0, 0.01, 0.03, 0.1, 0.3, 0.9),
            _screen,
        ),
        Family(
            "tilted",
            "depth along 8 pixels, share of the depth range",
            "A picture of one surface, more and more tilted, that hides nothing: what pixels share "
            "has the surface in front of itself.",
            (0, 1e-3, 3e-3, 0.01, 0.03, 0.1),
            _tilted,
        ),
    )
}
