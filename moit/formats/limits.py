"""How much a file may become in memory: no more than it can honestly hold, unless asked for.

A few kilobytes can claim to be gigabytes, and compressed zeros are. What files mostly hold is
within these bounds; the callers' argument `memory` takes their place.
"""

from __future__ import annotations

from moit.checks.arguments import whole

USUAL_MEMORY = 1 << 30  # bytes that any file may take
USUAL_GROWTH = 64  # times its own size that a larger file may


def memory_for(memory: int | None, size: int) -> int:
    """Bytes that what is read from a file of `size` bytes may take.

    memory : the caller's argument of that name: at least 1, or None for the usual.

    Raises TypeError and ValueError that name it.
    """
    if memory is None:
        return max(USUAL_MEMORY, USUAL_GROWTH * size)
    return whole("memory", memory, 1)


class TooMuchMemory(ValueError):
    """A file that needs more memory than it may take."""

    def __init__(self, needed: int, most: int) -> None:
        super().__init__(f"it needs {needed} bytes of memory; it may take {most}")
        self.needed = needed

    def with_argument(self) -> str:
        """The message where the caller has the argument `memory`."""
        return f"{self}, and memory={self.needed} allows it"
