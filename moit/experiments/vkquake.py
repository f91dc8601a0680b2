"""The checks that vkQuake's own harness made before moments went into the engine, for every
technique: lone surfaces, two close layers, coincident ones, and storage in words of 16 bits."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from moit import moments
from moit.catalog import MomentTechnique, techniques
from moit.catalog import technique as technique_named
from moit.comparing.rows import Row
from moit.experiments.claims import Claim, Less, Of
from moit.experiments.description import Array, Experiment, Section, Setting
from moit.fragments.fragments import Fragments
from moit.questions import composite, transmittance

SOURCE = "vkQuake (engine, 2026)"
OCTAVES = 14.0  # -log2 of what its depth buffer holds, by 14, is the depth that it takes moments of
NEAR, FAR = 1.0, 2.0**OCTAVES
LONE = 801
OFF = 0.005  # what its harness lets a lone surface be off by,
MOST_OFF = 8  # at so many depths at most,
PAIR_OFF = 0.05  # and two layers
APART = (0.02, 0.04, 0.08, 0.15, 0.25, 0.4)
PLACES = 41  # of the nearer layer
COINCIDENT = 16
FAINT = 0.1
SOLID = 0.5

BIAS = 6e-5  # vkQuake's
P4, P4_THEIRS, P4_PUBLISHED = "power4", f"power4(bias={BIAS!r})", "power4(bias='published')"
WORDS, WORDS_WEAK = "power4-16", f"power4-16(bias={BIAS / 50!r})"
MORE = (P4_PUBLISHED, P4_THEIRS, WORDS_WEAK)


def _depth(place: Array) -> Array:
    """Of places in [0, 1] of the octaves."""
    return NEAR * np.exp2(OCTAVES * np.asarray(place))


def _layers(places: Array, alpha: float, colors: Array) -> Fragments:
    """Of places (P, K): P pixels of K layers of `colors` (K, 3)."""
    pixels, count = places.shape
    return Fragments(
        np.arange(pixels + 1) * count,
        _depth(places).ravel(),
        np.full(places.size, alpha),
        np.tile(colors, (pixels, 1)),
        shape=(pixels, 1),
        depth_range=(NEAR, FAR),
        dtype="f4",
    )


def lone_surfaces(name: str) -> dict[str, float]:
    """A surface behind nothing: its transmittance at 801 depths should be one and the same. How far
    apart the least and the greatest are, and at how many depths it is off the median."""
    places = np.linspace(0.0, 1.0, LONE)[:, None]
    T = transmittance(_layers(places, SOLID, np.ones((1, 3))), name)
    off = np.abs(T - np.median(T))
    return {"lone_spread": float(np.ptp(T)), "lone_off": int((off > OFF).sum())}


def two_layers(name: str) -> dict[str, float]:
    """Red before green, apart by a share of the octaves: what colours are off by."""
    apart = np.array(APART)
    first = np.linspace(0.0, 1.0 - apart.max(), PLACES)
    places = np.stack(np.broadcast_arrays(first[:, None], first[:, None] + apart), -1).reshape(
        -1, 2
    )
    f = _layers(places, SOLID, np.eye(3)[:2])
    off = np.abs(_picture(f, name) - _picture(f, "sorted")).max(axis=1)
    closest = off.reshape(PLACES, len(APART))[:, 0]
    return {"pair_max": float(off.max()), "pair_close": float(closest.max())}


def coincident_layers(name: str) -> dict[str, float]:
    """Sixteen faint layers of one colour at one depth: what brightness is off by."""
    places = np.repeat(np.linspace(0.0, 1.0, PLACES)[:, None], COINCIDENT, axis=1)
    f = _layers(places, FAINT, np.ones((COINCIDENT, 3)))
    return {"coincident": float(np.abs(_picture(f, name) - _picture(f, "sorted")).max())}


def _picture(f: Fragments, name: str) -> Array:
    return np.asarray(composite(f, name), np.float64)[:, 0, :3]


CHECKS: tuple[Callable[[str], Mapping[str, float]], ...] = (
    lone_surfaces,
    two_layers,
    coincident_layers,
)
COLUMNS = ("technique", "bits_per_pixel", "lone_spread", "lone_off", "pair_max", "pair_close")


# A shader's pass 1: float32 from the depth to the sum. Its default bias, the published one, the one
# that engines' texts have (moit.export), and vkQuake's.
ADDED_UP = (
    *("power4", P4_PUBLISHED, P4_THEIRS),
    *("power6", "power6(bias='published')", "power6(bias=4e-06)"),
    *("power8", "power8(bias='published')"),
    *("trig2", "trig2(bias='published')", "trig2(bias=2e-06)"),
    *("trig3", "trig3(bias='published')", "trig3(bias=4e-06)"),
    *("trig4", "trig4(bias='published')", "trig4(bias=6e-06)"),
)
OPACITIES = np.linspace(0.05, 0.95, 10)


def added_in_floats(technique: MomentTechnique, z: Array, alpha: Array) -> tuple[Array, Array]:
    """b0 and b of lone surfaces, as a shader makes them: every product is rounded to float32."""
    absorbance = -np.log1p(-alpha.astype(np.float32))
    if technique.moments_are_complex:
        zone = technique.fields_for_core(np.dtype(np.float32))["wrapping_zone"]
        once = np.exp(1j * (z + np.float32(1)) * np.float32((2 * np.pi - zone) / 2))
        powers = [once.astype(np.complex64)]
    else:
        powers = [z.astype(np.float32)]
    while len(powers) < technique.moment_count:
        n = len(powers) + 1
        powers.append(powers[n // 2 - 1] * powers[(n + 1) // 2 - 1])
    sums = np.stack([power * absorbance for power in powers], axis=1)
    return absorbance, sums / absorbance[:, None]


def lone_in_floats(name: str) -> dict[str, float]:
    """At 801 depths, with ten opacities: how often transmittance is off, and by how much."""
    technique = technique_named(name)
    assert isinstance(technique, MomentTechnique)
    z, alpha = np.meshgrid(np.linspace(-1, 1, LONE, dtype=np.float32), OPACITIES)
    b0, b = added_in_floats(technique, z.ravel(), alpha.ravel())
    plain = dataclasses.replace(technique, warp="none")
    T = moments.transmittance(plain, b0, b, z.reshape(-1, 1))[:, 0]
    off = np.abs(T - (1 - alpha.ravel()) ** 0.25)  # overestimation
    return {"lone_wrong": int((off > OFF).sum()), "lone_max": float(off.max())}


@dataclass(frozen=True)
class FloatSums:
    """Lone surfaces, whose moments are added up in float32 from the first product on."""

    title: str
    text: str
    names: Sequence[str]

    def steps(self) -> int:
        return 1

    def run(self, setting: Setting) -> Section:
        rows = [Row(technique=name, **lone_in_floats(name)) for name in self.names]
        setting.done(self.title)
        return Section(self.title, self.text, ("technique", "lone_wrong", "lone_max"), rows)


def _names() -> tuple[str, ...]:
    return tuple(dict.fromkeys((*map(str, techniques()), *MORE)))


@dataclass(frozen=True)
class Harness:
    """A row for every technique, and for storage and bias as the engine has them."""

    title: str
    text: str
    names: Sequence[str]

    def steps(self) -> int:
        return len(self.names)

    def run(self, setting: Setting) -> Section:
        rows = []
        for name in self.names:
            found: dict[str, float] = {}
            for check in CHECKS:
                found |= check(name)
            bits = technique_named(name).bits_per_pixel
            rows.append(Row(technique=name, bits_per_pixel=bits, **found))
            setting.done(name)
        return Section(self.title, self.text, (*COLUMNS, "coincident"), rows)


HARNESS = Experiment(
    name="vkquake",
    paper=SOURCE,
    figure="its change to moments",
    title="what an engine checks before it takes a technique",
    about=(
        "vkQuake took up moment-based transparency in July 2026 with a harness of its own: 801 "
        f"lone surfaces over {OCTAVES:g} octaves of depth, of which at most {MOST_OFF} may be off "
        f"by more than {OFF:g}; two layers .02 to .4 of these octaves apart, off by at most "
        f"{PAIR_OFF:g}; sixteen coincident layers of opacity .1; and what words of 16 bits do to "
        "moments. Here every technique is asked the same, in float32. Its harness is known from "
        "its description alone: opacities, colours and what is taken for an error are ours."
    ),
    parts=(
        Harness(
            "Every technique",
            f"lone_spread: how far apart transmittance is of one surface at {LONE} depths; "
            f"lone_off: at how many it is more than {OFF:g} off the median. pair_max: the greatest "
            "error of a colour of two layers; pair_close: of those .02 apart. coincident: of "
            "brightness. Rays are pixels side by side, so that techniques of blocks of pixels "
            "(lr8) see their neighbours; hashed-alpha is off by its noise, strong5 by copies of "
            "the last fragment that it keeps, which occlude nothing.",
            _names(),
        ),
        FloatSums(
            "Added up in float32",
            "The core rounds sums once. A shader rounds every product that it adds, and what it "
            "has then may be the moments of nothing that can be: a lone surface is seen as opaque, "
            "or not at all. With less than the published bias pivots that are rounding alone are "
            "known for that, with it they are taken for true: six power moments then have some "
            f"that are not. Of {LONE} depths with ten opacities: how many are off by more than "
            f"{OFF:g}, and by how much.",
            ADDED_UP,
        ),
    ),
    claims=(
        Claim(
            "Added up in float32, four power moments lose no lone surface with its bias.",
            "its bias, 6e-5",
            (Less(Of("lone_wrong", P4_THEIRS), 1),),
        ),
        Claim(
            f"Of 801 lone surfaces at most {MOST_OFF} are off by more than {OFF:g}.",
            "harness",
            tuple(Less(Of("lone_off", one), MOST_OFF + 1) for one in (P4_THEIRS, P4)),
        ),
        Claim(
            f"Two layers .02 to .4 apart are off by at most {PAIR_OFF:g}.",
            "harness",
            tuple(Less(Of("pair_max", one), PAIR_OFF) for one in (P4_THEIRS, P4)),
        ),
        Claim(
            "Sixteen coincident layers are as bright as they should be.",
            "harness",
            tuple(Less(Of("coincident", one), 0.005) for one in (P4_THEIRS, P4)),
        ),
        Claim(
            "Moments in 16 bits need a bias some 50 times as strong.",
            "its comment",
            tuple(Less(Of(one, WORDS), Of(one, WORDS_WEAK)) for one in ("lone_spread", "pair_max")),
        ),
        Claim(
            "With it they visibly blur close layers.",
            "its comment",
            (Less(Of("pair_close", P4), Of("pair_close", WORDS)),),
        ),
    ),
)

EXPERIMENTS = (HARNESS,)
