"""Deep files of fewer samples, with a proof of what that changes."""

from __future__ import annotations

import math
import numbers
import os
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.checks.arguments import truth
from moit.checks.exceptions import FragmentsError
from moit.deep.opened import Deep, Opened, bands_of, dimmed_by, opened
from moit.formats.deep_bands import USUAL_MEMORY
from moit.formats.deep_output import DeepOutput, deep_output
from moit.formats.deep_rows import DeepRows, offsets_of, one_type
from moit.formats.exr_headers import Header
from moit.fragments.frame import Attribute
from moit.system.environment import thread_count
from moit.system.progress import Progress

# What the header says: the error asked for, and the greatest that were found.
NAMES = ("moit:simplifyError", "moit:simplifyTransmittanceError", "moit:simplifyLightError")

USUAL_ERROR = 1 / 255
ID = re.compile(r"(^|[^A-Za-z])id$|I[dD]$")
MOST_LIGHTS = 60


@dataclass(frozen=True)
class Certificate:
    """What `moit.deep.simplify` has proved of the file that it wrote; `str` says it in words.

    error : what was asked for.
    transmittance_error : the greatest |T - T'| at any depth of any pixel.
    light_error : the greatest |C - C'| of any channel of light at any depth of any pixel, divided
        by the pixel's scale: the greatest |C| in it, at least 1.
    samples_before, samples_after : how many there are.
    pixels : how many the image has.
    pixels_kept : how many stayed as they were, since nothing less would do.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> found = moit.deep.simplify("panes.exr", "less.exr", error=0.1)
    >>> found.pixels, found.samples_after < found.samples_before
    (48, True)
    """

    error: float
    transmittance_error: float
    light_error: float
    samples_before: int
    samples_after: int
    pixels: int
    pixels_kept: int

    def __str__(self) -> str:
        return (
            f"{self.samples_before:,} samples became {self.samples_after:,}; greatest error of "
            f"transmittance {self.transmittance_error:.3g}, of light {self.light_error:.3g}; "
            f"asked for {self.error:.3g}"
        )


def simplify(
    path: Deep,
    output: str | os.PathLike[str],
    error: float = USUAL_ERROR,
    *,
    depth_error: float = 0.0,
    keep_ids: bool | Sequence[str] = False,
    volumes: bool | None = None,
    short_numbers: bool = True,
    part: int | str | None = None,
    layer: str | None = None,
    compression: str | None = None,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
) -> Certificate:
    """Writes a deep OpenEXR file with fewer samples, and proves how little that changes.

    path, part, layer : as `read_deep`.
    output, compression, memory, progress : as `moit.deep.merge`.
    error : in (0, 1), of transmittance and, times the pixel's scale, of light.
    depth_error : in [0, 1), how far depths may move, relative to themselves, to such as have fewer
        digits: of what is left of a file, depths take most. 0: not at all. Otherwise what is proved
        is so after the samples of a pixel have moved, none of them past another.
    keep_ids : True: samples of different ids are never made one, and none is dropped that
        something is seen of. Ids are channels of whole numbers and those called id, objectId or
        the like; or name them. In any case other channels are those of the sample that hides most
        of what each new one stands for.
    volumes : whether volumes may stand for surfaces, where a slope reaches farther than a step.
        None: where the file has volumes (ZBack), since others would become larger by that channel.
    short_numbers : alpha and light have as few digits as the error allows, which compresses better;
        False: they are the nearest to the truth that the file's type holds.

    For every pixel and every depth, and so for an opaque holdout at any depth, of any colour c:

        |T - T'| <= error,  |C - C'| <= error scale,  and of the picture error (scale + |c|) at most

    T is the transmittance in front of that depth, of each alpha, C the light that is seen in front
    of it, of each channel of light of each layer; scale is the greatest |C| of the pixel, at least
    1. This is so by the method, and checked for each pixel in float64 after alpha and light were
    rounded to the file's half or float; depths are some of those that the file has, to the bit. A
    pixel that fails stays as it is. The header says what was asked for and found, as
    moit:simplifyError, moit:simplifyTransmittanceError and moit:simplifyLightError; of a file that
    was simplified before, the sums.

    Each pixel gets the least number of samples: see moit_simplify in csrc/moit_deep.h. Pixels that
    end opaque stay opaque. Lokovic and Veach, Deep Shadow Maps (2000), have the corridor.

    Returns the Certificate. Raises ValueError for an error outside (0, 1), else as `read_deep` and
    `write_deep`.

    >>> moit.write_deep("mixed.exr", moit.scenes.load("mixed", (16, 12)))
    >>> found = moit.deep.simplify("mixed.exr", "less.exr", error=0.01)
    >>> found.samples_after < found.samples_before, found.light_error <= 0.01
    (True, True)
    """
    _check("error", error, 0 < _number("error", error) < 1, "(0, 1)")
    _check("depth_error", depth_error, 0 <= _number("depth_error", depth_error) < 1, "[0, 1)")
    if volumes is not None:
        truth("volumes", volumes)
    truth("short_numbers", short_numbers)
    with opened(path, part, layer) as seen:
        errors = (float(error), float(depth_error))
        how = Simplifying(seen, errors, keep_ids, volumes, short_numbers)
        place = seen.place()
        kept = tuple(one for one in place.attributes if one.name not in NAMES)
        place = replace(place, attributes=(*kept, *_attributes((0.0, 0.0, 0.0))))
        top = seen.origin[0]
        with deep_output(os.fspath(output), place, how.types, compression) as out:
            for (rows,) in bands_of([seen], top, top + seen.shape[0], memory, progress):
                out.put(how.simplified(rows))
            _tell(out, seen.header, how.found)
    return how.found


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}")
    return float(value)


