"""What the passes of techniques take on a device, apart from what goes there and back."""

from __future__ import annotations

import dataclasses
import statistics
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from moit import scenes
from moit.catalog import Technique, listed
from moit.fragments.fragments import Fragments
from moit.gpu.bindings import COMPOSITE
from moit.gpu.passes import has_engine_text
from moit.gpu.questions import Question
from moit.rendering.rasterizing import rasterize
from moit.rendering.render import render
from moit.system.environment import machine
from moit.system.progress import Progress, steps

if TYPE_CHECKING:
    from moit.gpu.device import Device

# Those of MBOIT's table 1, and what one compares with them.
TECHNIQUES = (
    "unsorted",
    "wboit",
    "weighted-average",
    "adaptive4",
    "mlab2",
    "mlab4",
    "power4-16",
    "power4",
    "power6-16",
    "power6",
    "power8-16",
    "power8",
    "trig2",
    "trig3-16",
    "trig3",
    "trig4-16",
    "trig4",
    "moment-transparency",
    "two-moments-pass",
    "fourier7",
    "sorted",
)

SCENES = ("teapots", "ship-like")
SECOND = ("opaque", "shade", "resolve", "composite")  # what is no part of the first pass


@dataclasses.dataclass(frozen=True)
class Times:
    """Median milliseconds of a technique's passes.

    first : what makes the state of pixels: capture, factors.
    second : what shades and composites.
    rate : billions of fragments a second of the second.
    exact : whether passes computed with the core's kernels, where there is a text for engines.
    """

    technique: str
    bits: float | None
    first: float
    second: float
    rate: float
    exact: bool = False

    @property
    def all(self) -> float:
        return self.first + self.second


def fragments_for(count: int, layers: int = 16, seed: int = 0) -> Fragments:
    """`count` random fragments, `layers` a pixel, in float32."""
    random = np.random.default_rng(seed)
    pixels = max(1, count // layers)
    n = pixels * layers
    return Fragments(
        np.arange(pixels + 1) * layers,
        random.uniform(1, 100, n).astype(np.float32),
        random.uniform(0.05, 0.6, n).astype(np.float32),
        random.random((n, 3), np.float32),
    )


def array_times(
    device: Device,
    f: Fragments,
    techniques: Iterable[Technique | str] = TECHNIQUES,
    repeat: int = 5,
    progress: Progress = True,
    exact: bool = False,
) -> list[Times]:
    """The compute passes of `composite` over arrays of fragments.

    Medians of `repeat` runs after one that is not counted. On hardware timer queries count, on
    software renderers the time until the renderer is done. exact : as `moit.composite`.
    """
    chosen = listed(techniques)
    found = []
    with steps(progress, len(chosen), "passes") as done:
        for one in chosen:
            found.append(_times(device, f, one, repeat, exact))
            done(str(one))
    return found


def raster_times(
    device: Device,
    scene: str,
    size: tuple[int, int],
    techniques: Iterable[Technique | str] = TECHNIQUES,
    repeat: int = 5,
    progress: Progress = True,
    exact: bool = False,
) -> list[Times]:
    """The passes of `moit.render` over a scene of triangles, into RGBA16F; medians as above.

    The first pass is all until shading, and the opaque pass is left out; where fragments are listed
    and replayed, compositing them is the second.
    """
    chosen = listed(techniques)
    meshes = scenes.meshes(scene)
    with device:
        fragments = len(rasterize(meshes.meshes, meshes.camera, size, device=device))
    found = []
    with steps(progress, len(chosen), scene) as done:
        for one in chosen:
            runs = [
                render(meshes, one, size, device=device, exact=exact, report=True).timings
                for _ in range(repeat + 1)
            ][1:]
            firsts = [
                sum(seconds for name, seconds in run.items() if name not in SECOND) for run in runs
            ]
            seconds = [sum(run.get(name, 0.0) for name in SECOND[1:]) for run in runs]
            found.append(_median_times(one, firsts, seconds, fragments, exact))
            done(str(one))
    return found


def _times(device: Device, f: Fragments, one: Technique, repeat: int, exact: bool) -> Times:
    fields = one.fields_for(f)
    question = Question(device, f, one, fields, cull_opaque=True, threads=1, exact=exact)
    runs = [question.pass_times() for _ in range(repeat + 1)][1:]
    firsts = [sum(spent for number, spent in run if number != COMPOSITE) for run in runs]
    seconds = [sum(spent for number, spent in run if number == COMPOSITE) for run in runs]
    return _median_times(one, firsts, seconds, len(f), exact)


def _median_times(
    one: Technique, firsts: list[float], seconds: list[float], fragments: int, exact: bool
) -> Times:
    first, second = statistics.median(firsts), statistics.median(seconds)
    rate = fragments / max(second, 1e-12) / 1e9
    return Times(str(one), one.bits_per_pixel, first * 1e3, second * 1e3, rate, exact)


def table(times: list[Times]) -> str:
    """Markdown: a row a technique, with what it takes beyond unsorted alpha blending."""
    base = next((one.all for one in times if one.technique == "unsorted"), 0.0)
    lines = [
        "| technique | bits a pixel | pass 1 | pass 2 | beyond unsorted | pass 2, G fragments/s |",
        "|---|---|---|---|---|---|",
    ]
    for one in times:
        bits = "grows" if one.bits is None else f"{one.bits:g}"
        name = f"`{one.technique}`" + ", exact" * one.exact
        lines.append(
            f"| {name} | {bits} | {one.first:.3g} ms | {one.second:.3g} ms "
            f"| {one.all - base:+.3g} ms | {one.rate:.3g} |"
        )
    return "\n".join(lines)


def report(
    device: Device,
    techniques: Iterable[Technique | str] = TECHNIQUES,
    counts: Iterable[int] = (10_000_000, 20_000_000),
    size: tuple[int, int] = (1920, 1080),
    repeat: int = 5,
) -> str:
    """Markdown that names the device: a table for each scene of triangles, drawn, and for each of
    `counts` fragments, computed.

    Raises ValueError where there is nothing to time.
    """
    if repeat < 1 or any(count < 1 for count in counts):
        raise ValueError("repeat and fragments: expected at least 1")
    chosen = listed(techniques)
    twice = [one for one in chosen if has_engine_text(one)]
    info = device.info
    clock = "the renderer's clock" if device.software else "timer queries"
    parts = [
        f"# Passes on {info['renderer']}",
        f"{info['vendor']}, OpenGL {info['version']}; {machine()}. Medians of {repeat} runs by "
        f"{clock}. Pass 1 makes what a technique keeps of a pixel, pass 2 shades and composites. "
        "Techniques that have a text for engines are there twice: by that, and exact, as the CPU "
        "computes them.",
    ]

    def both(times_of: Callable[..., list[Times]], *over: Any) -> str:
        times = times_of(device, *over, chosen, repeat)
        if twice:
            times += times_of(device, *over, twice, repeat, exact=True)
        return table(times)

    for scene in SCENES:
        parts += [
            f"## `{scene}` at {size[0]} x {size[1]}, drawn",
            both(raster_times, scene, size),
        ]
    for count in counts:
        f = fragments_for(count)
        parts += [
            f"## Arrays of {len(f):,} fragments, 16 a pixel, by compute passes",
            both(array_times, f),
        ]
    return "\n\n".join(parts) + "\n"
