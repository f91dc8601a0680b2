"""A figure of matplotlib whose files are fit to print."""

from __future__ import annotations

from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

# Fonts whole, as TrueType: many publishers refuse Type 3. Texts of SVG can be read and searched.
FILES: dict[str, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none"}


class CleanFigure(Figure):
    """Files embed fonts and keep texts as texts. settings : matplotlib's for files."""

    def __init__(self, *args: Any, settings: Any = None, **options: Any) -> None:
        super().__init__(*args, **options)
        self.settings: Any = dict(settings or {})

    def savefig(self, *args: Any, **options: Any) -> None:
        with rc_context(self.settings | FILES):
            super().savefig(*args, **options)
