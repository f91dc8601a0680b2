"""Deep files as the verbs read them: rows with all channels, and what their numbers mean."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.arguments import path_name, whole
from moit.checks.exceptions import FragmentsError
from moit.formats.deep import ALPHA_SLACK, write_deep
from moit.formats.deep_bands import BYTES_A_PIXEL, FIRST_ROWS, LEAST_MEMORY
from moit.formats.deep_channels import COLOR, COLORED_ALPHA, Wanted
from moit.formats.deep_output import Place, place_of
from moit.formats.deep_parts import ExrFile, Part
from moit.formats.deep_rows import DTYPES, DeepRows, empty_rows, stacked
from moit.formats.deep_source import Source
from moit.formats.exr_headers import Headers
from moit.fragments.fragments import Fragments
from moit.system.progress import Progress, steps

Floats = NDArray[np.float32]
Deep = str | os.PathLike[str] | Fragments  # what verbs take: a file, or what is written to one

# What a verb takes at its height for each sample, measured: of two images, their merge, the pieces
# in doubles and the file that is written.
BYTES_A_SAMPLE = 200

# The ends of names of channels that are light, or as much as light: multiplied by alpha.
LIGHT = frozenset((*COLOR, "A", *COLORED_ALPHA, "RA", "GA", "BA", "Y", "RY", "BY"))
TYPES = {"uint": DTYPES[0], "half": DTYPES[1], "float": DTYPES[2]}


class Opened:
    """A deep part of a file, whose rows are taken from the top on. `opened` opens one."""

    def __init__(self, name: str, part: Part, headers: Headers, source: Source) -> None:
        self.name, self.part, self.source = name, part, source
        self.header, self.several = headers.parts[part.index], len(headers.parts) > 1
        self.held: DeepRows | None = None  # the last rows read, of which some may be left
        self.row = 0  # the first that is not read, from that of the data window

    @property
    def shape(self) -> tuple[int, int]:
        width, height = self.part.size
        return height, width

    @property
    def origin(self) -> tuple[int, int]:
        x, y = self.part.first
        return y, x

    @property
    def types(self) -> dict[str, Any]:
        """The dtype of each channel."""
        own = zip(self.part.channels, self.part.types, strict=True)
        return {name: TYPES[kind] for name, kind in own}

    def place(
        self, shape: tuple[int, int] | None = None, origin: tuple[int, int] | None = None
    ) -> Place:
        """That of a file that is made of this one: its other parts are copied."""
        beside = (self.name, self.part.index) if self.several else None
        return place_of(self.header, shape or self.shape, origin or self.origin, beside)

    def take(self, begin: int, end: int) -> DeepRows:
        """Rows y = begin to end - 1 of the display, with none above those taken before; those that
        lie outside of the data window are empty."""
        (top, left), (height, width) = self.origin, self.shape
        first, last = max(begin, top), min(end, top + height)
        if first >= last:
            return empty_rows((end - begin, width), (begin, left), self.types)
        parts = []
        if begin < first:
            parts.append(empty_rows((first - begin, width), (begin, left), self.types))
        parts.append(self._within(first, last))
        if last < end:
            parts.append(empty_rows((end - last, width), (last, left), self.types))
        return stacked(parts)

    def _within(self, first: int, last: int) -> DeepRows:
        parts = []
        if self.held is not None and first < self.held.bottom:
            part = self.held.rows(first, min(last, self.held.bottom))
            parts.append(part)
            first = part.bottom
        if first < last:
            top = self.origin[0]
            begin = max(self.row, self._down(first - top))
            self.row = min(self.shape[0], self.source.up(last - top))
            self.held = self.source.rows(begin, self.row)
            parts.append(self.held.rows(first, last))
        return stacked(parts)

    def _down(self, row: int) -> int:
        """The last row at or above `row` that a band may begin at."""
        return row // self.source.step * self.source.step

    def samples(self, rows: DeepRows) -> Samples:
        """Depths and opacities of rows of this file. Raises FragmentsError for what they cannot
        be, with the channel and the pixel."""
        names = self.part.names
        front = self.depth(rows, names["Z"])
        back = None
        if "ZBack" in names:
            back = np.maximum(front, self.depth(rows, names["ZBack"]))
        roles = COLORED_ALPHA if "AR" in names else ("A",)
        alpha = np.stack([self._alpha(rows, names[role]) for role in roles])
        return Samples(front, back, alpha)

    def depth(self, rows: DeepRows, channel: str) -> Floats:
        """A channel of depths, infinity as the greatest number."""
        depth = rows.channels[channel].astype(np.float32, copy=False)
        fit = np.isfinite(depth) | np.isposinf(depth)
        self._require(rows, fit, depth, channel, "a finite number, or infinity")
        return np.minimum(depth, np.finfo(np.float32).max)

    def _alpha(self, rows: DeepRows, channel: str) -> Floats:
        alpha = rows.channels[channel].astype(np.float32, copy=False)
        fit = (alpha >= -ALPHA_SLACK) & (alpha <= 1 + ALPHA_SLACK)
        self._require(rows, fit, alpha, channel, "a number in [0, 1]")
        return np.clip(alpha, np.float32(0), np.float32(1))

    def light(self, rows: DeepRows, channel: str) -> Floats:
        """A channel of light, or whatever is multiplied by alpha."""
        light = rows.channels[channel].astype(np.float32, copy=False)
        self._require(rows, np.isfinite(light), light, channel, "a finite number")
        return light

    def _require(
        self,
        rows: DeepRows,
        fit: NDArray[np.bool_],
        values: NDArray[Any],
        channel: str,
        needed: str,
    ) -> None:
        if fit.all():
            return
        at = int(fit.argmin())
        pixel = int(np.searchsorted(rows.offsets, at, "right")) - 1
        y, x = divmod(pixel, rows.shape[1])
        raise FragmentsError(
            f"{self.name!r}: {channel} of pixel x={rows.origin[1] + x}, y={rows.origin[0] + y}, "
            f"sample {at - int(rows.offsets[pixel])}: found {values[at]}; needed {needed}"
        )

    def alphas(self) -> tuple[str, ...]:
        """The channels of `Samples.alpha`."""
        roles = COLORED_ALPHA if "AR" in self.part.names else ("A",)
        return tuple(self.part.names[role] for role in roles)

    def net_alpha(self) -> str | None:
        """The one alpha that is told beside one for each colour."""
        prefix = self.part.layer
        name = f"{prefix}.A" if prefix else "A"
        return name if "AR" in self.part.names and name in self.part.channels else None

    def lights(self) -> tuple[str, ...]:
        """The channels that are light, of all layers, or as much as light."""
        opacities = {*self.alphas(), self.net_alpha()}
        return tuple(
            name
            for name, kind in self.types.items()
            if kind != np.uint32 and name not in opacities and name.rpartition(".")[2] in LIGHT
        )


@dataclass(frozen=True)
class Samples:
    """What moit_deep in csrc/moit_deep.h is: float32, checked.

    front : (N,); back : (N,), None where all are surfaces; alpha : (1, N), or (3, N) of colours.
    """

    front: Floats
    back: Floats | None
    alpha: Floats


def dimmed_by(channel: str, alphas: int) -> int | None:
    """Which of `alphas` dims a channel of light; None: the mean of all."""
    last = channel.rpartition(".")[2]
    if alphas == 1:
        return 0
    return COLOR.index(last) if last in COLOR else None


@contextmanager
def as_file(given: Deep) -> Iterator[str]:
    """The path of a deep file: of Fragments one that is gone when the block ends."""
    if not isinstance(given, Fragments):
        yield path_name(given)
        return
    with tempfile.TemporaryDirectory(prefix="moit-") as folder:
        path = os.path.join(folder, "fragments.exr")
        write_deep(path, given)
        yield path


@contextmanager
def opened(
    path: Deep,
    part: int | str | None = None,
    layer: str | None = None,
    *,
    all_layers: bool = False,
) -> Iterator[Opened]:
    """A deep part of a file, chosen as `read_deep` chooses.

    all_layers : no layer is chosen, so channels have no roles, and none is needed.
    """
    with ExitStack() as stack:
        name = stack.enter_context(as_file(path))
        stream = stack.enter_context(open(name, "rb"))  # what the system refuses is its own OSError
        file = ExrFile(name, stream)
        chosen = file.deep_part(part) if all_layers else file.chosen(Wanted(part, layer))
        chosen.window(file.size(), name)
        source = stack.enter_context(Source(name, chosen))
        yield Opened(name, chosen, file.headers, source)


@contextmanager
def all_opened(
    paths: Sequence[Deep], part: int | str | None, layer: str | None
) -> Iterator[list[Opened]]:
    """The same of several files."""
    with ExitStack() as stack:
        yield [stack.enter_context(opened(path, part, layer)) for path in paths]


def bands_of(
    inputs: Sequence[Opened],
    begin: int,
    end: int,
    memory: int,
    progress: Progress,
    width: int = 0,
) -> Iterator[list[DeepRows]]:
    """Rows begin to end - 1 of the display of all inputs, a band of rows at a time.

    width : of what is made of each of them, where that is not of their own width.
    """
    whole("memory", memory, LEAST_MEMORY)
    pixels = sum(max(one.shape[1], width) for one in inputs)
    row, rows = begin, max(1, min(FIRST_ROWS, memory // (BYTES_A_PIXEL * pixels)))
    with steps(progress, end - begin, "rows") as done:
        while row < end:
            last = min(end, row + rows)
            found = [one.take(row, last) for one in inputs]
            yield found
            for y in range(row, last):
                done(f"row {y}")
            most = sum(_most_in_a_row(one) for one in found)
            a_row = BYTES_A_PIXEL * pixels + BYTES_A_SAMPLE * most
            rows = max(1, min(2 * rows, memory // (2 * a_row)))
            row = last


def _most_in_a_row(rows: DeepRows) -> int:
    ends = rows.offsets[:: max(rows.shape[1], 1)]
    return int(np.diff(ends).max()) if len(ends) > 1 else 0
