"""Functions that stand for kinds of techniques, each marked where it is written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from moit.catalog.technique import FACTS

F = TypeVar("F", bound=Callable[..., object])


class ByKind(Generic[F]):
    """A table of functions, of each kind at most one, in the order of the core's rows.

    >>> from moit.catalog.by_kind import ByKind
    >>> greetings = ByKind()
    >>> @greetings("sorted", "unsorted")
    ... def hello():
    ...     return "hello"
    >>> greetings.kinds, greetings["sorted"]()
    (('sorted', 'unsorted'), 'hello')
    """

    def __init__(self) -> None:
        self._functions: dict[str, F] = {}

    def __call__(self, *kinds: str) -> Callable[[F], F]:
        """Marks a function as that of these kinds. ValueError where the core's table has none, or
        another stands for it."""

        for kind in kinds:
            if kind not in FACTS:
                raise ValueError(f"kind: the core's table has no row for {kind!r}")
            if kind in self._functions:
                raise ValueError(f"kind: {kind!r} has {self._functions[kind].__name__} already")

        def mark(function: F) -> F:
            self._functions.update(dict.fromkeys(kinds, function))
            return function

        return mark

    def __contains__(self, kind: str) -> bool:
        return kind in self._functions

    def __getitem__(self, kind: str) -> F:
        return self._functions[kind]

    def get(self, kind: str) -> F | None:
        return self._functions.get(kind)

    @property
    def kinds(self) -> tuple[str, ...]:
        return tuple(kind for kind in FACTS if kind in self._functions)
