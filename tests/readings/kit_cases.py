"""Pixels that no text was made with, and what moit's core says of them: for kits."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from golden import golden

import moit
from moit.catalog.targets import Target, channels
from moit.kit.recipe import HASHED, PEELED, SAMPLED
from readings import kit_blocks, kit_programs, kits

COUNTS = (1, 2, 3, 4, 6, 9, 16, 40)
RANGE = (0.1, 1000.0)
LONE = 401  # surfaces of pixels of their own, from one end of the depth range to the other


@dataclasses.dataclass(frozen=True)
class Case:
    depth: np.ndarray
    alpha: np.ndarray
    color: np.ndarray
    offsets: np.ndarray
    pixel: np.ndarray

    def fragments(self, dtype=np.float64) -> moit.Fragments:
        return moit.Fragments(
            self.offsets,
            self.depth.astype(dtype),
            self.alpha.astype(dtype),
            self.color.astype(dtype),
            depth_range=RANGE,
        )

    def summed(self, terms: np.ndarray) -> np.ndarray:
        """(P, k) of terms (n, k), added up in double and rounded once."""
        total = np.add.reduceat(terms.astype(np.float64), self.offsets[:-1], axis=0)
        return total.astype(np.float32)

    def blended(self, terms: np.ndarray, held: Sequence[tuple[str, Target]]) -> np.ndarray:
        """The same as targets blend it: of some the greatest is kept, in half floats."""
        sums, at = self.summed(terms), 0
        for _, target in held:
            size = channels(target.format)
            if target.blend == "max":
                most = np.maximum.reduceat(terms[:, at : at + size], self.offsets[:-1], axis=0)
                sums[:, at : at + size] = np.maximum(most, target.clear).astype(np.float16)
            at += size
        return sums


def held_case(seed: int = 20_261, pixels: int = 640) -> Case:
    """Surfaces all over the depth range, some close together, faint, solid and nearly opaque; and
    lone ones."""
    random = np.random.default_rng(seed)
    counts = np.concatenate([np.resize(COUNTS, pixels), np.ones(LONE, int)])
    pixels += LONE
    offsets = np.concatenate([[0], np.cumsum(counts)])
    pixel = np.repeat(np.arange(pixels), counts)
    near, far = np.log(RANGE[0] * 1.5), np.log(RANGE[1] / 1.5)
    middle, size = random.uniform(near, far, pixels), random.choice([0.03, 0.5, 4.0], pixels)
    place = middle[pixel] + size[pixel] * random.uniform(-1, 1, offsets[-1])
    alpha = random.choice([0.02, 0.2, 0.6, 0.95], pixels)[pixel] ** random.uniform(
        0.5, 1.5, offsets[-1]
    )
    alpha[random.random(offsets[-1]) < 0.01] = 0.995
    depth = np.exp(np.clip(place, near, far))
    depth[-LONE:], alpha[-LONE:] = np.geomspace(1.02 * RANGE[0], RANGE[1] / 1.02, LONE), 0.9
    return Case(
        depth.astype(np.float32),
        alpha.astype(np.float32),
        random.uniform(0, 1, (offsets[-1], 3)).astype(np.float32),
        offsets,
        pixel,
    )


def order_of_turned(case: Case) -> np.ndarray:
    """Where the fragments of a case turned round were before."""
    last = case.offsets[1:][case.pixel] - 1
    return last - (np.arange(len(case.pixel)) - case.offsets[case.pixel])


def turned(case: Case) -> Case:
    """With the fragments of each pixel from the last to the first."""
    order = order_of_turned(case)
    return dataclasses.replace(
        case, depth=case.depth[order], alpha=case.alpha[order], color=case.color[order]
    )


SOUND = 1e-4  # a least pivot that the rounding of targets to floats does no harm to


def through_errors(technique, language: str, case: Case) -> np.ndarray:
    """Of the transmittance of fragments, against the core in double on the fragments themselves:
    where moments are not so near impossible ones that rounding what targets hold decides, and of
    lone surfaces."""
    if getattr(technique, "in_halves", False):
        return errors_of_halves(technique, language, case)
    if kits.include(technique, language).side > 1:
        return errors_of_blocks(technique, language, case)
    kit = kits.include(technique, language)
    extents = own_extents(technique, language, case) if kit.extents else None
    z = placed(technique, language, case, extents)
    given = z if kit.extents else case.depth
    sums = case.blended(kits.accumulated(technique, language, given, case.alpha), kit.held)
    if kit.second:
        own = sums[case.pixel]
        second = case.summed(kits.accumulated_second(technique, language, own, z, case.alpha))
        found = kits.through_second(technique, language, own, second[case.pixel], z, case.alpha)
    elif any(not one.endswith("32f") for one in kit.factor_formats):
        held = rounded(kits.factors(technique, language, sums), kit.factor_formats)
        found = kits.through_factors(technique, language, held[case.pixel], z, case.alpha)
    else:
        asked = (sums[case.pixel], z, case.alpha)
        found = kits.through(technique, language, *asked, extents=extents)
    core = with_bias_of_float32(technique)
    fragments = case.fragments()
    error = np.abs(found - moit.transmittance(fragments, core))
    assert not np.isnan(error).any()
    return error[sound(core, fragments, case)]


def placed(technique, language: str, case: Case, extents: np.ndarray | None) -> np.ndarray:
    """(n,): z of fragments, by the camera's range of depth or their pixels' own."""
    if extents is None:
        return kits.warped(technique, language, case.depth)
    return kits.warped_within(technique, language, extents, case.depth)


def own_extents(technique, language: str, case: Case) -> np.ndarray:
    """(n, 2): of fragments, the ends of their pixels as targets hold these."""
    each = kits.extents_of(technique, language, case.depth)
    formats = [target.format for _, target in kits.include(technique, language).extents]
    most = rounded(np.maximum.reduceat(each, case.offsets[:-1], axis=0), formats)
    return most[case.pixel]


def rounded(numbers: np.ndarray, formats: Sequence[str]) -> np.ndarray:
    """(n, k) as targets hold them."""
    found, at = numbers.copy(), 0
    for one in formats:
        end = at + channels(one)
        if one.endswith("16f"):
            found[:, at:end] = found[:, at:end].astype(np.float16)
        elif one.endswith("16"):
            inside = np.clip(found[:, at:end].astype(np.float64), 0, 1)
            found[:, at:end] = np.floor(inside * 65535 + 0.5) / 65535
        at = end
    return found


def errors_of_blocks(technique, language: str, case: Case) -> np.ndarray:
    """The same of a picture whose blocks have moments, where those that pixels read between them
    are sound."""
    found, picture = kit_blocks.through(technique, language, case)
    core, fragments = with_bias_of_float32(technique), picture.fragments()
    error = np.abs(found - moit.transmittance(fragments, core))
    if not technique.stores_moments:
        return error
    pivots = moit.moments.least_pivot(core, *moit.moments.gather(fragments, core))
    return error[(pivots > SOUND)[case.pixel[: len(error)]]]


def errors_of_halves(technique, language: str, case: Case) -> np.ndarray:
    """Of transmittance read from half floats, which every fragment's terms have been added to in
    their order, against the core in double."""
    terms = kits.accumulated(technique, language, case.depth, case.alpha).astype(np.float64)
    held = np.zeros((len(case.offsets) - 1, terms.shape[1]), np.float16)
    place = np.arange(len(case.pixel)) - case.offsets[case.pixel]
    for k in range(place.max() + 1):
        now = place == k
        held[case.pixel[now]] = (held[case.pixel[now]] + terms[now]).astype(np.float16)
    sums = held.astype(np.float32)
    z = kits.warped(technique, language, case.depth)
    found = kits.through(technique, language, sums[case.pixel], z, case.alpha)
    return np.abs(found - moit.transmittance(case.fragments(), technique))


def sound(technique, fragments, case: Case) -> np.ndarray:
    """(n,) of fragments, whose pixels are."""
    lone = np.diff(case.offsets) == 1
    if not technique.stores_moments:
        return np.ones(len(case.pixel), bool)
    pivots = moit.moments.least_pivot(technique, *moit.moments.gather(fragments, technique))
    return (lone | (pivots > SOUND))[case.pixel]


def with_bias_of_float32(technique):
    """Whatever precision it computes in."""
    from moit.kit.recipes import recipe_of

    bias = recipe_of(technique, RANGE).values.get("BIAS")
    if bias is None:
        return technique
    return dataclasses.replace(technique, bias=bias)


def errors(technique, language: str, case: Case) -> tuple[str, np.ndarray]:
    """What they are of, and how large."""
    kit = kits.include(technique, language)
    if kit.state:
        return ordered_errors(technique, language, case)
    if kit.programs:
        return "transmittance", gathered_errors(technique, language, case)
    if kit.shape:
        found = {PEELED: _peeled, SAMPLED: _sampled, HASHED: _hashed}[kit.shape]
        error = np.abs(found(technique, language, case) - pictured(technique, case))
        return "colour and coverage", error[_distinct(case)]
    if kit.held:
        return "transmittance", through_errors(technique, language, case)
    return "colour and coverage", weighted_errors(technique, language, case)


def gathered_errors(technique, language: str, case: Case, everywhere: bool = False) -> np.ndarray:
    """Of transmittance by what atomics gather. Where the nearest are taken out of sums of floats,
    against the core in floats, which a bias is for; of pixels without fragments at one depth, of
    which the one that comes first is in front, and, unless `everywhere`, where what is left is
    sound."""
    found, picture = kit_programs.through(technique, language, case)
    in_floats = technique.kind == "front"
    fragments = picture.fragments(np.float32 if in_floats else np.float64)
    error = np.abs(found - moit.transmittance(fragments, technique))
    if not in_floats:
        return error
    counts = _distinct(case)[case.pixel[: len(error)]]
    return error[counts & (everywhere | sound_behind(technique, picture))]


def sound_behind(technique, picture) -> np.ndarray:
    """(n,) of fragments, in whose pixels the moments behind the nearest are sound, although what
    rounding leaves of all counts among the less that they are; or nothing is behind these."""
    every, pixel = picture.fragments(), picture.case.pixel[: picture.fragments_there]
    order = np.lexsort((every.depth, pixel))
    rank = np.empty(len(pixel), int)
    rank[order] = np.arange(len(pixel)) - picture.case.offsets[pixel[order]]
    rest = rank >= technique.layers
    counts = np.bincount(pixel[rest], minlength=picture.pixels)
    behind = moit.Fragments(
        np.concatenate([[0], np.cumsum(counts)]),
        every.depth[rest],
        every.alpha[rest],
        depth_range=RANGE,
    )
    total, moments = moit.moments.gather(behind, technique.behind)
    whole, _ = moit.moments.gather(every, technique.behind)
    pivots = moit.moments.least_pivot(technique.behind, total, moments)
    return ((counts == 0) | (pivots * total > SOUND * whole))[pixel]


def ordered_errors(technique, language: str, case: Case) -> tuple[str, np.ndarray]:
    """Of what fragments change one after the other: transmittance of fragments where there is a
    second pass, else colour and coverage of pixels."""
    words, tail = kits.inserted(technique, language, case)
    if kits.include(technique, language).shaded:
        found = kits.through_words(technique, language, words[case.pixel], case.depth, case.alpha)
        core = with_bias_of_float32(technique)
        return "transmittance", np.abs(found - moit.transmittance(case.fragments(), core))
    found = kits.resolved_layers(technique, language, words, tail)
    return "colour and coverage", np.abs(found - pictured(technique, case))


def _distinct(case: Case) -> np.ndarray:
    """Pixels without fragments at one depth, of which a depth test keeps one."""
    order = np.lexsort((case.depth, case.pixel))
    depth, pixel = case.depth[order], case.pixel[order]
    same = (np.diff(depth) == 0) & (np.diff(pixel) == 0)
    return ~np.isin(np.arange(len(case.offsets) - 1), pixel[1:][same])


def _peeled(technique, language: str, case: Case) -> np.ndarray:
    """(P, 4): rounds as a depth test makes them, each under those before."""
    if technique.normalize:
        terms = kits.added(technique, language, case.color, case.alpha)
    else:
        terms = kits.accumulated(technique, language, case.depth, case.alpha, case.color)
    picture = np.zeros((len(case.offsets) - 1, 4))
    before = np.zeros(len(picture), np.float32)
    for _ in range(technique.layers):
        drawn = kits.behind(technique, language, case.depth, before[case.pixel])
        depth = np.where(drawn, case.depth, np.float32(np.inf))
        nearest = np.minimum.reduceat(depth, case.offsets[:-1])
        seen = drawn & (case.depth == nearest[case.pixel])
        layer = np.zeros_like(picture)
        layer[case.pixel[seen]] = terms[seen]
        picture += layer * (1 - picture[:, 3:])
        before = np.where(np.isfinite(nearest), nearest, before)
    picture = picture.astype(np.float32)
    if not technique.normalize:
        return kits.resolved(technique, language, picture)
    return kits.resolved(technique, language, _let_through(technique, language, case), picture)


def _let_through(technique, language: str, case: Case) -> np.ndarray:
    """(P, 1): what all fragments do, multiplied up."""
    terms = kits.accumulated(technique, language, case.depth, case.alpha)
    return np.multiply.reduceat(1 - terms.astype(np.float64), case.offsets[:-1]).astype(np.float32)


def _sampled(technique, language: str, case: Case) -> np.ndarray:
    """(P, 4): samples' depths as a depth test makes them, colours where they are no farther."""
    row = np.zeros(len(case.pixel))
    mask = kits.masks(technique, language, row, case.pixel, case.depth, case.alpha)
    seen = np.zeros(len(case.pixel))
    for k in range(technique.samples):
        depth = np.where(mask >> k & 1, case.depth, np.float32(np.inf))
        nearest = np.minimum.reduceat(depth, case.offsets[:-1])[case.pixel]
        seen += (case.depth <= nearest) / technique.samples
    colours = case.summed(kits.added(technique, language, case.color, case.alpha) * seen[:, None])
    return kits.resolved(technique, language, _let_through(technique, language, case), colours)


