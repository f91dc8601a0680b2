"""A technique's answer in unlimited precision: what is left of its error is its method's alone."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core, moments
from moit.catalog import MomentTechnique, MomentTransparency, PowerMoments, Technique
from moit.catalog.reconstruction import OverestimatingMoments
from moit.core.questions import in_precision
from moit.fragments.fragments import Fragments
from moit.questions import transmittance
from moit.system.environment import thread_count

Array = NDArray[Any]

ROUNDED = 1e-15  # a bias that changes moments about as float64 does
SURE = 1e-6
LEAST_PIVOT = 1e-12  # below it, next to 1, float64 knows no more than three digits


def stored_as(technique: Technique, precision: str) -> Technique | None:
    """The technique in the form that stores "16 bit" words or half floats, or numbers of the
    fragments' dtype ("float32", "float64"); None where it has no such form."""
    changes = technique.stored_in(precision == "16 bit")
    if changes is None:
        return None
    if all(getattr(technique, name) == value for name, value in changes.items()):
        return technique
    if isinstance(technique, MomentTechnique) and isinstance(technique.bias, float):
        return None  # it was chosen for the other form
    return dataclasses.replace(technique, **changes)


def unlimited(technique: Technique) -> Technique | None:
    """The technique that in float64 comes closest; None where answers are random.

    Without bias, moments answer the same whatever range depth is mapped from (power moments, any
    affine map), so that the pixel's own range, in which float64 loses least, will do.
    """
    if technique.random:
        return None
    found = stored_as(technique, "float64")
    if found is None:
        found = technique
    if isinstance(found, MomentTechnique):
        found = dataclasses.replace(found, bias=0.0)
        if isinstance(found, PowerMoments) and found.warp != "none" and found.block_side == 1:
            found = dataclasses.replace(found, depth_range="pixel")
    return found


def unlimited_transmittance(f: Fragments, technique: Technique) -> Array | None:
    """(N,) the transmittance in front of each fragment; None where answers are random.

    Opaque fragments are taken like others (`cull_opaque=False`). Where a ray has no more depths
    than its moments have nodes, they determine it, and the answer is computed from the surfaces
    themselves; else it is float64's in the form of `unlimited`, or NaN where as little as float64
    rounds off moments would change it. Tests hold it to solutions in 80 digits.
    """
    found = unlimited(technique)
    if found is None:
        return None
    f = in_precision(f, np.float64)
    T = np.array(transmittance(f, found, cull_opaque=False))
    if isinstance(found, MomentTechnique):
        T[~_is_sure(f, found, T)] = np.nan
        if isinstance(found, OverestimatingMoments) and (
            found.moment_sets == found.block_side == 1
        ):
            known, few = _of_few_surfaces(f, found)
            T[few] = known[few]
    return T


def _is_sure(f: Fragments, technique: MomentTechnique, T: Array) -> Array:
    """(N,) whether neither rounding of moments nor what is made of pivots that are all rounding
    shows in T."""
    other = dataclasses.replace(technique, bias=ROUNDED)
    moved = transmittance(f, other, cull_opaque=False)
    pivot = moments.least_pivot(technique, *moments.gather(f, technique, cull_opaque=False))
    return np.asarray((np.abs(moved - T) <= SURE) & np.repeat(pivot > LEAST_PIVOT, f.counts))


def _of_few_surfaces(f: Fragments, technique: OverestimatingMoments) -> tuple[Array, Array]:
    """(N,) transmittance as moments without bias give it, and whether the fragment's ray has no
    more depths than they have nodes, which is where that is so."""
    nodes = technique.moment_count
    if not technique.moments_are_complex:
        nodes //= 2
    order = _core.depth_order(f.offsets, f.depth, thread_count(None))
    pixel = np.repeat(np.arange(len(f.counts)), f.counts)
    depth = f.depth[order]
    alpha = f.alpha[order]
    if isinstance(technique, MomentTransparency):
        a = -np.log1p(-technique.max_alpha * alpha)
    else:
        a = -np.log1p(-np.minimum(alpha, technique.max_alpha))
    first = np.ones(len(f), bool)  # of those at one depth
    first[1:] = (depth[1:] != depth[:-1]) | (pixel[1:] != pixel[:-1])
    group = np.cumsum(first) - 1
    surfaces = np.bincount(pixel[first], minlength=len(f.counts))
    at = np.bincount(group, weights=a)
    before = np.cumsum(at) - at  # of all rays so far
    start = before[group[np.minimum(f.offsets[:-1], max(len(f) - 1, 0))]] if len(f) else before
    here = at[group] - (a if technique.exclude_self else 0.0)
    share = before[group] - start[pixel] + technique.overestimation * here
    T, few = np.empty(len(f)), np.empty(len(f), bool)
    T[order] = np.exp(-share)
    few[order] = surfaces[pixel] <= nodes
    return T, few
