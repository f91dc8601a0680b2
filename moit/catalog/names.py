"""The catalog of techniques, and what names in it stand for."""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import functools
import importlib
import re
from collections.abc import Iterable, Mapping
from typing import Any

from moit.catalog.aliases import ALIASES, separated
from moit.catalog.technique import Technique

# How names of a class begin, and its module and name, in the order of the documentation's table;
# moit.catalog.registered fills it.
CLASSES: dict[str, str] = {}

# Python's parser says of a text that is nested deeply that there is no memory: of none that is
# shorter than this.
NESTED = 1000


def techniques() -> list[Technique]:
    """One of every kind, with default options, in the order of the documentation's table.

    >>> "sorted" in [str(t) for t in moit.techniques()]
    True
    """
    return list(dict.fromkeys(one for start in CLASSES for one in _listed_of(start)))


@functools.cache
def class_of(start: str) -> type[Technique]:
    """The class that is registered with names that begin so."""
    module, name = CLASSES[start].split(".")
    found: type[Technique] = getattr(importlib.import_module(f"moit.catalog.{module}"), name)
    return found


@functools.cache
def _listed_of(start: str) -> tuple[Technique, ...]:
    made = class_of(start)
    return tuple(made(**options) for options in made.listed)


def start_of(name: str) -> str:
    """How a name begins, of the ways that are registered the longest; "" where none is."""
    return max((start for start in CLASSES if name.startswith(start)), key=len, default="")


def _named(base_name: str) -> Technique | None:
    """The technique with this name, or one like those listed but for the number in its name."""
    start = start_of(base_name)  # classes are loaded when they are needed
    return _named_of([start] if start else [], base_name) or _named_of(CLASSES, base_name)


def _named_of(starts: Iterable[str], base_name: str) -> Technique | None:
    candidates = [one for start in starts for one in _listed_of(start)]
    for one in candidates:
        if one.base_name == base_name:
            return one
    number = re.search(r"[0-9]{1,4}", base_name)
    if number is None:
        return None
    for one in candidates:
        for option in one._in_name:
            if type(getattr(one, option)) is int:
                with contextlib.suppress(ValueError):
                    other = dataclasses.replace(one, **{option: int(number[0])})
                    if other.base_name == base_name:
                        return other
    return None


def spelled(name: str) -> str:
    """A base name as the catalog spells it, whatever the case, the hyphens and the alias.

    >>> from moit.catalog.names import spelled
    >>> spelled("MBOIT"), spelled("MLAB_2"), spelled("mboit6-16"), spelled("A-Buffer")
    ('power4', 'mlab2', 'power6-16', 'sorted')
    """
    name = re.sub(r"[\s_]+", "-", name.strip().lower())
    name = ALIASES.get(name, name)
    parts = re.fullmatch(r"([a-z][a-z-]*?)-?([0-9]*)(-16)?", name)
    if parts is None:
        return name
    start = ALIASES.get(parts[1], parts[1])
    usual = class_of(start).usual if start in CLASSES else 0
    if not usual:
        return name
    number, words = parts[2], parts[3] or ""
    if number == "16" and name.endswith("-16") and not words and start in ("power", "trig"):
        number, words = "", "-16"
    return f"{start}{number or usual}{words}"


def technique(name: str | Technique) -> Technique:
    """The technique that `name` stands for: the inverse of `str`.

    name : as `power4` or `power4(bias=0.0,exclude_self=True)`: a name of `techniques()` and
        options of its class as Python literals. Names that people use stand for these: `MBOIT`,
        `mboit6`, `a-buffer`, `linked-list`, `mt`, `nmt`, `at`, `mlab`; their case does not
        matter. A technique is returned as it is.

    Raises ValueError where there is no such technique (with the nearest names) or option, or an
    option's value is bad; TypeError where `name` is no string.

    >>> moit.technique("power4") == moit.PowerMoments(4)
    True
    >>> str(moit.technique("MBOIT6"))
    'power6'
    """
    if isinstance(name, Technique):
        if not name.kind:
            raise TypeError(f"technique: {type(name).__name__} is no technique by itself")
        return name
    if not isinstance(name, str):
        raise TypeError(f"technique: expected a name or a technique, got {type(name).__name__}")
    several = separated(name)
    if len(several) > 1:
        raise ValueError(
            f"technique: expected one, got {len(several)} with commas between: {name!r:.80}"
        )
    parsed = re.fullmatch(r"([^()]+)(?:\((.*)\))?", name.strip(), re.DOTALL)
    said = parsed[1].strip() if parsed else name.strip()
    found = (_named(said) or _named(spelled(said))) if parsed else None
    if not parsed or not found:
        raise ValueError(f"technique: there is no {name!r:.80}{_suggested(said)}")
    options = _options_in(name, parsed[2] or "")
    fields = {field.name: field for field in dataclasses.fields(found)}
    known = list(fields)
    for option, value in options.items():
        if option not in known:
            from difflib import get_close_matches  # late: `import moit` stays quick

            near = get_close_matches(option, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else f"; it has {', '.join(known)}"
            raise ValueError(f"{said:.80}: there is no option {option!r:.80}{hint}")
        own = getattr(found, option)
        if option in found._in_name and value != own != fields[option].default:
            raise ValueError(f"{option}: {said} says {own!r}, got {value!r:.80}")
    try:
        return dataclasses.replace(found, **options)
    except TypeError as error:
        raise ValueError(*error.args) from None


NEAREST = 3  # names that a message suggests, at most


def _suggested(name: str) -> str:
    """The end of a message about an unknown technique: the nearest names and aliases."""
    from difflib import get_close_matches  # late: `import moit` stays quick

    known = [*(one.base_name for one in techniques()), *ALIASES]
    near = get_close_matches(name.strip().lower()[:80], known, n=NEAREST, cutoff=0.5)
    if not near:
        return "; moit.techniques(), or `moit techniques`, lists what there is"
    *others, last = map(repr, near)
    return f"; did you mean {', '.join(others)} or {last}?" if others else f"; did you mean {last}?"


def listed(given: Any) -> list[Technique]:
    """What an argument `techniques` means: names or techniques, one or several; None: all. A text
    may have several names, with commas between them.

    Raises TypeError and ValueError that name the argument.
    """
    if given is None:
        return list(techniques())
    if isinstance(given, (str, Technique)):
        given = [given]
    if not isinstance(given, Iterable):
        raise TypeError(
            f"techniques: expected techniques or their names, got {type(given).__name__}"
        )
    found = list(dict.fromkeys(technique(name) for one in given for name in names_in(one)))
    if not found:
        raise ValueError("techniques: expected at least one, got none")
    return found


def names_in(one: Any) -> list[Any]:
    """Those that a text has with commas between them; what is no text is one by itself."""
    return separated(one) if isinstance(one, str) else [one]


def _options_in(name: str, text: str) -> Mapping[str, Any]:
    if "network=Network(" in text:
        raise ValueError(
            "network: one in memory cannot be read back from a name; write it to a file "
            "(Network.write) and give the file's path"
        )
    try:
        call = ast.parse(f"f({text})", mode="eval").body
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and not call.args:
            names = [word.arg for word in call.keywords]
            if all(names) and len(set(names)) == len(names):
                return {str(word.arg): ast.literal_eval(word.value) for word in call.keywords}
    except (SyntaxError, ValueError, TypeError, RecursionError):
        pass
    except MemoryError:
        if len(text) < NESTED:
            raise
    raise ValueError(
        f"technique: expected options as name=value,... with plain values, got {name!r:.200}"
    )
