"""The one include that an engine takes: a technique's text in a language, with its head, its
options, and what fetches a pixel's numbers from targets."""

from __future__ import annotations

import dataclasses
import hashlib
import re
from collections.abc import Iterator

from moit.catalog import Technique
from moit.catalog.targets import Target
from moit.kit.buffers import Buffer, buffer_of
from moit.kit.buffers import declared as buffering
from moit.kit.fetching import fetching
from moit.kit.gathered import Program, Touched
from moit.kit.languages import GLSL, HLSL, METAL, SLANG, Context, Language
from moit.kit.layout import FILLED, MOST, RUN_ON, comment_of, first_sentence, laid_out
from moit.kit.memory import Memory
from moit.kit.memory import declared as sharing
from moit.kit.ordered import NO_ORDER, Kept, keeping, start_of
from moit.kit.pasting import needed_items
from moit.kit.recipe import SAMPLED, Recipe, State, no_kit
from moit.kit.reserved import RESERVED
from moit.kit.rounds import WGSL_SAMPLES
from moit.kit.tokens import Item, Member, SubsetError, members_of, parameters_of, text_of, words_of
from moit.kit.uses import keeping_of, reaching, touched_by
from moit.kit.wgsl import KEPT, WGSL
from moit.system.version import VERSION

MOST_LINES = 250  # of an include, where its text can be laid out in so many
# What an include says in places of their own, not among its declarations.
_APART = ("option", "buffer", "memory")
LANGUAGES = {one.name: one for one in (GLSL, HLSL, WGSL, METAL, SLANG)}


@dataclasses.dataclass(frozen=True)
class Option:
    """What an engine may set: its default, and what the text says of it."""

    name: str
    value: str
    about: str


@dataclasses.dataclass(frozen=True)
class Include:
    """An include, and what a page says of it.

    calls : functions that an engine calls.
    heads : theirs, as declared.
    held, second, shaded : targets of pass 1, of a pass between that reads what pass 1 left, and of
        the pass that shades, by the names that they have.
    factors : what a pass between them may hand on, in targets of factor_formats; () for nothing.
    state, kept : words that fragments change in order, and how the include has them.
    buffers : what the text reads beside targets.
    shape, count : of a technique that the depth test sorts (moit.kit.recipe).
    side : of the blocks of pixels that `held` and `second` have a texel of; 1: of each pixel.
    memory, programs : arrays that fragments share, and the passes that change them.
    extents : targets of the pass before all others that finds each pixel's own range of depth.
    touching : functions of the text that read or change these.
    resolves : types of what `moit_resolve` is given.
    by_factors : of programs, what an engine calls beside the pass that shades where another pass
        makes factors.
    plain : the text with room for everything, however long: what is computed, whatever the layout.
    means : targets of the means of blocks, where fragments add at the picture's size.
    own_total : the target of `held` that pixels scale these to; "" where they do not.
    touched : of those that passes call which arrays they read, and which they change.
    notes : what the page says of functions, structs and constants, and of the whole ("") beyond
        the one line that each has in the text.
    """

    name: str
    language: Language
    text: str
    options: tuple[Option, ...]
    calls: tuple[str, ...]
    heads: tuple[str, ...]
    held: tuple[tuple[str, Target], ...]
    shaded: tuple[tuple[str, Target], ...]
    factors: tuple[Member, ...]
    notes: tuple[tuple[str, str], ...]
    state: State | None = None
    kept: Kept | None = None
    shape: str = ""
    count: int = 0
    factor_formats: tuple[str, ...] = ()
    buffers: tuple[Buffer, ...] = ()
    second: tuple[tuple[str, Target], ...] = ()
    side: int = 1
    memory: tuple[Memory, ...] = ()
    programs: tuple[Program, ...] = ()
    touching: tuple[str, ...] = ()
    touched: Touched = dataclasses.field(default_factory=dict)
    plain: str = ""
    extents: tuple[tuple[str, Target], ...] = ()
    resolves: tuple[str, ...] = ()
    by_factors: tuple[str, ...] = ()
    means: tuple[tuple[str, Target], ...] = ()
    own_total: str = ""

    @property
    def read_by_shading(self) -> tuple[tuple[str, Target], ...]:
        """Of what pass 1 left, the textures that a fetch of `sums` reads."""
        own = [one for one in self.held if one[0] == self.own_total]
        return (*self.means, *own) if self.means else self.held or self.shaded

    @property
    def resolve_reads_sums(self) -> bool:
        """Else what shading left is all that it reads."""
        return not self.held or "moit_sums" in self.resolves

    @property
    def factors_read_extents(self) -> bool:
        """Whether a pixel's factors hang on its own range of depth, too."""
        return any("moit_factor(" in head and "moit_extents" in head for head in self.heads)

    @property
    def digest(self) -> str:
        """Of what is computed: no comments, no blanks, not what a camera's planes decide."""
        body = re.sub(r"//.*", "", self.plain)
        body = re.sub(
            r"(MOIT_(?:WARP_\w+|DEPTH_NEAR|DEPTH_FAR)(?:: f32 =)?) -?[\d.e-]+", r"\1", body
        )
        found = hashlib.sha256("".join(body.split()).encode())
        for one in self.buffers:
            found.update(one.content)
        return found.hexdigest()[:16]


