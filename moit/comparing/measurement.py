"""One cell of a comparison: a technique on a scene, timed and held against the exact answer.

Everything here can be sent to another process: the work is a function at the top of a module,
its argument and result are dataclasses of arrays, numbers and strings.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core, metrics
from moit.catalog import Technique
from moit.checks.exceptions import told
from moit.comparing.rows import AFTER_METRICS, BEFORE_METRICS, LESS_IS_BETTER, Result, Row, Scene
from moit.core.questions import in_range
from moit.fragments.fragments import Fragments
from moit.inputs import as_fragments
from moit.questions import composite, transmittance
from moit.reports.columns import number
from moit.system.environment import thread_count

Array = NDArray[Any]
Pixel = tuple[int, int]

SAMPLES = 160  # depths at which a curve is drawn, besides those of the fragments
MUCH = 1.5  # times an error, which is worth a note
MOST_STEPS = 400  # fragments of a pixel whose steps a curve shows exactly


@dataclass(frozen=True)
class Job:
    """What `measure` needs: which technique on what, and how."""

    scene: str
    token: str  # the same for all jobs with this scene and reference
    source: Fragments | str
    technique: Technique
    label: str
    device: str
    reference: Technique
    metrics: tuple[str, ...]
    repeat: int
    pixels: tuple[Pixel, ...]
    background: Any = (0.0, 0.0, 0.0)  # (3,) numbers, or an array (height, width, 3)
    choice: dict[str, Any] = field(default_factory=dict)  # part and layer of a source in a file
    threads: int | None = None
    depth_range: tuple[float, float] | None = None
    cull_opaque: bool = True

    def fragments(self) -> Fragments:
        """What its source is."""
        return in_range(as_fragments(self.source, **self.choice), self.depth_range)

    @property
    def how(self) -> dict[str, Any]:
        """What all its questions are asked with."""
        return {"threads": self.threads, "cull_opaque": self.cull_opaque}


@dataclass(frozen=True)
class Exact:
    """The fragments of a scene and what is true of them, in float64."""

    f: Fragments
    image: Array  # (H, W, 4)
    least: Array  # (N,) transmittance in front of each fragment: of nearer ones and of earlier
    most: Array  # (N,) ... ones at the same depth, and of strictly nearer ones; both are right

    @cached_property
    def reference(self) -> metrics.Reference:
        """The image as what others are held against; not for one of too few pixels a side."""
        return metrics.Reference(self.image)


class _Recent:
    """The last few scenes that this process worked on: a scene's jobs share one reference."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.held: OrderedDict[str, Exact] = OrderedDict()
        self.lock = threading.Lock()

    def get(self, job: Job) -> Exact:
        with self.lock:
            if job.token not in self.held:
                self.held[job.token] = exact(
                    job.fragments(), job.reference, job.background, job.how
                )
                while len(self.held) > self.most:
                    self.held.popitem(last=False)
            self.held.move_to_end(job.token)
            return self.held[job.token]

    def forget(self, token: str) -> None:
        with self.lock:
            self.held.pop(token, None)


recent = _Recent(2)


def exact(f: Fragments, reference: Technique, background: Any, how: dict[str, Any]) -> Exact:
    """The reference image and the transmittance of `sorted`. how : threads and cull_opaque as
    `composite` takes them."""
    image = composite(f, reference, background=background, dtype=np.float64, **how)
    least = transmittance(f, "sorted", dtype=np.float64, **how)
    return Exact(f, image, least, strictly_nearer(f, least))


def strictly_nearer(f: Fragments, least: Array) -> Array:
    """(N,) `least`, but for fragments that share their depth the greatest of theirs: that of the
    first surface, which is in front of volumes."""
    if not len(f):
        return least
    order = _core.depth_order(f.offsets, f.depth, thread_count(None))
    depth = f.depth[order]
    is_first = np.ones(len(f), bool)
    is_first[1:] = depth[1:] != depth[:-1]
    is_first[f.offsets[:-1][f.counts > 0]] = True
    first = np.flatnonzero(is_first)
    most = np.empty_like(least)
    greatest = np.maximum.reduceat(least[order], first)
    most[order] = np.repeat(greatest, np.diff(first, append=len(f)))
    return most


