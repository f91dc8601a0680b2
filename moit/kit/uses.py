"""What in a text uses what."""

from __future__ import annotations

from collections.abc import Iterable

from moit.kit.memory import OPERATIONS, Memory
from moit.kit.tokens import Item


def keeping_of(items: list[Item], entries: tuple[str, ...]) -> set[str]:
    """Which of `entries` call what is precise, or are."""
    keeping = {name for item in items if "precise" in item.used for name in item.names}
    return reaching(items, keeping) & set(entries)


def touched_by(
    name: str, items: list[Item], memory: Iterable[Memory]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The arrays that a function reads, and those that it changes, itself or by others."""
    used = {one: item.used for item in items if item.kind == "function" for one in item.names}
    found: set[str] = set()
    waiting = [name]
    while waiting:
        more = used.get(waiting.pop(), set()) - found
        found |= more
        waiting += more
    reads = [one.name for one in memory if f"moit_load_{one.name}" in found]
    changes = [
        one.name
        for one in memory
        if any(f"moit_{op}_{one.name}" in found for op in OPERATIONS if op != "load")
    ]
    return tuple(reads), tuple(changes)


def reaching(items: list[Item], first: set[str]) -> set[str]:
    """These names, and those of items that use them."""
    found = set(first)
    while more := {name for item in items if item.used & found for name in item.names} - found:
        found |= more
    return found
