"""How an include is laid out: short statements share a line, as do short functions, and a comment
is one line. What is computed stays word for word."""

from __future__ import annotations

import dataclasses
import functools
import re
import textwrap
from collections.abc import Iterable

from moit.kit.tokens import Word, closing, following, is_sign, split, text_of, words_of

MOST = 100
FILLED = 6  # statements fill lines
RUN_ON = 7  # the tightest layout: functions do


def laid_out(text: str, tight: int = 0) -> list[str]:
    """Lines of declarations in any of the languages, with #if around some of them.

    tight : 0: what sets members of one thing shares a line; 1: all statements do where there is
        room; 2: and functions end on the line of their last statement; 3: and what one word of
        type declares may begin on a line and go on, with that word again, on the next; 5: and
        what holds others ends on their last line; 6: and statements fill lines, and go on where
        words may, on the next; 7: and so do whole functions, in which products have no blanks and
        nothing is said (the page says it).
    """
    return list(_laid_out(text, tight))


@functools.lru_cache(maxsize=4096)  # many includes share declarations
def _laid_out(text: str, tight: int) -> tuple[str, ...]:
    words = words_of(text)
    found: list[str] = []
    at = 0
    while at < len(words):
        word = words[at]
        if word.kind == "space":
            at += 1
        elif word.kind in ("comment", "directive"):
            found += comment_of(word.text) if word.kind == "comment" else [word.text.strip()]
            at += 1
        else:
            end = _end(words, at)
            found += _declaration(words[at:end], tight)
            at = end
    return tuple(found)


def comment_of(text: str, indent: str = "") -> list[str]:
    """A comment, in as few lines as it needs."""
    prefix = f"{indent}// "
    said = " ".join(line.strip().lstrip("/").strip() for line in text.splitlines())
    return textwrap.wrap(said, MOST, initial_indent=prefix, subsequent_indent=prefix)


def _end(words: list[Word], start: int) -> int:
    """Where a declaration ends: behind its body, or its semicolon."""
    at = start
    while at < len(words):
        if (
            is_sign(words, at, "{")
            and words[start].text != "struct"
            and "=" not in _said(words[start:at])
        ):
            return closing(words, at) + 1
        if is_sign(words, at, ";"):
            return at + 1
        if is_sign(words, at, "(", "[", "{"):
            at = closing(words, at)
            if words[start].text == "struct" and not is_sign(words, following(words, at), ";"):
                return at + 1  # WGSL's
        at += 1
    return at


def _said(words: list[Word]) -> list[str]:
    return [word.text for word in words if word.counts]


def _declaration(words: list[Word], tight: int) -> list[str]:
    opens = next((at for at in range(len(words)) if is_sign(words, at, "{")), None)
    is_function = opens is not None and "=" not in _said(words[:opens])
    if not is_function or words[0].text == "struct":
        return _constant(_flat(words))
    assert opens is not None
    head = f"{_flat(words[:opens])} {{"
    if tight == RUN_ON:
        braced = _UNBRACED.sub(r"\1 { \2 }", _flat(words))
        return _run_on(_PRODUCT.sub(r"\1", braced))
    body = _parts(words[opens + 1 : closing(words, opens)])
    line = f"{head} {' '.join(part.line for part in body)} }}"
    if len(line) <= MOST and len(body) <= 5 and all(part.shares for part in body):
        return [line]
    lines = [*_broken(head, ""), *_lines(body, "    ", tight), "}"]
    joins = body[-1].shares or (tight > 4 and "//" not in lines[-2])
    if tight > 1 and len(lines[-2]) + 2 <= MOST and joins:
        lines[-2:] = [f"{lines[-2]} }}"]
    return lines


def _run_on(text: str) -> list[str]:
    """In lines that end with statements where that leaves little room, else with arguments."""
    found: list[str] = []
    line = text
    while len(line) > MOST:
        room = line[: MOST + 1]
        ends = [
            (room.rfind("; ") + 1, 80),
            (room.rfind("{ ") + 1, 80),
            (room.rfind(", ") + 1, 88),
            (max(room.rfind(f" {sign} ") for sign in "+-?:"), 88),
            (room.rfind(" "), 5),
        ]
        place = next(at for at, least in ends if at >= least)
        found.append(line[:place])
        line = f"    {line[place:].strip()}"
    return [*found, line]


