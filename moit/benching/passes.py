"""What the passes of techniques take on a device, apart from what goes there and back."""

from __future__ import annotations

import dataclasses
import statistics
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from moit import scenes
from moit.catalog import Technique, listed
from moit.fragments.fragments import Fragments
from moit.gpu.bindings import COMPOSITE
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
    """

    technique: str
    bits: float | None
    first: float
    second: float
    rate: float

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
) -> list[Times]:
    """The compute passes of `composite` over arrays of fragments.

    Medians of `repeat` runs after one that is not counted. On hardware timer queries count, on
    software renderers the time until the renderer is done.
    """
    chosen = listed(techniques)
    found = []
    with steps(progress, len(chosen), "passes") as done:
        for one in chosen:
            found.append(_times(device, f, one, repeat))
            done(str(one))
    return found


def raster_times(
    device: Device,
    scene: str,
    size: tuple[int, int],
    techniques: Iterable[Technique | str] = TECHNIQUES,
    repeat: int = 5,
    progress: Progress = True,
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
                render(meshes, one, size, device=device, report=True).timings
                for _ in range(repeat + 1)
            ][1:]
            firsts = [
                sum(seconds for name, seconds in run.items() if name not in SECOND) for run in runs
            ]
            seconds = [sum(run.get(name, 0.0) for name in SECOND[1:]) for run in runs]
            found.append(_median_times(one, firsts, seconds, fragments))
            done(str(one))
    return found


def _times(device: Device, f: Fragments, one: Technique, repeat: int) -> Times:
    question = Question(device, f, one, one.fields_for(f), cull_opaque=True, threads=1)
    runs = [question.pass_times() for _ in range(repeat + 1)][1:]
    firsts = [sum(spent for number, spent in run if number != COMPOSITE) for run in runs]
    seconds = [sum(spent for number, spent in run if number == COMPOSITE) for run in runs]
    return _median_times(one, firsts, seconds, len(f))


def _median_times(
    one: Technique, firsts: list[float], seconds: list[float], fragments: int
) -> Times:
    first, second = statistics.median(firsts), statistics.median(seconds)
    rate = fragments / max(second, 1e-12) / 1e9
    return Times(str(one), one.bits_per_pixel, first * 1e3, second * 1e3, rate)


def table(times: list[Times]) -> str:
    """Markdown: a row a technique, with what it takes beyond unsorted alpha blending."""
    base = next((one.all for one in times if one.technique == "unsorted"), 0.0)
    lines = [
        "| technique | bits a pixel | pass 1 | pass 2 | beyond unsorted | pass 2, G fragments/s |",
        "|---|---|---|---|---|---|",
    ]
    for one in times:
        bits = "grows" if one.bits is None else f"{one.bits:g}"
        lines.append(
            f"| `{one.technique}` | {bits} | {one.first:.3g} ms | {one.second:.3g} ms "
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
    info = device.info
    clock = "the renderer's clock" if device.software else "timer queries"
    parts = [
        f"# Passes on {info['renderer']}",
        f"{info['vendor']}, OpenGL {info['version']}; {machine()}. Medians of {repeat} runs by "
        f"{clock}. Pass 1 makes what a technique keeps of a pixel, pass 2 shades and composites.",
    ]
    for scene in SCENES:
        parts += [
            f"## `{scene}` at {size[0]} x {size[1]}, drawn",
            table(raster_times(device, scene, size, chosen, repeat)),
        ]
    for count in counts:
        f = fragments_for(count)
        parts += [
            f"## Arrays of {len(f):,} fragments, 16 a pixel, by compute passes",
            table(array_times(device, f, chosen, repeat)),
        ]
    return "\n\n".join(parts) + "\n"
