"""The answer of a comparison: which technique is nearest to the reference within which memory."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from moit.comparing.rows import Findings, Row
from moit.reports.columns import number, plain_number

LEAST_BUDGET = 32  # bits per pixel; budgets are powers of two, as targets come
MOST = 3  # steps that a sentence tells, and pictures beside the reference's
AGREES = 1e-4  # distances below it are roundings: nobody sees them
ALIKE = 0.01  # distances that differ by less, relative to them, are equal

METRIC_WORDS = {
    "mse": "MSE",
    "rmse": "RMSE",
    "mae": "MAE",
    "psnr": "PSNR",
    "ssim": "SSIM",
    "flip": "FLIP",
    "hdr_flip": "HDR-FLIP",
    "T_mae": "mean error of transmittance",
}


class Name(str):
    """A technique within a sentence."""


Sentence = list[str]  # words and Names


@dataclass(frozen=True)
class Standing:
    """A technique on one device over all scenes.

    bits : per pixel, the most of any scene; None: they grow with the fragments.
    distance : from the reference, the mean over the scenes. worst : of a scene, and which.
    """

    technique: str
    bits: float | None
    distance: float
    worst: float
    where: str


@dataclass(frozen=True)
class Answer:
    """sentences : what the page opens with. shown : techniques whose pictures stand beside the
    reference's, those of the sentence first. scene : the one on which these differ most; "" where
    there is none."""

    sentences: list[Sentence]
    shown: list[str]
    scene: str

    @property
    def text(self) -> str:
        return " ".join("".join(sentence) for sentence in self.sentences)


def distance(metric: str, value: float) -> float:
    """How far a metric's value is from that of equal pictures, 0 or more: such that means over
    scenes, and ratios, say something."""
    if metric == "psnr":
        return 10 ** (-value / 20)  # the RMSE of pictures within [0, 1]; 0 for infinity
    if metric == "ssim":
        return max(1 - value, 0.0)
    return math.sqrt(value) if metric == "mse" else value


def from_distance(metric: str, far: float) -> float:
    """The metric's value at a distance."""
    if metric == "psnr":
        return -20 * math.log10(far) if far > 0 else math.inf
    return {"ssim": 1 - far, "mse": far**2}.get(metric, far)


def told(metric: str, far: float) -> str:
    """A distance as the metric's own number, in few digits."""
    return told_value(metric, from_distance(metric, far))


def told_value(metric: str, value: float, digits: int = 2) -> str:
    """A metric's number in few digits."""
    if metric == "psnr":
        return f"{value:.1f} dB"
    if metric == "mse":  # of which small ones count, too
        return number(value, digits)
    return plain_number(value, digits)


def standings(rows: Iterable[Row], metric: str, scenes: int) -> list[Standing]:
    """Of the rows of one device: the techniques that have the metric on all scenes, nearest
    first, of equals the smallest first."""
    by_name: dict[str, list[Row]] = {}
    for row in rows:
        by_name.setdefault(row["technique"], []).append(row)
    found = []
    for name, own in by_name.items():
        far = {row["scene"]: distance(metric, row[metric]) for row in own if has(row, metric)}
        if len(far) < scenes:
            continue
        where = max(far, key=far.__getitem__)
        bits = [row["bits_per_pixel"] for row in own]
        most = None if None in bits else max(bits)
        found.append(Standing(name, most, sum(far.values()) / len(far), far[where], where))
    return sorted(found, key=lambda one: (max(one.distance, AGREES), _size(one)))


