"""Derivatives through geometry: from pictures and fragments to what they are made of."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.catalog import Technique
from moit.catalog import technique as technique_named
from moit.checks.exceptions import SplatsError
from moit.checks.windows import picture_size
from moit.core.questions import background_of
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera
from moit.geometry.light import Lights, light_numbers, throw_shadows
from moit.geometry.meshes import Mesh, meshes_of
from moit.geometry.rasterizer import MOST_SIDE, Picture
from moit.geometry.splats import OF_DEGREE_0, SplatPicture, Splats
from moit.gradients.composites import Differentiable, checked_seed
from moit.gradients.meshes import DrawnMeshes, SceneGradients
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


SplatPullback = Callable[[ArrayLike], SplatGradients]
ScenePullback = Callable[[ArrayLike], SceneGradients]


@overload
def rasterize(
    scene: Splats, camera: Camera, size: tuple[int, int], *, threads: int | None = ...
) -> tuple[Fragments, Callable[[ArrayLike, ArrayLike, ArrayLike], SplatGradients]]: ...
@overload
def rasterize(
    scene: Mesh | Sequence[Mesh],
    camera: Camera,
    size: tuple[int, int],
    *,
    lights: Lights = ...,
    threads: int | None = ...,
) -> tuple[Fragments, Callable[[ArrayLike, ArrayLike, ArrayLike], SceneGradients]]: ...
def rasterize(
    scene: Splats | Mesh | Sequence[Mesh],
    camera: Camera,
    size: tuple[int, int],
    *,
    lights: Lights = (),
    threads: int | None = None,
) -> tuple[Fragments, Callable[[ArrayLike, ArrayLike, ArrayLike], Any]]:
    """The fragments of splats or meshes, as `moit.rasterize` gives them, and a pullback.

    scene : Splats of any convention, not thick; or a Mesh or several, without transmission.
    size : (width, height), each from 1 to 16,384.
    lights : on meshes, as of `moit.rasterize`, without shadows.
    threads : at least 1; None: as elsewhere. The results are the same bits for any number.

    pullback(d_depth, d_alpha, d_color) : (N,), (N,) and (N, 3), finite: derivatives of a loss by
        the fragments' numbers, as `moit.gradients.composite` gives them. Returns `SplatGradients`;
        of meshes `SceneGradients`: what they look like, not where they are, so d_depth is of no
        use there.

    Which fragments there are stays as it is (of splats alpha of at least 1/255, in the tiles that
    the reference has them in, as far as light comes to them), and so does their depth_range. Where
    an answer has a kink, derivatives are those of one side:

    - Alpha of splats that is held at .99 stays there. What is opaque of a mesh stays so.
    - Of "3dgs", a middle beyond 1.3 halves of the picture is projected as one at that limit.
    - Colour that is held at 0 stays there.
    - Of "exact", an axis below 1e-4 of the longest stays at that share of it.
    - Numbers beyond what float32 holds are the largest that it does.

    Raises SplatsError and MeshError (both ValueErrors), TypeError and ValueError. Derivatives of
    the projection after Zwicker et al., "EWA Splatting", 2002, as Kerbl et al. 2023 have it, of
    quaternions and harmonics by the chain rule.

    >>> ball = moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.5])
    >>> f, pullback = moit.gradients.rasterize(ball, moit.Camera(), (16, 12))
    >>> by = pullback(f.depth * 0, f.alpha * 0 + 1, f.color * 0)  # of the sum of alpha
    >>> bool(np.isclose(by.opacities, f.alpha.sum() / 0.5))
    True
    """
    drawn = _drawn(scene, camera, size, lights, threads)
    f = drawn.rows(0, drawn.height)

    def pullback(d_depth: ArrayLike, d_alpha: ArrayLike, d_color: ArrayLike) -> Any:
        n = len(f.depth)
        given = (
            checked_seed(d_depth, "d_depth", (n,), f.depth.dtype),
            checked_seed(d_alpha, "d_alpha", (n,), f.depth.dtype),
            checked_seed(d_color, "d_color", (n, 3), f.depth.dtype),
        )
        return drawn.pull(drawn.pull_rows(f, 0, drawn.height, given, None), None)

    return f, pullback


@overload
def render(
    scene: Splats,
    camera: Camera,
    size: tuple[int, int],
    technique: str | Technique,
    *,
    background: ArrayLike = ...,
    threads: int | None = ...,
) -> tuple[Array, SplatPullback]: ...
@overload
def render(
    scene: Mesh | Sequence[Mesh],
    camera: Camera,
    size: tuple[int, int],
    technique: str | Technique,
    *,
    background: ArrayLike = ...,
    lights: Lights = ...,
    threads: int | None = ...,
) -> tuple[Array, ScenePullback]: ...
def render(
    scene: Splats | Mesh | Sequence[Mesh],
    camera: Camera,
    size: tuple[int, int],
    technique: str | Technique,
    *,
    background: ArrayLike = (0, 0, 0),
    lights: Lights = (),
    threads: int | None = None,
) -> tuple[Array, Callable[[ArrayLike], Any]]:
    """The picture that a technique makes of splats or meshes, and its pullback to their numbers.

    Arguments as `rasterize` and `moit.gradients.composite`, whose kinks and errors it has; the
    picture, (height, width, 4) float32, is that of `moit.render`. Splats are drawn again for the
    pullback, in bands of rows of some four million fragments, so that memory does not grow with
    the picture; fragments of meshes are all held.

    pullback(d_image) : d_image (height, width, 4), finite: derivatives of a loss by the picture.
        Returns `SplatGradients` or `SceneGradients`.

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
    drawn = _drawn(scene, camera, size, lights, threads)
    chosen = technique_named(technique)
    shape = (drawn.height, drawn.width)
    behind = np.array(background_of(background, shape, np.float32))  # he may write over his

    def questions() -> Iterator[tuple[int, int, Fragments, Differentiable]]:
        for top, bottom in drawn.bands(MOST_AT_ONCE) if chosen.local else [(0, drawn.height)]:
            own = behind[top:bottom] if behind.ndim == 3 else behind
            f = drawn.rows(top, bottom)
            asked = Differentiable.of("composite", f, chosen, own, drawn.threads)
            yield top, bottom, f, asked

    image = np.empty((*shape, 4), np.float32)
    for top, bottom, _, question in questions():
        image[top:bottom] = question.answer()

    def pullback(d_image: ArrayLike) -> Any:
        seed = checked_seed(d_image, "d_image", image.shape, image.dtype)
        by_background, sums = np.zeros(behind.shape), None
        for top, bottom, f, question in questions():
            by = question.pull(seed[top:bottom])
            assert by.color is not None and by.background is not None
            sums = drawn.pull_rows(f, top, bottom, (by.depth, by.alpha, by.color), sums)
            if behind.ndim == 3:
                by_background[top:bottom] = by.background
            else:
                by_background += by.background
        return drawn.pull(sums, by_background.astype(image.dtype))

    return image, pullback