# What hangs on a condition or a loop without braces: another statement may stand behind it.
_UNBRACED = re.compile(r"\b((?:for|if) \((?:[^()]|\([^()]*\))*\)) (?!{)([^;{}]*;)")
_PRODUCT = re.compile(r"(?<=[\w)\]]) ([*/]) (?=[\w(-])")


def _constant(text: str) -> list[str]:
    if len(text) <= MOST:
        return [text]
    start, sign, rest = text.partition("(" if "(" in text and "{" not in text else "{")
    rest = rest.strip()
    if text.startswith("struct "):  # a member stays in one line
        rest = re.sub(r"(?<![;,]) (?!})", "\0", rest)
    more = textwrap.wrap(
        rest, MOST, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False
    )
    return [start + sign, *(one.replace("\0", " ") for one in more)]


def _flat(words: list[Word]) -> str:
    text = " ".join(text_of([word for word in words if word.kind != "comment"]).split())
    return re.sub(r"(?<=[(\[]) | (?=[)\],;])", "", text)


@dataclasses.dataclass(frozen=True)
class _Part:
    """A statement, or a comment.

    line : all of it.
    shares : whether others may stand on its line.
    head, body, tail : of what holds others, where one line is not enough: `head {` to `}`.
    type, declared : of a declaration, what stands before the names and each of these.
    """

    line: str
    shares: bool
    head: str = ""
    body: tuple[_Part, ...] = ()
    type: str = ""
    declared: tuple[str, ...] = ()

    @property
    def apart(self) -> tuple[_Part, ...]:
        """A declaration of each name by itself."""
        if not self.declared:
            return (self,)
        return tuple(
            _Part(f"{self.type} {one};", True, type=self.type, declared=(one,))
            for one in self.declared
        )


def _parts(words: list[Word]) -> list[_Part]:
    found: list[_Part] = []
    at = 0
    while at < len(words):
        word = words[at]
        if word.kind == "space":
            at += 1
        elif word.kind == "comment":
            said = " ".join(word.text.split())
            beside = found and "\n" not in words[at - 1].text
            if beside and len(found[-1].line) + len(said) + 6 <= MOST:
                found[-1] = _Part(f"{found[-1].line} {said}", False)
            else:
                found.insert(len(found) - bool(beside), _Part(said, False))
            at += 1
        else:
            at = _statement(words, at, found)
    return found


def _statement(words: list[Word], at: int, found: list[_Part]) -> int:
    """Puts the statement at `at` into `found`; where the next begins."""
    start = at
    while words[at].text in ("if", "for", "while", "else"):
        opens = following(words, at)
        if words[at].text == "else":
            at = opens
        else:
            at = following(words, closing(words, opens))
    if is_sign(words, at, "{"):
        end = closing(words, at) + 1
        inside = _parts(words[at + 1 : end - 1])
        head = f"{_flat(words[start:at])} {{".strip()
        line = " ".join([head, *(part.line for part in inside), "}"])
        if not all(part.shares for part in inside):
            line += " " * MOST  # never one line
        found.append(_Part(line, False, head, tuple(inside)))
        return end
    end = at
    while not is_sign(words, end, ";"):
        end = closing(words, end) if is_sign(words, end, "(", "[", "{") else end
        end += 1
    inside_words = words[start : end + 1]
    found += [
        _Part(" ".join(word.text.split()), False) for word in inside_words if word.kind == "comment"
    ]
    type, declared = _declared(words[at:end]) if start == at else ("", ())
    found.append(_Part(_flat(inside_words), start == at, type=type, declared=declared))
    return end + 1


def _declared(words: list[Word]) -> tuple[str, tuple[str, ...]]:
    """Of `type a = .., b = ..`; empty where a statement is nothing of the kind."""
    said = [at for at, word in enumerate(words) if word.counts]
    equals = next((n for n, at in enumerate(said) if is_sign(words, at, "=")), 0)
    if equals not in (2, 3) or words[said[0]].text in ("let", "var"):
        return "", ()  # WGSL has no such lists
    if any(words[at].kind != "name" for at in said[:equals]):
        return "", ()
    first = said[equals - 1]
    return _flat(words[:first]).strip(), tuple(_flat(one).strip() for one in split(words[first:]))


