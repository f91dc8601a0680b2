"""Techniques that reconstruct transmittance from moments of depth."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar

from moit.catalog.blocks import InBlocks
from moit.catalog.options import hold, whole, within
from moit.catalog.reconstruction import HalfMoments, OverestimatingMoments
from moit.catalog.targets import Targets, added, formats_for, held_in
from moit.catalog.technique import Listed
from moit.checks.arguments import one_of

# A quarter of the circle: beyond, eq. 6 would need its other branches.
MOST_WRAPPING_ZONE = math.pi / 2


@dataclasses.dataclass(frozen=True)
class CountedMoments(InBlocks, OverestimatingMoments):
    """Options of moments that are stored in one of several counts and sizes.

    count : how many beside the total absorbance b0.
    bits : 32: one number of the fragments' dtype per moment. 16: words (MBOIT 3.4).
    b0 : with 16 bits "half" or "float32"; None: half.
    intervals : of thick fragments, see `PowerMoments`.
    """

    count: int
    bits: int = 32
    b0: str | None = None
    intervals: int = dataclasses.field(default=0, kw_only=True)

    counts: ClassVar[tuple[int, ...]] = ()
    words: ClassVar[tuple[str, Any, Any] | None] = ("bits", 16, 32)

    def __post_init__(self) -> None:
        one_of("count", self.count, self.counts)
        one_of("bits", self.bits, (32, 16))
        whole(self, "intervals", 0, 64)
        one_of("b0", self.b0, (None,) if self.bits == 32 else ("half", "float32", None))
        if self.b0 == "half":
            hold(self, "b0", None)  # one technique, one name
        super().__post_init__()

    @property
    def base_name(self) -> str:
        return f"{self.kind}{self.count}" + ("-16" if self.bits == 16 else "")

    @property
    def cited(self) -> tuple[str, ...]:
        return (*self.papers, *(["mueller2025"] if self.intervals else []))

    @property
    def b0_is_half(self) -> bool:
        """Whether b0 is stored as a half float."""
        return self.bits == 16 and self.b0 is None

    @property
    def _in_name(self) -> tuple[str, ...]:
        return ("count", "bits")

    @property
    def bits_per_pixel(self) -> float | None:
        b0 = 16 if self.bits == 16 and self.b0 is None else 32
        numbers = self.moment_count * (2 if self.moments_are_complex else 1)
        return self._bits_in_blocks(numbers * self.bits + b0 + self._extent_bits)

    @property
    def published_bits(self) -> dict[str, float]:
        if self.resolution > 1:
            return {}
        numbers = self.moment_count * (2 if self.moments_are_complex else 1)
        return {"MBOIT": (numbers + 1) * self.bits}

    @property
    def _not_in_blocks(self) -> dict[str, bool]:
        return {**super()._not_in_blocks, "bits=16": self.bits == 16}

    @property
    def moment_count(self) -> int:
        return self.count

    def stored_in(self, words: bool) -> dict[str, Any] | None:
        return {**(super().stored_in(words) or {}), **({} if words else {"b0": None})}

    @property
    def _most_moment(self) -> float:
        return 1.5 if self.bits == 16 else super()._most_moment  # what words can stand for

    def _state_fields(self) -> dict[str, Any]:
        return {
            "count": self.count,
            "bits": self.bits,
            "b0_is_half": self.b0_is_half,
        }

    def drawn_to(self, colours: str = "16f") -> Targets | None:
        numbers = self.moment_count * (2 if self.moments_are_complex else 1)
        if self.bits == 32:
            return Targets(held_in((*formats_for(numbers, "32f"), "r32f")), added(colours))
        formats = (*formats_for(numbers, "16"), "r16f" if self.b0_is_half else "r32f")
        return Targets(held_in(formats, "ordered"), added(colours))


@dataclasses.dataclass(frozen=True)
class PowerMoments(HalfMoments, CountedMoments):
    """Absorbance along the ray from its power moments of depth.

    count : 4, 6 or 8 moments beside the total absorbance b0.
    bits : 32: one number of the fragments' dtype per moment. 16: words, into which fragments are
        blended one by one as they arrive, with rounding after each (section 3.4).
    b0 : with 16 bits, what the total absorbance is rounded to: "half" (None: that, too) or
        "float32".
    storage : None: as `bits` says. "half": half floats, to which blending adds what each fragment
        brings, so that no access has to be ordered; with depth_range "pixel" of Chebyshev
        polynomials, and extents in words of 16 bits, rounded outwards. That loses next to nothing
        and moves as floats do, but for pixels whose fragments all lie within such a word: by
        rounding their order of arrival says which is in front. Of the image's range close surfaces
        keep few digits, and hair flickers where it moves.
    overestimation : beta in [0, 1]: 0 counts what must lie in front of a depth, 1 what can.
    bias : in [0, 1], the share of a safe distribution that is mixed in so that rounding does no
        harm. "published": the paper's for float32 (5e-7, 5e-6, 5e-5 for 4, 6, 8 moments). None:
        5e-8, 5e-8, 1.5e-7 where the fragments are float32, and 1e-15, 1e-15, 1e-14 where they are
        float64. The default is that much less because matrices are factorised in double: nothing
        is worse for it, and what bias costs falls in proportion (docs/exactness.md).
        With 16 bits None is "published", too: 6e-5, 6e-4, 2.5e-3. Measured on rays of few to 500
        fragments, a third of it is a little nearer the truth nearly everywhere, and ten times it,
        which the paper allows for heavy overdraw, nowhere.
        In half floats None is 2e-4, 5e-4, 1e-3, and 4e-4, 1e-3, 6e-3 in the pixel's extent,
        whatever the fragments are: less than would cover what they round off, as pivots that may be
        rounding alone are known (measured on four kinds of rays); "published" is the same.
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [-1, 1] already.
    depth_range : what maps to [-1, 1]: "image", the fragments' depth_range, or "pixel", each
        pixel's own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (eq. 2).
    exclude_self : a fragment does not occlude itself: its own absorbance is taken from what may
        lie at its depth. False: as published.
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.
    resolution : a side in pixels, from 1, of the blocks that have moments of their own: the mean of
        their pixels', and between the middles of blocks what lies between. Not with
        depth_range "pixel" or words of 16 bits.
    total : with a resolution above 1 "block": blocks have the total absorbance, too, and what
        reaches the background is the product of 1 - alpha; "full": each pixel has its own total
        absorbance beside, and what it reads is scaled to that. With exclude_self that is the better
        by far (docs/blocks.md).
    upsampling : with a resolution above 1 "bilinear" or "depth-aware"; the latter gains nothing on
        most scenes.
    intervals : 0: the colour of volumes and Gaussians is emitted at the points that their moments
        are made of. From 1 to 64: in so many intervals along each of them, in which the curve says
        how much is absorbed by all, as MB3DGS has it (5 there; Mueller, Landsgesell, van Holland,
        Stotko and Klein, "Moment-Based 3D Gaussian Splatting", 2025). Surfaces are what they are.

    Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent Transparency", I3D
    2018, algorithm 1, equations 1 and 2, sections 3 and 4.

    >>> str(moit.PowerMoments(4))
    'power4'
    """

    kind: ClassVar[str] = "power"
    usual: ClassVar[int] = 4
    listed: ClassVar[Listed] = tuple(
        {"count": count, "bits": bits} for bits in (32, 16) for count in (4, 6, 8)
    )
    family: ClassVar[str] = "power, neural"
    source: ClassVar[str] = "Muenstermann et al. 2018 (MBOIT), algorithm 1"
    papers: ClassVar[tuple[str, ...]] = ("muenstermann2018",)
    counts: ClassVar[tuple[int, ...]] = (4, 6, 8)

    def __post_init__(self) -> None:
        if self.bits == 16 and self.storage == "half":
            raise ValueError("storage: bits=16 are words; half floats go with bits=32")
        if self.bits == 16 and self.count == 2:
            raise ValueError("bits: two moments are not stored in words; expected 32, got 16")
        super().__post_init__()

    @property
    def _not_in_blocks(self) -> dict[str, bool]:
        return {**super()._not_in_blocks, "storage='half'": self.in_halves}

    @property
    def bits_per_pixel(self) -> float | None:
        if self.in_halves:
            return 16 * (self.count + 1) + self._extent_bits
        return super().bits_per_pixel

    @property
    def published_bits(self) -> dict[str, float]:
        if self.in_halves or self.count == 2:
            return {}
        nmt = {"NMT": 320} if self.count == 4 and self.bits == 32 and self.resolution == 1 else {}
        return super().published_bits | nmt

    def stored_in(self, words: bool) -> dict[str, Any] | None:
        if words:
            return {"storage": "half"} if self.in_halves or self.count == 2 else {"bits": 16}
        return {"bits": 32, "b0": None, "storage": None}

    def _state_fields(self) -> dict[str, Any]:
        return {**CountedMoments._state_fields(self), **HalfMoments._state_fields(self)}


@dataclasses.dataclass(frozen=True)
class TwoMoments(PowerMoments):
    """Absorbance along the ray from its mean depth and its deviation: two moments in half floats.

    PowerMoments with count 2 and other defaults: storage "half", a fragment does not occlude
    itself, and half of what may lie at its depth counts. 6 bytes; drawn once before it is shaded.
    Of a ray of one surface all is known; of all distributions of absorbance with that mean m and
    variance v, at least (z - m)^2 / (v + (z - m)^2) of it lies in front of a z behind the mean
    (Cantelli).

    Other options as PowerMoments. Ours, on Muenstermann et al. 2018.

    >>> str(moit.TwoMoments()), moit.TwoMoments().bits_per_pixel
    ('power2', 48)
    """

    count: int = 2
    storage: str | None = dataclasses.field(default="half", kw_only=True)
    exclude_self: bool = dataclasses.field(default=True, kw_only=True)
    overestimation: float = dataclasses.field(default=0.5, kw_only=True)

    kind: ClassVar[str] = "power"
    usual: ClassVar[int] = 0
    listed: ClassVar[Listed] = ({},)
    source: ClassVar[str] = "ours, after Muenstermann et al. 2018 (MBOIT)"
    papers: ClassVar[tuple[str, ...]] = ("muenstermann2018",)
    counts: ClassVar[tuple[int, ...]] = (2,)


@dataclasses.dataclass(frozen=True)
class TrigonometricMoments(CountedMoments):
    """Absorbance along the ray from its trigonometric moments: means of powers of points on the
    unit circle, where a depth z in [-1, 1] has the angle (2 pi - wrapping_zone)(z + 1)/2.

    count : 2, 3 or 4 complex moments beside the total absorbance b0.
    bits : 32: two numbers of the fragments' dtype per moment. 16: two words, into which fragments
        are blended one by one as they arrive, with rounding after each (section 3.4).
    b0 : with 16 bits, what the total absorbance is rounded to: "half" (None: that, too) or
        "float32".
    wrapping_zone : theta, in radians in [0, pi/2]: the part of the circle that no depth has, in
        which what is reconstructed there fades from the front to the back (eqs 5 and 6). 0: none
        (eqs 3 and 4), which makes transmittance jump.
    overestimation : beta in [0, 1]: the share of what may lie at a depth that is counted in front
        of it. There are no sharp bounds as power moments have them.
    bias : in [0, 1], what moments are shrunk by so that rounding does no harm. "published": the
        paper's for float32 (4e-7, 8e-7, 1.5e-6 for 2, 3, 4 moments). None: a tenth of that where
        the fragments are float32, as rules are computed in double (less would do harm where there
        are many fragments, docs/bias.py), and 1e-15 where they are float64.
        With 16 bits both are 4e-4, 6.5e-4, 8.5e-4: a tenth of it is nearer the truth for few
        fragments and, but for 2 moments, worse in hair; ten times it is worse everywhere.
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [-1, 1] already.
    depth_range : what maps to [-1, 1]: "image", the fragments' depth_range, or "pixel", each
        pixel's own extent.
    normalize : scale a pixel's colours so that their weights sum to what is covered (eq. 2).
    exclude_self : a fragment does not occlude itself: its own absorbance is taken from what may
        lie at its depth. False: as published.
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.
    resolution : a side in pixels, from 1, of the blocks that have moments of their own: the mean of
        their pixels', and between the middles of blocks what lies between. Not with
        depth_range "pixel" or words of 16 bits.
    total : with a resolution above 1 "block": blocks have the total absorbance, too, and what
        reaches the background is the product of 1 - alpha; "full": each pixel has its own total
        absorbance beside, and what it reads is scaled to that. With exclude_self that is the better
        by far (docs/blocks.md).
    upsampling : with a resolution above 1 "bilinear" or "depth-aware"; the latter gains nothing on
        most scenes.
    intervals : 0: the colour of volumes and Gaussians is emitted at the points that their moments
        are made of. From 1 to 64: in so many intervals along each of them, in which the curve says
        how much is absorbed by all, as MB3DGS has it (5 there; Mueller, Landsgesell, van Holland,
        Stotko and Klein, "Moment-Based 3D Gaussian Splatting", 2025). Surfaces are what they are.

    Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent Transparency", I3D
    2018, algorithm 2, equations 3 to 6, section 5. Transmittance is kept within [exp(-b0), 1].

    >>> str(moit.TrigonometricMoments(2))
    'trig2'
    """

    wrapping_zone: float = math.pi / 10

    kind: ClassVar[str] = "trig"
    usual: ClassVar[int] = 2
    listed: ClassVar[Listed] = tuple(
        {"count": count, "bits": bits} for bits in (32, 16) for count in (2, 3, 4)
    )
    family: ClassVar[str] = "trigonometric"
    source: ClassVar[str] = "Muenstermann et al. 2018 (MBOIT), algorithm 2"
    papers: ClassVar[tuple[str, ...]] = ("muenstermann2018",)
    counts: ClassVar[tuple[int, ...]] = (2, 3, 4)

    def __post_init__(self) -> None:
        within(self, "wrapping_zone", 0, MOST_WRAPPING_ZONE)
        super().__post_init__()

    @property
    def moments_are_complex(self) -> bool:
        return True

    @property
    def thick_frequency(self) -> float:
        return self.count * (2 * math.pi - self.wrapping_zone)

    def _state_fields(self) -> dict[str, Any]:
        return {**super()._state_fields(), "wrapping_zone": self.wrapping_zone}