def steps(found: Sequence[Standing]) -> list[tuple[int, list[Standing]]]:
    """At which budgets of memory another technique becomes the nearest, and which: several where
    they are alike in distance and memory."""
    result: list[tuple[int, list[Standing]]] = []
    before = math.inf
    for budget in sorted({_budget(one.bits) for one in found if one.bits is not None}):
        within = [one for one in found if _size(one) <= budget]
        best = within[0].distance
        alike = [one for one in within if _alike(one.distance, best)]
        least = min(_size(one) for one in alike)
        winners = [one for one in alike if _size(one) == least]
        if not result or (best < before and not _alike(best, before)):
            result.append((budget, winners))
            before = best
    if len(result) > MOST:
        result = [result[0], result[len(result) // 2], result[-1]]
    return result


def has(row: Row, metric: str) -> bool:
    """Whether a row has a number that says how far off it is."""
    value = row.get(metric)
    return isinstance(value, (int, float)) and math.isfinite(distance(metric, value))


def nearness(row: Row, metric: str) -> float:
    """A row's distance from the reference; infinite where it has none."""
    return distance(metric, row[metric]) if has(row, metric) else math.inf


def answer(found: Findings) -> Answer:
    """What the rows say; `found` may hold failures, several scenes and devices, or nothing."""
    metric = found.main_metric()
    scenes = list(dict.fromkeys(row["scene"] for row in found.rows))
    devices = list(dict.fromkeys(row["device"] for row in found.rows))
    others = [row for row in found.rows if row["technique"] != found.reference]
    per_device = {
        device: standings([r for r in others if r["device"] == device], metric, len(scenes))
        for device in devices
    }
    told_by: dict[str, list[Sentence]] = {}
    for device, known in per_device.items():
        own = [row for row in others if row["device"] == device]
        told_by[device] = _sentences(known, own, metric, scenes, found.reference)
    sentences: list[Sentence] = []
    if len({str(one) for one in told_by.values()}) == 1:  # all devices agree
        sentences = next(iter(told_by.values()))
    else:
        for device, own_sentences in told_by.items():
            first, *rest = own_sentences
            sentences += [[f"{device.upper()}: ", *first], *rest]
    if not found.rows:
        sentences = [["Nothing was compared."]]
    known = next(iter(per_device.values()), [])
    shown = _shown(known)
    return Answer(sentences, shown, _telling_scene(found, shown, metric, scenes))


# The sentences


def _sentences(
    known: list[Standing], rows: list[Row], metric: str, scenes: list[str], reference: str
) -> list[Sentence]:
    named = list(dict.fromkeys(row["technique"] for row in rows))
    lost = [name for name in named if name not in {one.technique for one in known}]
    if not named:
        return [[f"Only the reference, {reference}, was compared."]]
    if not known:
        on = "" if len(scenes) == 1 else " on all scenes"
        return [[f"No technique could be held against {reference}{on}: the table says why."]]
    found = steps(known)
    sentences: list[Sentence] = []
    of = f"{'mean ' if len(scenes) > 1 else ''}{METRIC_WORDS.get(metric, metric)} "
    if len(named) == 1:
        far = _far(known[0].distance, metric, of)
        sentences.append([Name(named[0]), f", {_memory(known[0])}: {far} from {reference}"])
        sentences[-1] += [f" over {len(scenes)} scenes." if len(scenes) > 1 else "."]
    else:
        sentences.append(_within(known, found, metric, of, reference, len(scenes)))
        sentences += _beyond(known, found, metric)
    worst = found[-1][1][0] if found else known[0]
    if len(scenes) > 1 and worst.worst > AGREES:
        far = told(metric, worst.worst)
        sentences.append([Name(worst.technique), f" is farthest off on {worst.where} ({far})."])
    if lost:
        sentences.append(["Could not be held against it: ", *_listed(lost), "."])
    return sentences


def _within(
    known: list[Standing],
    found: Sequence[tuple[int, list[Standing]]],
    metric: str,
    of: str,
    reference: str,
    scenes: int,
) -> Sentence:
    """What each budget buys."""
    words: Sentence = [f"Nearest to {reference}", f" over {scenes} scenes" * (scenes > 1), ": "]
    for i, (budget, winners) in enumerate(found):
        unit = "" if i else " bits per pixel"
        far = _far(winners[0].distance, metric, "" if i else of)
        words += [", " if i else "", f"within {budget}{unit} "]
        words += [*_listed([one.technique for one in winners]), f" ({far})"]
    if not found:  # all grow with the fragments
        best = known[0]
        words += [Name(best.technique), f", {_memory(best)} ({_far(best.distance, metric, of)})"]
    return [*words, "."]


def _beyond(
    known: list[Standing], found: Sequence[tuple[int, list[Standing]]], metric: str
) -> list[Sentence]:
    """What more memory than that of the last step brings."""
    if not found:
        return []
    budget, winners = found[-1]
    last, best = winners[0], known[0]
    if best.bits is None and not _alike(best.distance, last.distance):
        far = _far(best.distance, metric, "")
        return [["Nearer still: ", Name(best.technique), f", {_memory(best)} ({far})."]]
    if any(_size(one) > budget for one in known):
        return [["More memory brings nothing nearer."]]
    return []


def _far(far: float, metric: str, of: str) -> str:
    return "no visible difference" if far <= AGREES else f"{of}{told(metric, far)}"


def _memory(one: Standing) -> str:
    if one.bits is None:
        return "whose memory grows with the fragments"
    return f"{one.bits:g} bits per pixel"


def _listed(names: Sequence[str], most: int = 3) -> Sentence:
    """Names with commas and "and"; of many the first."""
    shown: list[str] = [Name(name) for name in names[:most]]
    if len(names) > most:
        shown.append(f"{len(names) - most} more")
    words: Sentence = []
    for i, one in enumerate(shown):
        words += ["" if i == 0 else " and " if i == len(shown) - 1 else ", ", one]
    return words


def _budget(bits: float) -> int:
    """The least budget that holds so many."""
    budget = LEAST_BUDGET
    while budget < bits:
        budget *= 2
    return budget


def _size(one: Standing) -> float:
    return math.inf if one.bits is None else one.bits


def _alike(one: float, other: float) -> bool:
    one, other = max(one, AGREES), max(other, AGREES)
    return abs(one - other) <= ALIKE * min(one, other)


# The pictures beside it


def _shown(known: list[Standing]) -> list[str]:
    """The sentence's techniques, smallest first, then the nearest others."""
    told_of = [winners[0].technique for _, winners in steps(known)]
    others = [one.technique for one in known if one.technique not in told_of]
    return [*told_of, *others][:MOST]


def _telling_scene(found: Findings, shown: list[str], metric: str, scenes: list[str]) -> str:
    """Where these are least alike."""

    def spread(scene: str) -> float:
        far = [
            distance(metric, row[metric])
            for row in found.rows
            if row["scene"] == scene and row["technique"] in shown and has(row, metric)
        ]
        return max(far) - min(far) if far else -1.0

    return max(scenes, key=spread, default="")
