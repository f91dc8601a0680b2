"""A digest of functions and of what they hold, by which results tell whether they still answer.

It covers the text of a function, its code, its defaults, what it has captured, and the constants
and functions of its own package that it names. Of another package's the version stands for all.
"""

from __future__ import annotations

import functools
import inspect
import sys
import types
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

HEAP_TYPE = 1 << 9  # the flag of classes that are made while a program runs
PLAIN = (type(None), bool, int, float, complex, str, bytes, types.EllipsisType)


class Unknowable(Exception):
    """Something of which nobody can tell whether it is still the same."""


def source_digest(*values: Any) -> str | None:
    """The same for the same functions and values, in any process; None where that cannot be told.

    values : functions, methods, classes, objects that can be called; numbers, text, arrays, and
        containers of all of these.
    """
    reader = _Reader({_package_of(one) for value in values for one in _each(value)} - {"moit"})
    try:
        for value in values:
            reader.read(value)
    except Exception:  # a foreign object may raise anything
        return None
    return reader.digest.hexdigest()


class _Reader:
    """own : the packages whose sources are read."""

    def __init__(self, own: set[str]) -> None:
        self.own = own
        import hashlib  # late: `import moit` stays quick

        self.digest = hashlib.blake2b(digest_size=16)
        self.seen: dict[int, tuple[int, Any]] = {}  # held, so that no other gets the same id

    def read(self, value: Any) -> None:
        if not isinstance(value, PLAIN):
            if id(value) in self.seen:
                self.write("again", self.seen[id(value)][0])
                return
            self.seen[id(value)] = len(self.seen), value
        for kinds, way in WAYS:
            if isinstance(value, kinds):
                way(self, value)
                return
        self.write("object", type(value).__qualname__)
        self.read(type(value))
        self.read(_state_of(value))

    def write(self, *words: object) -> None:
        self.digest.update((repr(words) + "\n").encode())

    def plain(self, value: Any) -> None:
        self.write(type(value).__name__, value)

    def dtype(self, value: np.dtype[Any]) -> None:
        self.write("dtype", value.str)

    def array(self, value: Any) -> None:
        array = np.asarray(value)
        if array.dtype.hasobject:
            raise Unknowable
        self.write("array", array.dtype.str, array.shape)
        self.digest.update(np.ascontiguousarray(array).tobytes())

    def mapping(self, value: Mapping[Any, Any]) -> None:
        self.write("mapping", len(value))
        for key, held in value.items():
            self.read(key)
            self.read(held)

    def sequence(self, value: Any) -> None:
        self.write(type(value).__name__, len(value))
        for one in value:
            self.read(one)

    def members(self, value: Any) -> None:
        self.write("set", len(value))
        for one in sorted(source_digest(one) or "" for one in value):
            self.write(one)

    def module(self, value: types.ModuleType) -> None:
        self.write("module", value.__name__, getattr(value, "__version__", ""))

    def named(self, value: Any) -> None:
        """What is of C, or of another package: its name and the version."""
        package = sys.modules.get((getattr(value, "__module__", None) or "").partition(".")[0])
        name = getattr(value, "__qualname__", getattr(value, "__name__", ""))
        self.write("named", str(name), getattr(package, "__version__", ""))

    def method(self, value: types.MethodType) -> None:
        self.write("method")
        self.read(value.__func__)
        self.read(value.__self__)

    def partial(self, value: functools.partial[Any]) -> None:
        self.write("partial")
        self.read(value.func)
        self.read(value.args)
        self.read(value.keywords)

    def descriptor(self, value: Any) -> None:
        self.write(type(value).__name__)
        for name in ("__func__", "fget", "func"):
            if getattr(value, name, None) is not None:
                self.read(getattr(value, name))

    def a_class(self, value: type) -> None:
        """Its own attributes and those of its bases, up to what other packages bring."""
        self.write("class", value.__qualname__)
        for one in value.__mro__:
            if self.is_foreign(one):
                self.named(one)
                continue
            for name, held in sorted(vars(one).items()):
                written = not name.startswith("__") or name in ("__call__", "__post_init__")
                if written and name not in ("_abc_impl",):
                    self.write(name)
                    self.read(held)

    def function(self, value: types.FunctionType) -> None:
        if self.is_foreign(value):
            self.named(value)
            return
        self.write("function", value.__qualname__)
        try:
            self.write(inspect.getsource(value))
        except (OSError, TypeError):
            self.write("no source")
        self.code(value.__code__)
        self.read(value.__defaults__)
        self.read(value.__kwdefaults__)
        for cell in value.__closure__ or ():
            try:
                self.read(cell.cell_contents)
            except ValueError:
                self.write("empty")
        names = sorted(set(_names_in(value.__code__)))
        for name in names:
            if name in value.__globals__:
                self.write("global", name)
                self.reach(value.__globals__[name], names)

    def reach(self, value: Any, names: list[str]) -> None:
        """Reads what a function reaches by a global: of a module, what it may name there."""
        is_new = id(value) not in self.seen
        self.read(value)
        if is_new and isinstance(value, types.ModuleType) and not self.is_foreign(value):
            for name in names:
                if name in vars(value):
                    self.write("attribute", name)
                    self.reach(vars(value)[name], names)

    def is_foreign(self, value: Any) -> bool:
        """Whether a function, class or module is of a package whose version stands for it."""
        package = _package_of(value)
        if package in self.own:
            return False
        if package == "builtins":  # so, too, what was made without a module
            return not (isinstance(value, types.FunctionType) or _is_made(value))
        if package in ("moit", *sys.stdlib_module_names):
            return True
        file = getattr(sys.modules.get(package), "__file__", None) or ""
        return "site-packages" in file or "dist-packages" in file

    def code(self, value: types.CodeType) -> None:
        """The source may have changed on the disk since; and two lambdas of one line share it."""
        self.write("code", value.co_code, value.co_names, value.co_varnames)
        for one in value.co_consts:
            if isinstance(one, types.CodeType):
                self.code(one)
            elif isinstance(one, frozenset):
                self.members(one)
            else:
                self.write(one)


