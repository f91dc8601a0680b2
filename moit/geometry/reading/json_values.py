"""Values of a JSON file, each checked when it is asked for; errors name where it stands."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from moit.checks.exceptions import MeshError

REQUIRED: Any = object()


@dataclasses.dataclass(frozen=True)
class Entry:
    """An object of a JSON file. where : such as "meshes[2].primitives[0]"; "" for the whole."""

    value: dict[str, Any]
    where: str = ""

    def place(self, key: str) -> str:
        return f"{self.where}.{key}" if self.where else key

    def __contains__(self, key: str) -> bool:
        return key in self.value

    def _get(self, key: str, default: Any) -> Any:
        found = self.value.get(key, default)
        if found is REQUIRED:
            raise MeshError(f"{self.place(key)}: needed, and not there")
        return found

    def integer(self, key: str, default: Any = REQUIRED, least: int = 0, most: int = 2**62) -> Any:
        found = self._get(key, default)
        if isinstance(found, float) and found.is_integer():
            found = int(found)
        if isinstance(found, bool) or not isinstance(found, int) or not least <= found <= most:
            if found is default:
                return default  # None, say
            raise MeshError(
                f"{self.place(key)}: found {found!r:.80}; needed an integer from {least} to {most}"
            )
        return found

    def index(self, key: str, count: int, default: Any = REQUIRED) -> Any:
        """An integer below `count`, or the default where it is not there."""
        if key not in self.value and default is not REQUIRED:
            return default
        if key in self.value and not count:
            raise MeshError(f"{self.place(key)}: found {self.value[key]!r:.80}; there are none")
        return self.integer(key, most=count - 1)

    def number(self, key: str, default: Any = REQUIRED) -> float:
        return _number(self._get(key, default), self.place(key))

    def numbers(self, key: str, count: int, default: Any = REQUIRED) -> list[float]:
        found = self._get(key, default)
        if not isinstance(found, list | tuple) or len(found) != count:
            raise MeshError(f"{self.place(key)}: found {found!r:.80}; needed {count} numbers")
        return [_number(one, f"{self.place(key)}[{i}]") for i, one in enumerate(found)]

    def text(self, key: str, default: Any = REQUIRED) -> Any:
        found = self._get(key, default)
        if found is not default and not isinstance(found, str):
            raise MeshError(f"{self.place(key)}: found {found!r:.80}; needed a text")
        return found

    def entry(self, key: str) -> Entry:
        """The object there; an empty one where there is none."""
        return _entry(self.value.get(key, {}), self.place(key))

    def entries(self, key: str) -> list[Entry]:
        """The objects of the list there; none where there is none."""
        return [_entry(one, f"{self.place(key)}[{i}]") for i, one in enumerate(self.items(key))]

    def items(self, key: str) -> list[Any]:
        found = self.value.get(key, [])
        if not isinstance(found, list):
            raise MeshError(f"{self.place(key)}: found {found!r:.80}; needed a list")
        return found

    def indices(self, key: str, count: int) -> list[int]:
        """The list there of integers below `count`."""
        found = self.items(key)
        for i, one in enumerate(found):
            if isinstance(one, bool) or not isinstance(one, int) or not 0 <= one < count:
                raise MeshError(
                    f"{self.place(key)}[{i}]: found {one!r:.80}; needed one of {count}, from 0"
                )
        return found


def _entry(value: Any, where: str) -> Entry:
    if not isinstance(value, dict):
        raise MeshError(f"{where}: found {value!r:.80}; needed an object")
    return Entry(value, where)


def _number(value: Any, where: str) -> float:
    good = isinstance(value, int | float) and not isinstance(value, bool)
    try:
        number = float(value) if good else math.nan
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise MeshError(f"{where}: found {value!r:.80}; needed a finite number")
    return number