@dataclasses.dataclass(frozen=True)
class _Targets:
    """Those of an include, by the names that they have in it (see Include)."""

    held: tuple[tuple[str, Target], ...]
    shaded: tuple[tuple[str, Target], ...]
    second: tuple[tuple[str, Target], ...]
    extents: tuple[tuple[str, Target], ...]
    means: tuple[tuple[str, Target], ...]
    own_total: str

    @property
    def bound(self) -> int:
        """How many an engine binds: buffers and shared arrays come after them."""
        groups = (self.held, self.means, self.second, self.shaded, self.extents)
        return sum(len(group) for group in groups)


@dataclasses.dataclass(frozen=True)
class _Parts:
    """What an include says, before it is laid out.

    texts : of the items, in the language.
    """

    technique: Technique
    recipe: Recipe
    language: Language
    stem: str
    items: list[Item]
    texts: list[str]
    entries: tuple[str, ...]
    context: Context
    targets: _Targets
    kept: Kept | None
    buffers: tuple[Buffer, ...]
    resolves: tuple[str, ...]

    def laid_out_at(self, tight: int) -> tuple[str, frozenset[str]]:
        """The text, and what only the page says."""
        language, memory = self.language, self.recipe.memory
        said_on_page = _said_on_page(self.items, self.entries, tight)
        declared = _declared(self.items, self.texts, language, tight, said_on_page)
        declared = "\n\n".join(filter(None, [language.lacking(declared), declared]))
        if language is WGSL and "moit_kept(" in declared:
            declared = f"{KEPT}\n\n{declared}"
        start = start_of(language.name) if self.kept else ""
        arrays = "\n".join(buffering(language.name, one) for one in self.buffers)
        shared = sharing(language.name, memory, declared, self.targets.bound) if memory else ""
        parts = (start, language.start, _options(self.items, language), arrays, shared, declared)
        apart = "\n\n" if tight < FILLED else "\n"
        inside = apart.join([*(part for part in parts if part), self._fetched(tight)])
        if language is not WGSL:
            guard = f"MOIT_{self.stem.upper()}_INCLUDED"
            inside = f"#ifndef {guard}\n#define {guard}\n{inside}\n#endif"
        return f"{_head(self.technique, self.recipe, language)}\n\n{inside}\n", said_on_page

    def _fetched(self, tight: int) -> str:
        if self.kept:
            return keeping(self.language.name, self.kept, tight)
        of, small = self.targets, self.recipe.side > 1
        read = (of.held, of.shaded, of.second, of.extents, tight, small)
        return fetching(self.language.name, *read, self.resolves, of.means, of.own_total)

    def in_room(self) -> tuple[str, frozenset[str], int, str]:
        """Laid out as tightly as MOST_LINES ask, how tightly that is, and with room for all."""
        plain, said_on_page = self.laid_out_at(0)
        text, tight = plain, 0
        while text.count("\n") > MOST_LINES and tight < RUN_ON:
            tight += 1
            text, said_on_page = self.laid_out_at(tight)
        if text.count("\n") > MOST_LINES:  # where that does not do lines need not be filled
            tight = FILLED - 1
            text, said_on_page = self.laid_out_at(tight)
        return text, said_on_page, tight, plain


