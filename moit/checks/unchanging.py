"""What does not change once it is made: copied, and sent to other processes, as it is."""

from __future__ import annotations

from typing import Any

import numpy as np


class Unchanging:
    """Of what has values that nobody sets again, in slots or not."""

    __slots__ = ()

    def __reduce__(self) -> tuple[Any, ...]:
        slots = [name for one in type(self).__mro__ for name in getattr(one, "__slots__", ())]
        values = {name: getattr(self, name) for name in slots} | getattr(self, "__dict__", {})
        return _restored, (type(self), values)


def _restored(cls: type[Unchanging], values: dict[str, Any]) -> Unchanging:
    """With copies of arrays: those of a message begin anywhere, and may be changed by others."""
    made = object.__new__(cls)
    for name, value in values.items():
        if isinstance(value, np.ndarray):
            value = np.array(value, order="C")
            value.flags.writeable = False
        object.__setattr__(made, name, value)
    return made
