"""WGSL: no preprocessor, declarations the other way round, no `? :` and no `precise`.

WGSL lets a compiler regroup sums and fuse products. What is precise therefore goes through
`moit_kept`, whose bits no rule of arithmetic can see through: an exclusive or with a word that is 0
but that no compiler knows to be.
"""

from __future__ import annotations

from moit.kit.languages import Context, Language
from moit.kit.tokens import (
    ASSIGNS,
    TYPES,
    Item,
    SubsetError,
    Word,
    closing,
    following,
    is_sign,
    members_of,
    parameters_of,
    preceding,
    returned_by,
    split,
    stripped,
    text_of,
    words_of,
)

_TYPES = {"float": "f32", "int": "i32", "uint": "u32", "bool": "bool"} | {
    f"{kind}vec{size}": f"vec{size}<{name}>"
    for kind, name in {"": "f32", "i": "i32", "u": "u32", "b": "bool"}.items()
    for size in (2, 3, 4)
}
_FUNCTIONS = {
    "packHalf2x16": "pack2x16float",
    "unpackHalf2x16": "unpack2x16float",
    "inversesqrt": "inverseSqrt",
    "floatBitsToUint": "bitcast<u32>",
    "floatBitsToInt": "bitcast<i32>",
    "bitCount": "countOneBits",
    "uintBitsToFloat": "bitcast<f32>",
    "intBitsToFloat": "bitcast<f32>",
}
KEPT = """\
// A sum as it is rounded, for good: WGSL has no `precise`, and its compilers may regroup sums. No
// rule of arithmetic sees through bits: moit_zero is 0, but no compiler can know, as it is the sign
// of what happens to be never negative.
var<private> moit_zero: u32;
fn moit_kept(x: f32) -> f32 { return bitcast<f32>(bitcast<u32>(x) ^ moit_zero); }"""


class Wgsl(Language):
    """WGSL's spelling."""

    def option(self, name: str, value: str) -> str:
        kind = "f32" if set(value) & set(".eE") else "i32"
        return f"override {name}: {kind} = {value};"

    def item(self, item: Item, context: Context) -> str:
        comments = text_of(item.words[: item.start])
        if item.kind == "struct":
            return comments + _struct(item)
        if item.kind == "constant":
            return comments + _constant(item, context)
        if item.kind == "function":
            return comments + _Function(item, context).text()
        if item.kind == "comment":
            return comments
        raise SubsetError(f"{item.names}: WGSL has no {item.kind}")


WGSL = Wgsl(
    "wgsl",
    "wgsl",
    _TYPES,
    "const",
    False,
    "Options are `override` constants, which a pipeline sets. What is left to the device is how "
    "exact exp2, log2 and division are.",
    "WGSL has no `precise`, and lets a compiler regroup sums and fuse products: where digits hang "
    "on how sums are rounded they go through `moit_kept`, whose bits no compiler sees through, and "
    "exact products are split into halves.",
    "moit_kept",
    constructs=True,
)


def type_of(name: str, size: str = "") -> str:
    spelled = _TYPES.get(name, name)
    return f"array<{spelled}, {size}>" if size else spelled


def _struct(item: Item) -> str:
    members = [f"{one.name}: {type_of(one.type, one.size)}" for one in members_of(item)]
    line = f"struct {item.names[0]} {{ {', '.join(members)} }}"
    if len(line) <= 100:
        return line
    return "\n".join([f"struct {item.names[0]} {{", *(f"    {one}," for one in members), "}"])


def _constant(item: Item, context: Context) -> str:
    words = item.words[item.start :]
    name = item.names[0]
    equals = next(at for at in range(len(words)) if is_sign(words, at, "="))
    end = next(at for at in range(len(words) - 1, 0, -1) if is_sign(words, at, ";"))
    declared = [word for word in words[:equals] if word.counts and word.text != "const"]
    size = ""
    for opens, word in enumerate(declared):
        if word.text == "[":
            size = text_of(declared[opens + 1 : closing(declared, opens)])
    value = _Function(item, context).expression(words[equals + 1 : end])
    type = type_of(declared[0].text, size)
    # arrays are read at places known at run time only
    start = "var<private>" if size else "const"
    return f"{start} {name}: {type} ={text_of(value)};" + text_of(words[end + 1 :])


