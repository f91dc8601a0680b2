"""Fragments that lie record by record: structured arrays, and buffers that a GPU wrote."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit.checks.arrays import as_array
from moit.checks.exceptions import FragmentsError, FragmentsTypeError

# 16 bytes, as shaders append them: two integers in one word, two halves in each of two.
RECORD = np.dtype([("x", "<u2"), ("y", "<u2"), ("depth", "<f4"), ("rgba", "<f2", (4,))])

# What a field may be called, in any case; the first is what messages say.
NAMES = {
    "pixel": ("pixel", "index"),
    "x": ("x",),
    "y": ("y",),
    "xy": ("xy",),
    "depth": ("depth", "z"),
    "rgba": ("rgba",),
    "color": ("color", "colour", "rgb"),
    "r": ("r", "red"),
    "g": ("g", "green"),
    "b": ("b", "blue"),
    "alpha": ("alpha", "a", "opacity"),
    "transmission": ("transmission",),
    "back": ("back", "zback"),
    "emission": ("emission",),
    "deviation": ("deviation",),
}
SHAPES = {"xy": (2,), "rgba": (4,), "color": (3,), "transmission": (3,), "emission": (3,)}

Fields = dict[str, NDArray[Any]]


def columns(records: ArrayLike, layout: DTypeLike | None) -> Fields:
    """What `Fragments.from_pixels` takes, of records: see `Fragments.from_records`."""
    found = _fields(_structured(records, layout))
    columns: Fields = {}
    if "pixel" in found:
        columns["pixel"] = found["pixel"]
    if "xy" in found:
        columns["x"], columns["y"] = np.moveaxis(found["xy"], -1, 0)
    columns |= {name: found[name] for name in ("x", "y") if name in found}
    ways = [("pixel" in columns), ("xy" in found), ("x" in found or "y" in found)]
    if sum(ways) != 1 or ("x" in columns) != ("y" in columns):
        raise _missing("pixel, or x and y", found)
    if "depth" not in found:
        raise _missing("depth", found)
    columns["depth"] = found["depth"]
    if "rgba" in found:
        columns["color"], columns["alpha"] = found["rgba"][:, :3], found["rgba"][:, 3]
    if "color" in found:
        columns["color"] = found["color"]
    channels = [name for name in ("r", "g", "b") if name in found]
    if channels:
        columns["color"] = np.stack([found[name] for name in channels], axis=1)
    if "alpha" in found:
        columns["alpha"] = found["alpha"]
    colours = ("rgba" in found) + ("color" in found) + bool(channels)
    if colours > 1 or len(channels) not in (0, 3) or ("rgba" in found and "alpha" in found):
        raise _missing("one of rgba, color, or r, g and b", found)
    if "alpha" not in columns:
        raise _missing("alpha or rgba", found)
    others = ("transmission", "back", "emission", "deviation")
    return columns | {name: found[name] for name in others if name in found}


def _structured(records: ArrayLike, layout: DTypeLike | None) -> NDArray[Any]:
    if isinstance(records, (bytes, bytearray, memoryview)):
        array = np.frombuffer(records, np.uint8)
    else:
        array = as_array(records, "records")
    if array.dtype.names is None:
        array = _read_as(array, RECORD if layout is None else _layout(layout))
    elif layout is not None:
        raise FragmentsTypeError("layout: expected None, because records have fields of their own")
    return array.reshape(-1)


def _layout(layout: DTypeLike) -> np.dtype[Any]:
    try:
        named = np.dtype(layout)
    except (TypeError, ValueError) as error:
        raise FragmentsTypeError(f"layout: expected a structured dtype; {error}") from None
    if named.names is None or named.hasobject:
        raise FragmentsTypeError(f"layout: expected a structured dtype of numbers, got {named}")
    return named


def _read_as(array: NDArray[Any], layout: np.dtype[Any]) -> NDArray[Any]:
    """A buffer's bytes as records; what it holds as numbers is of no account."""
    if array.dtype.kind not in "fiuV" or array.dtype.hasobject:
        raise FragmentsTypeError(
            f"records: expected a structured array or a buffer of bytes, got {array.dtype}"
        )
    data = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    if len(data) % layout.itemsize:
        raise FragmentsError(
            f"records: found {len(data)} bytes; needed a multiple of {layout.itemsize}, the size "
            f"of a record ({', '.join(layout.names or ())})"
        )
    return data.view(layout)


def _fields(array: NDArray[Any]) -> Fields:
    """Each field by what it is; fields that mean nothing here are left out."""
    found: Fields = {}
    for field in array.dtype.names or ():
        name = next((name for name, known in NAMES.items() if field.lower() in known), None)
        if name is None:
            continue
        if name in found:
            raise FragmentsError(f"records: found two fields for {name}; needed one")
        values = array[field]
        needed = (len(array), *SHAPES.get(name, ()))
        if values.shape != needed:
            raise FragmentsError(
                f"records: field {field!r} must be {needed[1:] or 'one number'} a record; "
                f"got {values.shape[1:] or 'one number'}"
            )
        found[name] = values
    return found


def _missing(what: str, found: Fields) -> FragmentsError:
    return FragmentsError(
        f"records: needed {what}; found the fields {', '.join(found) or 'of no known name'}"
    )