class _Drawn(Protocol):
    """What is drawn in rows, and pulled back the same way."""

    width: int
    height: int
    threads: int

    def bands(self, most: int) -> list[tuple[int, int]]: ...
    def rows(self, top: int, bottom: int) -> Fragments: ...
    def pull_rows(
        self, f: Fragments, top: int, bottom: int, by: tuple[Array, Array, Array], sums: Any
    ) -> Any: ...
    def pull(self, sums: Any, background: Array | None) -> Any: ...


class _DrawnSplats:
    def __init__(self, splats: Splats, camera: Camera, size: tuple[int, int], threads: int) -> None:
        self._picture = Picture([splats], camera, camera.frame(size, threads))
        (self._part,) = self._picture.parts
        self.bands, self.rows = self._picture.bands, self._picture.rows
        (self.width, self.height), self.threads = size, threads

    def pull_rows(
        self, f: Fragments, top: int, bottom: int, by: tuple[Array, Array, Array], sums: Any
    ) -> Any:
        assert isinstance(self._part, SplatPicture)
        return self._part.pull_rows(top, bottom, by, sums)

    def pull(self, sums: Any, background: Array | None) -> SplatGradients:
        assert isinstance(self._part, SplatPicture)
        return SplatGradients(*self._part.pull(sums), background)


class _DrawnMeshes:
    def __init__(self, drawn: DrawnMeshes, size: tuple[int, int], threads: int) -> None:
        self._drawn, self._f = drawn, drawn.fragments()
        (self.width, self.height), self.threads = size, threads

    def bands(self, most: int) -> list[tuple[int, int]]:
        return [(0, self.height)]

    def rows(self, top: int, bottom: int) -> Fragments:
        return self._f

    def pull_rows(
        self, f: Fragments, top: int, bottom: int, by: tuple[Array, Array, Array], sums: Any
    ) -> Any:
        return self._drawn.pull(f, by[1], by[2])

    def pull(self, sums: Any, background: Array | None) -> SceneGradients:
        return SceneGradients(sums, background)


def _drawn(
    scene: Any, camera: Camera, size: tuple[int, int], lights: Lights, threads: int | None
) -> _Drawn:
    if not isinstance(camera, Camera):
        raise TypeError(f"camera: expected a Camera, got {type(camera).__name__}")
    checked, workers = picture_size(size, MOST_SIDE), thread_count(threads)
    if isinstance(scene, Splats):
        if scene.thick:
            raise SplatsError("thick: there are derivatives of flat splats only; expected False")
        if len(lights):
            raise ValueError("lights: no light falls on splats; expected none")
        return _DrawnSplats(scene, camera, checked, workers)
    meshes = meshes_of(scene)
    numbers = light_numbers(lights, camera)
    if throw_shadows(lights):
        raise ValueError("lights: there are derivatives without shadows only")
    drawn = DrawnMeshes(meshes, camera, checked, numbers, workers)
    return _DrawnMeshes(drawn, checked, workers)
