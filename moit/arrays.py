"""Arrays from outside: whatever holds numbers on the CPU, as NumPy arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.exceptions import FragmentsError, FragmentsTypeError

# DLPack's kinds of memory that a CPU can read: its own, pinned and managed memory.
READABLE = (1, 3, 11, 13)


def as_array(value: Any, name: str) -> NDArray[Any]:
    """`value` as a plain ndarray, without a copy where its memory can be shared.

    Takes NumPy arrays, numbers and nested sequences of them, and anything with `__array__`, the
    buffer protocol or DLPack on the CPU. Raises FragmentsTypeError for masked arrays, for memory
    of a GPU and for what is not an array, with `name` in the message.
    """
    if isinstance(value, np.ma.MaskedArray):
        raise FragmentsTypeError(
            f"{name}: expected an array without a mask; use .filled(value) or .compressed()"
        )
    if isinstance(value, np.ndarray):
        return np.asarray(value)
    try:
        device = value.__dlpack_device__() if hasattr(value, "__dlpack_device__") else None
        if device is not None and int(device[0]) not in READABLE:
            raise FragmentsTypeError(
                f"{name}: expected an array in the CPU's memory, got {type(value).__name__} on "
                "another device; copy it with .cpu() or the like"
            )
        if device is not None and not hasattr(value, "__array__"):
            return np.from_dlpack(value)
        return np.asarray(value)
    except FragmentsError:
        raise
    except MemoryError:
        raise
    except Exception as error:  # whatever a foreign object raises
        raise FragmentsTypeError(
            f"{name}: expected an array, got {type(value).__name__}: {error}"
        ) from error


def integers(value: Any, name: str) -> NDArray[Any]:
    """`value` as an array of integers that int64 holds; see `as_array`."""
    array = as_array(value, name)
    if array.dtype.kind not in "iu":
        raise FragmentsTypeError(f"{name}: expected integers, got {array.dtype}")
    if array.dtype.kind == "u" and array.dtype.itemsize == 8:
        large = array > np.uint64(2**63 - 1)
        if large.any():
            at = int(large.reshape(-1).argmax())
            raise FragmentsError(
                f"{name}[{at}]: found {array.reshape(-1)[at]}; needed an integer below 2**63"
            )
    return array


def shape_text(array: NDArray[Any] | tuple[int, ...]) -> str:
    """A shape as messages show it."""
    return str(array if isinstance(array, tuple) else array.shape)