def measure(job: Job) -> Result:
    """The row, image and curves of one technique; what fails is told in the row's note."""
    row = empty_row(job)
    notes = [job.technique.remark] if job.technique.remark else []
    try:
        truth = recent.get(job)
        image, seconds = _timed(truth.f, job)
    except Exception as error:
        row["note"] = told(error)
        return Result(row)
    row["seconds"] = float(np.median(seconds))
    row["seconds_iqr"] = float(np.subtract(*np.percentile(seconds, (75, 25))))
    row["fragments_per_second"] = len(truth.f) / max(row["seconds"], 1e-9)
    row.update(_image_errors(image, truth, job.metrics, job.threads, notes))
    notes.extend(_renormalised(truth, job, row))
    row.update(_transmittance_errors(truth, job, notes))
    curves = _curves(truth.f, job)
    row["note"] = "; ".join(notes)
    return Result(row, np.asarray(image, np.float32), curves)


def describe(job: Job) -> Scene:
    """What a report keeps of the job's scene."""
    truth = recent.get(job)
    f = truth.f
    depths = tuple(curve_depths(f, pixel) for pixel in job.pixels)
    return Scene(
        job.scene,
        f.shape,
        len(f),
        int(f.counts.max(initial=0)),
        np.asarray(truth.image, np.float32),
        job.pixels,
        depths,
        tuple(curve(f, "sorted", *at, **job.how) for at in zip(job.pixels, depths, strict=True)),
    )


def empty_row(job: Job) -> Row:
    """A row that knows its technique and nothing else."""
    row = Row(dict.fromkeys((*BEFORE_METRICS, *job.metrics, *AFTER_METRICS)))
    row.update(scene=job.scene, device=job.device, technique=job.label, note="")
    row["bits_per_pixel"] = job.technique.bits_per_pixel
    return row


def _timed(f: Fragments, job: Job) -> tuple[Array, list[float]]:
    how: dict[str, Any] = {"background": job.background, "device": job.device, **job.how}
    # The first call pays for pages of memory that the others find warm.
    image = composite(f, job.technique, **how)
    seconds = []
    for _ in range(job.repeat):
        start = time.perf_counter()
        composite(f, job.technique, **how)
        seconds.append(time.perf_counter() - start)
    return image, seconds


def _image_errors(
    image: Array, truth: Exact, names: tuple[str, ...], threads: int | None, notes: list[str]
) -> dict[str, float | None]:
    errors: dict[str, float | None] = dict.fromkeys(names)
    if names and min(image.shape[:2]) < metrics.LEAST_SIDE:
        size = f"{image.shape[0]} x {image.shape[1]} (height x width)"
        notes.append(f"no errors of the image: {size} is below {metrics.LEAST_SIDE} pixels a side")
        return errors
    try:
        errors.update(truth.reference.errors(image, names, threads=threads))
    except Exception as error:
        notes.append(f"no errors of the image: {told(error)}")
    return errors


def _renormalised(truth: Exact, job: Job, row: Row) -> list[str]:
    """What comes of a technique's colours if they are renormalised, where they are not and that
    changes the first error that is 0 for equal images by half as much again, or more."""
    other = job.technique.renormalised
    name = next((one for one in job.metrics if one in LESS_IS_BETTER and row[one]), None)
    if other is None or name is None:
        return []
    try:
        how: dict[str, Any] = {"background": job.background, "device": job.device, **job.how}
        image = composite(truth.f, other, **how)
        found = truth.reference.errors(image, [name], threads=job.threads)[name]
    except Exception as error:
        return [f"with normalize=True: {told(error)}"]
    much = max(found, row[name]) >= MUCH * min(found, row[name])
    return [f"with normalize=True {name} {number(found)}"] if much else []


