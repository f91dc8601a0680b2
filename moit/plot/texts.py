"""Names of any length, made to fit the place that they have."""

from __future__ import annotations

import functools
import re

SMALLEST = 5.0  # points, below which no text is read


@functools.lru_cache(4096)
def text_width(text: str, size: float) -> float:
    """Inches that a line of text takes, in the font that is set."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    if not text.strip():
        return 0.0
    plain = text.replace("$", r"\$")  # names hold no formulas
    path = TextPath((0, 0), plain, size=size, prop=FontProperties())
    # On a screen letters stand at whole pixels, a little farther apart.
    return float(path.get_extents().x1) / 72 * 1.04


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


def fitted(text: str, width: float, size: float, most_lines: int = 2) -> tuple[str, float]:
    """A text in lines no wider than that, and its size: smaller ones rather than many lines."""
    while True:
        lines = broken(text, width, size)
        if len(lines) <= most_lines or size <= SMALLEST:
            return "\n".join(lines), size
        size = max(size - 0.5, SMALLEST)