def _filling(parts: Iterable[_Part]) -> list[_Part]:
    """Statements that follow one another as one."""
    found: list[_Part] = []
    for part in parts:
        joins = part.shares and not part.head and found and found[-1].shares and not found[-1].head
        if joins:
            found[-1] = _Part(f"{found[-1].line} {part.line}", True)
        else:
            found.append(part)
    return found


def _lines(parts: Iterable[_Part], indent: str, tight: int) -> list[str]:
    found: list[str] = []
    before: _Part | None = None  # what a line has room behind
    if tight > 5:
        parts = _filling(parts)
    if tight > 2:
        parts = [one for part in parts for one in part.apart]
    for part in parts:
        line = indent + part.line
        more = f", {part.declared[0]};" if part.declared else ""
        if (
            tight > 2
            and before
            and more
            and before.type == part.type
            and len(found[-1]) + len(more) - 1 <= MOST
        ):
            found[-1] = found[-1][:-1] + more
        elif before and _belong(before, part, tight) and len(found[-1]) + len(part.line) < MOST:
            found[-1] += f" {part.line}"
        elif len(line) <= MOST:
            found.append(line)
        elif tight > 5 and not part.head and not part.line.startswith("//"):
            found += textwrap.wrap(
                part.line,
                MOST,
                initial_indent=indent,
                subsequent_indent=f"{indent}    ",
                break_long_words=False,
                break_on_hyphens=False,
            )
        elif part.head:
            found += _broken(indent + part.head, indent)
            found += [*_lines(part.body, indent + "    ", tight), indent + "}"]
            if tight > 4 and "//" not in found[-2] and len(found[-2]) + 2 <= MOST:
                found[-2:] = [f"{found[-2]} }}"]
        elif part.line.startswith("//"):
            found += comment_of(part.line, indent)
        else:
            found += _broken(line, indent)
        before = part if part.shares and len(line) <= MOST else None
    return found


def _belong(before: _Part, part: _Part, tight: int) -> bool:
    """Whether a statement may stand behind another on its line."""
    if not part.shares or re.fullmatch(r"(?!return\b)(var )?\w+(: )? ?\w+;", part.line):
        return False  # what is made of its members begins a line
    if tight:
        return True
    sets = re.compile(r"\w+\.\w+ = |(var )?\w+(: )? ?\w+;")
    return bool(sets.match(before.line) and sets.match(part.line))


def _broken(line: str, indent: str) -> list[str]:
    """A statement in lines that are not too long, broken where the fewest brackets are open, and
    behind a comma rather than elsewhere."""
    if len(line) <= MOST:
        return [line]
    places: list[tuple[int, bool, int]] = []  # brackets that are open, no comma, place
    depth = 0
    least = max(len(indent) + 8, MOST // 3)
    for at, sign in enumerate(line[: MOST + 1]):
        depth += (sign in "([{") - (sign in ")]}")
        if at >= least and sign == " ":
            is_comma = line[at - 1] == ","
            if is_comma or line[at + 1] in "-+*/?:|&" or line[at - 1] == "=":
                places.append((depth + 2 * (line[at - 1] == "="), not is_comma, at))
    if not places:
        return [line]
    fewest = min(place[:2] for place in places)
    place = max(at for *rank, at in places if tuple(rank) == fewest)
    rest = f"{indent}    {line[place:].strip()}"
    return [line[:place].rstrip(), *_broken(rest, indent)]


# Where a first sentence ends: before a capital, or what is written as one; and a clause in it.
_SENTENCE = re.compile(r"(?<=[^.A-Z][.])\s+(?=[A-Z`(])")
_CLAUSE = re.compile(r"[;:] |, (?=which |where )|(?<=[a-z]) (?=\([A-Z])")


def first_sentence(text: str, room: int = MOST - 3) -> str:
    """Of a comment: as much as there is room for, where a clause ends there; else all of it."""
    first = _SENTENCE.split(text, maxsplit=1)[0]
    if len(first) <= room:
        return first
    starts = [found.start() for found in _CLAUSE.finditer(first)]
    cuts = [
        at for at in starts if 20 <= at < room and first[:at].count("(") == first[:at].count(")")
    ]
    return f"{first[: cuts[-1]]}." if cuts else first
