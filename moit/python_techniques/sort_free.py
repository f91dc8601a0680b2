"""Splats whose weights were trained so that nobody has to sort them.

Hou, Rauwendaal, Li, Le, Farhadzadeh, Porikli, Bourd and Said, "Sort-free Gaussian Splatting via
Weighted Sum Rendering", ICLR 2025: C = (w_B c_B + sum of w a c) / (w_B + sum of w a), where the
weight w falls with depth, and of the third kind has a factor of the splat's own, which hangs on the
side that it is seen from.
"""

from __future__ import annotations

import dataclasses
import math
import os
import re
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit.catalog import PythonTechnique
from moit.catalog.options import positive
from moit.checks.arguments import one_of, path_name
from moit.checks.exceptions import SplatsError
from moit.checks.windows import picture_size
from moit.fragments.fragments import Fragments
from moit.geometry.camera import Camera
from moit.geometry.rasterizer import MOST_SIDE, rasterized
from moit.geometry.reading.ply import read_vertices
from moit.geometry.reading.splat_files import TURNED, read_splats
from moit.geometry.splats import DEGREES, OF_DEGREE_0, Splats
from moit.system.environment import thread_count

WEIGHTS = ("direct", "exponential", "linear")


@dataclasses.dataclass(frozen=True)
class SortFree(PythonTechnique):
    """A weighted sum in which what is behind is one more summand.

    weight : of a fragment at depth d. "direct": 1; "exponential": exp(-sigma d^power); "linear":
        max(0, 1 - d / sigma).
    sigma, power : of these; positive. 10, where training begins, is that of "linear".
    background : the weight of what is behind; positive. Training begins with 0.02 where splats
        have a factor of 0.1, which is 0.2 where they have none.

    Hou et al., ICLR 2025. Only where the sum has been trained for is its picture that of the scene;
    what a pixel lets through is background / (background + sum of w alpha), whatever the product of
    1 - alpha. For trained splats see `moit.SortFreeSplats`. Of others `moit.WeightedBlended` takes
    any such weight, with exact coverage, as Yang et al. ("SparseOIT", CVPR 2026) do.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], color=[[1, 0, 0], [0, 1, 0]])
    >>> moit.composite(f, moit.SortFree(sigma=4, background=0.375)).round(3).tolist()
    [[[0.375, 0.25, 0.0, 0.625]]]
    """

    weight: str = "linear"
    sigma: float = 10.0
    power: float = 1.0
    background: float = 0.2

    papers: ClassVar[tuple[str, ...]] = ("hou2025",)

    normalize = False
    bits_per_pixel = 0  # the sums are the accumulation target
    geometry_passes = 1

    def __post_init__(self) -> None:
        one_of("weight", self.weight, WEIGHTS)
        for name in ("sigma", "power", "background"):
            positive(self, name)
        super().__post_init__()

    def transmittance(self, fragments: Fragments) -> NDArray[np.float64]:
        """Of each fragment what its colour counts."""
        weights = self._weights(fragments)
        return weights / (self.background + self._sums(fragments, weights))[_pixels(fragments)]

    def total(self, fragments: Fragments) -> NDArray[np.float64]:
        sums = self._sums(fragments, self._weights(fragments))
        return self.background / (self.background + sums)

    def _weights(self, fragments: Fragments) -> NDArray[np.float64]:
        depth = fragments.depth.astype(np.float64)
        if self.weight == "linear":
            return np.maximum(0.0, 1 - depth / self.sigma)
        if self.weight == "exponential":
            return np.exp(-self.sigma * np.maximum(depth, 0) ** self.power)
        return np.ones(len(depth))

    def _sums(self, fragments: Fragments, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        pixels = len(fragments.offsets) - 1
        found: NDArray[Any] = np.bincount(_pixels(fragments), weights * fragments.alpha, pixels)
        return found.astype(np.float64)  # of none bincount makes whole numbers


def _pixels(fragments: Fragments) -> NDArray[np.int64]:
    return np.repeat(np.arange(len(fragments.offsets) - 1), np.diff(fragments.offsets))


@dataclasses.dataclass(frozen=True, eq=False)
class SortFreeSplats:
    """Splats with what was trained for sums without an order.

    splats : as they are drawn; none is left out for what lies in front of it, whatever their
        convention: "3dgs" is taken for "3dgs-all".
    factors : (N, K) of their weights, in real spherical harmonics of degree 0 to 3, K 1, 4, 9 or
        16, as `sh` of `moit.Splats` but of one channel and without its 1/2. Below 0 is 0.
    technique : a `moit.SortFree`, whose `background` goes with these factors.

    Raises SplatsError (a ValueError) and TypeError that name the argument.

    >>> ball = moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.9], colors=(0.8, 0.3, 0.1))
    >>> trained = moit.SortFreeSplats(ball, [[0.1 / 0.28209]], moit.SortFree(background=0.02))
    >>> f, technique = trained.seen(moit.Camera(), (16, 12))
    >>> moit.composite(f, technique).shape
    (12, 16, 4)
    """

    splats: Splats
    factors: ArrayLike
    technique: SortFree = SortFree(background=0.02)

    def __post_init__(self) -> None:
        if not isinstance(self.splats, Splats):
            raise TypeError(f"splats: expected Splats, got {type(self.splats).__name__}")
        if not isinstance(self.technique, SortFree):
            raise TypeError(f"technique: expected SortFree, got {type(self.technique).__name__}")
        factors = np.asarray(self.factors, np.float64)
        count = len(self.splats)
        if factors.ndim != 2 or len(factors) != count or factors.shape[1] not in DEGREES:
            needed = " or ".join(str((count, one)) for one in DEGREES)
            raise SplatsError(f"factors: expected shape {needed}, got {factors.shape}")
        if not np.isfinite(factors).all():
            raise SplatsError("factors: found numbers that are not finite")
        factors.flags.writeable = False
        object.__setattr__(self, "factors", factors)

    def seen(
        self, camera: Camera, size: tuple[int, int], *, threads: int | None = None
    ) -> tuple[Fragments, SortFree]:
        """(fragments, technique): by this technique their picture is the sum's.

        Each alpha has its splat's factor, over the greatest of them, by which the background's
        weight is divided: that changes nothing of the quotient. camera, size, threads : as
        `moit.rasterize`.
        """
        splats = self.splats
        if splats.convention == "3dgs":
            splats = splats.seen_by("3dgs-all")
        size, workers = picture_size(size, MOST_SIDE), thread_count(threads)
        f = rasterized([splats], camera, size, workers)
        # the same fragments once more, in colours that are factors
        channels = np.repeat(np.asarray(self.factors)[:, :, None], 3, axis=2)
        channels[:, 0] -= 0.5 / OF_DEGREE_0
        marked = splats._with(sh=channels)
        shown = rasterized([marked], camera, size, workers).color
        assert shown is not None
        factor = shown[:, 0].astype(np.float64)
        greatest = float(factor.max(initial=0)) or 1.0
        weighed = Fragments(
            f.offsets,
            f.depth,
            (f.alpha * (factor / greatest)).astype(np.float32),
            f.color,
            shape=f.shape,
            depth_range=f.depth_range,
            dtype=np.float32,
        )
        background = self.technique.background / greatest
        return weighed, dataclasses.replace(self.technique, background=background)


def read_sort_free(path: str | os.PathLike[str]) -> SortFreeSplats:
    """The splats of a .ply of sort-free splatting, with factors and numbers of its "linear" weight.

    path : as of `moit.read_splats`, with f_do_0 and f_ro_* besides, the harmonics of factors, and
        `info`, which has the background's weight in its first row and sigma in its second.

    These names are those of an implementation that others published (LiYukeee, "sort-free-gs"), as
    described; no file of it was at hand. Raises what `moit.read_splats` does.

    >>> moit.write_splats("ball.ply", moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.9]))
    >>> try:
    ...     moit.read_sort_free("ball.ply")
    ... except moit.SplatsError as error:
    ...     print(error)
    'ball.ply': has no property 'f_do_0' of sort-free splats
    """
    name = path_name(path)
    if os.path.splitext(name)[1].lower() != ".ply":
        raise SplatsError(f"{name!r}: expected a file .ply")
    splats = read_splats(name, convention="3dgs-all")
    with open(name, "rb") as file:
        rows, _ = read_vertices(file.read())
    rest = sorted((one for one in rows if re.fullmatch(r"f_ro_\d+", one)), key=_number_of)
    missing = [one for one in ("f_do_0", "info") if not isinstance(rows.get(one), np.ndarray)]
    if missing:
        raise SplatsError(f"{name!r}: has no property {missing[0]!r} of sort-free splats")
    if 1 + len(rest) not in DEGREES:
        raise SplatsError(f"{name!r}: has {len(rest)} properties f_ro_*; needed 0, 3, 8 or 15")
    info = rows["info"][:2].astype(np.float64).tolist()
    if len(info) < 2 or not all(math.isfinite(one) and one > 0 for one in info):
        raise SplatsError(f"{name!r}: found info {info}; needed two positive numbers")
    columns: Any = [rows[one].astype(np.float64) for one in ("f_do_0", *rest)]
    factors = np.stack(columns, axis=1) * TURNED[: 1 + len(rest)]
    return SortFreeSplats(splats, factors, SortFree(sigma=info[1], background=info[0]))


def _number_of(name: str) -> int:
    return int(name.rpartition("_")[2])
