"""The subset of GLSL that shaders/engine is written in, as words: what translators work on.

A text stays as it was written, with its comments, blanks and breaks of lines; a translator changes
words and puts others between. So what goes home reads like what we wrote.
"""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Iterator

_VECTORS = (f"{kind}vec{size}" for kind in ("", "i", "u", "b") for size in (2, 3, 4))
TYPES = ("void", "float", "int", "uint", "bool", *_VECTORS)
ASSIGNS = ("=", "+=", "-=", "*=", "/=")

_WORD = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)
      | (?P<directive>(?<![^\n])[ \t]*\#[^\n]*)
      | (?P<space>\s+)
      | (?P<number>0[xX][0-9a-fA-F]+u?|(?:\d+\.\d*|\.\d+|\d+)(?:[eE][-+]?\d+)?[fu]?)
      | (?P<name>[A-Za-z_]\w*)
      | (?P<sign>\+\+|--|&&|\|\||<<|>>|[-+*/<>=!]=|[-+*/<>=!?:;,.(){}\[\]&|^~%])""",
    re.VERBOSE | re.DOTALL,
)


class SubsetError(Exception):
    """A text of shaders/engine is not in the subset: our mistake, not a user's."""


@dataclasses.dataclass(eq=False, slots=True)
class Word:
    kind: str  # comment, directive, space, number, name, sign
    text: str

    @property
    def counts(self) -> bool:
        return self.kind not in ("space", "comment")


def words_of(text: str) -> list[Word]:
    return [Word(kind, said) for kind, said in _said(text)]


@functools.lru_cache(maxsize=4096)  # most texts are short and come again: "(", a name, a number
def _said(text: str) -> tuple[tuple[str, str], ...]:
    found, at = [], 0
    while at < len(text):
        match = _WORD.match(text, at)
        if match is None:
            line = text.count("\n", 0, at) + 1
            raise SubsetError(f"line {line}: found {text[at : at + 20]!r}; needed GLSL's subset")
        assert match.lastgroup
        found.append((match.lastgroup, match[0]))
        at = match.end()
    return tuple(found)


def text_of(words: list[Word]) -> str:
    return "".join(word.text for word in words)


def following(words: list[Word], at: int) -> int:
    """The place of the first word behind `at` that counts, or the end."""
    at += 1
    while at < len(words) and not words[at].counts:
        at += 1
    return at


def preceding(words: list[Word], at: int) -> int:
    """The same before `at`; -1 where there is none."""
    at -= 1
    while at >= 0 and not words[at].counts:
        at -= 1
    return at


BRACKETS = {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}


def closing(words: list[Word], at: int) -> int:
    """Where the bracket that opens at `at` closes."""
    depth = 0
    for place in range(at, len(words)):
        word = words[place]
        if word.kind == "sign":
            depth += BRACKETS.get(word.text, 0)
            if depth == 0:
                return place
    raise SubsetError(f"found {words[at].text!r} that is never closed")


def is_sign(words: list[Word], at: int, *signs: str) -> bool:
    if not 0 <= at < len(words):
        return False
    word = words[at]
    return word.text in signs and word.kind == "sign"


def split(words: list[Word], sign: str = ",") -> list[list[Word]]:
    """Parts between signs that no bracket holds."""
    parts: list[list[Word]] = [[]]
    depth = opened = 0
    for at, word in enumerate(words):
        if word.kind == "sign":
            if depth == 0 and word.text == sign:
                parts.append([])
                continue
            if depth == 0:
                opened = at
            depth = max(0, depth + BRACKETS.get(word.text, 0))
        parts[-1].append(word)
    if depth:
        closing(words, opened)  # says which is not closed
    return parts


def stripped(words: list[Word]) -> list[Word]:
    """Without blanks at both ends."""
    first, last = 0, len(words)
    while first < last and words[first].kind == "space":
        first += 1
    while last > first and words[last - 1].kind == "space":
        last -= 1
    return words[first:last]


@dataclasses.dataclass
class Item:
    """One thing that a text declares, with the comments before it.

    kind : struct, function, constant; condition, which holds others as they stand between
        directives; comment, which belongs to the file alone.
    names : what it declares.
    words : all of it.
    start : where in `words` its comments end.
    file : whose it is.
    """

    kind: str
    names: tuple[str, ...]
    words: list[Word]
    start: int
    file: str
    within: list[Item] = dataclasses.field(default_factory=list)

    @property
    def used(self) -> set[str]:
        """Names in it, those of directives, too."""
        found = {word.text for word in self.words if word.kind == "name"}
        for word in self.words:
            if word.kind == "directive":
                found |= set(re.findall(r"\w+", word.text))
        return found - set(self.names)


def items_of(text: str, file: str) -> list[Item]:
    """What a text without includes declares. Directives left in it are #if to #endif."""
    words = words_of(text)
    found: list[Item] = []
    at = 0
    while at < len(words):
        at, item = _item(words, at, file)
        if item:
            found.append(item)
    return found


def _item(words: list[Word], first: int, file: str) -> tuple[int, Item | None]:
    start = first
    while start < len(words) and not words[start].counts:
        # a comment that an empty line follows is the file's
        if words[start].kind == "space" and words[start].text.count("\n") > 1:
            before = stripped(words[first:start])
            if before:
                return start + 1, Item("comment", (), before, len(before), file)
        start += 1
    if start == len(words):
        rest = stripped(words[first:])
        return start, Item("comment", (), rest, len(rest), file) if rest else None
    if words[start].kind == "directive":
        end = _condition_end(words, start)
        inside = [
            item
            for part in _between_directives(words[start:end])
            for item in items_of(text_of(part), file)
        ]
        names = tuple(dict.fromkeys(name for item in inside for name in item.names))
        kind = "condition"
    else:
        kind, names, end = _declared(words, start)
        inside = []
        while end < len(words) and words[end].kind != "directive":  # a comment on the same line
            if words[end].kind == "comment" and "\n" not in text_of(words[start:end])[-1:]:
                end += 1
                break
            if words[end].kind == "space" and "\n" not in words[end].text:
                end += 1
                continue
            break
    item = Item(kind, names, [], 0, file, inside)
    body = stripped(words[start:end])
    before = stripped(words[first:start])
    if before:
        before.append(Word("space", "\n"))
    item.words, item.start = before + body, len(before)
    return end, item


def _condition_end(words: list[Word], start: int) -> int:
    depth = 0
    for at in range(start, len(words)):
        if words[at].kind == "directive":
            said = words[at].text.strip().lstrip("#").strip()
            depth += said.startswith("if") - said.startswith("endif")
            if depth == 0:
                return at + 1
    raise SubsetError("found #if without #endif")


def _between_directives(words: list[Word]) -> Iterator[list[Word]]:
    part: list[Word] = []
    for word in words:
        if word.kind == "directive":
            yield part
            part = []
        else:
            part.append(word)
    yield part


def _declared(words: list[Word], start: int) -> tuple[str, tuple[str, ...], int]:
    """Kind, names and end of a declaration."""
    end = start
    while not is_sign(words, end, ";", "{", "=", "("):
        end = following(words, end)
        if end >= len(words):
            raise SubsetError(f"found {text_of(words[start:end])[:40]!r}; needed a declaration")
    if words[start].text == "struct":
        name = words[following(words, start)].text
        end = following(words, closing(words, end))
        return "struct", (name,), end + 1
    if is_sign(words, end, "("):
        name = words[preceding(words, end)].text
        body = following(words, closing(words, end))
        if not is_sign(words, body, "{"):
            raise SubsetError(f"{name}: found a function without a body")
        return "function", (name,), closing(words, body) + 1
    name = next(
        words[at].text
        for at in range(end - 1, start, -1)
        if words[at].kind == "name" and is_sign(words, following(words, at), "[", "=", ";")
    )
    while not is_sign(words, end, ";"):
        end = closing(words, end) if is_sign(words, end, "(", "{", "[") else end
        end = following(words, end)
    return "constant", (name,), end + 1


@dataclasses.dataclass(frozen=True)
class Member:
    """Of a struct, or a parameter of a function; size: of an array, "" for none."""

    type: str
    name: str
    size: str = ""


def members_of(item: Item) -> list[Member]:
    """Of a struct."""
    opens = next(at for at in range(item.start, len(item.words)) if is_sign(item.words, at, "{"))
    inside = item.words[opens + 1 : closing(item.words, opens)]
    found = []
    for part in split(inside, ";"):
        counted = [word for word in part if word.counts]
        if counted:
            for one in split(counted[1:]):
                found.append(_member(counted[0].text, one))
    return found


def parameters_of(item: Item) -> list[Member]:
    """Of a function."""
    opens = next(at for at in range(item.start, len(item.words)) if is_sign(item.words, at, "("))
    inside = item.words[opens + 1 : closing(item.words, opens)]
    found = []
    for part in split(inside):
        counted = [word for word in part if word.counts and word.text not in ("const", "precise")]
        if counted:
            found.append(_member(counted[0].text, counted[1:]))
    return found


def returned_by(item: Item) -> str:
    """The type of a function."""
    return item.words[item.start].text


def _member(type: str, words: list[Word]) -> Member:
    return Member(type, words[0].text, text_of(words[2:-1]))
