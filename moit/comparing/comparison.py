"""compare: every technique on every scene, each held against the exact answer."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from typing import Any

from numpy.typing import ArrayLike

from moit.catalog import Technique, listed, technique
from moit.checks.arguments import nearest, truth, whole
from moit.comparing.cells import Cell, results
from moit.comparing.measurement import Job, describe, measure, telling_pixels
from moit.comparing.report import Report
from moit.comparing.results_folder import ResultsFolder, fingerprint
from moit.comparing.rows import Result, Scene
from moit.core.questions import background_for, in_range
from moit.engines import gpu_of
from moit.fragments.fragments import Fragments
from moit.gpu_costs.predicting import on_gpu
from moit.inputs import as_fragments, choices
from moit.metrics import NAMES
from moit.system.environment import machine, thread_count
from moit.system.progress import Progress, preparing, steps

Source = Fragments | str | os.PathLike[str]


def compare(
    f: Source | Iterable[Source] | Mapping[str, Source],
    techniques: Technique | str | Iterable[Technique | str] | None = None,
    *,
    devices: str | Iterable[str] = ("cpu",),
    reference: Technique | str = "sorted",
    metrics: str | Iterable[str] | None = None,
    repeat: int = 5,
    background: ArrayLike = (0.0, 0.0, 0.0),
    threads: int | None = None,
    depth_range: tuple[float, float] | None = None,
    cull_opaque: bool = True,
    executor: Executor | None = None,
    progress: Progress = True,
    out: str | os.PathLike[str] | None = None,
    part: int | str | None = None,
    layer: str | None = None,
    gpu: str | None = None,
    resolution: tuple[int, int] | None = None,
) -> Report:
    """Times techniques on fragments and measures how far they are from the exact answer.

    f : Fragments, a path or a scene's name; several of them; or {name: one of them}.
    techniques : techniques or their names; None: `moit.techniques()`.
    devices : "cpu" and "gpu". The GPU's times are those of whole calls, with what goes to the
        device and back; `moit bench --gpu` times its passes.
    reference : the technique whose image, composited in float64, the others are held against.
    metrics : which of mse, rmse, mae, psnr, ssim, flip, hdr_flip; None: all.
    repeat : how many composites are timed, after one that is not; an executor that measures
        several cells at once makes times longer.
    background : (3,) or (height, width, 3) linear radiance behind all of them.
    threads : at least 1; None: MOIT_THREADS, or as many as this process has processors.
    depth_range : (near, far), which all inputs get; None: each has its own.
    cull_opaque : as `composite`.
    executor : a concurrent.futures.Executor (of threads, of processes, dask's) to measure in;
        None: one cell after another, here.
    progress : True, False, or a callable (done, total, label).
    out : a folder that gets each result as soon as it is there. Called again with the same
        folder, what it holds for the same question is not measured again.
    part, layer : of each deep EXR that is given by path, as `composite`.
    gpu, resolution : as `Report.on_gpu`: what frames are predicted to take on a GPU that need not
        be here; None: nothing is predicted.

    Transmittance is held against that of `sorted` in float64, in front of each fragment. A
    technique that fails has its row all the same, with the error as its note.

    Raises ValueError and TypeError for bad arguments, GpuError where a device is missing, and
    whatever reading an input raises.

    >>> f = moit.scenes.load("panes", (8, 6))
    >>> report = moit.compare(f, ["sorted", "wboit"], metrics="mse", repeat=1, progress=False)
    >>> [row.technique for row in report.rows]
    ['sorted', 'wboit']
    """
    scenes = named_scenes(f)
    chosen = _labelled(listed(techniques))
    exact_one = technique(reference)
    on = _checked_devices(devices)
    wanted = _checked_metrics(metrics)
    times = whole("repeat", repeat, 1)
    thread_count(threads)
    culls = truth("cull_opaque", cull_opaque)
    if executor is not None and not hasattr(executor, "submit"):
        raise TypeError(
            f"executor: expected a concurrent.futures.Executor, got {type(executor).__name__}"
        )
    if gpu is not None:
        on_gpu(gpu, resolution)  # at once, where it is not known
    elif resolution is not None:
        raise ValueError("resolution: expected with gpu alone, whose frames it is of")
    folder = None if out is None else ResultsFolder(out)

    cells: list[Cell] = []
    chosen_of = choices(scenes.values(), part, layer)
    with preparing(progress, "compare") as reading:
        for (name, source), choice in zip(scenes.items(), chosen_of, strict=True):
            reading.now(f"reads {name}")
            called = "f" if len(scenes) == 1 else f"f[{name!r}]"
            fragments = in_range(as_fragments(source, called, **choice), depth_range)
            # Another process reads a file or a scene itself: that is less than sending it.
            sent = (
                fragments if executor is None or isinstance(source, Fragments) else _found(source)
            )
            common: dict[str, Any] = {
                "scene": name,
                "token": secrets.token_hex(8),
                "source": sent,
                "choice": {} if isinstance(sent, Fragments) else choice,
                "reference": exact_one,
                "metrics": wanted,
                "repeat": times,
                "pixels": telling_pixels(fragments),
                "background": _background(background, fragments),
                "threads": threads,
                "depth_range": None if depth_range is None else fragments.depth_range,
                "cull_opaque": culls,
            }
            mark = "" if folder is None else fingerprint(fragments)
            about = Job(technique=exact_one, label="reference", device="cpu", **common)
            cells.append(Cell(describe, about, mark))
            for device in on:
                for label, one in chosen.items():
                    job = Job(technique=one, label=label, device=device, **common)
                    cells.append(Cell(measure, job, mark))

    found: dict[int, Scene | Result] = {}
    with steps(progress, len(cells), "compare") as done:

        def begins(cell: Cell) -> None:
            done.now(f"{cell.job.scene} {cell.job.label}")

        for index, result in results(cells, executor, folder, begins):
            found[index] = result
            done(f"{cells[index].job.scene} {cells[index].job.label}")
    ordered = [found[index] for index in range(len(cells))]
    report = Report(
        [result for result in ordered if isinstance(result, Result)],
        {scene.name: scene for scene in ordered if isinstance(scene, Scene)},
        wanted,
        str(exact_one),
        machine(threads),
    )
    return report if gpu is None else report.on_gpu(gpu, resolution)


def named_scenes(f: Source | Iterable[Source] | Mapping[str, Source]) -> dict[str, Source]:
    """What `compare` was given, each under a name of its own: the key, the file's or the
    scene's name, or "fragments"."""
    if isinstance(f, Mapping):
        for name in f:
            if not isinstance(name, str):
                raise TypeError(f"f: expected names as str, got {type(name).__name__}")
        scenes = dict(f)
    elif isinstance(f, (Fragments, str, os.PathLike)):
        scenes = {_name(f): f}
    elif isinstance(f, Iterable):
        scenes = _with_names([(_name(one), one) for one in f])
    else:
        raise TypeError(
            "f: expected Fragments, a path or the name of a scene, several of them or a dict "
            f"of them; got {type(f).__name__}"
        )
    if not scenes:
        raise ValueError("f: expected at least one scene, got none")
    return scenes


def _name(source: object) -> str:
    if isinstance(source, os.PathLike) or (isinstance(source, str) and os.path.isfile(source)):
        return os.path.splitext(os.path.basename(os.fspath(source)))[0]
    return source if isinstance(source, str) else "fragments"


def _with_names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The pairs as a dict; a name that is taken gets a number."""
    named: dict[str, Any] = {}
    for name, one in pairs:
        number, free = 1, name
        while free in named:
            number += 1
            free = f"{name} ({number})"
        named[free] = one
    return named


def _found(source: str | os.PathLike[str]) -> str:
    return os.path.abspath(source) if os.path.isfile(source) else os.fspath(source)


def _labelled(techniques: list[Technique]) -> dict[str, Technique]:
    return _with_names([(str(one), one) for one in techniques])


def _names(argument: str, given: str | Iterable[str]) -> list[str]:
    """One name or several, each once."""
    if not isinstance(given, Iterable):
        raise TypeError(f"{argument}: expected names as str, got {type(given).__name__}")
    found = [given] if isinstance(given, str) else list(given)
    for name in found:
        if not isinstance(name, str):
            raise TypeError(f"{argument}: expected names as str, got {type(name).__name__}")
    return list(dict.fromkeys(found))


def _checked_devices(devices: str | Iterable[str]) -> list[str]:
    found = _names("devices", devices)
    for device in found:
        if device not in ("cpu", "gpu"):
            raise ValueError(f"devices: expected 'cpu' or 'gpu', got {device!r}")
        gpu_of(device)  # at once, where there is none
    if not found:
        raise ValueError("devices: expected at least one, got none")
    return found


def _checked_metrics(metrics: str | Iterable[str] | None) -> tuple[str, ...]:
    if metrics is None:
        return NAMES
    found = tuple(_names("metrics", metrics))
    for name in found:
        if name not in NAMES:
            raise ValueError(f"metrics: unknown {name!r:.80}{nearest(name, list(NAMES))}")
    return found


def _background(background: ArrayLike, f: Fragments) -> Any:
    behind = background_for(background, f)
    return tuple(behind.tolist()) if behind.ndim == 1 else behind
