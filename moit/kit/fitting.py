"""Lines that new names have made too long, broken again."""

from __future__ import annotations

import re
import textwrap

MOST = 100


def fitted(text: str) -> str:
    """A text of any of the languages with no line longer than 100 columns, as far as it can be."""
    found: list[str] = []
    lines = text.split("\n")
    at = 0
    while at < len(lines):
        line = lines[at]
        at += 1
        if len(line) > MOST and line.startswith("// "):
            # what is too much begins the next line of the paragraph
            cut = line.rindex(" ", 0, MOST + 1)
            line, rest = line[:cut], line[cut + 1 :]
            if at < len(lines) and re.match(r"// \S", lines[at]):
                lines[at] = f"// {rest} {lines[at][3:]}"
            else:
                lines.insert(at, f"// {rest}")
            found.append(line)
        else:
            found += _fitted(line)
    return "\n".join(found)


def _fitted(line: str, continued: bool = False) -> list[str]:
    if len(line) <= MOST or line.lstrip().startswith("#"):
        return [line]
    indent = line[: len(line) - len(line.lstrip())]
    code, _, comment = line.partition("//")
    if not code.strip():
        prefix = indent + "// "
        return textwrap.wrap(comment.strip(), MOST, initial_indent=prefix, subsequent_indent=prefix)
    if comment:
        return [*_fitted(f"{indent}// {comment.strip()}"), *_fitted(code.rstrip())]
    start = re.match(r"(.*\{) (return .*;) \}$", line)
    if start:  # a function of one line
        return [*_fitted(start[1]), *_fitted(f"{indent}    {start[2]}"), f"{indent}}}"]
    places = [
        match.end()
        for match in re.finditer(r", |= | (?=[-+*/?:] )", line[:MOST])
        if match.end() > len(indent) + 8
    ]
    if not places:
        return [line]
    more = "" if continued else "    "
    rest = f"{indent}{more}{line[places[-1] :].lstrip()}"
    return [line[: places[-1]].rstrip(), *_fitted(rest, True)]
