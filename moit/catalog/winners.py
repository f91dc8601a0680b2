"""What errs least for the bytes that it keeps, by what a GPU has to offer: docs/frontier.md.

The page's first chapter names them, generated of what was measured; `moit.recommend` looks at them
beside the catalog's own. tests/test_recommend.py holds this list to the page.
"""

from __future__ import annotations

from moit.catalog.names import technique
from moit.catalog.technique import Technique

WINNERS = (
    "adaptive8(merge='energy',normalize=True)",
    "adaptive10(merge='energy',normalize=True)",
    "anchors6",
    "front4",
    "front4(key_bits=32)",
    "neural-bounded(depth_range='pixel',storage='half')",
    "neural-bounded6(depth_range='pixel',storage='half')",
    "neural-bounded6(resolution=4,total='full')",
    "neural-bounded6(storage='half')",
    "power8(depth_range='pixel',exclude_self=True,overestimation=0.4,storage='half')",
    "neural-slices5(bits=6)",
    "neural-slices12",
    "neural-slices16",
    "neural-slices28",
    "strong4",
    "strong6",
    "strong10",
    "trig4(exclude_self=True,overestimation=0.4,resolution=4,total='full')",
)


def winners() -> list[Technique]:
    """Those of the list, which the catalog has with other options or another count."""
    return [technique(name) for name in WINNERS]
