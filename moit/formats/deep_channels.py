"""Which channels of a deep part are colour, alpha and depth: layers, views and names of one's own.

Names are layer.view.channel, as OpenEXR's document on multi-view files has them; an alpha for each
colour is called RA, GA, BA or AR, AG, AB.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from moit.checks.arguments import nearest
from moit.checks.exceptions import FragmentsError

COLOR = ("R", "G", "B")
COLORED_ALPHA = ("AR", "AG", "AB")
ALSO_COLORED_ALPHA = dict(zip(COLORED_ALPHA, ("RA", "GA", "BA"), strict=True))
ROLES = (*COLOR, "A", *COLORED_ALPHA, "Z", "ZBack")
LUMINANCE, CHROMA = "Y", ("RY", "BY")
TELLING = {*ROLES, *ALSO_COLORED_ALPHA.values(), LUMINANCE}


@dataclass(frozen=True)
class Wanted:
    """What a caller chose of a file, as it came in."""

    part: int | str | None = None
    layer: str | None = None
    channels: Mapping[str, str] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return self != Wanted()


def wanted(
    part: int | str | None,
    layer: str | None,
    channels: Mapping[str, str] | None = None,
    subimage: int | None = None,
) -> Wanted:
    """The arguments, checked without a look at a file."""
    if subimage is not None:
        if part is not None:
            raise ValueError("subimage: an older name of part; expected one of both")
        if isinstance(subimage, str):
            raise TypeError("subimage: expected an integer, got str")
        part = subimage
    if layer is not None and not isinstance(layer, str):
        raise TypeError(f"layer: expected a name as str, got {type(layer).__name__}")
    if channels is not None and not isinstance(channels, Mapping):
        raise TypeError(f"channels: expected a dict, got {type(channels).__name__}")
    given = dict(channels or {})
    for role, name in given.items():
        if role not in (*ROLES, *ALSO_COLORED_ALPHA.values()):
            raise ValueError(f"channels: expected keys of {', '.join(ROLES)}; got {role!r:.80}")
        if not isinstance(name, str):
            raise TypeError(f"channels[{role!r}]: expected a name as str, got {name!r:.80}")
    return Wanted(part, layer, given)


def layers(channels: Sequence[str]) -> tuple[str, ...]:
    """The prefixes of channels' names up to their last dot, in the file's order; "" for none."""
    return tuple(dict.fromkeys(channel.rpartition(".")[0] for channel in channels))


@dataclass(frozen=True)
class PartChannels:
    """The channels of a part, and which of its layers are views (the first has no prefix)."""

    channels: Sequence[str]
    views: Sequence[str] = ()
    given: Mapping[str, str] = field(default_factory=dict)

    def find(self, role: str, layer: str, above: bool) -> str | None:
        """The channel of a layer, with `above` also of one that the layer is part of."""
        own = (self.given.get(role), self.given.get(ALSO_COLORED_ALPHA.get(role, "")))
        asked = next((name for name in own if name), None)
        if asked is not None:
            found = self._at(asked, layer) or (asked if asked in self.channels else None)
            if found is None:
                raise FragmentsError(
                    f"channels[{role!r}]: there is no channel {asked!r}; found "
                    f"{', '.join(self.channels)}"
                )
            return found
        while True:
            for name in (role, ALSO_COLORED_ALPHA.get(role)):
                found = self._at(name, layer) if name else None
                if found and not self._is_vector(layer):
                    return found
            # A view's depth is not that of another.
            first, _, last = layer.rpartition(".")
            if not layer or not above or last in self.views[1:]:
                return None
            layer = first

    def _at(self, name: str, layer: str) -> str | None:
        full = f"{layer}.{name}" if layer else name
        return full if full in self.channels else None

    def _is_vector(self, layer: str) -> bool:
        """Whether Y and Z are coordinates, as of normals."""
        return bool(layer and self._at("X", layer) and self._at("Y", layer))

    def names(self, layer: str) -> dict[str, str]:
        """The channel of each role that there is in a layer. Depth and alpha may be of the layers
        that it is part of; colour is its own."""
        found = {role: self.find(role, layer, above=False) for role in COLOR}
        if not any(found.values()) and not self._is_vector(layer):
            found = dict.fromkeys(COLOR, self._at(LUMINANCE, layer))
        colored = {role: self.find(role, layer, above=True) for role in COLORED_ALPHA}
        alpha = self.find("A", layer, above=True)
        own = {_level(name) for name in colored.values() if name}
        if own and not (alpha and ("A" in self.given or _level(alpha) > max(own))):
            found |= colored
        else:
            found["A"] = alpha
        found["Z"] = depth = self.find("Z", layer, above=True)
        if depth is not None:
            found["ZBack"] = self.find("ZBack", depth.rpartition(".")[0], above=False)
        return {role: name for role, name in found.items() if name is not None}

    def fault(self, layer: str) -> str:
        """What a layer needs to be read; "" where it has all."""
        names = self.names(layer)
        if "Z" not in names:
            return "the channel Z, the depth of each sample"
        colored = [role for role in COLORED_ALPHA if role in names]
        if colored and len(colored) < 3:
            return "an alpha for each of R, G and B, or one channel A"
        if not colored and "A" not in names:
            return "the channel A, the opacity of each sample"
        colors = [role for role in COLOR if role in names]
        if len(colors) not in (0, 3):
            return "the channels R, G and B, or none of them"
        if not self.find("R", layer, above=False) and any(self._at(name, layer) for name in CHROMA):
            return "the channels R, G and B, not luminance and chroma"
        return ""

    def has_color(self, layer: str) -> bool:
        return "R" in self.names(layer)

    def complete(self, layer: str) -> bool:
        return not self.fault(layer) and self.has_color(layer)

    def tells(self, layer: str) -> bool:
        """Whether a layer has a channel of its own that is read."""
        prefix = f"{layer}." if layer else ""
        return any(f"{prefix}{name}" in self.channels for name in TELLING) or bool(
            not layer and self.given
        )


def _level(channel: str) -> int:
    """How many layers a channel lies in."""
    return channel.count(".")


def chosen_layer(part: PartChannels, layer: str | None) -> tuple[str, dict[str, str]]:
    """The layer that is meant, and the channel of each role in it.

    Without a choice it is the channels without prefix where these have colour, alpha and depth, or
    the only layer that has. Raises FragmentsError, with all layers, where that is none or several,
    and where one lacks a channel; ValueError for a layer that is not there.
    """
    known = [one for one in layers(part.channels) if one]
    if layer is None:
        layer = _found(part, known)
    elif layer and layer not in known:
        end = nearest(layer, known) if known else "; none has a prefix"
        raise ValueError(f"layer: there is no {layer!r}{end}")
    fault = part.fault(layer)
    if fault:
        shown = (one if one.isprintable() else repr(one) for one in part.channels)
        found = ", ".join(shown) or "none"
        where = f" in the layer {layer!r}" if layer else ""
        raise FragmentsError(f"needed {fault}{where}; found {found}{_hint(fault)}")
    return layer, part.names(layer)


def _found(part: PartChannels, known: Sequence[str]) -> str:
    for fits in (part.complete, lambda one: not part.fault(one)):
        if fits("") and (part.tells("")):
            return ""
        able = [one for one in known if fits(one) and part.tells(one)]
        if len(able) == 1:
            return able[0]
        if able:
            raise FragmentsError(
                f"layer: needed one of {', '.join(map(repr, able))}, since the channels without "
                "prefix are no image; found None"
            )
    return ""


def _hint(fault: str) -> str:
    for role, words in (("A", "the channel A"), ("Z", "the channel Z")):
        if fault.startswith(words):
            return f"; channels={{{role!r}: NAME}} names another"
    return ""


def split_colored_alpha(
    each: Sequence[NDArray[np.float32]],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(N,) alpha and (N, 3) transmission of an alpha for each colour: the greatest is alpha, and a
    colour passes what it lacks of that."""
    colored = np.stack(each, axis=1)
    alpha = colored.max(axis=1)
    # Where alpha is 0 nothing passes through anything: no transmission.
    share = np.ones(colored.shape)
    np.divide(colored, alpha[:, None], out=share, where=alpha[:, None] > 0, dtype=np.float64)
    return alpha, (1 - share).astype(np.float32)