WAYS: tuple[tuple[Any, Any], ...] = (
    (PLAIN, _Reader.plain),
    ((np.ndarray, np.generic), _Reader.array),
    (np.dtype, _Reader.dtype),
    (Mapping, _Reader.mapping),
    ((tuple, list), _Reader.sequence),
    ((set, frozenset), _Reader.members),
    (types.ModuleType, _Reader.module),
    (types.MethodType, _Reader.method),
    (functools.partial, _Reader.partial),
    ((staticmethod, classmethod, property, functools.cached_property), _Reader.descriptor),
    (type, _Reader.a_class),
    (types.FunctionType, _Reader.function),
    ((types.BuiltinFunctionType, np.ufunc, types.GenericAlias), _Reader.named),
    ((types.MemberDescriptorType, types.GetSetDescriptorType), _Reader.named),
)


def _names_in(code: types.CodeType) -> Iterator[str]:
    yield from code.co_names
    for one in code.co_consts:
        if isinstance(one, types.CodeType):
            yield from _names_in(one)


def _package_of(value: Any) -> str:
    name = value.__name__ if isinstance(value, types.ModuleType) else value.__module__
    return str(name or "builtins").partition(".")[0]


def _is_made(value: Any) -> bool:
    return isinstance(value, type) and bool(value.__flags__ & HEAP_TYPE)


def _each(value: Any) -> list[Any]:
    """The functions and classes among what a value holds at once, and itself."""
    found = [value, *value.values()] if isinstance(value, Mapping) else [value]
    return [one for one in found if isinstance(one, (type, types.FunctionType))]


def _state_of(value: Any) -> Any:
    """What an object holds; of arrays of others, their numbers."""
    if hasattr(value, "__array__") or hasattr(value, "__dlpack__"):
        return np.asarray(value) if hasattr(value, "__array__") else np.from_dlpack(value)
    if hasattr(value, "__wrapped__"):  # what functools.cache and the like make
        return value.__wrapped__
    if not hasattr(value, "__dict__"):
        raise Unknowable
    return vars(value)
