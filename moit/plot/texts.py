"""Names of any length, made to fit the place that they have."""

from __future__ import annotations

import functools
import re

SMALLEST = 5.0  # points, below which no text is read


@functools.lru_cache(1 << 14)
def text_width(text: str, size: float) -> float:
    """Inches that a line of text takes, in the font that is set; no formula is seen in it."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    width, _, _ = text_to_path.get_text_width_height_descent(
        text, FontProperties(size=size), ismath=False
    )
    # On a screen letters stand at whole pixels, a little farther apart.
    return float(width) / 72 * 1.04


def broken(text: str, width: float, size: float) -> list[str]:
    """Lines of `text` no wider than that many inches, broken behind spaces and punctuation, and
    within words where these alone are wider."""
    lines: list[str] = []
    line = ""
    for piece in re.findall(r"[^\s(,/-]*[\s(,/-]?", text):
        if line and text_width((line + piece).rstrip(), size) > width:
            lines.append(line)
            line = ""
        line += piece
        while text_width(line.rstrip(), size) > width and len(line) > 1:
            fits = next(
                n
                for n in range(len(line) - 1, 0, -1)
                if n == 1 or text_width(line[:n], size) <= width
            )
            lines.append(line[:fits])
            line = line[fits:]
    return [one.strip() for one in [*lines, line] if one.strip()] or [""]


def fitted(
    text: str, width: float, size: float, most_lines: int = 2, ends: bool = False
) -> tuple[str, float]:
    """A text in lines no wider than that, and its size: smaller ones rather than many lines.

    ends : there is room for no more lines than that: what is beyond them is left out.
    """
    while True:
        lines = broken(text, width, size)
        if len(lines) <= most_lines:
            return "\n".join(lines), size
        if size <= SMALLEST:
            break
        size = max(size - 0.5, SMALLEST)
    if ends:
        lines = [*lines[: most_lines - 1], f"{lines[most_lines - 1][:-1]}…"]
    return "\n".join(lines), size
