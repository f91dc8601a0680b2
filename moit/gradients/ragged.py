"""Questions about rays of as many samples as each has, in arrays as frameworks' users hold them."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Sequence
from typing import Any, Concatenate, NamedTuple, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from moit.catalog import Technique
from moit.catalog import technique as technique_named
from moit.checks.arrays import integers
from moit.checks.exceptions import FragmentsError
from moit.fragments.fragments import Fragments
from moit.gradients.composites import Differentiable, Gradients

Array = NDArray[Any]
P = ParamSpec("P")
R = TypeVar("R")

NAMES = ("depth", "alpha", "color", "transmission", "background")
LAYOUTS = ("offsets", "packed_info", "ray_indices")


class Asked(NamedTuple):
    """What is asked of rays, beside their arrays: hashable, as compilers of functions need it.

    asks : "composite", "transmittance" or "total_transmittance"; technique : what `name_of` gives.
    """

    asks: str
    technique: str
    depth_range: Sequence[float] | None
    threads: int | None


def arguments_of(
    function: Callable[Concatenate[str, P], Any],
) -> Callable[[Callable[..., R]], Callable[P, R]]:
    """Decorates what passes on arguments as they are: it has those of `function` but the first."""

    def with_arguments(to: Callable[..., R]) -> Callable[P, R]:
        signature = inspect.signature(function)
        given = [*signature.parameters.values()][1:]
        to.__signature__ = signature.replace(parameters=given)  # type: ignore[attr-defined]
        return to

    return with_arguments


def lacking(framework: str, error: ImportError) -> ImportError:
    """What to raise where a framework cannot be imported."""
    return ImportError(
        f"moit.{framework} needs {framework} ({error}); install it with: "
        f"pip install 'moit[{framework}]'"
    )


def offsets_of(
    count: int,
    offsets: Any = None,
    packed_info: Any = None,
    ray_indices: Any = None,
    n_rays: int | None = None,
) -> NDArray[np.int64]:
    """(R + 1,): where the samples of each ray begin, and where the last ray's end.

    count : of all samples.
    offsets : (R + 1,) the same.
    packed_info : (R, 2) of each ray where its samples begin and how many there are, one ray after
        the other.
    ray_indices : (N,) the ray of each sample, ascending, of `n_rays`; as for the others, these are
        as many as they say where n_rays is None, so rays without samples are missing at the end.

    Raises TypeError unless exactly one of the three is given; FragmentsError (a ValueError) where
    it does not fit.
    """
    given = dict(zip(LAYOUTS, (offsets, packed_info, ray_indices), strict=True))
    names = [name for name, one in given.items() if one is not None]
    if len(names) != 1:
        found = " and ".join(names) or "none"
        raise TypeError(f"expected one of {', '.join(LAYOUTS)}; got {found}")
    numbers = integers(given[names[0]], names[0])
    if offsets is not None:
        ends = numbers.astype(np.int64, copy=False)
    elif packed_info is not None:
        ends = _of_packed(numbers)
    else:
        ends = _of_indices(numbers, count, n_rays)
    if n_rays is not None and len(ends) - 1 != n_rays:
        raise FragmentsError(f"n_rays: found {n_rays}; {names[0]} has {len(ends) - 1} rays")
    return ends


def _of_packed(packed: Array) -> NDArray[np.int64]:
    if packed.ndim != 2 or packed.shape[1] != 2:
        raise FragmentsError(f"packed_info: expected shape (R, 2), got {packed.shape}")
    starts, counts = packed.astype(np.int64).T
    ends = np.concatenate([[0], np.cumsum(counts)])
    wrong = starts != ends[:-1]
    if wrong.any():
        at = int(wrong.argmax())
        raise FragmentsError(
            f"packed_info[{at}, 0]: found {starts[at]}; needed {ends[at]}, where the samples of "
            "the rays before end"
        )
    return ends


def _of_indices(ray: Array, count: int, n_rays: int | None) -> NDArray[np.int64]:
    if ray.shape != (count,):
        raise FragmentsError(f"ray_indices: expected shape ({count},), got {ray.shape}")
    rays = (int(ray[-1]) + 1 if count else 0) if n_rays is None else n_rays
    falls = ray[1:] < ray[:-1]
    if falls.any():
        at = int(falls.argmax()) + 1
        raise FragmentsError(
            f"ray_indices[{at}]: found {ray[at]} after {ray[at - 1]}; needed samples of one ray "
            "beside one another, rays ascending"
        )
    if count and not (0 <= ray[0] and ray[-1] < rays):
        wrong = ray[0] if ray[0] < 0 else ray[-1]
        raise FragmentsError(f"ray_indices: found {wrong}; needed rays from 0 to {rays - 1}")
    return np.searchsorted(ray, np.arange(rays + 1)).astype(np.int64, copy=False)


def name_of(technique: str | Technique) -> str:
    """What `moit.technique` makes the same technique of.

    Raises ValueError where no name does.
    """
    chosen = technique_named(technique)
    name = str(chosen)
    try:
        same = technique_named(name) == chosen
    except ValueError:
        same = False
    if not same:
        raise ValueError(f"technique: expected one that its name describes, got {name:.80}")
    return name


def question_of(asked: Asked, offsets: Array, arrays: Sequence[Array | None]) -> Differentiable:
    """What is asked of rays; answers are those of an image of one row.

    arrays : depth, alpha, color, transmission and background, (3,) or (R, 3), of one dtype, float32
        or float64; raises TypeError if not.
    """
    depth, alpha, color, transmission, background = arrays
    for name, one in (("depth", depth), ("alpha", alpha)):
        if one is None:
            raise TypeError(f"{name}: expected an array, got None")
    assert depth is not None and alpha is not None
    if depth.dtype not in (np.float32, np.float64):
        raise TypeError(f"depth: expected float32 or float64, got {depth.dtype}")
    for name, one in zip(NAMES, arrays, strict=True):
        if one is not None and one.dtype != depth.dtype:
            raise TypeError(f"{name}: expected {depth.dtype} as depth has, got {one.dtype}")
    f = Fragments(
        offsets,
        depth,
        alpha,
        color,
        transmission=transmission,
        depth_range=asked.depth_range,
        dtype=depth.dtype,
    )
    if background is not None and background.ndim == 2:
        background = background[None]
    return Differentiable.of(asked.asks, f, asked.technique, background, asked.threads)


def answer(question: Differentiable) -> Array:
    """(R, 4) for "composite", (N,) for "transmittance", (R,) or (R, 3) for the total."""
    found = question.answer()
    return found if question.asks == "transmittance" else found[0]


def pull(question: Differentiable, seed: Array) -> Gradients:
    """From the derivatives by `answer`; background of the shape that it was given in."""
    found = question.pull(seed if question.asks == "transmittance" else seed[None])
    if found.background is None or found.background.ndim == 1:
        return found
    return dataclasses.replace(found, background=found.background[0])


def shape_of_answer(asks: str, samples: Any, rays: Any, coloured: bool) -> tuple[Any, ...]:
    """Of `answer`, from how many samples and rays there are, and whether there is transmission."""
    if asks == "transmittance":
        return (samples,)
    if asks == "composite":
        return (rays, 4)
    return (rays, 3) if coloured else (rays,)
