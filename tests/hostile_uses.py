"""Kits, deep verbs, derivatives and trainings, asked for what nobody asks for on purpose.

Each function takes a number, which is a seed, and says in words what was broken: an error that is
not moit's own, a text that no compiler takes, an answer that is not finite or not the one that
another way gives. `python -m tests.fuzz --target kits` (deep, gradients, trainings) tries many.
"""

import dataclasses
import functools
import importlib.util
import json
import math
import re
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import hostile
import hostile_scenes
import numpy as np
from readings.compilers import refused_by_glslang
from variants import EVERY

import moit
from moit.kit.including import LANGUAGES
from moit.kit.recipes import names_with_kits

Rng = np.random.Generator
Array = np.ndarray
# A training that went astray raises FloatingPointError.
OWN = (moit.MoitError, ValueError, TypeError, MemoryError, FloatingPointError)
NUMBERS = (0.0, 1e-45, 1e-38, 1e-7, 0.1, 1.0, 1.0000001, 100.0, 1e6, 1e30, 3e38, 1e39, 1e300)
FRAGMENTS = (0, 1, 2, 5, 17)
EMPTY = "#version 450\nvoid main() {}\n"  # of one file alone glslang says no name


def _told(asked: Callable[[Rng], Iterator[str]], seed: list[int]) -> list[str]:
    """What is broken; nothing where it is refused."""
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            return list(asked(np.random.default_rng(seed)))
    except OWN:
        return []
    except Exception as error:
        return [f"{error!r} is not moit's own"]


def _technique(rng: Rng) -> moit.Technique:
    maker = int(rng.integers(2 * len(hostile.MAKERS)))
    return hostile.MAKERS[maker](rng) if maker < len(hostile.MAKERS) else rng.choice(EVERY)


