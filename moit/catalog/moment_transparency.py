"""Moment Transparency: four moments of depth in [0, 1], in the variants of its paper."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

from moit.catalog.options import hold, names_of, whole
from moit.catalog.reconstruction import OverestimatingMoments
from moit.catalog.targets import Targets, added, held_in, multiplied
from moit.catalog.technique import Listed
from moit.checks.arguments import one_of

STORAGES = names_of("STORAGE")
LOW_RESOLUTIONS = ("raster", "average")
INTERVALS = {"unit": (0.0, 1.0), "symmetric": (-1.0, 1.0)}


@dataclasses.dataclass(frozen=True)
class MomentTransparency(OverestimatingMoments):
    """Optical depth along the ray from four power moments of depth.

    passes : 1; or 2: a second set of moments is gathered of what the first lets through to each
        fragment, and read instead (MT section 4.4, supplement 1.2).
    storage : what moments are read from. "float32": one number of the fragments' dtype each.
        "nlqm": non-linearly quantised moments, two depths, a weight and an offset in words of 16
        bits (section 4.2, supplement 1.3; the words are ours: csrc/kernels/nonlinear_moments.h).
        "unorm16": moments in four words of 16 bits. The last two are rounded once, after all
        fragments are summed, and keep the total as a half float.
    resolution : a side in pixels of the blocks that have moments of their own, from 1 (section
        4.1). Between the middles of blocks moments are interpolated bilinearly, before they are
        divided by their total. Blocks count from display coordinates (0, 0); at the edges of a
        crop they lack their neighbours. Not with "nlqm", which cannot be interpolated.
    overestimation : beta in [0, 1]: 0, as published, counts what must lie in front of a depth, 1
        what can; the paper's variant has 0.25. With two passes it applies to both.
    low_resolution : moments of a block are "raster", those of the pixel at its middle, as a smaller
        render target would have them (the paper's), or "average", the mean of its pixels'. Either
        way fragments count in front of the farthest opaque surface of the block's pixels, and all
        of them where a pixel has none.
    interval : what depth is warped to: "unit", [0, 1], or "symmetric", [-1, 1] (a footnote of the
        paper).
    bias : in [0, 1], the share of a safe distribution that is mixed in so that rounding does no
        harm. None, "published": 3e-7 of (0, .375, 0, .375), whatever the fragments' dtype; for
        "unorm16" 3e-5 of (.5, .5, .5, .5), or of (0, .628, 0, .628) 6e-5 where the interval is
        symmetric.
    warp : "log" (eq. 6; depth must be positive), "linear", or "none": depth lies in `unit_range`.
    depth_range : what maps to the interval: "image", the fragments' depth_range, or "pixel", each
        pixel's own extent; the latter with resolution 1 only.
    normalize : scale a pixel's colours so that their weights sum to what is covered (stage 4).
    exclude_self : a fragment does not occlude itself; with resolution 1 only. False: as published.
    max_alpha : in (0, 1): every alpha is multiplied by this where its logarithm is taken.

    Sharpe, "Moment Transparency", HPG 2018, equations 1 to 6, and its supplement. What reaches the
    background is the product of 1 - alpha.

    >>> str(moit.MomentTransparency(2))
    'two-moments-pass'
    """

    passes: int = 1
    storage: str = "float32"
    resolution: int = 1
    overestimation: float = dataclasses.field(default=0.0, kw_only=True)
    low_resolution: str = dataclasses.field(default="raster", kw_only=True)
    interval: str = dataclasses.field(default="unit", kw_only=True)

    kind: ClassVar[str] = "moment-transparency"
    listed: ClassVar[Listed] = (
        {},
        {"storage": "nlqm"},
        {"resolution": 8},
        {"passes": 2},
        {"passes": 2, "resolution": 8},
    )
    family: ClassVar[str] = "two moments"
    source: ClassVar[str] = "Sharpe 2018 (MT)"
    papers: ClassVar[tuple[str, ...]] = ("sharpe2018",)

    def __post_init__(self) -> None:
        one_of("passes", self.passes, (1, 2))
        one_of("storage", self.storage, STORAGES)
        whole(self, "resolution", 1)
        one_of("low_resolution", self.low_resolution, LOW_RESOLUTIONS)
        one_of("interval", self.interval, tuple(INTERVALS))
        hold(self, "unit_range", INTERVALS[self.interval])
        super().__post_init__()
        if self.resolution > 1:
            found = [
                name
                for name, bad in (
                    ("storage='nlqm'", self.storage == "nlqm"),
                    ("depth_range='pixel'", self.depth_range == "pixel"),
                    ("exclude_self=True", self.exclude_self),
                )
                if bad
            ]
            if found:
                raise ValueError(
                    f"resolution: expected 1 with {found[0]}, got {self.resolution}: moments of "
                    "blocks are interpolated, and are not the pixel's own"
                )

    @property
    def base_name(self) -> str:
        return self._name[0]

    @property
    def _in_name(self) -> tuple[str, ...]:
        return self._name[1]

    @property
    def _name(self) -> tuple[str, tuple[str, ...]]:
        """The name, and the options that it shows."""
        name = "two-moments-pass" if self.passes == 2 else "moment-transparency"
        if self.passes == 1 and self.storage == "nlqm":
            return f"{name}-nlqm", ("passes", "storage")
        if self.resolution == 8:
            return f"{name}-lr8", ("passes", "resolution")
        return name, ("passes",)

    @property
    def bits_per_pixel(self) -> float | None:
        """Four moments and a total; beside them, where storage is not as gathered, what is read."""
        each = 5 * 32 + (0 if self.storage == "float32" else 5 * 16)
        return self.passes * each / self.resolution**2 + self._extent_bits

    @property
    def published_bits(self) -> dict[str, float]:
        """Table 1 counts the 12 bytes of WBOIT's targets, too."""
        published = [(1, "float32", 1), (1, "nlqm", 1), (2, "float32", 1)]
        published += [(1, "float32", 8), (2, "float32", 8)]
        if (self.passes, self.storage, self.resolution) not in published or self._extent_bits:
            return {}
        return {"MT": 8 * 12 + (self.bits_per_pixel or 0)}

    def stored_in(self, words: bool) -> dict[str, Any] | None:
        held = self.storage if self.storage != "float32" else "unorm16"
        return {"storage": held if words else "float32"}

    @property
    def block_side(self) -> int:
        return self.resolution

    @property
    def draws_blocks(self) -> bool:
        return self.low_resolution == "raster"

    @property
    def geometry_passes(self) -> int | None:
        return (super().geometry_passes or 0) + self.passes - 1

    @property
    def moment_count(self) -> int:
        return 4

    @property
    def moment_sets(self) -> int:
        return self.passes

    @property
    def keeps_words_of_moments(self) -> bool:
        return self.storage != "float32" and self.resolution == 1

    def _state_fields(self) -> dict[str, Any]:
        return {
            "count": self.moment_count,
            "passes": self.passes,
            "storage": STORAGES.index(self.storage),
            "resolution": self.resolution,
            "average": self.low_resolution == "average",
            "symmetric": self.interval == "symmetric",
        }

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        moments, total = held_in(("rgba32f", "r32f")), multiplied()
        if self.resolution > 1:
            return Targets(moments, added(colours, total))
        return Targets((*moments, total), added(colours))

    def shipped_to(self) -> Targets | None:
        found = self.drawn_to()
        assert found
        return dataclasses.replace(found, second=found.held[:2] if self.passes == 2 else ())