def include_of(technique: Technique, recipe: Recipe, language: Language) -> Include:
    """A technique's text in a language. ValueError where the language cannot say it."""
    _refuse_unsayable(technique, recipe, language)
    items = _items_of(recipe, language)
    names = _rename(items)
    structs = {item.names[0]: item for item in items if item.kind == "struct"}
    entries = tuple(names[one] for one in recipe.entries if one in names)
    begins = {names[one]: member for one, member in recipe.never_negative.items() if one in names}
    touching = reaching(items, {names[f] for one in recipe.memory for f in one.functions})
    context = Context(structs, keeping_of(items, entries), begins, touching)
    targets = _targets_of(recipe, structs)
    stem = re.sub(r"\W+", "_", technique.base_name)
    parts = _Parts(
        technique,
        recipe,
        language,
        stem,
        items,
        ["" if item.kind in _APART else language.item(item, context) for item in items],
        entries,
        context,
        targets,
        _kept(recipe, targets.held, targets.shaded, entries),
        tuple(
            buffer_of(language.name, names[one], rows, stem, targets.bound + i)
            for i, (one, rows) in enumerate(recipe.buffers.items())
        ),
        _given_to("moit_resolve", items),
    )
    text, said_on_page, tight, plain = parts.in_room()
    functions = {item.names[0]: item for item in items if item.kind == "function"}
    return Include(
        name=f"moit_{stem}.{language.ending}",
        language=language,
        text=text,
        options=tuple(_option(item) for item in items if item.kind == "option"),
        calls=entries,
        heads=tuple(language.head(functions[one], context) for one in entries if one in functions),
        held=targets.held,
        shaded=targets.shaded,
        factors=tuple(members_of(structs["moit_factors"])) if "moit_factors" in structs else (),
        notes=tuple(_notes(items, said_on_page, tight == RUN_ON)),
        state=recipe.state,
        kept=parts.kept,
        shape=recipe.shape,
        count=recipe.count,
        factor_formats=_factor_formats(recipe, structs.get("moit_factors")),
        buffers=parts.buffers,
        second=targets.second,
        side=recipe.side,
        memory=recipe.memory,
        programs=recipe.programs,
        touching=tuple(sorted(touching)),
        touched={one: touched_by(one, items, recipe.memory) for one in entries if one in touching},
        plain=plain,
        extents=targets.extents,
        resolves=parts.resolves,
        by_factors=tuple(names[one] for one in recipe.by_factors if one in names),
        means=targets.means,
        own_total=targets.own_total,
    )


def _refuse_unsayable(technique: Technique, recipe: Recipe, language: Language) -> None:
    if recipe.state and language is WGSL:
        raise no_kit(technique, NO_ORDER, "'wavelet8'", " in WGSL")
    if recipe.shape == SAMPLED and language is WGSL and recipe.count != WGSL_SAMPLES:
        why = f"pixels have {WGSL_SAMPLES} samples there, or one"
        raise no_kit(technique, why, f"'stochastic{WGSL_SAMPLES}'", " in WGSL")


def _items_of(recipe: Recipe, language: Language) -> list[Item]:
    """What the text needs, with the options that the recipe decides."""
    fixed = dict(recipe.fixed)
    if language.fused is not None:
        fixed["NOT_FUSED"] = int(not language.fused)
    needed = (*recipe.entries, *recipe.fetching)
    items = needed_items(recipe.text, fixed, needed, recipe.arrays, recipe.made)
    items = [*(Item("buffer", (one,), [], 0, "") for one in recipe.buffers), *items]
    items = [*(Item("memory", one.functions, [], 0, "") for one in recipe.memory), *items]
    for item in items:
        if item.kind == "option" and item.names[0] in recipe.values:
            item.words[item.start :] = words_of(_number(recipe.values[item.names[0]]))
    return items


def _targets_of(recipe: Recipe, structs: dict[str, Item]) -> _Targets:
    words_alone = recipe.state is not None and not recipe.held
    held, shaded = _named_targets(recipe, None if words_alone else structs.get("moit_sums"))
    return _Targets(
        held,
        shaded,
        _by_members(recipe.text, "seconds", structs.get("moit_seconds"), recipe.second),
        _by_members(recipe.text, "extents", structs.get("moit_extents"), recipe.extents),
        tuple((f"mean{i}", one) for i, one in enumerate(recipe.means)),
        held[-1][0] if recipe.own_total else "",
    )


def _given_to(function: str, items: list[Item]) -> tuple[str, ...]:
    """Types of what a function is given."""
    found = [item for item in items if item.kind == "function" and function in item.names]
    return tuple(one.type for item in found for one in parameters_of(item))


def _kept(
    recipe: Recipe,
    held: tuple[tuple[str, Target], ...],
    shaded: tuple[tuple[str, Target], ...],
    entries: tuple[str, ...],
) -> Kept | None:
    if recipe.state is None:
        return None
    resolve = next(one for one in entries if one.startswith("moit_resolve"))
    return Kept(len(recipe.state.clears), held, shaded[0][0] if shaded else "", resolve)


