"""Deep files as they are seen through others."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.deep.opened import Deep, Opened, Samples, bands_of, dimmed_by, opened
from moit.formats.deep_bands import USUAL_MEMORY
from moit.formats.deep_channels import COLORED_ALPHA
from moit.formats.deep_output import deep_output
from moit.formats.deep_rows import DeepRows, as_held, one_type, side_by_side
from moit.system.environment import thread_count
from moit.system.progress import Progress

ENDS = ("Z", "ZBack")


def holdout(
    path: Deep,
    by: Deep,
    output: str | os.PathLike[str],
    *,
    part: int | str | None = None,
    layer: str | None = None,
    by_part: int | str | None = None,
    by_layer: str | None = None,
    compression: str | None = None,
    memory: int = USUAL_MEMORY,
    progress: Progress = False,
) -> None:
    """Writes a deep image as it is seen through another, which is not seen itself.

    path, part, layer : the image, as `read_deep`.
    by, by_part, by_layer : what holds it out: opaque, half transparent or volumes.
    output, compression, memory, progress : as `moit.deep.merge`.

    Flattened up to any depth at which a sample begins or ends, the file gives the light of `path`
    that reaches the eye through all that is in front of it in both images, and as alpha what
    `path` hides of the background. So a and b, each held out by the other, flattened and added, are
    the merge of a and b, flattened. For that a sample's alpha is not just multiplied by what `by`
    lets through: what is behind it must not come to light where `by` has dimmed it.

    Volumes are split where samples of either image begin or end inside them; what coincides is
    mixed by its absorbance, as `Fragments.tidy` has it, in float64. What nothing is seen of is left
    out. All channels of light, of all layers, are dimmed: those whose names end in R, G, B, Y or A.
    Others, such as ids, stay with their samples. Windows and metadata are those of `path`.

    Raises as `read_deep` and `write_deep`. Colour of `by` is not read.

    >>> moit.write_deep("panes.exr", moit.scenes.load("panes", (8, 6)))
    >>> moit.deep.holdout("panes.exr", "panes.exr", "half.exr")
    >>> round(float(moit.read_deep("half.exr").alpha.max()), 2) <= 1
    True
    """
    with opened(path, part, layer) as seen, opened(by, by_part, by_layer) as held:
        top, (height, width) = seen.origin[0], seen.shape
        place = seen.place()
        types = _types(seen, held)
        with deep_output(os.fspath(output), place, types, compression) as out:
            for rows, other in bands_of([seen, held], top, top + height, memory, progress):
                out.put(held_out(seen, rows, held, other.columns(seen.origin[1], width)))


def held_out(seen: Opened, rows: DeepRows, held: Opened, other: DeepRows) -> DeepRows:
    """Rows of a file as they are seen through those of another, of the same window."""
    own, by = seen.samples(rows), held.samples(other)
    both, owner = side_by_side([_opacities(rows, own, by), _opacities(other, by, own)])
    channels = both.channels
    alphas = sorted(name for name in channels if name.startswith("alpha"))
    offsets, source, front, back, alpha, gain = _core.hold_out(
        both.offsets,
        channels["front"],
        channels.get("back"),
        np.stack([channels[name] for name in alphas]),
        owner == 1,
        thread_count(None),
    )
    # Where each sample of both was among those of the file.
    index = np.cumsum(owner == 0) - 1
    sample = index[source]
    found = {name: array[sample] for name, array in rows.channels.items()}
    names, types = seen.part.names, _types(seen, held)
    for role, depth, was in (("Z", front, own.front), ("ZBack", back, own.back)):
        if was is not None:  # as it was where nothing is cut: infinity is not a number of ours
            name, cut = names[role], depth != was[sample]
            ends = as_held(np.where(cut, depth, 0), types[name], name)
            found[name] = np.where(cut, ends, found[name].astype(types[name], copy=False))
    for name in seen.lights():
        k = dimmed_by(name, len(gain))
        factor = gain.mean(axis=0) if k is None else gain[k]
        found[name] = as_held(seen.light(rows, name)[sample] * factor, found[name].dtype, name)
    net, roles = seen.net_alpha(), seen.alphas()
    if len(own.alpha) < len(alpha):  # one alpha, hidden in each colour in another way
        (net,), roles = roles, _colored(seen)
    for name, values in zip(roles, alpha, strict=True):
        found[name] = as_held(values, types[name], name)
    if net:
        found[net] = as_held(alpha.mean(axis=0), types[net], net)
    return DeepRows(rows.shape, rows.origin, offsets, found)


def _colored(seen: Opened) -> tuple[str, ...]:
    prefix = f"{seen.part.layer}." if seen.part.layer else ""
    return tuple(f"{prefix}{role}" for role in COLORED_ALPHA)


def _types(seen: Opened, held: Opened) -> dict[str, Any]:
    """The dtype of each channel that is written: an alpha for each colour, too, where only what
    holds out has that; and of depths at which volumes are cut, one that holds those of both."""
    types, alphas = seen.types, seen.alphas()
    if len(alphas) < len(held.alphas()):
        types |= dict.fromkeys(_colored(seen), types[alphas[0]])
    if "ZBack" in seen.part.names:
        ends = [seen.part.names[role] for role in ENDS]
        cuts = [held.types[held.part.names[role]] for role in ENDS if role in held.part.names]
        types |= dict.fromkeys(ends, one_type([types[name] for name in ends] + cuts))
    return types


def _opacities(rows: DeepRows, own: Samples, other: Samples) -> DeepRows:
    """Depths and opacities as channels: as many as both images need."""
    channels: dict[str, NDArray[Any]] = {"front": own.front}
    if own.back is not None or other.back is not None:
        channels["back"] = own.front if own.back is None else own.back
    count = max(len(own.alpha), len(other.alpha))
    for k, alpha in enumerate(np.broadcast_to(own.alpha, (count, len(rows)))):
        channels[f"alpha{k}"] = alpha
    return rows.with_channels(channels)
