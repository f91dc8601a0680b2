"""A figure of matplotlib whose files are fit to print."""

from __future__ import annotations

import io
import os
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from moit.system.files import write_bytes

# Fonts whole, as TrueType: many publishers refuse Type 3. Texts of SVG can be read and searched.
FILES: dict[str, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "none"}


class CleanFigure(Figure):
    """Files embed fonts, keep texts as texts, and appear whole or not at all. settings :
    matplotlib's for files."""

    def __init__(self, *args: Any, settings: Any = None, **options: Any) -> None:
        super().__init__(*args, **options)
        self.settings: Any = dict(settings or {})

    def savefig(self, fname: Any, **options: Any) -> None:
        """As matplotlib's, which leaves half a file where the disk is full. Raises OSError that
        names the file."""
        with rc_context(self.settings | FILES):
            if not isinstance(fname, str | os.PathLike):  # a file that somebody has opened
                super().savefig(fname, **options)
                return
            path, options["format"] = self._file(os.fspath(fname), options.get("format"))
            drawn = io.BytesIO()  # whose errors no writer of matplotlib hides behind its own
            super().savefig(drawn, **options)
            write_bytes(path, drawn.getvalue())

    def _file(self, path: str, kind: str | None) -> tuple[str, str]:
        """What matplotlib calls the file, and its format: that of its ending, or the usual one,
        which becomes its ending."""
        kind = kind or os.path.splitext(path)[1][1:]
        if kind:
            return path, kind
        kind = self.canvas.get_default_filetype()
        return f"{path.rstrip('.')}.{kind}", kind
