"""Numbers as colours and opacities: transfer functions for points, lines and volumes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.checks.arrays import as_array
from moit.checks.exceptions import PrimitiveError
from moit.geometry.attributes import Attributes
from moit.reports.pictures import from_srgb

Array = NDArray[Any]
ColorMap = str | ArrayLike | Callable[[Array], Any]
OpacityMap = ArrayLike | Callable[[Array], Any]

ATTRIBUTES = Attributes(PrimitiveError)


def map_scalars(
    values: ArrayLike,
    colors: ColorMap,
    opacity: OpacityMap = 1.0,
    *,
    limits: tuple[float, float] | None = None,
    color_space: str = "srgb",
) -> NDArray[np.float32]:
    """Numbers as colours: what `moit.Points`, `moit.Lines` and `moit.Mesh` take as `color`.

    values : (N,) finite.
    colors : of shares of the way from the lower to the upper limit: a table (K, 3) of K colours, at
        equal distances, between which it is linear; a function of shares (N,) in [0, 1], which
        gives (N, 3) or more columns, of which three are taken; or the name of one of matplotlib's,
        which has to be there.
    opacity : likewise: a number, a table (K,), or a function, that gives numbers in [0, 1].
    limits : (lower, upper); what is beyond counts as these. None: the least and the greatest value.
    color_space : of `colors`: "srgb", as maps are made for screens, or "linear".

    Returns (N, 4): linear colours and opacities. Raises PrimitiveError (a ValueError) or TypeError
    that name the argument.

    >>> moit.map_scalars([0, 1, 2], [(0, 0, 1), (1, 0, 0)], (0.1, 0.9)).round(2).tolist()[2]
    [1.0, 0.0, 0.0, 0.8999999761581421]
    """
    numbers = ATTRIBUTES.numbers(values, "values", np.float64)
    if numbers.ndim != 1:
        raise PrimitiveError(f"values: expected shape (N,), got {numbers.shape}")
    ATTRIBUTES.one_of("color_space", color_space, ("linear", "srgb"))
    low, high = _limits(limits, numbers)
    share = np.clip((numbers - low) / (high - low or 1.0), 0.0, 1.0)
    shades = _read(_named(colors), share, "colors", (3,))
    alpha = _read(opacity, share, "opacity", ())
    for name, found in (("colors", shades), ("opacity", alpha)):
        most = 1.0 if name == "opacity" or color_space == "srgb" else np.inf
        needed = "a number in [0, 1]" if most == 1 else "a number that is not negative"
        ATTRIBUTES.check(found, name, (found >= 0) & (found <= most), needed)
    if color_space == "srgb":
        shades = from_srgb(shades)
    return np.concatenate([shades, alpha[:, None]], axis=1).astype(np.float32)


def _limits(limits: tuple[float, float] | None, numbers: Array) -> tuple[float, float]:
    if limits is None:
        return (float(numbers.min()), float(numbers.max())) if len(numbers) else (0.0, 1.0)
    pair = ATTRIBUTES.numbers(limits, "limits", np.float64)
    if pair.shape != (2,) or not pair[0] <= pair[1]:
        raise PrimitiveError(
            f"limits: expected (lower, upper), the first not above the second, got {limits!r:.80}"
        )
    return float(pair[0]), float(pair[1])


def _named(colors: ColorMap) -> ArrayLike | Callable[[Array], Any]:
    if not isinstance(colors, str):
        return colors
    from matplotlib import colormaps

    if colors not in colormaps:
        raise PrimitiveError(f"colors: matplotlib has no map {colors!r:.80}")
    found: Callable[[Array], Any] = colormaps[colors]
    return found


def _read(given: Any, share: Array, name: str, row: tuple[int, ...]) -> Array:
    """(N, *row) float64 at these shares."""
    if callable(given):
        found = as_array(given(share), name)
        if row and found.ndim == 2:
            found = found[:, : row[0]]
        if found.shape != (len(share), *row):
            raise PrimitiveError(
                f"{name}: the function was given {share.shape} and gave {found.shape}; needed "
                f"{(len(share), *row)}"
            )
        return ATTRIBUTES.numbers(found, name, np.float64)
    table = ATTRIBUTES.numbers(given, name, np.float64)
    if table.shape == row:
        return np.broadcast_to(table, (len(share), *row)).copy()
    if table.ndim != 1 + len(row) or table.shape[1:] != row or not len(table):
        rows = f"({', '.join(map(str, ('K', *row)))})" if row else "(K,)"
        raise PrimitiveError(f"{name}: expected shape {row} or {rows}, got {table.shape}")
    place = share * (len(table) - 1)
    before = np.minimum(place.astype(np.int64), max(len(table) - 2, 0))
    after = np.minimum(before + 1, len(table) - 1)
    part = (place - before).reshape(-1, *(1 for _ in row))
    return np.asarray(table[before] + part * (table[after] - table[before]))
