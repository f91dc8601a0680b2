"""How much of a picture jumps when the camera turns, though each ray sees what it saw before.

Radl, Steiner et al., "StopThePop: Sorted Gaussian Splatting for View-Consistent Real-time
Rendering", 2024, compare frames with those before, warped by optical flow. A camera that only turns
has rays alone to follow, so the flow is known, and nothing comes into view from behind.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.catalog import Technique
from moit.catalog import technique as technique_named
from moit.checks.arguments import whole
from moit.checks.arrays import as_array, finite
from moit.checks.windows import picture_size
from moit.geometry.camera import Camera
from moit.geometry.light import Lights
from moit.geometry.rasterizer import MOST_SIDE
from moit.rendering.render import Scene, checked_scene, render

if TYPE_CHECKING:
    from moit.gpu.device import Device
else:  # what `typing.get_type_hints` reads, without loading it
    Device = Any

Array = NDArray[np.float64]
BLOCK = 8  # pixels a side
SEEN = 1 / 255  # a change that a display shows
LEAST_SIDE = 4 * BLOCK


@dataclasses.dataclass(frozen=True)
class Popping:
    """How a picture changes along its rays, from frame to frame, in the mean colours of blocks of
    8 x 8 pixels, in units of linear radiance.

    largest : the greatest change of a channel of any block, from any frame to the next.
    share : of all blocks of all frames, how many have a channel that changes by over 1/255.
    rms : the root of the mean square of all changes.
    each : of each frame but the first the greatest change from the one before, (frames - 1).

    >>> ball = moit.Splats([[0, 0, -1]], [0.3], [[1, 0, 0, 0]], [0.8], colors=[[1, 0, 0]])
    >>> found = moit.popping(ball, "sorted", (48, 32), camera=moit.Camera(), frames=3)
    >>> len(found.each), found.largest == max(found.each)
    (2, True)
    """

    largest: float
    share: float
    rms: float
    each: tuple[float, ...]


def popping(
    scene: Scene,
    technique: str | Technique,
    size: tuple[int, int],
    *,
    camera: Camera | None = None,
    turn: float = math.radians(1),
    frames: int = 25,
    lights: Lights = (),
    background: ArrayLike | None = None,
    device: str | Device = "cpu",
    threads: int | None = None,
) -> Popping:
    """What jumps while a camera turns about its `up`: where order changes that a ray does not see.

    scene, technique, lights, background (3,), device, threads : as `moit.render`. Without lights
        meshes have the one behind the eye, which turns as that does.
    size : (width, height), each at least 32.
    camera : in the middle of the turn; None: as `moit.render`.
    turn : radians from one frame to the next, not 0, and so small that half of the picture stays.
    frames : at least 2.

    A camera that turns sees along every ray what it saw before, so each frame is the one before,
    moved by a known map. It is read between pixels by Catmull-Rom's cubic; edges are off by that
    to both sides, so that blocks of 8 x 8 pixels are compared by their means. What then is left is
    small where the picture hangs on rays alone, whatever the technique's own error: `sorted` with
    splats of the convention "exact". It jumps where the order of whole splats does, as in
    the convention "3dgs", where layers merge in another order, and where pixels draw lots.

    Costs `frames` calls of `moit.render`. Raises TypeError and ValueError.

    >>> pair = moit.Splats([[0.4, 0, -1], [-0.4, 0, -1.01]], [0.9] * 2, [[1, 0, 0, 0]] * 2,
    ...     [0.8] * 2, colors=[[1, 0, 0], [0, 0, 1]])
    >>> seen = {"camera": moit.Camera(), "frames": 5}
    >>> moit.popping(pair, "sorted", (48, 32), **seen).largest > 0.3
    True
    >>> moit.popping(pair.seen_by("exact"), "sorted", (48, 32), **seen).largest < 0.05
    True
    """
    technique = technique_named(technique)
    frames = whole("frames", frames, 2)
    parts, middle, behind = checked_scene(scene, camera, background)
    if np.shape(behind) != (3,):
        raise ValueError(f"background: expected shape (3,), got {np.shape(behind)}")
    size = picture_size(size, MOST_SIDE)
    if min(size) < LEAST_SIDE:
        raise ValueError(f"size: expected at least {LEAST_SIDE} pixels a side, got {size}")
    step = _step(turn, middle, size)
    before: tuple[Array, Camera] | None = None
    changes = []
    for k in range(frames):
        seen_by = _turned(middle, step * (k - (frames - 1) / 2))
        made = render(
            parts,
            technique,
            size,
            camera=seen_by,
            lights=lights,
            background=behind,
            device=device,
            threads=threads,
            progress=False,
        )
        picture = made[..., :3].astype(np.float64)
        if before is not None:
            moved, there = _as_seen_by(seen_by, *before)
            changes.append(_means_of_blocks(picture - moved, there))
        before = picture, seen_by
    found = np.concatenate(changes)
    most = np.abs(found).max(axis=1)
    return Popping(
        float(most.max()),
        float((most > SEEN).mean()),
        float(np.sqrt((found**2).mean())),
        tuple(float(np.abs(some).max()) for some in changes),
    )


def _step(turn: float, camera: Camera, size: tuple[int, int]) -> float:
    array = as_array(turn, "turn")
    if array.dtype.kind not in "fiu" or array.shape != ():
        raise TypeError(f"turn: expected a number, got {turn!r:.80}")
    step = float(finite(array, "turn", np.float64))
    most = math.atan(1 / camera.scale(size)[0])
    if not 0 < abs(step) <= most:
        raise ValueError(f"turn: expected radians up to {most:.3g}, not 0; got {step:g}")
    return step


def _turned(camera: Camera, angle: float) -> Camera:
    """About its up, to the right."""
    right, up, forward = camera.axes
    ahead = np.array(camera.eye) + math.cos(angle) * forward + math.sin(angle) * right
    return dataclasses.replace(camera, target=tuple(ahead.tolist()), up=tuple(up.tolist()))


def _as_seen_by(camera: Camera, picture: Array, own: Camera) -> tuple[Array, NDArray[np.bool_]]:
    """(height, width, 3) of what a camera at the same place sees of a picture, between its pixels
    by Catmull and Rom's cubic, and where it sees it: (height, width)."""
    height, width = picture.shape[:2]
    across, along = camera.scale((width, height))
    row, column = np.mgrid[:height, :width]
    right, up, forward = camera.axes
    ray = (
        (2 * (column + 0.5) / width - 1)[..., None] / across * right
        + (1 - 2 * (row + 0.5) / height)[..., None] / along * up
        + forward
    )
    away, x, y = (ray @ own.axes[k] for k in (2, 0, 1))
    there = away > 0
    away = np.where(there, away, 1)
    left, share_x = _whole_and_rest((across * x / away + 1) * width / 2 - 0.5)
    top, share_y = _whole_and_rest((1 - along * y / away) * height / 2 - 0.5)
    there &= (left >= 1) & (left < width - 2) & (top >= 1) & (top < height - 2)
    sums = np.zeros_like(picture)
    for j, down in enumerate(_cubic(share_y)):
        for i, over in enumerate(_cubic(share_x)):
            rows = np.clip(top + j - 1, 0, height - 1)
            columns = np.clip(left + i - 1, 0, width - 1)
            sums += (down * over)[..., None] * picture[rows, columns]
    return sums, there


def _whole_and_rest(place: Array) -> tuple[NDArray[np.intp], Array]:
    whole_part = np.floor(place)
    return whole_part.astype(np.intp), place - whole_part


def _cubic(t: Array) -> tuple[Array, ...]:
    """Weights of the four pixels round a place t behind the second."""
    return (
        ((-0.5 * t + 1) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1,
        ((-1.5 * t + 2) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    )


def _means_of_blocks(change: Array, there: NDArray[np.bool_]) -> Array:
    """(N, 3) of the blocks of which all is there."""
    rows, columns = (side // BLOCK for side in there.shape)
    shape = (rows, BLOCK, columns, BLOCK)
    end = (slice(rows * BLOCK), slice(columns * BLOCK))
    whole_ones = there[end].reshape(shape).all(axis=(1, 3))
    means: Array = change[end].reshape(*shape, 3).mean(axis=(1, 3))[whole_ones]
    return means