def _check(name: str, value: Any, fits: bool, needed: str) -> None:
    if not fits:
        raise ValueError(f"{name}: expected a number in {needed}, got {value}")


class Simplifying:
    """How the rows of a file are simplified, and what was found of those that were."""

    def __init__(
        self,
        seen: Opened,
        errors: tuple[float, float],
        keep_ids: bool | Sequence[str],
        volumes: bool | None,
        short_numbers: bool,
    ) -> None:
        self.seen, self.errors, self.short_numbers = seen, errors, short_numbers
        names = seen.part.names
        self.volumes = "ZBack" in names if volumes is None else volumes
        self.alphas, self.lights, self.net = seen.alphas(), seen.lights(), seen.net_alpha()
        if len(self.lights) > MOST_LIGHTS:
            raise FragmentsError(
                f"{seen.name!r}: has {len(self.lights)} channels of light; needed at most "
                f"{MOST_LIGHTS}"
            )
        self.ids = _ids(seen, keep_ids)
        depth = names["Z"].rpartition(".")[0]
        self.back = names.get("ZBack") or (f"{depth}.ZBack" if depth else "ZBack")
        self.types = dict(seen.types)
        if self.volumes:
            self.types.setdefault(self.back, self.types[names["Z"]])
        # What was an end may become a beginning.
        ends = [name for name in (names["Z"], self.back) if name in self.types]
        self.types |= dict.fromkeys(ends, one_type([self.types[name] for name in ends]))
        self.depth = self.types[names["Z"]]
        self.dimmed_by = np.array(
            [_dimmed_by(name, len(self.alphas)) for name in self.lights], np.intc
        )
        self.found = Certificate(errors[0], 0.0, 0.0, 0, 0, seen.shape[0] * seen.shape[1], 0)

    def simplified(self, rows: DeepRows) -> DeepRows:
        seen, count = self.seen, thread_count(None)
        own = seen.samples(rows)
        light = np.zeros((len(self.lights), len(rows)), np.float32)
        for i, name in enumerate(self.lights):
            light[i] = seen.light(rows, name)
        halves = np.array([self.types[name] == np.float16 for name in self.lights], np.bool_)
        counts, source, front, back, alpha, light, worst = _core.simplify(
            rows.offsets,
            own.front,
            own.back,
            own.alpha,
            light,
            self.dimmed_by,
            halves,
            self._identity(rows),
            self.types[self.alphas[0]] == np.float16,
            self.depth == np.float16,
            self.volumes,
            self.short_numbers,
            *self.errors,
            count,
        )
        offsets = offsets_of(counts)
        place = np.repeat(rows.offsets[:-1] - offsets[:-1], counts) + np.arange(offsets[-1])
        sample = source[place]
        channels = {name: array[sample] for name, array in rows.channels.items()}
        channels[seen.part.names["Z"]] = self._depth(front[place], rows)
        if self.back in self.types:
            channels[self.back] = self._depth(back[place], rows)
        for name, values in zip(self.alphas, alpha, strict=True):
            channels[name] = values[place].astype(self.types[name])
        for name, values in zip(self.lights, light, strict=True):
            channels[name] = values[place].astype(self.types[name])
        if self.net:
            net = np.mean([channels[name] for name in self.alphas], axis=0, dtype=np.float64)
            channels[self.net] = net.astype(self.types[self.net])
        self._note(rows, counts, worst)
        return DeepRows(rows.shape, rows.origin, offsets, channels)

    def _depth(self, depth: NDArray[np.float32], rows: DeepRows) -> NDArray[Any]:
        names, most = self.seen.part.names, np.finfo(np.float32).max
        held = [rows.channels[names[role]] for role in ("Z", "ZBack") if role in names]
        if any(np.isposinf(one).any() for one in held):  # the core has the greatest number for it
            depth = np.where(depth == most, np.float32(np.inf), depth)
        return depth.astype(self.depth)

    def _identity(self, rows: DeepRows) -> NDArray[np.int64] | None:
        """A number for each sample, the same for those of the same ids."""
        if not self.ids:
            return None
        identity = np.zeros(len(rows), np.int64)
        for name in self.ids:
            _, own = np.unique(rows.channels[name], return_inverse=True)
            _, identity = np.unique(
                identity * (int(own.max(initial=0)) + 1) + own, return_inverse=True
            )
        return identity.astype(np.int64)

    def _note(self, rows: DeepRows, counts: NDArray[np.int64], worst: NDArray[np.float64]) -> None:
        held = self.found
        before = np.diff(rows.offsets)
        kept = (counts == before) & (before > 0) & (worst == 0).all(axis=1)
        transmittance, light = worst.max(axis=0, initial=0.0)
        self.found = replace(
            held,
            transmittance_error=max(held.transmittance_error, float(transmittance)),
            light_error=max(held.light_error, float(light)),
            samples_before=held.samples_before + len(rows),
            samples_after=held.samples_after + int(counts.sum()),
            pixels_kept=held.pixels_kept + int(np.count_nonzero(kept)),
        )


