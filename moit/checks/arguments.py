"""What arguments of many functions must be: their checks, and what these say."""

from __future__ import annotations

import operator
import os
from typing import Any

import numpy as np


def truth(name: str, value: Any) -> bool:
    """`value`, which must be True or False, Python's or NumPy's."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name}: expected True or False, got {value!r:.80}")
    return bool(value)


def whole(name: str, value: Any, least: int, most: int | None = None) -> int:
    """`value` as an int within [least, most]; truth values are no numbers."""
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected an integer, got {value!r:.80}") from None
    if most is None and number < least:
        raise ValueError(f"{name}: expected at least {least}, got {number}")
    if most is not None and not least <= number <= most:
        raise ValueError(f"{name}: expected an integer from {least} to {most}, got {number}")
    return number


def one_of(name: str, value: Any, allowed: tuple[Any, ...]) -> None:
    """Raises ValueError unless `value` is one of `allowed`, in type too."""
    try:
        found = any(value == one and type(value) is type(one) for one in allowed)
    except Exception:  # a foreign object may raise anything
        found = False
    if not found:
        shown = ", ".join(map(repr, allowed))
        raise ValueError(f"{name}: expected {shown}, got {value!r:.80}")


def path_name(path: str | bytes | os.PathLike[Any], name: str = "path") -> str:
    """A path as text, as `os.fsdecode` gives it."""
    try:
        found = os.fsdecode(path)
    except TypeError:
        raise TypeError(
            f"{name}: expected str, bytes or os.PathLike, got {type(path).__name__}"
        ) from None
    if "\0" in found:
        raise ValueError(f"{name}: expected no null character in a path, got {found!r:.80}")
    return found


def nearest(found: str, names: list[str]) -> str:
    """The end of a message about an unknown name: the nearest known one, or all of them."""
    from difflib import get_close_matches  # late: `import moit` stays quick

    match = get_close_matches(found.lower(), names, n=1)
    return f"; did you mean {match[0]!r}?" if match else f"; known: {', '.join(names)}"
