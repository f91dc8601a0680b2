"""Derivatives through geometry: from pictures and fragments to the splats that they are made of."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.catalog import Technique
from moit.catalog import technique as technique_named
from moit.checks.exceptions import SplatsError
from moit.checks.windows import picture_size
from moit.core.questions import background_of
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera
from moit.geometry.rasterizer import MOST_SIDE, Picture
from moit.geometry.splats import OF_DEGREE_0, SplatPicture, Splats
from moit.gradients.composites import Differentiable, checked_seed
from moit.system.environment import thread_count

Array = NDArray[Any]

MOST_AT_ONCE = 1 << 22  # fragments, of which a band of rows has no more if it has several rows


@dataclasses.dataclass(frozen=True, eq=False)
class SplatGradients:
    """Derivatives of a loss by the numbers of splats, float32.

    means, scales : (N, 3).
    rotations : (N, 4), by quaternions of length 1, along the sphere that these form; of others
        divide by their length.
    opacities : (N,).
    sh : (N, K, 3), of the splats' degree.
    background : of the shape that it was given in; None where there was none.

    >>> ball = moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.9])
    >>> image, pullback = moit.gradients.render(ball, moit.Camera(), (16, 12), "sorted")
    >>> d = pullback(image)
    >>> d.scales.shape, bool(d.opacities > 0)
    ((1, 3), True)
    """

    means: Array
    scales: Array
    rotations: Array
    opacities: Array
    sh: Array
    background: Array | None = None

    @property
    def colors(self) -> Array:
        """(N, 3), by colours that are the same from all sides."""
        return self.sh[:, 0] / np.float32(OF_DEGREE_0)


Pullback = Callable[[ArrayLike], SplatGradients]


def rasterize(
    splats: Splats, camera: Camera, size: tuple[int, int], *, threads: int | None = None
) -> tuple[Fragments, Callable[[ArrayLike, ArrayLike, ArrayLike], SplatGradients]]:
    """The fragments of splats, as `moit.rasterize` gives them, and a pullback to their numbers.

    splats : of any convention; not thick, and not of those that a list would mix.
    size : (width, height), each from 1 to 16,384.
    threads : at least 1; None: as elsewhere. The results are the same bits for any number.

    pullback(d_depth, d_alpha, d_color) : (N,), (N,) and (N, 3), finite: derivatives of a loss by
        the fragments' numbers, as `moit.gradients.composite` gives them. Returns `SplatGradients`.

    Which fragments there are stays as it is (alpha of at least 1/255, in the tiles that the
    reference has them in, as far as light comes to them), and so does their depth_range. Where an
    answer has a kink, derivatives are those of one side:

    - Alpha that is held at .99 stays there.
    - Of "3dgs", a middle beyond 1.3 halves of the picture is projected as one at that limit.
    - Colour that is held at 0 stays there.
    - Of "exact", an axis below 1e-4 of the longest stays at that share of it.
    - Numbers beyond what float32 holds are the largest that it does.

    Raises SplatsError (a ValueError), TypeError and ValueError. Derivatives of the projection after
    Zwicker et al., "EWA Splatting", 2002, as Kerbl et al. 2023 have it, of quaternions and
    harmonics by the chain rule.

    >>> ball = moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.5])
    >>> f, pullback = moit.gradients.rasterize(ball, moit.Camera(), (16, 12))
    >>> by = pullback(f.depth * 0, f.alpha * 0 + 1, f.color * 0)  # of the sum of alpha
    >>> bool(np.isclose(by.opacities, f.alpha.sum() / 0.5))
    True
    """
    picture, drawn = _picture(splats, camera, size, threads)
    f = picture.rows(0, picture.size[1])

    def pullback(d_depth: ArrayLike, d_alpha: ArrayLike, d_color: ArrayLike) -> SplatGradients:
        n = len(f.depth)
        given = (
            checked_seed(d_depth, "d_depth", (n,), f.depth.dtype),
            checked_seed(d_alpha, "d_alpha", (n,), f.depth.dtype),
            checked_seed(d_color, "d_color", (n, 3), f.depth.dtype),
        )
        sums = drawn.pull_rows(0, picture.size[1], given, None)
        return SplatGradients(*drawn.pull(sums))

    return f, pullback


def render(
    splats: Splats,
    camera: Camera,
    size: tuple[int, int],
    technique: str | Technique,
    *,
    background: ArrayLike = (0, 0, 0),
    threads: int | None = None,
) -> tuple[Array, Pullback]:
    """The picture that a technique makes of splats, and its pullback to their numbers.

    Arguments as `rasterize` and `moit.gradients.composite`, whose kinks and errors it has; the
    picture, (height, width, 4) float32, is that of `moit.render`. Fragments are drawn again for the
    pullback, in bands of rows of some four million, so that memory does not grow with the picture.

    pullback(d_image) : d_image (height, width, 4), finite: derivatives of a loss by the picture.
        Returns `SplatGradients`.

    >>> rng = np.random.default_rng(1)
    >>> means, turns = rng.normal(size=(50, 3)) / 3, rng.normal(size=(50, 4))
    >>> camera, target = moit.Camera(), np.full((12, 16, 4), 0.5)
    >>> color = np.full((50, 3), 0.5)
    >>> def loss_of(color):
    ...     splats = moit.Splats(means, np.full(50, 0.2), turns, np.full(50, 0.3), colors=color)
    ...     image, pullback = moit.gradients.render(splats, camera, (16, 12), "power4")
    ...     return 0.5 * ((image - target) ** 2).sum(), pullback(image - target)
    >>> before, by = loss_of(color)
    >>> after, _ = loss_of(np.maximum(color - 0.1 * by.colors, 0))
    >>> bool(after < before)
    True
    """
    picture, drawn = _picture(splats, camera, size, threads)
    chosen = technique_named(technique)
    shape = (picture.size[1], picture.size[0])
    behind = background_of(background, shape, np.float32)

    def questions() -> Iterator[tuple[slice, Differentiable]]:
        for top, bottom in picture.bands(MOST_AT_ONCE) if chosen.local else [(0, shape[0])]:
            own = behind[top:bottom] if behind.ndim == 3 else behind
            f = picture.rows(top, bottom)
            yield slice(top, bottom), Differentiable.of("composite", f, chosen, own, drawn.threads)

    image = np.empty((*shape, 4), np.float32)
    for rows, question in questions():
        image[rows] = question.answer()

    def pullback(d_image: ArrayLike) -> SplatGradients:
        seed = checked_seed(d_image, "d_image", image.shape, image.dtype)
        by_background, sums = np.zeros(behind.shape), None
        for rows, question in questions():
            by = question.pull(seed[rows])
            assert by.color is not None and by.background is not None
            sums = drawn.pull_rows(rows.start, rows.stop, (by.depth, by.alpha, by.color), sums)
            if behind.ndim == 3:
                by_background[rows] = by.background
            else:
                by_background += by.background
        assert sums is not None
        return SplatGradients(*drawn.pull(sums), by_background.astype(image.dtype))

    return image, pullback


def _picture(
    splats: Splats, camera: Camera, size: tuple[int, int], threads: int | None
) -> tuple[Picture, SplatPicture]:
    """What is drawn, of checked arguments, and its only part."""
    if not isinstance(splats, Splats):
        raise TypeError(f"splats: expected a Splats, got {type(splats).__name__}")
    if splats.thick:
        raise SplatsError("thick: there are derivatives of flat splats only; expected False")
    if not isinstance(camera, Camera):
        raise TypeError(f"camera: expected a Camera, got {type(camera).__name__}")
    frame = camera.frame(picture_size(size, MOST_SIDE), thread_count(threads))
    picture = Picture([splats], camera, frame)
    (drawn,) = picture.parts
    assert isinstance(drawn, SplatPicture)
    return picture, drawn
