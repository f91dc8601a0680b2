"""The page beside an include: passes, targets, bindings, options, limits, errors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from moit.catalog import Technique
from moit.catalog.targets import texel_bytes
from moit.gpu_costs.predicting import RESOLUTION
from moit.kit.buffers import bound_as
from moit.kit.costs import DENSITY, SHOWN, cost_rows, frame_rows
from moit.kit.gathered import SMALL
from moit.kit.including import Include, arguments_of
from moit.kit.interface_page import blend_states, outputs, rows_of, what_depth_is, what_is_given
from moit.kit.interfaces import INTERFACES, OF_LANGUAGE, format_names
from moit.kit.licence import LICENCE
from moit.kit.measured import measured_error
from moit.kit.memory_page import early_tests, how_bound, memory_table
from moit.kit.recipe import Recipe
from moit.kit.small_targets import FARTHEST, MEANS
from moit.kit.table import table_of
from moit.kit.usage import factors_made, factors_shade, usage_text
from moit.system.version import VERSION


def page_of(technique: Technique, recipe: Recipe, include: Include) -> str:
    """README.md."""
    table = table_of(technique, recipe, include)
    language = include.language
    made_with = arguments_of(recipe, language)
    sized = ("size",) if include.side > 1 else ()
    parts = [
        f"# {technique} in {_NAMES[language.name]}",
        f"`{include.name}` has what moit {VERSION} makes of {_source(technique)}: order-"
        f"independent transparency in {recipe.passes} pass{'es' * (recipe.passes > 1)} over "
        f"transparent geometry, {_HOW[_kind(include)]}, and a resolve. Made by",
        f'```sh\nmoit export "{technique}" -o FOLDER {made_with}\n```',
        "## Passes",
        f"After everything opaque, with its depth bound. {_ORDER[_kind(include)]} Where "
        "depth is reversed the test is greater.",
        rows_of(
            ("pass", "draws", "writes", "reads", "calls", "depth"),
            [
                (
                    one["name"],
                    one["draws"] + _told(one),
                    ", ".join(one["targets"]) or "-",
                    ", ".join(one["reads"]) or "-",
                    ", ".join(f"`{name}`" for name in one["calls"]) or "-",
                    _depth(one["depth"]),
                )
                for one in table["passes"]
            ],
        ),
        *_abouts(table),
        *_state(include, table),
        "## Targets",
        "Fragments add up by the blend function: source and destination factors, operation. "
        f"{table['bytes_a_pixel']:g} bytes a pixel. The resolve is blended over the opaque picture "
        f"with one, one-minus-src-alpha. {outputs(language.name)} The same as JSON: "
        "`targets.json`.",
        rows_of(
            ("target", *sized, *INTERFACES, "clear", "blend", "binding"),
            [
                (
                    one["name"],
                    *([_size(one)] if sized else []),
                    *one["format"].values(),
                    f"{one['clear']:g}",
                    "{source}, {destination}, {operation}".format(**one["blend"]),
                    str(table["bindings"][one["name"]]),
                )
                for one in table["targets"]
            ],
        ),
        *blend_states(table),
        *_of_blocks(include),
        *_memory(include),
        "## Calls",
        f"```{language.ending}\n{usage_text(include)}\n```",
        "Functions that the include has for you:",
        f"```{language.ending}\n" + "\n".join(f"{one};" for one in include.heads) + "\n```",
        f"Colours are linear, not multiplied by alpha. {what_depth_is(technique, language.name)}"
        + what_is_given(include),
        "## Bindings",
        _bindings(include),
        *(bound_as(language.name, one) for one in include.buffers),
        *([how_bound(language.name, include.memory)] if include.memory else []),
        *_factors(include),
        *_options(include),
        "## Limits",
        "\n".join(f"- {one}" for one in (*recipe.limits, *_web_limits(include), _remark(include))),
        "## Error",
        _error(technique, include),
        "## Cost",
        _cost(technique, bool(include.extents)),
        *_notes(include),
        "## Licence",
        LICENCE.strip(),
    ]
    return "\n\n".join(parts) + "\n"


def _source(technique: Technique) -> str:
    """Ours are named by what they do."""
    source = technique.source
    return source.replace("ours", f"`{technique.base_name}`, our own", 1)


_NAMES = {"glsl": "GLSL", "hlsl": "HLSL", "wgsl": "WGSL", "metal": "Metal", "slang": "Slang"}


def _size(target: Mapping[str, Any]) -> str:
    side = target.get("block_side", 1)
    return f"1/{side} of width and height, rounded up" if side > 1 else "the picture's"


def _side(include: Include) -> int:
    """Of blocks that small targets have a texel of; 1 where there are none."""
    if include.programs:
        small = any(one.where == SMALL for one in include.programs)
        sides = [one.value for one in include.options if one.name == "MOIT_RESOLUTION"]
        return int(sides[0]) if small else 1
    return include.side


def _of_blocks(include: Include) -> list[str]:
    """What targets of blocks need of an engine."""
    side = _side(include)
    if include.means:
        read = sum(texel_bytes(one.format) for _, one in include.means) / side**2
        beside = f", and {include.own_total} of the pixel itself" if include.own_total else ""
        return [
            f"A texel of the smaller targets has the mean of {side} by {side} pixels, counted from "
            "the picture's first pixel, of fewer where the picture ends; their sides are the "
            f"picture's divided by {side}, rounded up. `{MEANS}` draws to all of them once. "
            f"Shading reads {read:g} bytes a pixel of them{beside}. Other sides of blocks: "
            "`MOIT_RESOLUTION`. An engine that would rather have no pass at the picture's size may "
            "draw pass 1 to the smaller targets themselves, blended, and leave this pass out: "
            "blocks then have what is seen at their middle, of which no error was measured."
        ]
    return [] if side == 1 else [_small(side, _OF_TEXELS[bool(include.programs)])]


_OF_TEXELS = {
    False: (
        "A texel of the smaller targets has the moments",
        "`shading` and the resolve draw to the whole picture. Other sides of blocks: "
        "`MOIT_RESOLUTION`.",
    ),
    True: (
        "Passes of blocks draw to a picture without colours, with a depth target alone: a texel "
        "adds to the slices",
        "`shading` and the resolve draw to the whole picture. Another `MOIT_RESOLUTION` is of all "
        "passes, and of the sizes of arrays.",
    ),
}


def _small(side: int, said: tuple[str, str]) -> str:
    """What smaller targets need of an engine."""
    return (
        f"{said[0]} of {side} by {side} pixels, counted from "
        "the picture's first pixel, as geometry is seen at its middle: draw with the same camera. "
        f"Where a side of the picture is no multiple of {side} the last texels reach beyond it: "
        f"with n texels the picture takes s = width / ({side} n) of their width, so that x of clip "
        "space becomes s x + (s - 1) w; y, with s of the height, s y + (1 - s) w where the first "
        "row is at y = 1 (Direct3D, Metal, WebGPU), else s y + (s - 1) w. The pass "
        f"`{FARTHEST}` reads a texture `opaque`, the depth of the opaque picture, and fragments of "
        f"the smaller targets are tested against what it writes. {said[1]}"
    )


def _memory(include: Include) -> list[str]:
    if not include.memory:
        return []
    return [
        "## Arrays",
        "Buffers of words of 32 bits, which fragments and threads change by atomics. WIDTH and "
        "HEIGHT are the picture's, in pixels, and `size` in calls is both, a uniform of yours. "
        "Between passes writes have to be visible (barriers), and an array with a clear value is "
        "filled with it before each frame. Functions of threads do nothing beyond the last, so "
        "that groups may have any size.",
        memory_table(include.memory),
        early_tests(include.language.name),
    ]


_HOW = {
    "blended": "whose fragments blending alone adds up",
    "ordered": "whose fragments read and change what a pixel keeps one after the other",
    "sorted": "whose fragments the depth test sorts",
    "gathered": "whose fragments change arrays by atomics",
}
_ORDER = {
    "blended": "Order within a pass does not matter.",
    "ordered": "In the pass that inserts the fragments of a pixel come in the order in which "
    "triangles are drawn, as the device's ordered access has it.",
    "sorted": "Order within a pass does not matter.",
    "gathered": "Order within a pass does not matter, for the last bit, but passes have to end "
    "before the next begin.",
}


def _kind(include: Include) -> str:
    if include.programs:
        return "gathered"
    return "ordered" if include.state else "sorted" if include.shape else "blended"


def _depth(state: Mapping[str, Any]) -> str:
    if not state["test"]:
        return "none"
    return f"test {state['test']}, {'write' if state['write'] else 'no write'}"


def _told(one: Mapping[str, Any]) -> str:
    """Of a pass in the table: how often, and on how many samples."""
    rounds = f", {one['rounds']} times" if "rounds" in one else ""
    return rounds + (f", {one['samples']} samples a pixel" if "samples" in one else "")


def _abouts(table: Mapping[str, Any]) -> list[str]:
    found = [f"- {one['name']}: {one['about']}" for one in table["passes"] if "about" in one]
    return ["\n".join(found)] if found else []


def _state(include: Include, table: Mapping[str, Any]) -> list[str]:
    """What fragments change in order."""
    if include.state is None:
        return []
    clears = include.state.clears
    runs: list[list[int]] = []  # of layers with one clear value: the first, the last, the value
    for i, clear in enumerate(clears):
        if runs and runs[-1][2] == clear:
            runs[-1][1] = i
        else:
            runs.append([i, i, clear])
    rows = [(f"{a} to {b}" if b > a else str(a), f"0x{clear:08x}") for a, b, clear in runs]
    vulkan, direct, *_ = format_names("r32ui").values()
    return [
        "## Words",
        f"A pixel keeps {len(clears)} words of 32 bits, {4 * len(clears)} bytes: an array of "
        f"{len(clears)} textures of {vulkan} (Direct3D: {direct}), readable and writable by "
        "fragment shaders, bound at the first place. Each layer has a value that it is cleared to "
        "before the pass that inserts:",
        rows_of(("layers", "clear"), rows),
        _LANGUAGE_ORDER[include.language.name],
    ]


_VIEWS = (
    "The shader that inserts defines MOIT_INSERTS, and is `[earlydepthstencil]`. Words are then a "
    "RasterizerOrderedTexture2DArray<uint>, at a register behind those of targets."
)
_LANGUAGE_ORDER = {
    "glsl": "The shader that inserts defines MOIT_INSERTS and has the include before all else but "
    "#version, as it asks for ARB_fragment_shader_interlock; `MOIT_BEGIN_ORDERED` and "
    "`MOIT_END_ORDERED` stand in `main` itself, as the extension wants it. Define both of another "
    "extension, or as nothing where order is kept otherwise (tiles, one thread a pixel).",
    "hlsl": _VIEWS,
    "slang": f"{_VIEWS} `MOIT_BEGIN_ORDERED` and `MOIT_END_ORDERED` are for Slang's GLSL and "
    "SPIR-V, which order nothing by themselves.",
    "metal": "Words are an argument, `texture2d_array<uint, access::read_write> words "
    "[[texture(0), raster_order_group(0)]]` where fragments insert, and "
    "`texture2d_array<uint>` where they are read. The function that inserts is "
    "`[[early_fragment_tests]]`.",
}


def _options(include: Include) -> list[str]:
    if not include.options:
        return []
    how = (
        "Set by a pipeline's constants."
        if include.language.name == "wgsl"
        else "Define them before the include to set others."
    )
    rows = [(f"`{one.name}`", one.value, one.about) for one in include.options]
    return ["## Options", how, rows_of(("option", "default", "meaning"), rows)]


def _factors(include: Include) -> list[str]:
    if not include.factors:
        return []
    names = [one.name for one in include.factors]
    spoken = OF_LANGUAGE[include.language.name]
    listed = ", ".join(
        f"{one} ({format_names(format)[spoken]})"
        for one, format in zip(names, include.factor_formats, strict=True)
    )
    lines = [f"{one} = pixel.{one};" for one in names]
    function, left, two = "moit_factor", "what pass 1 left", "the two"
    if include.state:
        function, left = "moit_factor_of_words", "words"
    also = ""
    if include.second:
        function, left, two = "moit_factor_second", "what passes before left", "the last two"
        also = (
            "\n\n`moit_factor`, which the pass before calls, may have such a pass, too, after the "
            "first over geometry, and into the same textures."
        )
    return [
        "## A pass for factors",
        f"`{function}` is the same for all fragments of a pixel. As above every fragment does it; "
        f"where pixels have more than two or three, a pass over the whole picture between {two} "
        f"does it once, without blending, into {listed}. `shading` then reads these textures into "
        f"a `moit_factors`, and not {left}:",
        f"```{include.language.ending}\n// the pass for factors, for a pixel\n"
        + "\n".join([*factors_made(include), *lines])
        + "\n\n// shading, for a fragment\n"
        + "\n".join(factors_shade(include))
        + "\n```"
        + also,
    ]


def _bindings(include: Include) -> str:
    """How the include reads what passes before left."""
    kept = (
        *(*include.held, *include.means, *include.second),
        *(*include.shaded, *include.extents),
    )
    last = len(kept) - 1
    if include.state:
        last = len(include.held) + len(include.shaded)
    one_sample = "Textures have one sample a pixel."
    if include.language.name == "wgsl":
        return (
            "WGSL includes nothing: paste the text before a shader's. Textures are in group "
            "`MOIT_GROUP` at `MOIT_BINDING_0` and so on, constants to be changed in the text; a "
            "pipeline that does not read them binds none. Their sample type is unfilterable-float. "
            f"{one_sample}"
        )
    if include.language.name == "metal":
        textures = "Textures are arguments of an entry point, handed on as shown. "
        if include.state:
            return (
                f"{textures}To keep words elsewhere define `MOIT_LOAD(words, pixel, i)` and "
                f"`MOIT_STORE(words, pixel, i, word)` before the include. {one_sample}"
            )
        return (
            f"{textures}To read otherwise define `MOIT_FETCH(texture, pixel)` before the include. "
            f"{one_sample}"
        )
    is_glsl = include.language.name == "glsl"
    macro, space = ("BINDING", "0, set = 1") if is_glsl else ("REGISTER", "t0, space1")
    names = f"MOIT_{macro}_{{}}"
    moved = (
        f"to move them define {'all of these' if last else 'this'} before the include, which may "
        f"name a set, too: `#define MOIT_{macro}_0 {space}`."
    )
    fetches = _numbered("MOIT_FETCH_{}(pixel)", 1 if include.state else 0, last)
    otherwise = f"To read otherwise (subpass inputs, arrays, more samples) define {fetches}"
    if include.state:
        read = f" {otherwise}." if last else ""
        textures = f", textures at {_numbered(names, 1, last)}" if last else ""
        written = "" if is_glsl else ", a u register where fragments insert"
        return (
            f"Words are bound at {_numbered(names, 0, 0)}{written}{textures}; {moved} To keep "
            "words elsewhere (buffers, tiles) define `MOIT_LOAD(pixel, i)` and, where fragments "
            f"insert, `MOIT_STORE(pixel, i, word)`.{read}"
        )
    return (
        f"Textures are bound at {_numbered(names, 0, last)}; {moved} {otherwise}, and no texture "
        "is declared. A pass that reads nothing, as the first over geometry, defines "
        "`MOIT_NO_FETCH`."
    )


def _numbered(name: str, first: int, last: int) -> str:
    """Names from the first number to the last."""
    ends = (f"`{name.format(i)}`" for i in dict.fromkeys((first, last)))
    return " to ".join(ends)


def _remark(include: Include) -> str:
    """What the language asks for, and of digits where the text keeps more than a float has."""
    language = include.language
    keeps = language.digits and language.keeps_digits in include.text
    return f"{language.remark} {language.digits}" if keeps else language.remark


WEB_BYTES = 32  # of targets that a pass writes, a pixel: what every device of WebGPU has
WEB_BINDING, WEB_BUFFER = 128 << 20, 256 << 20  # bytes of an array, likewise


def _web_limits(include: Include) -> list[str]:
    """What has to be asked of a device of WebGPU."""
    if include.language.name != "wgsl":
        return []
    return [*_web_targets(include), *_web_arrays(include)]


def _web_arrays(include: Include) -> list[str]:
    pixels = math.prod(RESOLUTION)
    size = max((4 * one.words_a_pixel * pixels for one in include.memory), default=0)
    asked = [
        f"{name}: {size:.0f}"
        for name, has in (
            ("maxStorageBufferBindingSize", WEB_BINDING),
            ("maxBufferSize", WEB_BUFFER),
        )
        if size > has
    ]
    if not asked:
        return []
    return [
        f"At {' x '.join(map(str, RESOLUTION))} the largest array is more than devices of WebGPU "
        f"have unless asked: ask for {', '.join(asked)}."
    ]


def _web_targets(include: Include) -> list[str]:
    most = {
        what: sum(texel_bytes(format) for format in formats)
        for what, formats in (
            ("pass 1", [one.format for _, one in include.held]),
            ("a pass for factors", include.factor_formats),
        )
    }
    said = [f"{what} writes {size}" for what, size in most.items() if size > WEB_BYTES]
    if not said:
        return []
    return [
        f"Bytes a pixel: {', '.join(said)}, and devices of WebGPU have {WEB_BYTES} unless asked: "
        f"ask for maxColorAttachmentBytesPerSample: {max(most.values())}."
    ]


def _notes(include: Include) -> list[str]:
    """What comments of the include leave out."""
    if not include.notes:
        return []
    lines = [f"- `{name}`: {said}" if name else f"- {said}" for name, said in include.notes]
    return ["## How it works", "In the order of the text:", "\n".join(lines)]


def _error(technique: Technique, include: Include) -> str:
    found = measured_error(technique, include)
    if found is None:
        return (
            "Not measured for this text: it was made with options other than those that are, or by "
            "another version. `tests/test_kit_run.py` of moit says how."
        )
    golden = ""
    if "problems" in found:
        golden = (
            f" With the published bias, on {found['problems']} golden problems, hard rays whose "
            f"moments it is given as they are: by at most {found['golden_most']:.1e}, "
            f"{found['golden_most_of_999']:.1e} in 99.9 %."
        )
    return (
        f"This very text, on {found['device']}, against moit's core in double on "
        f"{found['fragments']} fragments that it was not made with: {found['what']} is off by at "
        f"most {found['most']:.1e}, by no more than {found['most_of_999']:.1e} in 99.9 % of them."
        + golden
    )


def _cost(technique: Technique, in_own_range: bool) -> str:
    rows = cost_rows(technique)
    if not rows:
        return "None is stored for this technique: `moit bench --gpu-cost` predicts it."
    return (
        "Cycles and instructions of a wave, as AMD's compiler says without a GPU (`moit bench "
        "--gpu-cost`); factors and resolve are a pixel's, all else is a fragment's, and fused is "
        "factor and transmittance in one"
        + "; they count neither the pass `extents` nor what reads its target" * in_own_range
        + ":\n\n"
        + rows_of(SHOWN, [list(row.values()) for row in rows])
        + "\n\nPredicted from these and the bytes of targets, in milliseconds of a frame of "
        f"{' x '.join(map(str, RESOLUTION))} pixels with {DENSITY:g} fragments each; beyond "
        "is what unsorted alpha blending does not take anyway (`moit recommend --by gpu` has your "
        "own picture and other cards):\n\n"
        + rows_of(("GPU", "ms", "beyond"), frame_rows(technique))
    )
