"""Answers about rays, and pictures of splats, as PyTorch operators with gradients: `pip install
'moit[torch]'`.

Tensors lie in the CPU's memory, float32 or float64, and are read where they are. Samples of rays
stand one ray after the other; where each ray has its own, exactly one of these says:

offsets : (R + 1,) where the samples of each ray begin, and where the last ray's end.
packed_info : (R, 2) where they begin and how many there are.
ray_indices : (N,) the ray of each sample, ascending; with n_rays, the number of rays.

Other arguments are as of `moit.gradients`, whose derivatives these are, with its kinks and errors.
depth_range : (near, far) of what the technique warps; None: that of these samples, which then
moves with them and is held still by derivatives, so give it for training. The operators work under
`torch.compile`, whole graphs with offsets and a technique's name; derivatives have none of their
own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from moit.catalog import Technique
from moit.geometry.camera import Camera
from moit.gradients import framed_splats, ragged
from moit.gradients.composites import Differentiable
from moit.gradients.ragged import Asked

try:
    import torch
    from torch import Tensor
except ImportError as error:
    raise ragged.lacking("torch", error) from error

__all__ = ["composite", "render", "total_transmittance", "transmittance"]

_GIVEN = (
    "Tensor depth, Tensor alpha, Tensor? color, Tensor? transmission, Tensor? background, "
    "Tensor offsets, str asks, str technique, float[]? depth_range, int? threads"
)


def composite(
    depth: Tensor,
    alpha: Tensor,
    color: Tensor,
    *,
    technique: str | Technique,
    offsets: Tensor | None = None,
    packed_info: Tensor | None = None,
    ray_indices: Tensor | None = None,
    n_rays: int | None = None,
    background: Tensor | None = None,
    transmission: Tensor | None = None,
    depth_range: Sequence[float] | None = None,
    threads: int | None = None,
) -> Tensor:
    """(R, 4): each ray's colour, and its alpha, as `moit.composite` gives them.

    depth, alpha : (N,); color, transmission : (N, 3); background : (3,), (R, 3), or None: black.
    Layouts as the module says. Raises TypeError and ValueError.

    >>> depth, alpha = torch.tensor([1.0, 2.0]), torch.tensor([0.5, 0.5], requires_grad=True)
    >>> ends = torch.tensor([0, 2])
    >>> image = composite(depth, alpha, torch.ones(2, 3), technique="sorted", offsets=ends)
    >>> image[0, 3].backward()
    >>> alpha.grad
    tensor([0.5000, 0.5000])
    """
    ends = _offsets(depth, offsets, packed_info, ray_indices, n_rays)
    if background is None:
        background = torch.zeros(3, dtype=depth.dtype)
    arrays = (depth, alpha, color, transmission, background)
    return _ask(arrays, ends, _asked("composite", technique, depth_range, threads))


def _of_rays(
    asks: str,
    depth: Tensor,
    alpha: Tensor,
    *,
    technique: str | Technique,
    offsets: Tensor | None = None,
    packed_info: Tensor | None = None,
    ray_indices: Tensor | None = None,
    n_rays: int | None = None,
    color: Tensor | None = None,
    transmission: Tensor | None = None,
    depth_range: Sequence[float] | None = None,
    threads: int | None = None,
) -> Tensor:
    """What has no background."""
    ends = _offsets(depth, offsets, packed_info, ray_indices, n_rays)
    arrays = (depth, alpha, color, transmission, None)
    return _ask(arrays, ends, _asked(asks, technique, depth_range, threads))


@ragged.arguments_of(_of_rays)
def transmittance(*arrays: Any, **how: Any) -> Tensor:
    """(N,): the transmittance in front of each sample; arguments as `composite`, color for
    techniques whose weights ask for it.

    >>> depth, alpha = torch.tensor([1.0, 2.0]), torch.tensor([0.5, 0.5])
    >>> transmittance(depth, alpha, technique="sorted", ray_indices=torch.tensor([0, 0]))
    tensor([1.0000, 0.5000])
    """
    return _of_rays("transmittance", *arrays, **how)


@ragged.arguments_of(_of_rays)
def total_transmittance(*arrays: Any, **how: Any) -> Tensor:
    """(R,), or with transmission (R, 3): what comes through each ray; arguments as
    `transmittance`.

    >>> depth, alpha = torch.tensor([1.0, 2.0]), torch.tensor([0.5, 0.5])
    >>> packed = torch.tensor([[0, 2], [2, 0]])
    >>> total_transmittance(depth, alpha, technique="power4", packed_info=packed)
    tensor([0.2500, 1.0000])
    """
    return _of_rays("total_transmittance", *arrays, **how)


def render(
    means: Tensor,
    scales: Tensor,
    rotations: Tensor,
    opacities: Tensor,
    *,
    camera: Camera,
    size: tuple[int, int],
    technique: str | Technique,
    colors: Tensor | None = None,
    sh: Tensor | None = None,
    convention: str = "3dgs",
    background: Tensor | None = None,
    threads: int | None = None,
) -> Tensor:
    """(height, width, 4): a picture of splats, as `moit.gradients.render` makes it.

    means, scales : (N, 3); rotations : (N, 4), of any length; opacities : (N,); and colors, (N, 3),
        or sh, (N, K, 3), as `moit.Splats` has them; float32.
    camera : a moit.Camera, which stays as it is; size : (width, height).
    background : (3,), (height, width, 3), or None: black.

    Raises TypeError and ValueError as `moit.gradients.render`, whose kinks it has.

    >>> means, turns = torch.zeros(1, 3, requires_grad=True), torch.tensor([[1.0, 0, 0, 0]])
    >>> ball = means, torch.full((1, 3), 0.2), turns, torch.tensor([0.5])
    >>> how = {"camera": Camera(eye=(0.1, 0, 3)), "size": (16, 12), "technique": "power4"}
    >>> image = render(*ball, colors=torch.ones(1, 3), **how)
    >>> image.square().sum().backward()
    >>> means.grad.shape
    torch.Size([1, 3])
    """
    framed_splats.check_camera(camera)
    if background is None:
        background = torch.zeros(3)
    given = (means, scales, rotations, opacities)
    others = {"colors": colors, "sh": sh, "background": background}
    named = {name: one for name, one in others.items() if one is not None}
    for name, one in {**dict(zip(framed_splats.NAMES, given, strict=True)), **named}.items():
        _check(name, one, (torch.float32,))
    seen = framed_splats.harmonics_of(colors, sh)
    numbers = [getattr(camera, name) for name in _CAMERA]
    flat = [float(x) for one in numbers for x in (one if isinstance(one, tuple) else (one,))]
    name = technique if isinstance(technique, str) else ragged.name_of(technique)
    arrays = (means, scales, rotations, opacities, seen, background)
    return _picture(*arrays, flat, list(size), name, convention, threads)


def _check(name: str, one: Any, dtypes: tuple[Any, ...]) -> None:
    if not isinstance(one, Tensor):
        raise TypeError(f"{name}: expected a tensor, got {type(one).__name__}")
    if one.device.type != "cpu":
        raise ValueError(f"{name}: expected a tensor on the CPU, got one on {one.device}")
    if one.dtype not in dtypes:
        needed = " or ".join(str(dtype).removeprefix("torch.") for dtype in dtypes)
        raise TypeError(f"{name}: expected {needed}, got {one.dtype}")


def _asked(
    asks: str,
    technique: str | Technique,
    depth_range: Sequence[float] | None,
    threads: int | None,
) -> Asked:
    # a name is the operator's to read: compilers see it as it is
    name = technique if isinstance(technique, str) else ragged.name_of(technique)
    return Asked(asks, name, depth_range, threads)


def _ask(arrays: tuple[Tensor | None, ...], offsets: Tensor, asked: Asked) -> Tensor:
    for name, one in zip(ragged.NAMES, arrays, strict=True):
        needed = name in ("depth", "alpha") or (asked.asks, name) == ("composite", "color")
        if one is None and not needed:
            continue
        _check(name, one, (torch.float32, torch.float64))
    return _answer(*arrays, offsets, *asked)


def _offsets(
    depth: Tensor,
    offsets: Tensor | None,
    packed_info: Tensor | None,
    ray_indices: Tensor | None,
    n_rays: int | None,
) -> Tensor:
    _check("depth", depth, (torch.float32, torch.float64))
    others = (packed_info, ray_indices, n_rays)
    if isinstance(offsets, Tensor) and all(one is None for one in others):
        return offsets  # which the operator checks, and compilers see as it is
    layout = (offsets, packed_info, ray_indices)
    return torch.from_numpy(ragged.offsets_of(len(depth), *layout, n_rays))


# ---- The operators: arrays of NumPy share the tensors' memory -----------------------------------


def _question(*given: Any) -> Differentiable:
    arrays = [None if one is None else one.detach().numpy() for one in given[:ARRAYS]]
    return ragged.question_of(Asked(*given[ARRAYS + 1 :]), given[ARRAYS].numpy(), arrays)


def _answered(*given: Any) -> Tensor:
    return torch.from_numpy(ragged.answer(_question(*given)))


def _shaped(*given: Any) -> Tensor:
    depth, transmission, rays = given[0], given[3], given[ARRAYS].shape[0] - 1
    asks, coloured = given[ARRAYS + 1], transmission is not None
    shape = ragged.shape_of_answer(asks, depth.shape[0], rays, coloured)
    found: Tensor = depth.new_empty(shape)
    return found


def _pulled(seed: Tensor, *given: Any) -> list[Tensor]:
    """The derivatives by those of the arrays that there are, in their order."""
    by = ragged.pull(_question(*given), seed.detach().numpy())
    found = (by.depth, by.alpha, by.color, by.transmission, by.background)
    return [
        torch.from_numpy(one)
        for one, array in zip(found, given[:ARRAYS], strict=True)
        if array is not None
    ]


def _pulled_shapes(seed: Tensor, *given: Any) -> list[Tensor]:
    return [
        torch.empty_like(one, memory_format=torch.contiguous_format)
        for one in given[:ARRAYS]
        if one is not None
    ]


def _keep(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
    ctx.save_for_backward(*inputs[: ARRAYS + 1])
    ctx.others = inputs[ARRAYS + 1 :]


def _backward(context: Any, seed: Tensor) -> tuple[Tensor | None, ...]:
    kept = context.saved_tensors
    found = iter(_pull(seed, *kept, *context.others))
    by_arrays = [None if one is None else next(found) for one in kept[:ARRAYS]]
    return (*by_arrays, *[None] * (1 + len(context.others)))


ARRAYS = len(ragged.NAMES)  # before the offsets
_answer = torch.library.custom_op(
    "moit::answer", _answered, mutates_args=(), device_types="cpu", schema=f"({_GIVEN}) -> Tensor"
)
_answer.register_fake(_shaped)
_answer.register_autograd(_backward, setup_context=_keep)
_pull = torch.library.custom_op(
    "moit::pull",
    _pulled,
    mutates_args=(),
    device_types="cpu",
    schema=f"(Tensor seed, {_GIVEN}) -> Tensor[]",
)
_pull.register_fake(_pulled_shapes)


# ---- Pictures of splats --------------------------------------------------------------------------

_CAMERA = ("eye", "target", "up", "fov_y", "near", "far")
_SPLATS = (
    "Tensor means, Tensor scales, Tensor rotations, Tensor opacities, Tensor sh, "
    "Tensor background, float[] camera, int[] size, str technique, str convention, int? threads"
)


def _drawn(*given: Any) -> Any:
    arrays = [one.detach().numpy() for one in given[:SPLAT_ARRAYS]]
    camera, (width, height), *others = given[SPLAT_ARRAYS:]
    vectors: Any = [tuple(camera[k : k + 3]) for k in (0, 3, 6)]
    return framed_splats.drawn(arrays, Camera(*vectors, *camera[9:]), (width, height), *others)


def _picture_of(*given: Any) -> Tensor:
    return torch.from_numpy(_drawn(*given)[0])


def _picture_shape(*given: Any) -> Tensor:
    width, height = given[7]
    return torch.empty((height, width, 4))


def _picture_pulled(seed: Tensor, *given: Any) -> list[Tensor]:
    turns = given[2].detach().numpy()
    by = framed_splats.pulled(_drawn(*given), seed.detach().numpy(), turns)
    return [torch.from_numpy(one) for one in by]


def _picture_pulled_shapes(seed: Tensor, *given: Any) -> list[Tensor]:
    return [
        torch.empty_like(one, memory_format=torch.contiguous_format) for one in given[:SPLAT_ARRAYS]
    ]


def _keep_splats(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
    ctx.save_for_backward(*inputs[:SPLAT_ARRAYS])
    ctx.others = inputs[SPLAT_ARRAYS:]


def _picture_backward(context: Any, seed: Tensor) -> tuple[Tensor | None, ...]:
    found = _pull_picture(seed, *context.saved_tensors, *context.others)
    return (*found, *[None] * len(context.others))


SPLAT_ARRAYS = 6  # before the camera
_picture = torch.library.custom_op(
    "moit::render",
    _picture_of,
    mutates_args=(),
    device_types="cpu",
    schema=f"({_SPLATS}) -> Tensor",
)
_picture.register_fake(_picture_shape)
_picture.register_autograd(_picture_backward, setup_context=_keep_splats)
_pull_picture = torch.library.custom_op(
    "moit::pull_render",
    _picture_pulled,
    mutates_args=(),
    device_types="cpu",
    schema=f"(Tensor seed, {_SPLATS}) -> Tensor[]",
)
_pull_picture.register_fake(_picture_pulled_shapes)
