"""Answers about rays, and pictures of splats, as JAX functions with gradients: `pip install
'moit[jax]'`.

Arrays are float32 or, where JAX has them enabled, float64; the core's answers come by a callback on
the CPU, also under `jax.jit`. Samples of rays stand one ray after the other:

offsets : (R + 1,) where the samples of each ray begin, and where the last ray's end; it may be
    traced, as all arrays may.
packed_info : (R, 2) where they begin and how many there are; known when traced.
ray_indices : (N,) the ray of each sample, ascending; with n_rays, the number of rays; known when
    traced.

Exactly one of the three is given. Other arguments are as of `moit.gradients`, whose derivatives
these are, with its kinks and errors. depth_range : (near, far) of what the technique warps; None:
that of these samples, which then moves with them and is held still by derivatives, so give it for
training. There are derivatives backwards only (`jax.grad`, `jax.vjp`), and none of derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from moit.catalog import Technique
from moit.geometry.camera import Camera
from moit.gradients import framed_splats, ragged
from moit.gradients.ragged import Asked

try:
    import jax
    import jax.numpy as jnp
except ImportError as error:
    raise ragged.lacking("jax", error) from error

__all__ = ["composite", "render", "total_transmittance", "transmittance"]

Array = Any  # of JAX, or traced


def composite(
    depth: Array,
    alpha: Array,
    color: Array,
    *,
    technique: str | Technique,
    offsets: Array | None = None,
    packed_info: Array | None = None,
    ray_indices: Array | None = None,
    n_rays: int | None = None,
    background: Array | None = None,
    transmission: Array | None = None,
    depth_range: Sequence[float] | None = None,
    threads: int | None = None,
) -> Array:
    """(R, 4): each ray's colour, and its alpha, as `moit.composite` gives them.

    depth, alpha : (N,); color, transmission : (N, 3); background : (3,), (R, 3), or None: black.
    Layouts as the module says. Raises TypeError and ValueError; for numbers that are traced, by
    `jax.jit` or `jax.grad`, as JAX's own error of a callback.

    >>> depth, alpha = jnp.array([1.0, 2.0]), jnp.array([0.5, 0.5])
    >>> def seen(alpha):
    ...     image = composite(depth, alpha, jnp.ones((2, 3)), technique="sorted", offsets=[0, 2])
    ...     return image[0, 3]
    >>> jax.grad(seen)(alpha).tolist()
    [0.5, 0.5]
    """
    ends = _offsets(depth, offsets, packed_info, ray_indices, n_rays)
    behind = (0.0, 0.0, 0.0) if background is None else background
    arrays = (depth, alpha, color, transmission, behind)
    return _ask(arrays, ends, _asked("composite", technique, depth_range, threads))


def _of_rays(
    asks: str,
    depth: Array,
    alpha: Array,
    *,
    technique: str | Technique,
    offsets: Array | None = None,
    packed_info: Array | None = None,
    ray_indices: Array | None = None,
    n_rays: int | None = None,
    color: Array | None = None,
    transmission: Array | None = None,
    depth_range: Sequence[float] | None = None,
    threads: int | None = None,
) -> Array:
    """What has no background."""
    ends = _offsets(depth, offsets, packed_info, ray_indices, n_rays)
    arrays = (depth, alpha, color, transmission, None)
    return _ask(arrays, ends, _asked(asks, technique, depth_range, threads))


@ragged.arguments_of(_of_rays)
def transmittance(*arrays: Any, **how: Any) -> Array:
    """(N,): the transmittance in front of each sample; arguments as `composite`, color for
    techniques whose weights ask for it.

    >>> depth, alpha = jnp.array([1.0, 2.0]), jnp.array([0.5, 0.5])
    >>> transmittance(depth, alpha, technique="sorted", ray_indices=[0, 0]).tolist()
    [1.0, 0.5]
    """
    return _of_rays("transmittance", *arrays, **how)


@ragged.arguments_of(_of_rays)
def total_transmittance(*arrays: Any, **how: Any) -> Array:
    """(R,), or with transmission (R, 3): what comes through each ray; arguments as
    `transmittance`.

    >>> depth, alpha = jnp.array([1.0, 2.0]), jnp.array([0.5, 0.5])
    >>> total_transmittance(depth, alpha, technique="power4", offsets=[0, 2, 2]).tolist()
    [0.25, 1.0]
    """
    return _of_rays("total_transmittance", *arrays, **how)


def render(
    means: Array,
    scales: Array,
    rotations: Array,
    opacities: Array,
    *,
    camera: Camera,
    size: tuple[int, int],
    technique: str | Technique,
    colors: Array | None = None,
    sh: Array | None = None,
    convention: str = "3dgs",
    background: Array | None = None,
    threads: int | None = None,
) -> Array:
    """(height, width, 4): a picture of splats, as `moit.gradients.render` makes it.

    means, scales : (N, 3); rotations : (N, 4), of any length; opacities : (N,); and colors, (N, 3),
        or sh, (N, K, 3), as `moit.Splats` has them; float32.
    camera : a moit.Camera, which stays as it is; size : (width, height).
    background : (3,), (height, width, 3), or None: black.

    Raises TypeError and ValueError as `moit.gradients.render`, whose kinks it has; for numbers that
    are traced as `composite`.

    >>> sizes, turns = jnp.float32([[0.2, 0.2, 0.2]]), jnp.float32([[1, 0, 0, 0]])
    >>> others, color = (sizes, turns, jnp.float32([0.5])), jnp.float32([[1, 1, 1]])
    >>> how = {"camera": Camera(eye=(0.1, 0, 3)), "size": (16, 12), "technique": "power4"}
    >>> def brightness(means):
    ...     return (render(means, *others, colors=color, **how) ** 2).sum()
    >>> jax.grad(brightness)(jnp.float32([[0, 0, 0]])).shape
    (1, 3)
    """
    framed_splats.check_camera(camera)
    colors, sh = (one if one is None else jnp.asarray(one) for one in (colors, sh))
    behind = np.zeros(3, np.float32) if background is None else background
    harmonics = framed_splats.harmonics_of(colors, sh)
    given = (means, scales, rotations, opacities, harmonics, behind)
    arrays = tuple(jnp.asarray(one) for one in given)
    for name, one in zip((*framed_splats.NAMES, "colors or sh", "background"), arrays, strict=True):
        if one.dtype != jnp.float32:
            raise TypeError(f"{name}: expected float32, got {one.dtype}")
    width, height = size
    how = (camera, (int(width), int(height)), ragged.name_of(technique), convention, threads)
    if not any(isinstance(one, jax.core.Tracer) for one in arrays):
        return jnp.asarray(_drawn(how, arrays)[0])  # what does not fit is said here
    return _picture(how, arrays)


def _offsets(depth: Array, offsets: Array, packed: Array, indices: Array, rays: int | None) -> Any:
    if isinstance(offsets, jax.core.Tracer) and packed is None and indices is None:
        return offsets
    ends, pairs, of_each = (
        one if one is None else np.asarray(one) for one in (offsets, packed, indices)
    )
    ends = ragged.offsets_of(len(jnp.asarray(depth)), ends, pairs, of_each, rays)
    small = ends.max(initial=0) < 2**31 and ends.min(initial=0) >= -(2**31)
    return ends.astype(np.int32) if small else ends  # JAX's own integers


def _asked(
    asks: str,
    technique: str | Technique,
    depth_range: Sequence[float] | None,
    threads: int | None,
) -> Asked:
    span = None if depth_range is None else tuple(map(float, depth_range))
    return Asked(asks, ragged.name_of(technique), span, threads)


def _ask(given: tuple[Array | None, ...], offsets: Array, asked: Asked) -> Array:
    for name, one in zip(("depth", "alpha"), given[:2], strict=True):
        if one is None:
            raise TypeError(f"{name}: expected an array, got None")
    depth = jnp.asarray(given[0])
    arrays = tuple(one if one is None else jnp.asarray(one) for one in given[1:-1])
    behind = None if given[-1] is None else jnp.asarray(given[-1], depth.dtype)
    held = (depth, *arrays, behind)
    if not any(isinstance(one, jax.core.Tracer) for one in (*held, offsets)):
        _question(asked, held, offsets)  # what does not fit is said here, not by a callback
    return _answer(asked, held, offsets)


def _question(asked: Asked, arrays: tuple[Any, ...], offsets: Any) -> Any:
    held = [None if one is None else np.asarray(one) for one in arrays]
    return ragged.question_of(asked, np.asarray(offsets), held)


def _answer_of(asked: Asked, arrays: tuple[Any, ...], offsets: Any) -> Array:
    depth, transmission = arrays[0], arrays[3]
    rays, coloured = offsets.shape[0] - 1, transmission is not None
    shape = ragged.shape_of_answer(asked.asks, depth.shape[0], rays, coloured)

    def answered(arrays: tuple[Any, ...], offsets: Any) -> Any:
        return ragged.answer(_question(asked, arrays, offsets))

    of_answer = jax.ShapeDtypeStruct(shape, depth.dtype)
    return jax.pure_callback(answered, of_answer, arrays, offsets, vmap_method="sequential")


def _forward(asked: Asked, arrays: tuple[Any, ...], offsets: Any) -> tuple[Any, Any]:
    return _answer_of(asked, arrays, offsets), (arrays, offsets)


def _backward(asked: Asked, kept: tuple[Any, Any], seed: Array) -> tuple[Any, None]:
    arrays, offsets = kept

    def pulled(arrays: tuple[Any, ...], offsets: Any, seed: Any) -> tuple[Any, ...]:
        by = ragged.pull(_question(asked, arrays, offsets), np.asarray(seed))
        found = (by.depth, by.alpha, by.color, by.transmission, by.background)
        pairs = zip(found, arrays, strict=True)
        return tuple(None if one is None else by_one for by_one, one in pairs)

    like = jax.tree.map(lambda one: jax.ShapeDtypeStruct(one.shape, one.dtype), arrays)
    found = jax.pure_callback(pulled, like, arrays, offsets, seed, vmap_method="sequential")
    return found, None


_answer = jax.custom_vjp(_answer_of, nondiff_argnums=(0,))
_answer.defvjp(_forward, _backward)


# ---- Pictures of splats --------------------------------------------------------------------------


def _drawn(how: tuple[Any, ...], arrays: tuple[Any, ...]) -> Any:
    return framed_splats.drawn([np.asarray(one) for one in arrays], *how)


def _picture_of(how: tuple[Any, ...], arrays: tuple[Any, ...]) -> Array:
    width, height = how[1]
    like = jax.ShapeDtypeStruct((height, width, 4), jnp.float32)
    return jax.pure_callback(
        lambda arrays: _drawn(how, arrays)[0], like, arrays, vmap_method="sequential"
    )


def _picture_forward(how: tuple[Any, ...], arrays: tuple[Any, ...]) -> tuple[Any, Any]:
    return _picture_of(how, arrays), arrays


def _picture_backward(how: tuple[Any, ...], arrays: tuple[Any, ...], seed: Array) -> tuple[Any]:
    def pulled(arrays: tuple[Any, ...], seed: Any) -> tuple[Any, ...]:
        turns = np.asarray(arrays[2])
        return tuple(framed_splats.pulled(_drawn(how, arrays), np.asarray(seed), turns))

    like = tuple(jax.ShapeDtypeStruct(one.shape, one.dtype) for one in arrays)
    return (jax.pure_callback(pulled, like, arrays, seed, vmap_method="sequential"),)


_picture = jax.custom_vjp(_picture_of, nondiff_argnums=(0,))
_picture.defvjp(_picture_forward, _picture_backward)