class _Function:
    """One function's body, statement by statement."""

    def __init__(self, item: Item, context: Context) -> None:
        self.item = item
        self.structs = context.structs
        self.context = context
        self.precise: set[str] = set()
        whole = parameters_of(item) if item.kind == "function" else []
        self.integers = {one.name for one in whole if one.type == "int" and not one.size}

    def text(self) -> str:
        words = self.item.words[self.item.start :]
        opens = next(at for at in range(len(words)) if is_sign(words, at, "{"))
        body = words[opens + 1 : closing(words, opens)]
        self.assigned = _assigned(body)
        listed, copies = [], ""
        for one in parameters_of(self.item):
            name = one.name
            if name in self.assigned:  # WGSL's parameters stay as they are
                copies += f"\n    var {name} = {name}_given;"
                name += "_given"
            listed.append(f"{name}: {type_of(one.type, one.size)}")
        returned = returned_by(self.item)
        arrow = "" if returned == "void" else f" -> {type_of(returned)}"
        for one in parameters_of(self.item):
            if one.type in self.context.begins and self.item.names[0] in self.context.keeping:
                begin = self.context.begins[one.type].format(one.name)
                copies += f"\n    moit_zero = bitcast<u32>({begin}) >> 31u;"
        inside = text_of(self.statements(body))
        if copies and not inside.startswith("\n"):
            inside = f"\n    {inside.strip()}\n"
        return f"fn {self.item.names[0]}({', '.join(listed)}){arrow} {{{copies}{inside}}}"

    def statements(self, words: list[Word]) -> list[Word]:
        found: list[Word] = []
        at = 0
        while at < len(words):
            if not words[at].counts:
                found.append(words[at])
                at += 1
                continue
            at = self.statement(words, at, found)
        return found

    def statement(self, words: list[Word], at: int, found: list[Word]) -> int:
        """Puts the statement at `at` into `found`; where the next begins."""
        word = words[at]
        if word.kind == "directive":
            raise SubsetError(f"{self.item.names}: found {word.text}; WGSL has no preprocessor")
        if is_sign(words, at, "{"):
            end = closing(words, at)
            found += [word, *self.statements(words[at + 1 : end]), words[end]]
            return end + 1
        if word.text in ("if", "for"):
            opens = following(words, at)
            end = closing(words, opens)
            inside = words[opens + 1 : end]
            head = self.loop(inside) if word.text == "for" else self.expression(inside)
            found += [word, *words_of(" ("), *head, *words_of(") ")]
            return self.block(words, end, found)
        if word.text == "else":
            after = following(words, at)
            found += [word, Word("space", " ")]
            if words[after].text == "if":
                return self.statement(words, after, found)
            return self.block(words, at, found)
        end = at
        while not is_sign(words, end, ";"):
            end = closing(words, end) if is_sign(words, end, "(", "[", "{") else end
            end += 1
        found += [*self.simple(words[at:end]), words[end]]
        return end + 1

    def block(self, words: list[Word], before: int, found: list[Word]) -> int:
        """What follows `if (...)` or `else`, in braces."""
        start = following(words, before)
        if is_sign(words, start, "{"):
            return self.statement(words, start, found)
        found += words_of("{ ")
        end = self.statement(words, start, found)
        found += words_of(" }")
        return end

    def loop(self, words: list[Word]) -> list[Word]:
        first, until, step = split(words, ";")
        names = [word.text for word in first if word.kind == "name"]
        self.assigned.add(names[1])
        parts = [self.simple(stripped(first)), self.expression(until), self.simple(stripped(step))]
        return words_of(f"{text_of(parts[0])};{text_of(parts[1])}; {text_of(parts[2])}")

    def simple(self, words: list[Word]) -> list[Word]:
        """A declaration, an assignment, a step, or return."""
        counted = [word for word in words if word.counts]
        start, is_precise = 0, False
        while counted[start].text in ("precise", "const"):
            is_precise |= counted[start].text == "precise"
            start += 1
        type = counted[start].text
        if (type in TYPES or type in self.structs) and counted[start + 1].kind == "name":
            behind = words.index(counted[start + 1])
            return self.declaration(type, words[behind:], is_precise)
        if type == "return":
            place = words.index(counted[start])
            return [*words[: place + 1], *self.expression(words[place + 1 :])]
        if type in ("++", "--"):
            return [*self.expression(words[words.index(counted[0]) + 1 :]), Word("sign", type)]
        for at, word in enumerate(words):
            if word.kind == "sign" and word.text in ASSIGNS:
                target, value = words[:at], words[at + 1 :]
                name = counted[0].text
                spelled = self.expression(value)
                if name in self.precise:
                    if word.text != "=":
                        raise SubsetError(f"{name}: found {word.text}; needed = of what is precise")
                    spelled = words_of(f" moit_kept({text_of(stripped(spelled))})")
                return [*self.expression(target), word, *spelled]
        return self.expression(words)

    def declaration(self, type: str, words: list[Word], is_precise: bool) -> list[Word]:
        parts = []
        for part in split(words):
            part = stripped(part)
            name = part[0].text
            after = following(part, 0)
            size = ""
            if is_sign(part, after, "["):
                end = closing(part, after)
                size = text_of(part[after + 1 : end])
                after = following(part, end)
            spelled = type_of(type, size)
            if is_precise:
                if type != "float":
                    raise SubsetError(f"{name}: found precise {type}; needed precise float")
                self.precise.add(name)
            if not is_sign(part, after, "="):
                parts.append(f"var {name}: {spelled}")
                continue
            value = text_of(stripped(self.expression(part[after + 1 :])))
            if is_precise:
                value = f"moit_kept({value})"
            word = "var" if name in self.assigned or size else "let"
            # of what type it is the value says; but 1 alone would be an integer where it is not
            said = "" if type != "float" or "." in value or "(" in value else f": {spelled}"
            parts.append(f"{word} {name}{said} = {value}")
        return words_of("; ".join(parts))

    def expression(self, words: list[Word]) -> list[Word]:
        """With `? :` as select, and types and functions by WGSL's names."""
        parts = split(words)
        if len(parts) > 1:
            found = self.expression(parts[0])
            for part in parts[1:]:
                found += [Word("sign", ","), *self.expression(part)]
            return found
        chosen = split(words, "?")
        if len(chosen) > 1:
            condition = chosen[0]
            rest = words[len(condition) + 1 :]
            yes, no = _branches(rest)
            said = [text_of(stripped(self.expression(part))) for part in (no, yes, condition)]
            blank = words_of(" ") if words and words[0].kind == "space" else []
            return [*blank, *words_of(f"select({', '.join(said)})")]
        found = []
        at = 0
        while at < len(words):
            word = words[at]
            after = following(words, at)
            if is_sign(words, at, "(", "["):
                end = closing(words, at)
                found += [word, *self.expression(words[at + 1 : end]), words[end]]
                at = end + 1
                continue
            if word.text in TYPES and is_sign(words, after, "["):
                end = closing(words, after)
                size = text_of(words[after + 1 : end])
                found += words_of(type_of(word.text, size))
                at = end + 1
                continue
            if is_sign(words, at, "<<", ">>"):  # which take no signed count
                bracketed = is_sign(words, after, "(")
                end = closing(words, after) if bracketed else after
                count = words[after + bracketed : end + (not bracketed)]
                spelled = text_of(self.expression(count))
                if words[after].kind != "number":
                    spelled = f"u32({spelled})"
                found += [word, *words_of(f" {spelled}")]
                at = end + 1
                continue
            if word.kind != "name" or is_sign(words, preceding(words, at), "."):
                found.append(word)
            elif word.text in self.integers and _follows_float(words, at):
                found += words_of(f"f32({word.text})")
            elif word.text == "atan" and len(split(words[after + 1 : closing(words, after)])) == 2:
                found.append(Word("name", "atan2"))
            else:
                spelled = _TYPES.get(word.text) or _FUNCTIONS.get(word.text, word.text)
                found += words_of(spelled)
            at += 1
        return found