def _hashed(technique, language: str, case: Case) -> np.ndarray:
    """(P, 4): the nearest of what is left, as a depth test keeps it."""
    row = np.zeros(len(case.pixel))
    left = kits.masks(technique, language, row, case.pixel, case.depth, case.alpha) == 1
    depth = np.where(left, case.depth, np.float32(np.inf))
    nearest = np.minimum.reduceat(depth, case.offsets[:-1])[case.pixel]
    terms = kits.accumulated(technique, language, case.depth, case.alpha, case.color)
    picture = np.zeros((len(case.offsets) - 1, 4), np.float32)
    seen = left & (case.depth == nearest)
    picture[case.pixel[seen]] = terms[seen]
    return kits.resolved(technique, language, picture)


def pictured(technique, case: Case, dtype=np.float64) -> np.ndarray:
    """(P, 4): premultiplied colour and coverage of each pixel, by the core."""
    f = case.fragments(dtype)
    picture = moit.composite(f, technique).reshape(len(case.offsets) - 1, -1)[:, :3]
    return np.column_stack([picture, 1 - moit.total_transmittance(f, technique).ravel()])


def weighted_errors(technique, language: str, case: Case) -> np.ndarray:
    """Of colours and coverage of each pixel, (P, 4)."""
    terms = kits.accumulated(technique, language, case.depth, case.alpha, case.color)
    sums = case.summed(terms)
    if kits.include(technique, language).shaded[-1][1].blend == "multiply-complement":
        through = np.multiply.reduceat(1 - terms[:, -1].astype(np.float64), case.offsets[:-1])
        sums[:, -1] = through
    found = kits.resolved(technique, language, sums)
    return np.abs(found - pictured(technique, case))


