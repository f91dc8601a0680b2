"""Fingerprints of everything moit answers, to compare runs by their bits.

Run as a program it prints them as JSON, for a process with another instruction set, or for the same
program at another commit: `python tests/digests.py BEFORE.json` prints what differs from that.
`--few` asks about a quarter of the fragments, in twice the pixels: threads share these by the
thousand, and it takes half the time.
"""

import hashlib
import json
import os
import sys

import numpy as np
from oracle.hard_rays import flat, hard_rays
from variants import EVERY, WITH_CURVE

import moit
from moit import _core, gradients
from moit.catalog import MomentTechnique


def fragments(dtype: str, few: bool) -> moit.Fragments:
    """Several tiles of pixels: hard rays, opaque fragments, ties, empty pixels.

    few : more pixels, of which fewer hold any.
    """
    offsets, depth, alpha = flat(hard_rays(seed=3, of_each_kind=2 if few else 8))
    rng = np.random.default_rng(4)
    pixels, filled = (4200, 0.1) if few else (2000, 0.8)
    counts = rng.integers(0, 40, pixels) * (rng.random(pixels) < filled)
    many = int(counts.sum())
    depth = np.concatenate([depth, rng.choice(np.linspace(-1, 1, 201), many)])
    alpha = np.concatenate([alpha, rng.choice([0, 0.2, 0.5, 0.999, 1], many)])
    depth = np.exp(3 * depth).astype(dtype)
    return moit.Fragments(
        np.concatenate([offsets, offsets[-1] + np.cumsum(counts)]),
        depth,
        alpha,
        rng.uniform(0, 2, (len(depth), 3)),
        depth_range=(depth.min(), depth.max()),
        dtype=dtype,
    )


def tinted(f: moit.Fragments) -> moit.Fragments:
    """`f` with coloured transmission, a fifth of it none."""
    rng = np.random.default_rng(5)
    passed = rng.random((len(f), 3)) * (rng.random((len(f), 1)) < 0.8)
    arrays = (f.offsets, f.depth, f.alpha, f.color)
    return moit.Fragments(*arrays, transmission=passed, dtype=f.dtype)


def digest(arrays) -> str:
    found = hashlib.sha256()
    for array in arrays if isinstance(arrays, tuple) else (arrays,):
        found.update(np.ascontiguousarray(array).tobytes())
    return found.hexdigest()[:16]


def parts_of(found: gradients.Gradients) -> tuple[np.ndarray, ...]:
    parts = found.depth, found.alpha, found.color, found.background, found.transmission
    return tuple(one for one in parts if one is not None)


def digests(dtype: str, threads: int, few: bool) -> dict[str, str]:
    """A fingerprint by question and technique."""
    f = fragments(dtype, few)
    tints = tinted(f)
    depth = np.geomspace(0.05, 20, 9)
    found = {}
    for technique in EVERY:
        answers = {
            "composite": moit.composite(f, technique, threads=threads, background=(0.1, 0.2, 0.3)),
            "transmittance": moit.transmittance(f, technique, threads=threads),
            "bounds": moit.bounds(f, technique, threads=threads),
            "total": moit.total_transmittance(f, technique, threads=threads),
        }
        if technique.supports_transmission:
            answers["tinted composite"] = moit.composite(tints, technique, threads=threads)
            answers["tinted total"] = moit.total_transmittance(tints, technique, threads=threads)
        if technique in WITH_CURVE:
            answers["curve"] = moit.transmittance(f, technique, depth=depth, threads=threads)
            answers["curve bounds"] = moit.bounds(f, technique, depth=depth, threads=threads)
        if isinstance(technique, MomentTechnique):
            state = moit.moments.gather(f, technique)
            two_passes = getattr(technique, "passes", 1) == 2
            z = np.linspace(*technique.unit_range, 11, dtype=dtype)
            z = np.tile(z, (len(f.counts), 1))
            answers["gather"] = (*state[0], *state[1]) if two_passes else state
            answers["moments"] = moit.moments.transmittance(technique, *state, z)
            answers["moment bounds"] = moit.moments.bounds(technique, *state, z)
        if technique.has_gradient and not _core.gradient_refusal(technique.fields_for(f)):
            image = answers["composite"]
            _, pullback = gradients.composite(f, technique, threads=threads)
            answers["pullback"] = parts_of(pullback(image))
        if "pullback" in answers and technique.supports_transmission:
            _, pullback = gradients.composite(tints, technique, threads=threads)
            answers["tinted pullback"] = parts_of(pullback(image))
        for question, arrays in answers.items():
            found[f"{question} {technique} {dtype}"] = digest(arrays)
    return found


def picture_digests() -> dict[str, str]:
    """Fingerprints of triangles: fragments, pictures, shadow maps; and of errors of images."""
    found, size = {}, (96, 54)
    for name in ("foliage", "spheres-mesh", "cloud-with-disk"):
        scene = moit.scenes.meshes(name)
        f = moit.rasterize(scene.meshes, scene.camera, size)
        found[f"rasterize {name}"] = digest((f.offsets, f.depth, f.alpha, f.color))
        for technique in ("sorted", "wboit", "power6", "mlab4"):
            found[f"render {name} {technique}"] = digest(moit.render(name, technique, size))
        small = moit.render(name, "wboit", size, resolution=2, upsampling="depth-aware")
        found[f"small {name}"] = digest(small)
        for technique in ("power4", "fourier7", "sorted"):
            shadows = moit.ShadowMap(name, technique, light=(0.3, -1.0, 0.2), resolution=64)
            points = scene.meshes[0].vertices[::7]
            found[f"shadows {name} {technique}"] = digest(shadows.transmittance(points))
    scene = moit.scenes.splats("pot-splats", 2000)
    for convention in ("3dgs", "exact"):
        splats = scene.splats.seen_by(convention)
        image, pullback = gradients.render(splats, scene.camera, size, "power4")
        by = pullback(image)
        parts = by.means, by.scales, by.rotations, by.opacities, by.sh
        found[f"pullback to splats {convention}"] = digest((image, *parts))
    f = moit.scenes.load("mixed", (160, 90))
    images = [moit.composite(f, t)[..., :3] for t in ("sorted", "wboit", "per-pixel")]
    found["per-pixel mixed"] = digest(images[2])
    for name in moit.metrics.NAMES:
        value = getattr(moit.metrics, name)(images[1], images[0])
        found[f"{name} mixed"] = digest(np.float64(value))
    return found


def compared(path: str, found: dict[str, str]) -> int:
    """Prints what differs from a file that this program has written; how many there are."""
    with open(path, encoding="utf-8") as file:
        before = json.load(file)["digests"]
    names = [name for name in {**before, **found} if before.get(name) != found.get(name)]
    for name in names:
        print(f"{name}: {before.get(name, 'missing')} before, {found.get(name, 'missing')} now")
    print(f"{len(names)} of {len(found)} answers differ")
    return len(names)


if __name__ == "__main__":
    threads = int(os.environ.get("MOIT_THREADS", "2"))
    few = sys.argv[1:] == ["--few"]
    both = {**digests("float32", threads, few), **digests("float64", threads, few)}
    if sys.argv[1:] and not few:
        sys.exit(compared(sys.argv[1], {**both, **picture_digests()}) > 0)
    json.dump({"info": str(moit.info()), "digests": {**both, **picture_digests()}}, sys.stdout)
