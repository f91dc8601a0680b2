"""One text of an engine reading, with what it includes and what options decide: what goes home."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from moit.gpu import texts
from moit.kit.tokens import (
    Item,
    SubsetError,
    Word,
    closing,
    is_sign,
    items_of,
    split,
    stripped,
    text_of,
    words_of,
)

_INCLUDE = re.compile(r'\s*#\s*include\s+"(.+)"')
_DEFINE = re.compile(r"\s*#\s*define\s+(\w+)(\([^)]*\))?[ \t]*(.*)")
_DIRECTIVE = re.compile(r"\s*#\s*(\w+)\s*(.*?)\s*(//.*)?$")
_OPTION = re.compile(r"\s*#\s*ifndef\s+(\w+)\n\s*#\s*define\s+\1\s+(.*)\n\s*#\s*endif")
_EXPRESSION = re.compile(r"[\w\s()!=<>&|+*/-]*")

# A define's parameters, None for none, and what it stands for.
Macros = dict[str, tuple[list[str] | None, str]]


def needed_items(
    name: str,
    fixed: Mapping[str, object],
    entries: Iterable[str],
    arrays: Mapping[str, Iterable[float]],
    made: str = "",
) -> list[Item]:
    """What `entries` need, as far as the text `name` declares these, in its order, each with its
    comments.

    fixed : defines that are decided: #if goes, and names become their values. What else a text
        has a default for (#ifndef, #define, #endif) stays as an option, and so does #if on it.
    arrays : constants that the text reads and does not declare.
    made : the text itself, where no file has it.
    """
    pasted = _Pasted({key: (None, str(value)) for key, value in fixed.items()})
    for constant, numbers in arrays.items():
        pasted.items += items_of(_array(constant, [str(np.float32(one)) for one in numbers]), name)
    pasted.add(name, made)
    return _reached(pasted.items, entries, name)


def _array(name: str, numbers: list[str]) -> str:
    numbers = [one if set(one) & set(".e") else f"{one}.0" for one in numbers]
    lines = textwrap.wrap(", ".join(numbers), 96, break_on_hyphens=False)
    inside = "\n".join(f"    {line}" for line in lines)
    size = len(numbers)
    return f"const float {name}[{size}] = float[{size}](\n{inside});\n"


class _Pasted:
    """What a text and its includes declare."""

    def __init__(self, macros: Macros) -> None:
        self.macros = macros
        self.items: list[Item] = []
        self.options: set[str] = set()
        self._seen: set[str] = set()

    def add(self, name: str, made: str = "") -> None:
        if name in self._seen:
            return
        self._seen.add(name)
        lines = (made or texts.plain(name)).splitlines()
        states: list[tuple[str, bool, bool]] = []  # kind, whether taken now, whether one was taken
        part: list[str] = []
        at = 0
        while at < len(lines):
            line = lines[at]
            at += 1
            taken = all(state[1] for state in states)
            match = _DIRECTIVE.match(line)
            if match is None:
                if taken:
                    part.append(line)
                continue
            word, said = match[1], match[2]
            option = _OPTION.match("\n".join(lines[at - 1 : at + 2])) if taken else None
            if option:
                at += 2
                self._option(name, part, option[1], option[2].split("//")[0].strip())
            elif word in ("if", "ifdef", "ifndef"):
                if taken and self.options & set(re.findall(r"\w+", said)):
                    part.append(line)
                    states.append(("kept", True, True))
                else:
                    holds = taken and _holds(word, said, self.macros)
                    states.append(("decided", holds, holds))
            elif word in ("else", "elif", "endif"):
                kind, _, was = states.pop()
                around = all(state[1] for state in states)
                if kind == "kept":
                    part.append(line)
                if word != "endif":
                    more = word == "else" or (around and _holds("if", said, self.macros))
                    now = kind == "kept" or (not was and around and more)
                    states.append((kind, now, was or now))
            elif not taken or word in ("version", "line", "extension", "pragma"):
                continue
            elif include := _INCLUDE.match(line):
                self._declare(name, part)
                self.add(include[1])
            elif define := _DEFINE.match(line):
                if define[1] not in self.macros:  # what is given wins
                    names = re.findall(r"\w+", define[2]) if define[2] else None
                    self.macros[define[1]] = (names, define[3].split("//")[0].strip())
            elif word == "undef":
                self._declare(name, part)  # by what the name stands for until here
                self.macros.pop(said, None)
            else:
                raise SubsetError(f"{name}: found {line.strip()!r}")
        self._declare(name, part)

    def _declare(self, name: str, part: list[str]) -> None:
        text = "\n".join(part) + "\n"
        self.items += items_of(text_of(_expanded_for_good(words_of(text), self.macros)), name)
        part.clear()

    def _option(self, file: str, part: list[str], name: str, value: str) -> None:
        comments: list[str] = []
        while part and part[-1].lstrip().startswith("//"):
            comments.insert(0, part.pop())
        self._declare(file, part)
        if name in self.macros:
            return
        before = [
            word for line in comments for word in (Word("comment", line), Word("space", "\n"))
        ]
        words = [*before, *words_of(value)]
        self.items.append(Item("option", (name,), words, len(before), file))
        self.options.add(name)


def _holds(word: str, said: str, macros: Macros) -> bool:
    if word != "if":
        return (said in macros) == (word == "ifdef")
    said = re.sub(r"defined\s*\(?\s*(\w+)\s*\)?", lambda found: str(int(found[1] in macros)), said)
    for _ in range(8):  # values may be names
        said = re.sub(
            r"\b[A-Za-z_]\w*", lambda found: macros.get(found[0], (None, found[0]))[1], said
        )
    said = re.sub(r"(?<=\d)[uU]\b", "", said)
    if re.search(r"[A-Za-z_]", said) or not _EXPRESSION.fullmatch(said):
        raise SubsetError(f"#if {said}: found a name without a value")
    python = said.replace("&&", " and ").replace("||", " or ")
    return bool(eval(re.sub(r"!(?!=)", " not ", python), {"__builtins__": {}}))


def _expanded_for_good(words: list[Word], macros: Macros) -> list[Word]:
    """Names of defines become what they stand for. The dialect's K makes floats of literals, which
    they are."""
    for _ in range(8):
        words, changed = _expanded(words, macros)
        if not changed:
            break
    found: list[Word] = []
    at = 0
    while at < len(words):
        inside = words[at + 2 : at + 3] if is_sign(words, at + 1, "(") else []
        if words[at].text == "float" and inside and _is_float(inside[0].text):
            if is_sign(words, at + 3, ")"):
                found.append(inside[0])
                at += 4
                continue
        found.append(words[at])
        at += 1
    return found


def _is_float(text: str) -> bool:
    return text[:1].isdigit() and bool(set(text) & set(".eE")) and not text.startswith("0x")


def _expanded(words: list[Word], macros: Macros) -> tuple[list[Word], bool]:
    found: list[Word] = []
    changed = False
    at = 0
    while at < len(words):
        word = words[at]
        macro = macros.get(word.text) if word.kind == "name" else None
        if macro is None:
            found.append(word)
            at += 1
            continue
        names, value = macro
        content = words_of(value)
        if names is None:
            at += 1
        elif is_sign(words, at + 1, "("):
            end = closing(words, at + 1)
            given = [stripped(part) for part in split(words[at + 2 : end])]
            by_name = dict(zip(names, given, strict=True)) if names else {}
            content = [
                one
                for part in content
                for one in (by_name.get(part.text, [part]) if part.kind == "name" else [part])
            ]
            at = end + 1
        else:
            found.append(word)
            at += 1
            continue
        found += [Word(one.kind, one.text) for one in content]
        changed = True
    return found, changed


def _reached(items: list[Item], entries: Iterable[str], main: str) -> list[Item]:
    declared: dict[str, list[Item]] = {}
    for item in items:
        for name in item.names:
            declared.setdefault(name, []).append(item)
    reached: set[int] = set()
    waiting = list(entries)
    while waiting:
        for item in declared.get(waiting.pop(), ()):
            if id(item) not in reached:
                reached.add(id(item))
                waiting += sorted(item.used)
    return list(_with_comments(items, reached, main))


def _with_comments(items: list[Item], reached: set[int], main: str) -> Iterator[Item]:
    """Comments of a file stand where something of it does; those of the first file come first."""
    files = {item.file for item in items if id(item) in reached}
    first = [item for item in items if item.kind == "comment" and item.file == main]
    yield from first
    for item in items:
        if id(item) in reached or (item.kind == "comment" and item.file in files - {main}):
            yield item
