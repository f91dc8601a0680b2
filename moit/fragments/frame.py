"""What an OpenEXR file says of an image besides its pixels: windows, pixel aspect, metadata."""

from __future__ import annotations

import math
import numbers
import operator
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from moit.checks.windows import MOST, origin_of

# Types of a fixed number of values, as struct has them. OpenEXR's files are little-endian.
_NUMBERS = {
    "int": "i",
    "float": "f",
    "double": "d",
    "v2i": "2i",
    "v2f": "2f",
    "v2d": "2d",
    "v3i": "3i",
    "v3f": "3f",
    "v3d": "3d",
    "box2i": "4i",
    "box2f": "4f",
    "m33f": "9f",
    "m33d": "9d",
    "m44f": "16f",
    "m44d": "16d",
    "rational": "iI",
    "timecode": "2I",
    "keycode": "7i",
    "chromaticities": "8f",
}

# Types of other things, which are of this many bytes.
_SIZES = {"compression": 1, "envmap": 1, "lineOrder": 1, "tiledesc": 9}


@dataclass(frozen=True)
class Attribute:
    """One line of a header, as its bytes are in the file: nothing of it is lost when it is written
    again, whatever its type means."""

    raw_name: bytes
    raw_type: bytes
    data: bytes

    @property
    def name(self) -> str:
        return decoded(self.raw_name)

    @property
    def type(self) -> str:
        return decoded(self.raw_type)

    @property
    def value(self) -> Any:
        """int, float, str, a tuple of these, or the bytes of what is none of them."""
        data = self.data
        form = _NUMBERS.get(self.type)
        if form and struct.calcsize(f"<{form}") == len(data):
            found = struct.unpack(f"<{form}", data)
            return found[0] if len(found) == 1 else found
        if self.type == "string":
            return decoded(data)
        if self.type == "stringvector":
            return _strings(data)
        if self.type == "floatvector" and len(data) % 4 == 0:
            return struct.unpack(f"<{len(data) // 4}f", data)
        return data

    @property
    def sound(self) -> bool:
        """Whether its bytes can be what its type says. Of unknown types all can."""
        kind = self.type
        if kind in _NUMBERS or kind in ("stringvector", "floatvector"):
            return not isinstance(self.value, bytes)
        if kind == "bytes":
            return len(self.data) >= 4 + int.from_bytes(self.data[:4], "little")
        return len(self.data) == _SIZES.get(kind, len(self.data))


@dataclass(frozen=True)
class Frame:
    """Where an image lies on the display, and what else its file's header says.

    display_shape : (height, width) of the display window, at least one pixel.
    display_origin : (y, x) of its first pixel. The pixels that there are, the data window, may lie
        anywhere: they start at `Fragments.origin`.
    pixel_aspect : width of a pixel by its height, positive.
    attributes : the header's other lines, kept as they are in the file; `metadata` reads them.

    Fragments that `read_deep` made have one, and `write_image` and `write_deep` take it: so a
    picture lies where the deep image lay. Raises FragmentsError or TypeError.

    >>> frame = moit.Frame((1080, 1920), pixel_aspect=2.0)
    >>> moit.write_image("part.exr", np.ones((8, 6, 3)), origin=(20, 30), frame=frame)
    >>> moit.inspect("part.exr").parts[0].frame.display_shape
    (1080, 1920)
    """

    display_shape: tuple[int, int]
    display_origin: tuple[int, int] = (0, 0)
    pixel_aspect: float = 1.0
    attributes: tuple[Attribute, ...] = ()

    def __post_init__(self) -> None:
        shape, origin = _shape_of(self.display_shape), origin_of(self.display_origin)
        aspect = self.pixel_aspect
        if isinstance(aspect, bool) or not isinstance(aspect, numbers.Real):
            raise TypeError(f"pixel_aspect: expected a number, got {type(aspect).__name__}")
        if not 0 < float(aspect) < math.inf:
            raise ValueError(f"pixel_aspect: expected a positive number, got {aspect}")
        if not all(isinstance(one, Attribute) for one in self.attributes):
            raise TypeError("attributes: expected those of a Frame that was read from a file")
        object.__setattr__(self, "display_shape", shape)
        object.__setattr__(self, "display_origin", origin)
        object.__setattr__(self, "pixel_aspect", float(aspect))
        object.__setattr__(self, "attributes", tuple(self.attributes))

    @property
    def metadata(self) -> Mapping[str, Any]:
        """The header's other lines by name: int, float, str, tuples of these, or bytes of a type
        that is not known."""
        return MappingProxyType({one.name: one.value for one in self.attributes})


def _shape_of(shape: Any) -> tuple[int, int]:
    """(height, width), checked; no pixel of a display window is held, so there may be many."""
    try:
        height, width = (operator.index(side) for side in shape)
    except (TypeError, ValueError):
        raise TypeError(f"display_shape: expected two integers, got {shape!r:.80}") from None
    if not (1 <= height <= MOST and 1 <= width <= MOST):
        raise ValueError(
            f"display_shape: expected (height, width), each from 1 to {MOST}; got "
            f"({height}, {width})"
        )
    return height, width


def decoded(text: bytes) -> str:
    """Text of a header, which may be of a time before UTF-8."""
    try:
        return text.decode()
    except UnicodeDecodeError:
        return text.decode("latin-1")


def _strings(data: bytes) -> tuple[str, ...] | bytes:
    found, at = [], 0
    while at + 4 <= len(data):
        (length,) = struct.unpack_from("<i", data, at)
        if not 0 <= length <= len(data) - at - 4:
            return data
        found.append(decoded(data[at + 4 : at + 4 + length]))
        at += 4 + length
    return tuple(found) if at == len(data) else data
