"""Figures with matplotlib, which `pip install 'moit[plot]'` brings.

`style="paper"` makes them as wide as a column of a paper, `style="paper-double"` as wide as both.
Files of those that moit makes (`figure.savefig("a.pdf")`) hold texts as texts, with their fonts.
"""

from __future__ import annotations

from moit.plot.arguments import checked_pixel
from moit.plot.costs import speed_error
from moit.plot.dials import stability
from moit.plot.pictures import error_maps, images
from moit.plot.rays import curves

__all__ = ["checked_pixel", "curves", "error_maps", "images", "speed_error", "stability"]