def _fragments(rng: Rng, most: int = 60) -> moit.Fragments:
    """Pixels in a few rows."""
    size = int(rng.integers(1, 5)), int(rng.integers(1, most // 4))
    counts = rng.integers(0, rng.choice(FRAGMENTS) + 1, size[0] * size[1])
    f = hostile.fragments_of(rng, rng.choice([np.float32, np.float64]), counts)
    return moit.Fragments(
        f.offsets,
        f.depth,
        f.alpha,
        f.color,
        transmission=f.transmission,
        shape=size,
        depth_range=f.depth_range,
    )


# ---- Kits ----------------------------------------------------------------------------------------


def _kits(rng: Rng) -> Iterator[str]:
    named = moit.technique(str(rng.choice(names_with_kits())))
    one = named if rng.random() < 0.3 else _technique(rng)
    language = str(rng.choice([*LANGUAGES, "glsl"]))
    span: Any = None
    if rng.random() < 0.7:
        signs = rng.choice([1, -1], 2) if rng.random() < 0.2 else 1
        span = tuple(rng.choice(NUMBERS, 2) * signs)
        span = tuple(sorted(span)) if rng.random() < 0.9 else span
    with tempfile.TemporaryDirectory() as folder:
        first, second = (Path(folder) / name for name in ("first", "second"))
        files = [Path(path) for path in moit.export(one, first, language, depth_range=span)]
        again = [Path(path) for path in moit.export(one, second, language, depth_range=span)]
        if [path.read_bytes() for path in files] != [path.read_bytes() for path in again]:
            yield f"{one} in {language}, {span}: the second export is another"
        table = json.loads((first / "targets.json").read_text(encoding="utf-8"))
        text = (first / table["include"]).read_text(encoding="utf-8")
    code = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)
    told = f"{one} in {language}, {span}"
    if wrong := re.findall(r"(?<![\w.])-?(?:nan|inf|infinity)(?![\w(])", code, re.IGNORECASE):
        yield f"{told}: {wrong[:3]} in its text"
    for number in re.findall(r"(?<![\w.])\d+\.?\d*(?:[eE][+-]?\d+)(?=[fF]?\b)", code):
        if float(number) > 3.5e38:
            yield f"{told}: no float is {number}"
    if any(code.count(pair[0]) != code.count(pair[1]) for pair in ("()", "{}", "[]")):
        yield f"{told}: brackets that do not close"
    if language == "glsl":
        whole = f"#version 450\n{text}\nvoid main() {{}}\n"
        yield from (
            f"{told}: {words}" for words in refused_by_glslang({whole: "frag", EMPTY: "frag"})
        )


# ---- Deep files ----------------------------------------------------------------------------------


def _flat(path: Path) -> Array:
    moit.deep.flatten(path, path.with_suffix(".flat.exr"))
    return moit.read_image(path.with_suffix(".flat.exr")).astype(float)


def _deep(rng: Rng) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        a, b, out = (Path(folder) / f"{name}.exr" for name in ("a", "b", "out"))
        f = hostile.with_more(_fragments(rng), rng)
        moit.write_deep(a, f)
        moit.write_deep(b, hostile.with_more(_fragments(rng), rng))
        whole = _flat(a)
        height, width = whole.shape[:2]
        light = max(1.0, float(np.abs(whole).max(initial=0)))
        if not np.isfinite(whole).all():
            yield "flatten: not finite"
        if not ((whole[..., 3] >= 0) & (whole[..., 3] <= 1 + 1e-6)).all():
            yield f"flatten: covers {whole[..., 3].max()}"

        def same(name: str, most: float) -> Iterator[str]:
            found = _flat(out)
            if found.shape != whole.shape or not np.abs(found - whole).max(initial=0) <= most:
                yield f"{name}: flattened it is another picture"

        verb = rng.integers(6)
        if verb == 0:
            moit.deep.merge([a], out)
            yield from same("merge", 1e-5 * light)
            moit.deep.merge([a, b], out)
            if not np.isfinite(_flat(out)).all():
                yield "merge: not finite"
        elif verb == 1:
            moit.deep.crop(a, out, (height, width), (0, 0))
            yield from same("crop", 0.0)
        elif verb == 2:
            error = float(rng.choice([1e-6, 1e-3, 1 / 255, 0.1]))
            depth_error = float(rng.choice([0.0, 0.0, 1e-3, 1.0]))
            told = moit.deep.simplify(a, out, error, depth_error=depth_error)
            if not told.transmittance_error <= error:
                yield f"simplify: {told}, of {error} asked"
            yield from same("simplify", 1.01 * error * light + 1e-5 * light)
        elif verb == 3:
            moit.deep.holdout(a, b, out)
            if not np.isfinite(_flat(out)).all():
                yield "holdout: not finite"
        elif verb == 4:
            picture = Path(folder) / "picture.exr"
            moit.write_image(picture, whole.astype(np.float32))
            moit.deep.recolor(a, picture, out, half=False)
            found = _flat(out)
            seen = whole[..., 3] > (
                1e-4 if f.transmission is None else 2
            )  # a channel may have none
            away = np.abs(found - whole)[seen].max(initial=0)
            if not away <= 1e-3 * light:
                yield f"recolor: its own picture comes back {away:.2g} away"
        else:
            name = str(rng.choice(["power4", "power8", "trig3", "power6(warp='linear')"]))
            moit.deep.to_moments(a, out, name)
            T = moit.deep.read_moments(out).transmittance(rng.uniform(0, 20, 3))
            if not ((T >= 0) & (T <= 1)).all():
                yield f"to_moments: {name} lets {T.min()} to {T.max()} through"
            camera = moit.Camera(eye=tuple(rng.normal(0, 4, 3)))
            moit.deep.to_points(a, out.with_suffix(".ply"), camera)


# ---- Derivatives ---------------------------------------------------------------------------------


def _finite(name: str, found: Any) -> Iterator[str]:
    for key in getattr(found, "__dataclass_fields__", ()):
        numbers = getattr(found, key)
        if numbers is not None and not np.isfinite(numbers).all():
            yield f"{name}: by {key} not finite"


def _gradients(rng: Rng) -> Iterator[str]:
    if rng.random() < 0.3:
        yield from _of_splats(rng)
        return
    f, one = _fragments(rng), _technique(rng)
    how = {"threads": 1, "cull_opaque": bool(rng.integers(2))}
    for ask in ("composite", "transmittance", "total_transmittance"):
        answer, pullback = getattr(moit.gradients, ask)(f, one, **how)
        if answer.tobytes() != getattr(moit, ask)(f, one, **how).tobytes():
            yield f"{one}: {ask} is another one"
        seed = rng.normal(0, 1, answer.shape).astype(answer.dtype)
        yield from _finite(f"{one}: {ask}", pullback(seed))


def _of_splats(rng: Rng) -> Iterator[str]:
    splats = hostile_scenes.splats(rng)
    camera = moit.Camera(eye=tuple(rng.normal(0, 4, 3)))
    one = str(rng.choice(hostile_scenes.TECHNIQUES))
    image, pullback = moit.gradients.render(splats, camera, (17, 13), one)
    if not np.isfinite(image).all():
        yield f"splats, {one}: a picture that is not finite"
    if image.tobytes() != moit.render(splats, one, (17, 13), camera=camera).tobytes():
        yield f"splats, {one}: not the picture of moit.render"
    yield from _finite(f"splats, {one}", pullback(np.ones_like(image)))


# ---- The same by JAX and PyTorch, where there are such -------------------------------------------

Found = tuple[Array, dict[str, Array]]  # an answer, and derivatives by what was given


def _by_jax(ask: str, given: dict[str, Array], seed: Array, how: dict[str, Any]) -> Found:
    import jax

    from moit import jax as door

    jax.config.update("jax_enable_x64", True)
    call = functools.partial(getattr(door, ask), **how)
    held = {name: jax.numpy.asarray(one) for name, one in given.items()}
    call(**held)  # untraced: what does not fit is said here
    answer, pull = jax.vjp(lambda held: call(**held), held)
    (found,) = pull(jax.numpy.asarray(seed.reshape(answer.shape)))
    return np.asarray(answer), {name: np.asarray(one) for name, one in found.items()}


def _by_torch(ask: str, given: dict[str, Array], seed: Array, how: dict[str, Any]) -> Found:
    import torch

    from moit import torch as door

    held = {name: torch.tensor(one, requires_grad=True) for name, one in given.items()}
    how = {k: torch.tensor(one) if isinstance(one, Array) else one for k, one in how.items()}
    answer = getattr(door, ask)(**held, **how)
    seeds = torch.tensor(seed.reshape(tuple(answer.shape)))
    found = torch.autograd.grad(answer, [*held.values()], seeds, allow_unused=True)
    pairs = zip(held, found, strict=True)
    return answer.detach().numpy(), {name: one.numpy() for name, one in pairs if one is not None}


DOORS = {
    name: door
    for name, door in (("jax", _by_jax), ("torch", _by_torch))
    if importlib.util.find_spec(name)
}


def _are_same(found: Array, expected: Array) -> bool:
    """But for signs of zeros, and for what is below normal numbers, which JAX makes zeros."""
    tiny = np.finfo(found.dtype).tiny
    both = [np.where(np.abs(one) < tiny, 0, one) for one in (found, expected.reshape(found.shape))]
    return found.dtype == expected.dtype and np.array_equal(*both, equal_nan=True)


def _doors(rng: Rng) -> Iterator[str]:
    """A framework's answers and derivatives are those of moit.gradients."""
    if not DOORS:
        return
    name = str(rng.choice([*DOORS]))
    if rng.random() < 0.4:
        yield from _splats_by(name, rng)
        return
    f, one = _fragments(rng), _technique(rng)
    f = moit.Fragments(
        *(f.offsets, f.depth, f.alpha, f.color),
        transmission=f.transmission,
        depth_range=f.depth_range,
    )
    counts = np.diff(f.offsets)
    layout: dict[str, Any] = [
        {"offsets": f.offsets},
        {"packed_info": np.stack([f.offsets[:-1], counts], axis=1)},
        {"ray_indices": np.repeat(np.arange(len(counts)), counts), "n_rays": len(counts)},
    ][rng.integers(3)]
    how = {"technique": one, "depth_range": f.depth_range, "threads": 1, **layout}
    ask = str(rng.choice(["composite", "transmittance", "total_transmittance"]))
    expected, pullback = getattr(moit.gradients, ask)(f, one, threads=1)
    seed = rng.normal(0, 1, expected.shape).astype(expected.dtype)
    by = pullback(seed)
    names = ("depth", "alpha", "color", "transmission")
    given = {key: getattr(f, key) for key in names if getattr(f, key) is not None}
    told = f"{name}, {one}, {sorted(layout)}: {ask}"
    answer, found = DOORS[name](ask, given, seed, how)
    if not _are_same(answer, expected):
        yield f"{told} is another one"
    for key, numbers in found.items():
        if getattr(by, key) is not None and not _are_same(numbers, getattr(by, key)):
            yield f"{told}: by {key} another one"


def _splats_by(name: str, rng: Rng) -> Iterator[str]:
    splats = hostile_scenes.splats(rng)
    camera = moit.Camera(eye=tuple(rng.normal(0, 4, 3)))
    one = str(rng.choice(hostile_scenes.TECHNIQUES))
    keys = ("means", "scales", "rotations", "opacities")
    given = {key: np.array(getattr(splats, key), np.float32) for key in keys}
    given["sh"] = rng.normal(0, 1, (len(splats.means), int(rng.choice([1, 4])), 3))
    given["sh"] = given["sh"].astype(np.float32)
    same = moit.Splats(*(given[key] for key in keys), sh=given["sh"])
    image, pullback = moit.gradients.render(same, camera, (17, 13), one, threads=1)
    how = {"camera": camera, "size": (17, 13), "technique": one, "threads": 1}
    seed = rng.normal(0, 1, image.shape).astype(image.dtype)
    answer, found = DOORS[name]("render", given, seed, how)
    by = pullback(seed)
    if not _are_same(answer, image):
        yield f"{name}: splats, {one}: another picture"
    for key in keys:
        if not np.isfinite(found[key]).all():
            yield f"{name}: splats, {one}: by {key} not finite"
        if key != "rotations" and not _are_same(found[key], getattr(by, key)):
            yield f"{name}: splats, {one}: by {key} another one"


# ---- Trainings -----------------------------------------------------------------------------------


def _trainings(rng: Rng) -> Iterator[str]:
    name = str(rng.choice(["neural-bounded", "neural-bounded6", "neural", "dfa", "neural-slices"]))
    data = [_fragments(rng, 120) for _ in range(rng.integers(1, 3))]
    options = {
        "fragments": int(rng.choice([1, 50, 2000])),
        "epochs": int(rng.integers(1, 4)),
        "batch": int(rng.choice([1, 64, 10**9])),
        "rate": float(rng.choice([1e-300, 1e-3, 0.1, 1e3, 1e30, math.inf])),
        "loss": str(rng.choice(["transmittance", "visible", "color", "picture"])),
        "seed": int(rng.choice([0, 1, 2**31 - 1, 2**31])),
    }
    if options["batch"] == 1:
        options["fragments"] = min(50, options["fragments"])
    network = moit.train(name, data, progress=False, **options)
    if not np.isfinite(network.packed()).all():
        yield f"{name}, {options}: weights that are not finite"
    image = moit.composite(data[0], dataclasses.replace(moit.technique(name), network=network))
    if not np.isfinite(image).all():
        yield f"{name}, {options}: a picture that is not finite"


def tried_kit(number: int) -> list[str]:
    return _told(_kits, [31, number])


def tried_deep(number: int) -> list[str]:
    return _told(_deep, [32, number])


def tried_gradients(number: int) -> list[str]:
    return _told(_gradients, [33, number])


def tried_doors(number: int) -> list[str]:
    return _told(_doors, [35, number])


def tried_training(number: int) -> list[str]:
    return _told(_trainings, [34, number])
