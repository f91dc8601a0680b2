"""Fragments as passes over arrays are given them, and which passes these are."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog import Technique
from moit.checks.exceptions import GpuError
from moit.fragments.fragments import Fragments
from moit.fragments.squares import Squares, squares_of
from moit.gpu.bindings import SOFTWARE_ITERATIONS
from moit.gpu.blocks import Blocks, blocks_of, guides_of, opaque_and_net
from moit.gpu.described import Constants
from moit.gpu.moment_passes import extents_are_words
from moit.gpu.passes import passes_of

if TYPE_CHECKING:
    from moit.gpu.device import Device

TABLE_ENTRY = 12  # bytes of one cell in a buffer: three floats


class Prepared:
    """Fragments and a technique on a device: what no opaque surface hides, and the passes over it.

    fields : as the core takes them; weights of fragments in them are (N,).
    exact : as the core computes it, to the bit where the device rounds as it does; else by texts
        for engines, where there are any.
    relative : composites weigh fragments relative to the one that weighs most. For pixels whose
        weights are lost otherwise; of the others these are other pictures.
    """

    def __init__(
        self,
        device: Device,
        f: Fragments,
        technique: Technique,
        fields: dict[str, Any],
        cull_opaque: bool,
        threads: int,
        exact: bool = True,
        relative: bool = False,
    ) -> None:
        self.device, self.f, self.fields, self.threads = device, f, fields, threads
        self.technique, self.cull_opaque, self.relative = technique, cull_opaque, relative
        self.dtype = f.depth.dtype
        self.overflows = 0
        self.record: list[tuple[int, int]] | None = None  # passes and what times them
        self.kept, self.occluder, opacity, net = _core.surviving(f, cull_opaque, threads)
        double = self.dtype == np.float64
        self.constants = Constants.of(fields, double, f.depth_range, exact or relative)
        self.passes = passes_of(technique, self.constants)
        if relative:
            self.passes = self.passes.absorbed()
        everything = bool(self.kept.all())
        kept = slice(None) if everything else self.kept
        self.offsets = f.offsets
        if not everything:
            self.offsets = np.concatenate([[0], np.cumsum(self.kept)])[f.offsets]
        self._check_loops()
        self.depth, self.emission = f.depth[kept], f.alpha[kept]
        self.color = None if f.color is None else f.color[kept]
        self.alpha = self.emission if net is None else net[kept]
        self.opacity = None if opacity is None else opacity[kept]
        self.weights = fields["weights"][kept] if "weights" in fields else None
        # Depth that is warped by other steps than the shaders': each pixel's own, or extreme ones;
        # and what is rounded to keys.
        small_keys = bool(fields.get("small_keys"))
        self.warped_before = (
            small_keys
            or self.constants.warp == "extreme"
            or (
                self.constants.warp != "none"
                and bool(fields.get("range_per_pixel"))
                and not extents_are_words(fields)
            )
        )
        if self.warped_before:
            self.survivors = Fragments(
                self.offsets, self.depth, self.alpha, depth_range=f.depth_range, dtype=self.dtype
            )
            self.depth = _core.warped(self.survivors, fields, threads, None)
            asks_order = self.passes.keeps_nearest and not (small_keys or cull_opaque)
            if asks_order and len(self.alpha):
                self._check_order()
        if small_keys:
            self.alpha = _rounded_to_keys(self.alpha)

    def program(self, number: int, double: bool) -> Any:
        """The pass of this number, from the one place that chooses which texts passes are.

        double : whether it computes in double; where the fragments are double all passes do.
        """
        is_double = self.dtype == np.float64
        return self.device.program(
            f"techniques/{self.passes.shader}",
            **self.passes.defines_on(self.device),
            SCALAR="double" if is_double else "float",
            DOUBLE=int(double or is_double),
            PASS=number,
        )

    @property
    def asks_again(self) -> bool:
        """Whether a pixel's transmittance is asked for again in double where float may have lost
        it. State of blocks and tables is not to be had for single pixels, nor are
        samples."""
        return (
            self.dtype == np.float32
            and not (self.passes.block_stages or self.passes.tables)
            and not self.technique.random
        )

    @property
    def marks(self) -> int:
        """Which pixels are to be looked at again; see shaders/arrays/questions.glsl."""
        if self.relative or not self.passes.normalize:
            return 0
        return 2 if self.asks_again and self.passes.absorbs else 1

    @functools.cached_property
    def blocks(self) -> Blocks:
        """Those that a technique has state of, and what they take."""
        opaque, self._net = opaque_and_net(self.f, self.threads)
        side, average = self.fields["resolution"], self.fields.get("average", True)
        if not self.passes.of_farthest_surface:
            return blocks_of(self.f, side, average, None, self.kept)
        return blocks_of(self.f, side, average, opaque if self.cull_opaque else None)

    @functools.cached_property
    def squares(self) -> Squares:
        """Where blocks are."""
        if not self.passes.block_words:
            return self.blocks
        return squares_of(self.f, self.fields["resolution"])

    @functools.cached_property
    def tables(self) -> tuple[NDArray[np.float32], int, int, int, int, int]:
        """Where slices stand: of each region's cells three numbers; the regions' side in pixels, 0
        where the image is one, how many pixels of the first are above the image and to its left,
        and how many stand side by side; how many cells are joined where all are by as many.

        Raises GpuError where the device cannot hold them in a buffer."""
        side = getattr(self.technique, "table_side", 0)
        tables = squares_of(self.f, side).count if side else 1
        size = tables * self.fields["cells"] * TABLE_ENTRY
        if size > self.device.storage_bytes:  # before anything of that size is made
            raise GpuError(
                f"table: {tables} tables of where slices stand have {size} bytes, and "
                f"{self.device.renderer} can hold {self.device.storage_bytes} in a buffer; use "
                "device='cpu', or table='image'"
            )
        return _core.slice_tables(self.f, self.fields, self.cull_opaque, self.threads)

    @functools.cached_property
    def units(self) -> NDArray[np.float64]:
        """(P,) half of each pixel's own range of depth in the image's, which is from -1 to 1: what
        the core's bounded networks know of it."""
        depth, begin = self.survivors.depth.astype(np.float64), self.offsets[:-1]
        filled = np.flatnonzero(np.diff(self.offsets))
        ends = np.tile(np.asarray(self.f.depth_range, np.float64), (len(begin), 1))
        seen = np.ones(len(depth), bool)
        if not self.cull_opaque:  # opaque ones count where a pixel has no others
            some = np.logical_or.reduceat(self.alpha < 1, begin[filled]) if len(filled) else filled
            seen = (self.alpha < 1) | ~np.repeat(some, np.diff(self.offsets)[filled])
        for k, (choose, none) in enumerate(((np.minimum, np.inf), (np.maximum, -np.inf))):
            ends[filled, k] = choose.reduceat(np.where(seen, depth, none), begin[filled])
        held = Fragments(
            2 * np.arange(len(begin) + 1),
            ends.ravel(),
            np.zeros(ends.size),
            depth_range=self.f.depth_range,
            dtype=np.float64,
        )
        fields = {**self.fields, "range_per_pixel": False}
        z = _core.warped(held, fields, self.threads, None).reshape(-1, 2)
        return np.asarray(0.5 * (z[:, 1] - z[:, 0]))

    @functools.cached_property
    def guides(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """As `guides_of` has them; None where shares of blocks are bilinear."""
        if not (self.fields.get("depth_aware") and self.cull_opaque):
            return None
        opaque, _ = opaque_and_net(self.f, self.threads)
        return guides_of(self.f, self.squares, opaque)

    def _check_order(self) -> None:
        """Opaque fragments may lie behind the range that depth was warped from, at its end: which
        is nearer passes do not see any more."""
        if self.alpha.max() >= 1:
            raise GpuError(
                "cull_opaque: opaque fragments among the nearest have no passes where the core "
                f"warps depth; {self.technique} with cull_opaque=False needs device='cpu'"
            )

    def _check_loops(self) -> None:
        """Software renderers leave loops early, silently: a thread has so many turns in all."""
        if not self.device.software or self.occluder.size == 0:
            return
        counts = np.diff(self.offsets)
        pixel, most = int(counts.argmax()), SOFTWARE_ITERATIONS // self.passes.iterations
        if counts[pixel] > most:
            raise GpuError(
                f"offsets: pixel {pixel} has {counts[pixel]} fragments, and loops of "
                f"{self.device.renderer} are sure to reach {most} of them only; use device='cpu'"
            )


def _rounded_to_keys(alpha: NDArray[Any]) -> NDArray[Any]:
    """As keys of 32 bits have it: csrc/core/techniques/front.c."""
    root = np.rint(4095.0 * np.sqrt(1.0 - alpha.astype(np.float64))) / 4095.0
    return np.asarray((1.0 - root * root).astype(alpha.dtype))
