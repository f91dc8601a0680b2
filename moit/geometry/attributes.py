"""What parts of scenes are made of, checked: numbers, and colours with opacities."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.checks.arguments import one_of
from moit.checks.arrays import as_array, finite
from moit.reports.pictures import from_srgb

Array = NDArray[Any]


@dataclasses.dataclass(frozen=True)
class Attributes:
    """Reads arguments of one kind of part, whose errors these are."""

    error: type[ValueError]

    def numbers(self, value: ArrayLike, name: str, dtype: Any = np.float32) -> Array:
        """A copy of finite real numbers."""
        array = as_array(value, name)
        if array.dtype.kind not in "fiu":
            raise TypeError(f"{name}: expected real numbers, got {array.dtype}")
        return self.finite(array, name, dtype).copy()

    def finite(self, array: Array, name: str, dtype: Any) -> Array:
        try:
            return finite(array, name, dtype)
        except ValueError as error:
            raise self.error(*error.args) from None

    def one_of(self, name: str, value: Any, allowed: tuple[Any, ...]) -> None:
        try:
            one_of(name, value, allowed)
        except ValueError as error:
            raise self.error(*error.args) from None

    def each(
        self,
        value: ArrayLike,
        name: str,
        one: tuple[int, ...],
        count: int,
        dtype: Any = np.float32,
    ) -> Array:
        """(count, *one) of one for all or as many."""
        array = self.numbers(value, name, dtype)
        if array.shape == one:
            array = np.broadcast_to(array, (count, *one)).copy()
        if array.shape != (count, *one):
            raise self.error(f"{name}: expected shape {one} or {(count, *one)}, got {array.shape}")
        return array

    def opacities(self, value: ArrayLike, name: str, count: int) -> Array:
        """(count,) in [0, 1]."""
        found = self.each(self.fractions(value, name), name, (), count)
        self.check(found, name, (found >= 0) & (found <= 1), "a number in [0, 1]")
        return found

    def shades(
        self, color: ArrayLike, color_space: str, count: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """Linear colours (count, 3), and opacities where color has a fourth column."""
        self.one_of("color_space", color_space, ("linear", "srgb"))
        decode = color_space == "srgb"
        array = self.fractions(color, "color", decode)
        width = 4 if array.ndim and array.shape[-1] == 4 else 3
        array = self.each(array, "color", (width,), count)
        shades, own = array[:, :3], array[:, 3] if width == 4 else None
        self.check(array, "color", array >= 0, "a number that is not negative")
        if own is not None and (own > 1).any():
            at = int(np.argmax(own > 1))
            raise self.error(f"color[{at}, 3]: found {own[at]}; needed an alpha in [0, 1]")
        if decode:
            self.check(shades, "color", shades <= 1, "an sRGB number in [0, 1]")
            shades = from_srgb(shades).astype(np.float32)
        return np.ascontiguousarray(shades), own

    def fractions(self, value: ArrayLike, name: str, decode: bool = False) -> Array:
        """Numbers; integers are shares of their greatest, where that is asked for."""
        array = as_array(value, name)
        if array.dtype.kind not in "iu" or not array.size:
            return array
        small = array.dtype.kind == "u" and array.dtype.itemsize <= 2
        if decode:
            most = 65535 if small and array.dtype.itemsize == 2 else 255
            self.check(array, name, (array >= 0) & (array <= most), f"an integer in [0, {most}]")
            return array / np.float64(most)
        if small or (name == "color" and int(array.max()) > 1):
            raise TypeError(
                f"{name}: found {array.dtype} up to {array.max()}; needed real numbers, of which 1 "
                "is full. Divide integers by their greatest (255 for 8 bits); those that a "
                "picture's pixels have are decoded by color_space='srgb'"
            )
        return array

    def check(self, array: Array, name: str, good: NDArray[np.bool_], needed: str) -> None:
        if not good.all():
            at = np.unravel_index(int(np.argmin(good)), array.shape)
            place = ", ".join(str(int(i)) for i in at)
            raise self.error(f"{name}[{place}]: found {array[at]}; needed {needed}")