def _follows_float(words: list[Word], at: int) -> bool:
    """Whether a literal float is multiplied or divided by what stands there: of integers GLSL makes
    floats then."""
    sign = preceding(words, at)
    before = preceding(words, sign)
    return is_sign(words, sign, "*", "/") and before >= 0 and "." in words[before].text


def _branches(words: list[Word]) -> tuple[list[Word], list[Word]]:
    """Of what stands behind ?: before and behind its own colon."""
    depth = at = 0
    while at < len(words):
        if is_sign(words, at, "(", "["):
            at = closing(words, at)
        elif is_sign(words, at, "?"):
            depth += 1
        elif is_sign(words, at, ":"):
            if depth == 0:
                return words[:at], words[at + 1 :]
            depth -= 1
        at += 1
    raise SubsetError("found ? without :")


def _assigned(words: list[Word]) -> set[str]:
    """Names that are given another value after their declaration."""
    found: set[str] = set()
    for at, word in enumerate(words):
        if word.kind != "sign":
            continue
        if word.text in ("++", "--"):
            for near in (preceding(words, at), following(words, at)):
                if 0 <= near < len(words) and words[near].kind == "name":
                    found.add(words[near].text)
        if word.text not in ASSIGNS:
            continue
        place = preceding(words, at)
        start = place
        while start >= 0 and not is_sign(words, start, ";", "{", "}", ")"):
            if is_sign(words, start, "]"):  # back to where it opens
                while not is_sign(words, start, "["):
                    start -= 1
            start -= 1
        names = [one.text for one in words[start + 1 : at] if one.counts]
        if not names:
            continue
        while names[0] in ("precise", "const", "else"):
            names = names[1:]
        declares = len(names) > 1 and names[0].isidentifier() and names[1].isidentifier()
        if not declares and "," not in names:
            found.add(names[0])
    return found