def _dimmed_by(name: str, alphas: int) -> int:
    k = dimmed_by(name, alphas)
    return 1 if k is None else k  # of grey light in colours, the middle one


def _ids(seen: Opened, keep_ids: bool | Sequence[str]) -> tuple[str, ...]:
    """The channels that are ids."""
    if isinstance(keep_ids, str) or not isinstance(keep_ids, bool | Sequence):
        raise TypeError(
            f"keep_ids: expected True, False or names of channels, got {type(keep_ids).__name__}"
        )
    if keep_ids is False:
        return ()
    types = seen.types
    if keep_ids is True:
        return tuple(name for name, kind in types.items() if kind == np.uint32 or ID.search(name))
    for name in keep_ids:
        if name not in types:
            raise ValueError(
                f"keep_ids: there is no channel {name!r}; found {', '.join(seen.part.channels)}"
            )
    return tuple(keep_ids)


def _attributes(values: Sequence[float]) -> tuple[Attribute, ...]:
    return tuple(
        Attribute(name.encode(), b"double", struct.pack("<d", value))
        for name, value in zip(NAMES, values, strict=True)
    )


def _tell(out: DeepOutput, before: Header, found: Certificate) -> None:
    """Puts into the header what was found, and was found before."""
    values = [found.error, found.transmittance_error, found.light_error]
    for i, name in enumerate(NAMES):
        held = before.get(name)
        if held is not None and isinstance(held.value, float) and math.isfinite(held.value):
            values[i] += held.value
    out.at_end(_attributes(values))