def stored_errors(technique, language: str, case: Case) -> np.ndarray:
    """Of transmittance read from the very floats that the core is given, of power moments: b0 is
    made a power of 2, so that dividing by it loses nothing."""
    sums = case.summed(kits.accumulated(technique, language, case.depth, case.alpha))
    b0 = np.exp2(np.round(np.log2(sums[:, -1:]))).astype(np.float32)
    b = (sums[:, :-1] / sums[:, -1:]).astype(np.float32)
    sums = np.concatenate([b * b0, b0], 1)[case.pixel]
    z = kits.warped(technique, language, case.depth)
    found = kits.through(technique, language, sums, z, case.alpha)
    plain = dataclasses.replace(technique, warp="none")
    core = moit.moments.transmittance(plain, b0[case.pixel, 0], b[case.pixel], z[:, None])
    return np.abs(found - core[:, 0])


def golden_errors(technique, language: str) -> np.ndarray:
    """(P, K) of transmittance from moments and depths, against answers of 80 digits
    (tests/golden.py); of trigonometric ones against the core in double, as turning them by an angle
    rounds them anew."""
    technique = dataclasses.replace(technique, bias="published")  # that of the answers
    data, z = golden(technique.base_name), golden("problems")["eval_depth"].astype(np.float32)
    b, b0 = data["b"], np.exp2(np.round(np.log2(data["b0"]))).astype(np.float32)
    share = data["truth_A_lower"] + technique.overestimation * data["truth_w0"]
    exact = np.exp(-b0[:, None].astype(np.float64) * share)
    if technique.moments_are_complex:
        angle = np.arange(1, technique.count + 1) * (2 * np.pi - technique.wrapping_zone) / 2
        turned = (b * np.exp(-1j * angle)).astype(np.complex64)
        plain = dataclasses.replace(technique, warp="none")
        back = turned.astype(np.complex128) * np.exp(1j * angle)
        back = np.clip(back.real, -1, 1) + 1j * np.clip(back.imag, -1, 1)
        exact = moit.moments.transmittance(plain, b0.astype(np.float64), back, z)
        b = np.ascontiguousarray(turned).view(np.float32)
    rows = np.repeat(np.concatenate([b * b0[:, None], b0[:, None]], 1), z.shape[1], axis=0)
    opacity = np.full(z.size, 0.5, np.float32)
    found = kits.through(technique, language, rows, z.ravel(), opacity)
    return np.abs(found.reshape(z.shape) - exact)
