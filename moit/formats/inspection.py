"""What an OpenEXR file holds, without making Fragments of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from moit.checks.arguments import path_name
from moit.checks.exceptions import FragmentsError
from moit.formats.deep_bands import BYTES_A_PIXEL, BYTES_A_SAMPLE, USUAL_MEMORY, Bands
from moit.formats.deep_channels import PartChannels, chosen_layer, layers
from moit.formats.deep_parts import ExrFile, Part
from moit.fragments.frame import Frame


@dataclass(frozen=True)
class InspectedPart:
    """One part of an OpenEXR file; `str` is a table of this.

    index, name, view : what `read_deep(part=)` takes; "" where there is none.
    kind : "deepscanline", "deeptile", "scanlineimage" or "tiledimage".
    channels : their names and types ("half", "float" or "uint").
    layers : the prefixes of channels' names, "" for none.
    readable : the layers that `read_deep` can read; of them it takes by itself ...
    layer : ... this one; None where it has to be chosen, or none can be read ...
    problem : ... as this says; "" if nothing is wrong.
    views : of a part that holds several views, their names.
    shape, origin : (height, width) and (y, x) of the data window.
    frame : the display window, the pixel aspect and the header's metadata.
    samples, most_samples : how many there are in all, and in one pixel at most; None if flat.
    covered : how many pixels have samples; None if flat.
    depth_range : (near, far) of all finite depths; None where there are none.
    volumes : samples with ZBack > Z.
    memory : bytes that read_deep takes for it, about.
    """

    index: int
    name: str
    view: str
    kind: str
    compression: str
    channels: dict[str, str]
    layers: tuple[str, ...]
    readable: tuple[str, ...]
    layer: str | None
    problem: str
    views: tuple[str, ...]
    shape: tuple[int, int]
    origin: tuple[int, int]
    frame: Frame
    samples: int | None = None
    most_samples: int | None = None
    covered: int | None = None
    depth_range: tuple[float, float] | None = None
    volumes: int | None = None
    memory: int | None = None

    @property
    def deep(self) -> bool:
        return self.samples is not None

    def __str__(self) -> str:
        words = [f"part {self.index}"]
        words += [repr(self.name)] if self.name else []
        words += [f"(view {self.view!r})"] if self.view else []
        lines = [f"{' '.join(words)}: {self.kind}, compression {self.compression}"]
        width = max(len(name) for name, _ in self._lines())
        lines += [f"  {name:<{width}}  {text}" for name, text in self._lines()]
        return "\n".join(lines)

    __repr__ = __str__

    def _lines(self) -> Iterator[tuple[str, str]]:
        frame = self.frame
        yield "data window", _window(self.shape, self.origin)
        aspect = f", pixel aspect {frame.pixel_aspect:g}" if frame.pixel_aspect != 1 else ""
        yield "display window", _window(frame.display_shape, frame.display_origin) + aspect
        channels = (f"{_shown(name)} ({kind})" for name, kind in self.channels.items())
        yield "channels", ", ".join(channels)
        if self.layers != ("",):
            yield "layers", ", ".join(one or "(no prefix)" for one in map(_shown, self.layers))
        if self.views:
            yield "views", ", ".join(map(_shown, self.views))
        if self.samples is not None:
            pixels = self.shape[0] * self.shape[1]
            yield (
                "samples",
                f"{self.samples:,}, at most {self.most_samples:,} a pixel, "
                f"in {self.covered:,} of {pixels:,} pixels",
            )
        if self.depth_range is not None:
            yield "depth", "{:.6g} to {:.6g}".format(*self.depth_range)
        if self.volumes is not None:
            yield "volumes", f"{self.volumes:,}"
        if self.memory is not None:
            yield "memory", f"{_bytes(self.memory)} to read"
        if self.layer:
            yield "layer taken", _shown(self.layer)
        if self.problem:
            yield "to read it", self.problem
        for name, value in frame.metadata.items():
            if name == "view" or name.startswith("screenWindow"):
                continue
            text = repr(value)
            yield _shown(name), text if len(text) <= 80 else f"{text[:77]}..."


@dataclass(frozen=True)
class Inspection:
    """What `moit.inspect` found; `str` is a table of it.

    parts : an InspectedPart each.
    """

    path: str
    parts: tuple[InspectedPart, ...]

    def __str__(self) -> str:
        count = f"{len(self.parts)} part{'s' if len(self.parts) > 1 else ''}"
        return "\n".join([f"{self.path!r}: OpenEXR, {count}", *map(str, self.parts)])

    __repr__ = __str__


def inspect(path: str | os.PathLike[str], *, samples: bool = True) -> Inspection:
    """What an OpenEXR file holds: parts, views, layers and channels; windows and metadata; of deep
    parts the numbers of samples and volumes, the range of depths, the memory to read them.

    path : a deep or a flat file.
    samples : False: looks at headers only, however large the file; then what is said of samples is
        None.

    Deep parts are read in bands, so the file may be larger than memory. Raises OSError where the
    file is missing, damaged or not OpenEXR.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> (part,) = moit.inspect("panes.exr").parts
    >>> part.shape, part.samples, sorted(part.channels)
    ((6, 8), 54, ['A', 'B', 'G', 'R', 'Z'])
    """
    name = path_name(path)
    with open(name, "rb") as stream:  # what the system refuses is its own OSError
        file = ExrFile(name, stream)
        for part in file.parts:
            if part.deep:
                part.window(file.size(), name)
    found = []
    for part in file.parts:
        one = _of_header(part)
        found.append(_counted(one, name, part) if samples and part.deep else one)
    return Inspection(name, tuple(found))


def _of_header(part: Part) -> InspectedPart:
    held = PartChannels(part.channels, part.views)
    problem, layer = "", None
    if part.deep:
        try:
            layer, _ = chosen_layer(held, None)
        except FragmentsError as error:
            problem = str(error)
    (x, y), (width, height) = part.first, part.size
    known = layers(part.channels)
    return InspectedPart(
        part.index,
        part.name,
        part.view,
        part.kind,
        part.compression,
        dict(zip(part.channels, part.types, strict=True)),
        known,
        tuple(one for one in known if part.deep and held.tells(one) and not held.fault(one)),
        layer,
        problem,
        part.views,
        (height, width),
        (y, x),
        part.frame,
    )


def _counted(found: InspectedPart, name: str, part: Part) -> InspectedPart:
    """The same with what its samples say: of the layer that is taken, or of the first that can be
    read, or else of any depth."""
    held = PartChannels(part.channels, part.views)
    able = [found.layer] if found.layer is not None else [*found.readable, *found.layers]
    names: dict[str, str] = {}
    if able:
        names = held.names(able[0])
    front, back = names.get("Z"), names.get("ZBack")
    total = most = covered = volumes = 0
    near, far = np.inf, -np.inf
    for rows in Bands(name, part, USUAL_MEMORY).all_rows():
        counts, depth = np.diff(rows.offsets), rows.channels[front or part.channels[0]]
        total += len(rows)
        most = max(most, int(counts.max()))
        covered += int(np.count_nonzero(counts))
        reached = depth[np.isfinite(depth)]
        if front and len(reached):
            near, far = min(near, float(reached.min())), max(far, float(reached.max()))
        if front and back:
            volumes += int(np.count_nonzero(rows.channels[back] > depth))
    return replace(
        found,
        samples=total,
        most_samples=most,
        covered=covered,
        depth_range=(near, far) if near <= far else None,
        volumes=volumes if front else None,
        memory=BYTES_A_PIXEL * found.shape[0] * found.shape[1] + BYTES_A_SAMPLE * total,
    )


def _window(shape: tuple[int, int], origin: tuple[int, int]) -> str:
    return f"{shape[1]} x {shape[0]} from x {origin[1]}, y {origin[0]}"


def _shown(name: str) -> str:
    return name if name.isprintable() else repr(name)


def _bytes(count: int) -> str:
    size: Any = count
    for unit in ("bytes", "KiB", "MiB"):
        if size < 1024:
            return f"{size:.3g} {unit}"
        size /= 1024
    return f"{size:.3g} GiB"
