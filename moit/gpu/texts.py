"""The GLSL sources, and the one step between them and a GL compiler.

A technique's passes are a file of shaders/techniques. It includes the kernels that C compiles, too:
they live in csrc/kernels and are found as kernels/. GLSL has no include, so `source` pastes.

The texts are those of the build, which moit._gl holds. MOIT_SHADER_DIR names a folder to read them
from instead, each time: shaders/ of a checkout, while one works on them.
"""

import functools
import os
import re
from pathlib import Path

__all__ = ["explain", "names", "plain", "source"]

_INCLUDE = re.compile(r'\s*#include "(.+)"(\s*// in double)?')
_CONDITION = re.compile(r"\s*#\s*(if|else|elif|endif)")  # ifdef and ifndef are ifs
_LITERAL = re.compile(r"(?<![\w.])((\d+\.\d*|\.\d+)([eE][-+]?\d+)?|\d+[eE][-+]?\d+)(?![\w.])")

# Line 34 of the third file that is opened is called 20034. Compilers differ in what they make of
# GLSL's own numbers for files: Mesa forgets them in most of its messages.
_FILE = 10_000
_OPENED = re.compile(r"^#line (\d+) // (.+)$", re.MULTILINE)
_PLACE = re.compile(
    r"\b0([:(])(\d+)"
)  # 0:20034(7) in Mesa, 0(20034) in NVIDIA's, 0:20034 in glslang


def names() -> list[str]:
    """The techniques' files, as `source` takes them."""
    return sorted(name for name in _texts() if re.fullmatch(r"techniques/.+\.glsl", name))


def plain(name: str) -> str:
    """One text as it was written. Raises ValueError where there is none of this name."""
    text = _text(name)
    if text is None:
        raise ValueError(f"found {name}; the texts there are: {', '.join(_texts())}")
    return text


def source(name: str | Path, **defines: str | float) -> str:
    """The text of one pass, ready for a GL compiler.

    name : such as "techniques/power_moments.glsl"; a Path: a file of one's own, which may include
        what is here.
    defines : set after #version. With DOUBLE=1, `real` is double, and every literal that has a
        point or an exponent gets the suffix lf, without which GLSL would round it to float.

    PRIMITIVE is no define but the text that `#include "PRIMITIVE"` stands for, that of triangles
    unless it is given: what the picture is drawn of.

    Of an include that is followed by `// in double` literals get the suffix in any case.

    #line directives carry the files' own lines, which `explain` reads back from a compiler's log.
    Raises ValueError where there is no such file, or one includes itself.
    """
    double = str(defines.get("DOUBLE", 0)) != "0"
    text = name.read_text(encoding="utf-8") if isinstance(name, Path) else None
    name = name.name if isinstance(name, Path) else name
    return "\n".join([*_pasted(name, defines, double, [], (), text), ""])


def explain(log: str, text: str) -> str:
    """A compiler's `log` on `text`, a result of `source`, with our files and lines in it."""
    opened = {int(line) // _FILE: name for line, name in _OPENED.findall(text)}

    def ours(place: re.Match[str]) -> str:
        number, line = divmod(int(place[2]), _FILE)
        return f"{opened[number]}{place[1]}{line}" if number in opened else place[0]

    return _PLACE.sub(ours, log)


@functools.lru_cache(maxsize=1024)
def _lines(text: str, double: bool) -> tuple[str, ...]:
    return tuple((_LITERAL.sub(r"\1lf", text) if double else text).splitlines())


def _folder() -> str:
    return os.environ.get("MOIT_SHADER_DIR", "")


def _texts() -> list[str]:
    """The names of all texts."""
    if not _folder():
        from moit import _gl

        return _gl.shader_names()
    root = Path(_folder())
    # kernels is a link in a checkout, which ** does not follow
    found = {
        path.relative_to(root) for folder in ("**", "kernels") for path in root.glob(f"{folder}/*")
    }
    return sorted(path.as_posix() for path in found if path.suffix in (".glsl", ".h"))


def _text(name: str) -> str | None:
    """One text as it is, None where there is none of this name."""
    if not _folder():
        from moit import _gl

        return _gl.shader_text(name)
    if name not in _texts():
        return None
    return Path(_folder(), name).read_text(encoding="utf-8")


def _pasted(
    name: str,
    defines: dict[str, str | float],
    double: bool,
    opened: list[str],
    within: tuple[str, ...],
    text: str | None = None,
) -> list[str]:
    """One file in pieces; `opened` are all until now, `within` those that include it.

    double : whether literals of it, and of what it includes, get the suffix.
    text : None: that of the file of this name.
    """
    if name in within:
        raise ValueError(f"{name} includes itself, by way of {', '.join(within[1:]) or 'nothing'}")
    text = _text(name) if text is None else text
    if text is None:
        asked = f"{within[-1]} includes {name}" if within else f"found {name}"
        place = _folder() or "this build"
        raise ValueError(f"{asked}; the techniques there are in {place}: {', '.join(names())}")
    first = len(opened) * _FILE
    opened.append(name)
    made = [f"#line {first + 1} // {name}"] if within else []
    # A compiler that skips lines skips #line, too: numbers are given again where it may go on.
    depth, lost = 0, False
    for what, number, piece in _pieces(text, double):
        if what.startswith("include"):
            suffixed = double or what == "include in double"
            file = piece if piece != "PRIMITIVE" else str(defines.get(piece, "meshes/surface.glsl"))
            made += _pasted(file, defines, suffixed, opened, (*within, name))
            made.append(f"#line {first + number + 1} // {name}")
            lost = depth > 0
            continue
        made.append(piece)
        if what == "version":
            for key, value in defines.items():
                if key != "PRIMITIVE":
                    made += _lines(f"#define {key} {value}", double)
            made.append(f"#line {first + number + 1} // {name}")
        elif what:
            depth += {"if": 1, "endif": -1}.get(what, 0)
            if lost and what != "if":
                made.append(f"#line {first + number + 1} // {name}")
                lost = depth > 0
    return made


@functools.lru_cache(maxsize=1024)  # many programs are made of few texts
def _pieces(text: str, double: bool) -> tuple[tuple[str, int, str], ...]:
    """A text cut where pasting has something to do: what, the line's number, and the line.

    What: "include" or "include in double", the line its file's name; "version"; the word of a
    condition; "" for all lines between two of these, in one piece.
    """
    found: list[tuple[str, int, str]] = []
    between: list[str] = []
    for number, line in enumerate(_lines(text, double), 1):
        what, piece = "", line
        if "#" in line:  # most have none
            if include := _INCLUDE.match(line):
                what, piece = "include in double" if include[2] else "include", include[1]
            elif condition := _CONDITION.match(line):
                what = condition[1]
            elif line.startswith("#version"):
                what = "version"
        if not what:
            between.append(line)
            continue
        if between:
            found.append(("", number - 1, "\n".join(between)))
            between = []
        found.append((what, number, piece))
    if between:
        found.append(("", 0, "\n".join(between)))
    return tuple(found)