def _number(value: float | int) -> str:
    if isinstance(value, int):
        return str(value)
    text = f"{value:.9g}"
    return text if set(text) & set(".e") else f"{text}.0"


def _rename(items: list[Item]) -> dict[str, str]:
    """Gives what the text declares names that no engine has; by the old ones the new ones."""
    names: dict[str, str] = {}
    for item in items:
        for name in item.names:
            names[name] = f"MOIT_{name}" if name.isupper() else f"moit_{name}"
    said = {old: new for old, new in names.items() if new.startswith("MOIT_") and len(old) > 2}
    for item in items:
        _rename_item(item, names, said)
    return names


def _parameters(item: Item) -> set[str]:
    return {one.name for one in parameters_of(item)}


def _renamed(text: str, names: dict[str, str]) -> str:
    return re.sub(r"\b\w+\b", lambda found: names.get(found[0], found[0]), text)


def _rename_item(item: Item, names: dict[str, str], said: dict[str, str]) -> None:
    item.names = tuple(names[name] for name in item.names)
    if item.kind == "function":  # a parameter may have the name of a function that it does not call
        own = _parameters(item)
        names = {old: new for old, new in names.items() if old not in own}
    for word in item.words:
        if word.kind == "name":
            again = f"{word.text}_" if word.text in RESERVED else word.text
            word.text = names.get(word.text, again)
        elif word.kind in ("comment", "directive"):
            word.text = _renamed(word.text, said if word.kind == "comment" else names)
    for inside in item.within:
        _rename_item(inside, names, said)


def _named_targets(
    recipe: Recipe, sums: Item | None
) -> tuple[tuple[tuple[str, Target], ...], tuple[tuple[str, Target], ...]]:
    """The members of `sums` are the targets, in their order."""
    captured = recipe.held or (() if recipe.state else recipe.shaded)
    named = _by_members(recipe.text, "sums", sums, captured)
    if not recipe.held and not recipe.state:
        return (), named
    place = len(named) + len(recipe.second)
    shaded = enumerate(recipe.shaded, place)
    return named, tuple((f"target{i}", target) for i, target in shaded)


def _by_members(
    text: str, name: str, struct: Item | None, targets: tuple[Target, ...]
) -> tuple[tuple[str, Target], ...]:
    members = members_of(struct) if struct else []
    sizes = {"float": "r", "vec2": "rg", "vec4": "rgba"}
    found = [sizes.get(one.type) for one in members]
    needed = [target.format.rstrip("0123456789f") for target in targets]
    if found != needed:
        raise SubsetError(f"{text}: {name} has members {found}; the targets are {needed}")
    return tuple((one.name, target) for one, target in zip(members, targets, strict=True))


def _factor_formats(recipe: Recipe, factors: Item | None) -> tuple[str, ...]:
    if recipe.factor_formats or not factors:
        return recipe.factor_formats
    return tuple(FLOATS[one.type] for one in members_of(factors))


# Of targets that hold floats as they are.
FLOATS = {"float": "r32f", "vec2": "rg32f", "vec4": "rgba32f"}


def _option(item: Item) -> Option:
    """With the last paragraph of what stands above it."""
    about = _paragraphs(item)[-1].removeprefix(item.names[0]).strip()
    return Option(item.names[0], text_of(item.words[item.start :]), about)


# What a comment says of a file that does not go home; of a define that is decided (what an engine
# may set has our prefix).
_FILE = re.compile(r" \((see )?\w+\.glsl\)|(?<=\w)\.glsl\b")
_DECIDED = re.compile(r"\b(?!MOIT_)[A-Z]+_[A-Z_]+\b")


# What one of our texts says of a name that others have for it: `NAME  what that is`.
_GIVEN = re.compile(r"^[A-Z][A-Z_]+  ", re.MULTILINE)


def _paragraphs(item: Item) -> list[str]:
    """Of the comments above an item, as far as they speak of what goes home."""
    lines = [
        word.text.lstrip("/").strip() for word in item.words[: item.start] if word.text != "\n"
    ]
    text = "\n".join(line or "\n" for line in lines)
    parts = re.split(r"\n\s*\n", text)
    if item.kind != "option":
        parts = [part for part in parts if not _GIVEN.match(part.lstrip("\n"))]
    found = [_FILE.sub("", " ".join(part.split())) for part in parts]
    return [part for part in found if part and not _DECIDED.search(part)]


