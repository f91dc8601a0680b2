"""Colour of thick fragments as MB3DGS has it: in intervals along each of them.

Mueller, Landsgesell, van Holland, Stotko and Klein, "Moment-Based 3D Gaussian Splatting",
arXiv 2512.11800: with T of moments at the ends t_j of N intervals of a fragment, tau = -ln T, and
sigma_i the density of its absorbance,

    w_i = sum_j (T(t_j) - T(t_j+1)) sigma_i(t_j) / sigma(t_j),
    sigma(t_j) = (tau(t_j+1) - tau(t_j)) / (t_j+1 - t_j),

and colours are the mean of fragments' by w_i, scaled to what is covered. The ends of a Gaussian are
mean + 3 deviation Phi^-1(j / (N + 2)), j from 1 to N + 1, cut to the range of depth; what the paper
calls uniform is read so. A volume is divided evenly. A surface counts by alpha T. Moments are those
of `moit.core.pieces.thinned`, which are exact, where the paper takes the warp to be linear in a
Gaussian.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.core.engine import Array
from moit.fragments.fragments import Fragments
from moit.fragments.merging import merge

KAPPA = 3.0  # of the paper: how much farther the ends lie than quantiles do


@dataclasses.dataclass(frozen=True)
class Probes:
    """Where each fragment asks for the transmittance.

    f : of alpha 0, fragment by fragment; fragment : (M,) whose each is; share : (M,) of its
    absorbance up to the next, 0 for the last.
    """

    f: Fragments
    fragment: NDArray[np.int64]
    share: NDArray[np.float64]


def weights(f: Fragments, probes: Probes, through: Array, max_alpha: float) -> NDArray[np.float64]:
    """(N,) what each fragment's colour counts with; through : (M,) T at the probes."""
    depth = through.astype(np.float64)
    own = f.coverage.astype(np.float64)
    absorbed = -np.log1p(-np.minimum(own, max_alpha))
    after = np.append(depth[1:], 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        passed = np.log(depth) - np.log(after)  # tau of the interval
    # (T_j - T_j+1) / tau is T_j where nothing absorbs, and 0 where nothing comes
    seen = np.where(passed == 0, depth, (depth - after) / np.where(passed == 0, 1.0, passed))
    seen = np.where(np.isfinite(seen), seen, 0.0)
    inner = probes.share > 0
    sums = (
        np.bincount(probes.fragment[inner], (seen * probes.share)[inner], minlength=len(f))
        * absorbed
    )
    thick = np.bincount(probes.fragment, inner, minlength=len(f)) > 0
    first = np.searchsorted(probes.fragment, np.arange(len(f)))
    return np.where(thick, sums, own * depth[first])


def probes_of(f: Fragments, intervals: int) -> Probes:
    """Of a surface one, at its depth; of what is thick `intervals` + 1."""
    from statistics import NormalDist  # late: `import moit` stays quick

    near, far = f.depth_range
    depth = f.depth.astype(np.float64)
    behind = depth if f.back is None else f.back.astype(np.float64)
    solid = f.alpha == 1 if f.transmission is None else (f.alpha == 1) & ~f.transmission.any(axis=1)
    spread = np.zeros(len(f)) if f.deviation is None else f.deviation.astype(np.float64)
    gaussian, box = (spread > 0) & ~solid, (behind > depth) & ~solid
    thick = gaussian | box
    count = np.where(thick, intervals + 1, 1)
    fragment = np.repeat(np.arange(len(f)), count)
    place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    quantile = np.array(
        [NormalDist().inv_cdf(j / (intervals + 2)) for j in range(1, intervals + 2)]
    )
    even = np.linspace(0.0, 1.0, intervals + 1)
    at = depth[fragment]
    of_gaussian, of_box = gaussian[fragment], box[fragment]
    x = KAPPA * quantile[place[of_gaussian]]
    at[of_gaussian] = np.clip(at[of_gaussian] + spread[fragment[of_gaussian]] * x, near, far)
    length = (behind - depth)[fragment[of_box]]
    at[of_box] += length * even[place[of_box]]
    inner = place + 1 < count[fragment]
    share = np.zeros(len(at))
    share[inner & of_box] = 1.0 / intervals
    some = np.flatnonzero(inner & of_gaussian)
    deviation = spread[fragment[some]]
    away = (at[some] - depth[fragment[some]]) / deviation
    share[some] = np.exp(-0.5 * away**2) * (at[some + 1] - at[some]) / deviation
    whole = np.bincount(fragment, share, minlength=len(f))[fragment]
    share = np.divide(share, whole, out=np.zeros_like(share), where=whole > 0)
    ends = np.concatenate([[0], np.cumsum(count)])[f.offsets]
    asked = f._with(at.astype(f.dtype), np.zeros(len(at), f.dtype), offsets=ends)
    return Probes(asked, fragment, share)


def among(points: Fragments, probes: Fragments) -> tuple[Fragments, NDArray[np.int64]]:
    """Both as one, without colours, and where the probes are in it."""
    bare = points._with(points.depth, points.alpha, None, points.transmission)
    before = points.offsets[1:].repeat(probes.counts)  # of each probe's pixel and those before it
    return merge([bare, probes]), before + np.arange(len(probes))


def image_of(
    f: Fragments,
    weight: NDArray[np.float64],
    background: NDArray[np.float64],
    normalize: bool,
    how: dict[str, Any],
) -> Array:
    """(height, width, 4), as composites are, of what each fragment counts with."""
    assert f.color is not None
    pixels = len(f.counts)
    pixel = np.repeat(np.arange(pixels), f.counts)
    kept, occluder, opacity, _ = _core.surviving(f, how["cull_opaque"], how["threads"])
    covering = np.where(kept, f.coverage.astype(np.float64), 0.0)
    weight = np.where(kept, weight, 0.0)
    net = np.ones(pixels)
    np.multiply.at(net, pixel, 1 - covering)
    # where a fragment covers some of its alpha only, its light is that of alpha
    light = f.color.astype(np.float64)
    if f.transmission is not None:
        share = np.divide(f.alpha, covering, out=np.zeros(len(f)), where=covering > 0)
        light = light * share[:, None]
    sums = np.stack([np.bincount(pixel, weight * c, minlength=pixels) for c in light.T], axis=-1)
    covered = np.bincount(pixel, weight, minlength=pixels)
    if normalize:
        scale = np.divide(1 - net, covered, out=np.zeros(pixels), where=covered > 0)
        sums *= scale[:, None]
    through = np.repeat(net[:, None], 3, axis=1)
    if opacity is not None:
        through = np.ones((pixels, 3))
        np.multiply.at(through, pixel, 1 - np.where(kept[:, None], opacity, 0).astype(np.float64))
    behind = np.broadcast_to(background.reshape(-1, 3), (pixels, 3)).copy()
    hides = occluder >= 0
    behind[hides] = f.color[occluder[hides]]
    passed = np.where(hides, 0.0, through.mean(axis=1))
    image = np.concatenate([sums + through * behind, (1 - passed)[:, None]], axis=1)
    answer: Array = image.astype(f.dtype).reshape(*f.shape, 4)
    return answer
