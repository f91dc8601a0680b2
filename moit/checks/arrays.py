"""Arrays from outside: whatever holds numbers on the CPU, as NumPy arrays of the right type."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit.checks.exceptions import FragmentsError, FragmentsTypeError

# Depth, alpha, color, transmission, back, emission and deviation, of one dtype.
Arrays = tuple[
    NDArray[Any],
    NDArray[Any],
    NDArray[Any] | None,
    NDArray[Any] | None,
    NDArray[Any] | None,
    NDArray[Any] | None,
    NDArray[Any] | None,
]

# DLPack's kinds of memory that a CPU can read: its own; CUDA's and ROCm's pinned memory; CUDA's
# managed memory.
READABLE = (1, 3, 11, 13)


def as_array(value: Any, name: str) -> NDArray[Any]:
    """`value` as a plain ndarray, without a copy where its memory can be shared.

    Takes NumPy arrays, numbers and nested sequences of them, and anything with `__array__`, the
    buffer protocol or DLPack on the CPU. Raises FragmentsTypeError for masked arrays, for memory
    of a GPU and for what is not an array, with `name` in the message.
    """
    if isinstance(value, np.ma.MaskedArray):
        raise FragmentsTypeError(
            f"{name}: expected an array without a mask, got a masked array; "
            "fill it with .filled(value) or drop what is masked with .compressed()"
        )
    if isinstance(value, np.ndarray):
        return np.asarray(value)
    try:
        device = value.__dlpack_device__() if hasattr(value, "__dlpack_device__") else None
        elsewhere = device is not None and int(device[0]) not in READABLE
        if not elsewhere:
            if device is not None and not hasattr(value, "__array__"):
                return np.from_dlpack(value)
            return np.asarray(value)
    except MemoryError:
        raise
    except Exception as error:  # a foreign object may raise anything
        raise FragmentsTypeError(
            f"{name}: expected an array, got {type(value).__name__}: {error}"
        ) from error
    raise FragmentsTypeError(
        f"{name}: expected an array in the CPU's memory, got {type(value).__name__} on another "
        "device; copy it with .cpu() or the like"
    )


def integers(value: Any, name: str) -> NDArray[Any]:
    """`value` as an array of integers that int64 can hold; see `as_array`."""
    array = as_array(value, name)
    if isinstance(value, (list, tuple)) and not value:
        return array.astype(np.int64)  # no element gives an empty list a type
    if array.dtype.kind not in "iu":
        raise FragmentsTypeError(f"{name}: expected integers, got {array.dtype}")
    if array.dtype.kind == "u" and array.dtype.itemsize == 8:
        large = (array > np.uint64(2**63 - 1)).reshape(-1)
        if large.any():
            at = int(large.argmax())
            raise FragmentsError(
                f"{name}[{at}]: found {array.reshape(-1)[at]}; needed an integer below 2**63"
            )
    return array


def real_arrays(
    depth: ArrayLike,
    alpha: ArrayLike,
    color: ArrayLike | None,
    transmission: ArrayLike | None,
    back: ArrayLike | None,
    emission: ArrayLike | None,
    deviation: ArrayLike | None,
    dtype: DTypeLike | None,
    dimensions: int = 1,
) -> Arrays:
    """The arrays, aligned, C-contiguous and of one dtype; what is so already is not copied.

    depth, alpha, back, deviation : `dimensions` dimensions, the same shape; color, transmission,
        emission : a last one of 3.
    dtype : float32, float64, or None for float64 where any of the arrays is, else float32.
    """
    given = {"depth": depth, "alpha": alpha, "color": color, "transmission": transmission}
    given |= {"back": back, "emission": emission, "deviation": deviation}
    found = {}
    for name, value in given.items():
        if value is None and name not in ("depth", "alpha"):
            continue
        found[name] = as_array(value, name)
        if found[name].dtype.kind not in "fiu":
            raise FragmentsTypeError(f"{name}: expected real numbers, got {found[name].dtype}")
        if name not in ("depth", "back", "deviation") and not isinstance(value, (list, tuple)):
            _refuse_integers(found[name], name)
    shape = found["depth"].shape
    if len(shape) != dimensions:
        expected = "(N,)" if dimensions == 1 else "(K, height, width)"
        raise FragmentsError(f"depth: expected {expected}, got {shape}")
    for name, array in found.items():
        needed = shape if name in ("depth", "alpha", "back", "deviation") else (*shape, 3)
        if array.shape != needed:
            raise FragmentsError(
                f"{name}: with depth of shape {shape}, {name} must be {needed}; got {array.shape}"
            )
    if emission is not None and color is None:
        raise FragmentsError("emission: without color there is no image to add it to; needed None")
    held = _dtype_of(found) if dtype is None else _dtype_named(dtype)
    with np.errstate(all="ignore"):  # what becomes infinite is reported as such
        ready = {name: np.require(a, held, ["C", "A"]) for name, a in found.items()}
    others = ("color", "transmission", "back", "emission", "deviation")
    color, transmission, back, emission, deviation = map(ready.get, others)
    return ready["depth"], ready["alpha"], color, transmission, back, emission, deviation


def _refuse_integers(array: NDArray[Any], name: str) -> None:
    """Arrays of integers are 8-bit images far more often than numbers; lists mean what they say."""
    if array.dtype.kind == "f" or not array.size:
        return
    most = np.iinfo(array.dtype).max
    helps = f"for a share divide by the greatest of the type: {name} / {most}"
    if name in ("color", "emission"):
        helps = (
            f"numbers that are linear radiance as they are become floats by {name}.astype(float); "
            "8-bit colours are mostly sRGB: divide by 255 and decode them to linear"
        )
    raise FragmentsTypeError(f"{name}: expected floats, got {array.dtype}; {helps}")


def _dtype_of(arrays: dict[str, NDArray[Any]]) -> np.dtype[Any]:
    # In either byte order; long double is none of the two and becomes float32.
    double = any(a.dtype.kind == "f" and a.dtype.itemsize == 8 for a in arrays.values())
    return np.dtype(np.float64 if double else np.float32)


def _dtype_named(dtype: DTypeLike) -> np.dtype[Any]:
    try:
        named = np.dtype(dtype)
    except (TypeError, ValueError) as error:
        raise FragmentsTypeError(f"dtype: expected float32, float64 or None; {error}") from None
    if named.kind != "f" or named.itemsize not in (4, 8):
        raise FragmentsTypeError(f"dtype: expected float32, float64 or None, got {named}")
    return named.newbyteorder("=")


def finite(array: NDArray[Any], name: str, dtype: DTypeLike) -> NDArray[Any]:
    """`array` as C-contiguous numbers of `dtype`, without a copy where it is that already.

    Raises ValueError naming the first number that is not finite there.
    """
    with np.errstate(over="ignore"):
        ready = np.require(array, dtype, ["C", "A"])
    good = np.isfinite(ready)
    if not good.all():
        at = np.unravel_index(int(np.argmin(good)), array.shape)
        place = f"[{', '.join(str(int(i)) for i in at)}]" if at else ""
        needed = "number" if not np.isfinite(array[at]) else f"{ready.dtype}"
        raise ValueError(f"{name}{place}: found {array[at]}; needed a finite {needed}")
    return ready