def _transmittance_errors(truth: Exact, job: Job, notes: list[str]) -> dict[str, float | None]:
    names = ("T_mae", "T_p99", "T_max", "T_alpha")
    if not len(truth.f):
        notes.append("no T errors: no fragments")
        return dict.fromkeys(names)
    try:
        held = transmittance(truth.f, job.technique, device=job.device, **job.how)
        off = np.maximum(np.maximum(held - truth.most, truth.least - held), 0)
        weight = truth.f.alpha.astype(np.float64)
        weighted = float(off @ weight) / max(float(weight.sum()), 1e-300)
        values = (float(off.mean()), float(np.percentile(off, 99)), float(off.max()), weighted)
    except Exception as error:
        notes.append(f"no T errors: {told(error)}")
        return dict.fromkeys(names)
    return dict(zip(names, values, strict=True))


def _curves(f: Fragments, job: Job) -> tuple[Array, ...] | None:
    if not job.technique.has_curve:
        return None
    try:
        return tuple(
            curve(f, job.technique, pixel, curve_depths(f, pixel), job.device, **job.how)
            for pixel in job.pixels
        )
    except Exception:
        return None  # the row has told what failed


def curve(
    f: Fragments, t: Technique | str, pixel: Pixel, depth: Array, device: str = "cpu", **how: Any
) -> Array:
    """(K,) float64: the transmittance of one pixel (y, x) at the (K,) depths."""
    y, x = pixel
    held = transmittance(f[y, x], t, depth, device=device, **how)
    return np.asarray(held, np.float64).reshape(len(depth))


def curve_depths(f: Fragments, pixel: Pixel) -> Array:
    """(K,) increasing depths that show a pixel's curve: evenly spaced from a little before its
    nearest to a little behind its farthest fragment, and on both sides of each fragment."""
    y, x = pixel
    depth = np.unique(f[y, x].depth)
    if not len(depth):
        return np.linspace(*f.depth_range, 2, dtype=f.dtype)
    near, far = float(depth[0]), float(depth[-1])
    margin = 0.06 * (far - near) or 0.02 * (f.depth_range[1] - f.depth_range[0]) or 0.05 * abs(far)
    begin = max(near - margin, 0.5 * near) if near > 0 else near - margin
    even = np.linspace(begin, far + margin, SAMPLES).astype(f.dtype)
    steps = depth[:: -(-len(depth) // MOST_STEPS)]
    return np.unique(np.concatenate([even, steps, np.nextafter(steps, np.inf, dtype=f.dtype)]))


def telling_pixels(f: Fragments) -> tuple[Pixel, ...]:
    """Up to three pixels (y, x) with the most, many and the usual number of fragments that are
    neither opaque nor behind an opaque one."""
    counts = _seen_through(f)
    layered = np.flatnonzero(counts >= min(2, counts.max(initial=1)))
    if not len(layered):
        return ()
    order = layered[np.argsort(counts[layered], kind="stable")]
    found = []
    for share in (1.0, 0.8, 0.4):
        count = counts[order[round(share * (len(order) - 1))]]
        same = np.flatnonzero(counts == count)
        found.append(int(same[len(same) // 2]))  # the middle one: rarely at the image's border
    width = f.shape[1]
    return tuple((pixel // width, pixel % width) for pixel in dict.fromkeys(found))


def _seen_through(f: Fragments) -> Array:
    """(P,) how many fragments there are in front of each pixel's nearest opaque one."""
    pixels = len(f.counts)
    pixel = np.repeat(np.arange(pixels), f.counts)
    wall = np.full(pixels, np.inf)
    opaque = f.alpha == 1
    if f.transmission is not None:
        opaque &= ~f.transmission.any(axis=1)
    np.minimum.at(wall, pixel[opaque], f.depth[opaque])
    seen = (f.alpha > 0) & ~opaque & (f.depth <= wall[pixel])
    return np.bincount(pixel[seen], minlength=pixels)
