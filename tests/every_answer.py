"""Fingerprints of what moit answers, one a line, to hold one version of the tree to another.

    python tests/every_answer.py > before.txt
    python tests/every_answer.py --compare before.txt

The second prints the lines that differ and exits with 1. PYTHONPATH says which tree is asked.
Only public names are used, so that one text serves trees that are arranged differently.
"""

import argparse
import sys
from collections.abc import Iterator

import numpy as np
from digests import digest, fragments, tinted
from variants import EVERY, WITH_CURVE

import moit

DTYPES = ("float32", "float64")
SMALL = (40, 24)
FORMULAS = ("panes", "mixed", "hair", "spheres")
DRAWN = ("sorted", "power4", "power6", moit.WeightedBlended(), moit.FourierOpacity(15))
LIGHTS = [((0.3, -1.0, -0.4), (0.9, 0.8, 0.7)), ((-1.0, -0.2, 0.1), (0.1, 0.2, 0.3))]


def scenes(dtype: str) -> dict[str, moit.Fragments]:
    """Hard rays, opaque surfaces and empty pixels; the same tinted; scenes of formulas."""
    hard = fragments(dtype)
    drawn = {name: moit.scenes.load(name, SMALL) for name in FORMULAS}
    return {"hard": hard, "tinted": tinted(hard), **drawn}


def answers(f: moit.Fragments, technique, dtype: str) -> Iterator[tuple[str, object]]:
    """What each question gives, by its name."""
    behind = (0.1, 0.2, 0.3)
    yield "composite", moit.composite(f, technique, background=behind, dtype=dtype)
    yield "transmittance", moit.transmittance(f, technique, dtype=dtype)
    yield "total", moit.total_transmittance(f, technique, dtype=dtype)
    yield "bounds", moit.bounds(f, technique, dtype=dtype)
    yield "uncut", moit.composite(f, technique, dtype=dtype, cull_opaque=False)
    if technique in WITH_CURVE:
        low, high = f.depth_range
        depth = np.linspace(low, high, 5)
        yield "curve", moit.transmittance(f, technique, depth=depth, dtype=dtype)
        yield "curve bounds", moit.bounds(f, technique, depth=depth, dtype=dtype)
    for raw in (False, True):
        try:
            state = moit.moments.gather(f, technique, raw, dtype=dtype)
        except TypeError:  # it stores no moments
            return
        pairs = state if isinstance(state[0], tuple) else (state,)
        yield f"gather raw={raw}", tuple(array for pair in pairs for array in pair)


def of_questions() -> Iterator[tuple[str, object]]:
    for dtype in DTYPES:
        for scene, f in scenes(dtype).items():
            for technique in EVERY:
                if f.transmission is not None and not technique.supports_transmission:
                    continue
                for question, found in answers(f, technique, dtype):
                    yield f"{scene} | {technique} | {question} | {dtype}", found


def of_triangles(device: str) -> Iterator[tuple[str, object]]:
    for name in moit.scenes.names():
        try:
            scene = moit.scenes.meshes(name)
        except ValueError:  # a scene of formulas
            continue
        f = moit.rasterize(scene.meshes, scene.camera, SMALL, lights=LIGHTS, device=device)
        yield f"{name} | rasterize | {device}", (f.offsets, f.depth, f.alpha, f.color)
        for technique in DRAWN:
            image = moit.render(name, technique, SMALL, device=device)
            yield f"{name} | render {technique} | {device}", image


def of_shadows() -> Iterator[tuple[str, object]]:
    scene = moit.scenes.meshes("spheres-mesh")
    points = np.random.default_rng(1).uniform(-1.5, 1.5, (200, 3))
    for technique in moit.techniques():
        try:
            shadows = moit.ShadowMap(scene.meshes, technique, light=scene.camera, resolution=32)
        except (TypeError, ValueError):  # not for shadows
            continue
        yield f"shadow map | {technique}", shadows.transmittance(points)


def of_metrics() -> Iterator[tuple[str, object]]:
    f = moit.scenes.load("mixed", SMALL)
    pair = (moit.composite(f, "power4")[..., :3], moit.composite(f, "sorted")[..., :3])
    for name in moit.metrics.NAMES:
        yield f"metric | {name}", np.float64(getattr(moit.metrics, name)(*pair))
        yield f"metric | {name} map", getattr(moit.metrics, f"{name}_map")(*pair)


def of_arrays_on_the_gpu() -> Iterator[tuple[str, object]]:
    f = moit.scenes.load("mixed", SMALL)
    for technique in moit.techniques():
        try:
            yield f"mixed | {technique} | gpu", moit.composite(f, technique, device="gpu")
        except (moit.GpuError, TypeError, ValueError) as error:
            yield f"mixed | {technique} | gpu", np.frombuffer(type(error).__name__.encode(), "u1")


def lines() -> Iterator[str]:
    parts = [of_questions(), of_triangles("cpu"), of_shadows(), of_metrics()]
    try:
        moit.gpu.Device().close()
        parts += [of_arrays_on_the_gpu(), of_triangles("gpu")]
    except moit.GpuError as error:
        print(f"without a GPU: {error}", file=sys.stderr)
    for part in parts:
        for name, found in part:
            yield f"{digest(found)}  {name}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--compare", metavar="FILE", help="what this printed for another tree")
    file = parser.parse_args().compare
    if file is None:
        for line in lines():
            print(line, flush=True)
        return 0
    with open(file) as kept:
        before = {name: bits for bits, name in (one.rstrip("\n").split("  ", 1) for one in kept)}
    now = {name: bits for bits, name in (one.split("  ", 1) for one in lines())}
    differing = [name for name in {**before, **now} if before.get(name) != now.get(name)]
    for name in differing:
        print(f"{before.get(name, 'absent'):16} -> {now.get(name, 'absent'):16}  {name}")
    print(f"{len(now)} answers, {len(differing)} differ", file=sys.stderr)
    return bool(differing)


if __name__ == "__main__":
    sys.exit(main())