def _said_on_page(items: list[Item], entries: tuple[str, ...], tight: int) -> frozenset[str]:
    """What has comments that there is no room for: functions that an engine does not call, then
    all; and "" for what is said of a whole file; last, constants and structs that no pass hands
    on."""
    if tight < FILLED - 2:
        return frozenset()
    names = {item.names[0] for item in items if item.kind == "function"}
    if tight >= FILLED:
        inner = {item.names[0] for item in items if item.kind in ("constant", "struct")}
        return frozenset({"", *names, *(inner - _HANDED_ON if tight == RUN_ON else ())})
    return frozenset(names - set(entries)) | ({""} if tight == FILLED - 1 else set())


_HANDED_ON = {f"moit_{one}" for one in ("sums", "seconds", "extents", "factors", "state")}


def _notes(
    items: list[Item], said_on_page: frozenset[str], of_statements: bool
) -> Iterator[tuple[str, str]]:
    """of_statements : what is said within functions, too."""
    for item in items:
        paragraphs = _paragraphs(item)
        if of_statements and item.kind == "function":
            within = [word.text for word in item.words[item.start :] if word.kind == "comment"]
            inside = " ".join(" ".join(within).replace("//", " ").split())
            paragraphs += [f"Within: {inside}."] if inside else []
        said = " ".join(paragraphs[:-1] if item.kind == "option" else paragraphs)
        left_out = item.kind == "option" or said_on_page.intersection(item.names or ("",))
        if said and (left_out or said != first_sentence(said)):
            yield "" if item.kind in ("option", "comment") else item.names[0], said


def _options(items: list[Item], language: Language) -> str:
    """Each with as much of what it means as its line takes."""
    lines = []
    for item in items:
        if item.kind == "option":
            option = _option(item)
            made = language.option(option.name, option.value).split("\n")
            at = min(1, len(made) - 1)
            about = first_sentence(option.about, MOST - len(made[at]) - 4)
            made[at] += f" // {about}" if len(f"{made[at]} // {about}") <= MOST else ""
            lines += made
    return "\n".join(lines)


def _declared(
    items: list[Item],
    texts: list[str],
    language: Language,
    tight: int,
    said_on_page: frozenset[str],
) -> str:
    """Everything but options, each with a line of comment, but for those that the page explains
    and that have no room for it beside them."""
    lines: list[str] = []
    before = ""
    for item, text in zip(items, texts, strict=True):
        if item.kind in _APART:
            continue
        comments = text_of(item.words[: item.start])
        said = " ".join(_paragraphs(item))
        if item.kind == "comment" and "" in said_on_page and lines:
            continue
        section = item.kind == "comment" and tight < 2
        if section or (not tight and said and before == "function"):
            lines.append("")
        comment = comment_of(first_sentence(said)) if said else []
        text = text[len(comments) :]
        if item.kind == "struct" and language.makes_structs(items, item):
            text += f"\n{language.maker(item)}"
        made = laid_out(text, tight)
        beside = f"{made[0] if made else ''} {' '.join(comment)}"
        if tight > 2 and comment and made and len(beside) <= MOST:
            made[0] = beside
        elif not said_on_page.intersection(item.names):
            lines += comment
        if item.kind == before == "constant" and not said and len(f"{lines[-1]} {text}") <= MOST:
            lines[-1] += f" {text}"
        else:
            lines += made
        before = item.kind
    return "\n".join(lines).strip()


def arguments_of(recipe: Recipe, language: Language) -> str:
    """Of the command that makes the text."""
    near, far = (repr(one).removesuffix(".0") for one in recipe.depth_range)
    has_depth = any(name.startswith(("WARP_SCALE", "DEPTH")) for name in recipe.values)
    return f"--language {language.name}" + f" --depth-range {near},{far}" * has_depth


def _head(technique: Technique, recipe: Recipe, language: Language) -> str:
    passes = {1: "one pass", 2: "two passes"}.get(recipe.passes, f"{recipe.passes} passes")
    how = "in the order of triangles" if recipe.state else "by blending"
    how = "by depth tests" if recipe.shape else how
    how = "by atomic additions" if recipe.programs else how
    made = f'moit export "{technique}" {arguments_of(recipe, language)}'
    line = f"// Made by moit {VERSION}: {made}"
    line = line if len(line) <= MOST else f"// Made by moit {VERSION}:\n// {made}"
    what = f"// {technique}: order-independent transparency"
    between = " " if len(f"{what} {how}, in {passes}") <= MOST else "\n// "
    return f"""\
{what}{between}{how}, in {passes}
// over transparent geometry and a resolve. What to set up: README.md and targets.json beside this.
// Source: {technique.source}.
{line}
// Copyright (c) 2026, the moit authors. SPDX-License-Identifier: BSD-3-Clause"""
