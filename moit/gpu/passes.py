"""The techniques as passes over arrays of fragments: which shader, and what it is given.

A technique's shader (shaders/techniques/, one a file) has its passes under `#if PASS`; what all of
them share is in shaders/arrays/.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from moit.catalog import Slices, Technique
from moit.checks.exceptions import GpuError
from moit.fragments.fragments import Fragments
from moit.gpu import moment_passes, slice_passes
from moit.gpu.bindings import (
    ADD_TO_CELLS,
    BLEND_TAIL,
    CAPTURE,
    COVER,
    EQUAL_WEIGHTS,
    FACTOR,
    FORM_AVERAGE,
    FORM_BLENDED,
    FORM_SUM,
    KEEP,
    KEY,
    MIX,
    NOTHING_KEPT,
    RANK,
    WEIGHT_BLOG,
)
from moit.gpu.block_passes import in_blocks
from moit.gpu.described import (
    CAPTURED,
    CAPTURED_AND_FACTORED,
    Constants,
    Passes,
    Stage,
    passes_for,
)

# Files that have passes of their own, beside those below.
FILES = (moment_passes, slice_passes)


def kinds() -> tuple[str, ...]:
    """The kinds of techniques that have passes."""
    return passes_for.kinds


def passes_of(technique: Technique, constants: Constants) -> Passes:
    """Raises GpuError where there are none."""
    make = passes_for.get(technique.kind)
    if make is None:
        raise GpuError(
            f"technique: {technique} has no passes for device='gpu'; use device='cpu', or one of "
            f"{', '.join(kinds())}"
        )
    passes = in_blocks(make(constants), constants)
    if technique.block_side > 1 and not passes.block_stages:
        raise GpuError(
            f"technique: {technique} has no passes that make states of blocks of pixels; use "
            "device='cpu', or resolution=1"
        )
    sizes = {
        "STATE_SIZE": passes.state,
        "FACTORS_SIZE": passes.factors,
        "DOUBLES_SIZE": passes.doubles,
        "INDICES_SIZE": passes.indices,
    }

    defines = {
        "ABSORBED": 0,
        "OF_BLOCKS": 0,
        **passes.defines,
        **{name: f"{size}u" for name, size in sizes.items()},
    }
    return dataclasses.replace(passes, defines=defines)


def has_passes(technique: Technique) -> bool:
    """Whether it has passes of its own, with its options."""
    if technique.engine != "core" or technique.kind not in passes_for:
        return False
    return not (
        isinstance(technique, Slices) and technique.inside and technique.depth_range == "pixel"
    )


def has_engine_text(technique: Technique) -> bool:
    """Whether a device reads it by a text for engines unless exact passes are asked for."""
    if not has_passes(technique):
        return False
    empty = np.zeros(0, np.float32)
    none = Fragments([0, 0], empty, empty, np.zeros((0, 3), np.float32), depth_range=(1.0, 2.0))
    constants = Constants.of(technique.fields_for(none), False, none.depth_range, exact=False)
    return passes_of(technique, constants).engine


@passes_for("dfa")
def _deep_fragments(c: Constants) -> Passes:
    return Passes(
        "dfa.glsl",
        state=18,
        factors=3,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE), Stage(BLEND_TAIL), Stage(MIX)),
        network=c.fields["network"],
    )


@passes_for("fourier")
def _fourier_opacity(c: Constants) -> Passes:
    count = c.fields["count"]
    return Passes(
        "fourier_opacity.glsl",
        {"HARMONICS": count // 2, "BITS": c.fields["bits"]},
        state=count,
        factors=count,
        stages=CAPTURED_AND_FACTORED,
        block_weights=[1.0, *([0.0] * (count - 1))],
        normalize=c.fields["normalize"],
        absorbs=True,
        coloured="curve",
    )


@passes_for("transmittance-function-map")
def _transmittance_function_map(c: Constants) -> Passes:
    count = c.fields["count"]
    in_blocks = c.fields["resolution"] > 1
    return Passes(
        "transmittance_function_map.glsl",
        {"COSINES": count, "BITS": c.fields["bits"]},
        state=count + in_blocks,
        factors=(count + 1) * in_blocks,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE)),
        block_weights=[*([0.0] * count), 1.0],
        iterations=3 * count + 16,
        normalize=c.fields["normalize"],
        coloured="curve",
    )


@passes_for("sorted")
def _sorted(c: Constants) -> Passes:
    return Passes(
        "sorted.glsl",
        state_of_fragment=1,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE)),
        asks="from",
    )


@passes_for("unsorted")
def _unsorted(c: Constants) -> Passes:
    return Passes("unsorted.glsl")


# weighted.glsl has all defines in each FORM.
def _weighted(form: int, c: Constants, stages: tuple[Stage, ...], **defines: int) -> Passes:
    near, far = c.span
    return Passes(
        "weighted.glsl",
        {"FORM": form, "WEIGHT": WEIGHT_BLOG, "BITS": 32, **defines},
        doubles=1,
        stages=stages,
        uniforms={
            "depth_scale": c.fields.get("depth_scale", 1.0),
            "depth_near": near,
            "buffer_scale": far / (far - near) if near < far else 0.0,
        },
        coloured="totals",
    )


@passes_for("weighted-sum")
def _weighted_sum(c: Constants) -> Passes:
    if c.fields["normalize"]:
        return _weighted(FORM_BLENDED, c, CAPTURED, WEIGHT=EQUAL_WEIGHTS)
    return _weighted(FORM_SUM, c, CAPTURED_AND_FACTORED)


@passes_for("weighted-average")
def _weighted_average(c: Constants) -> Passes:
    return _weighted(FORM_AVERAGE, c, CAPTURED_AND_FACTORED)


@passes_for("wboit")
def _weighted_blended(c: Constants) -> Passes:
    own = {"WEIGHT": c.fields["weight"], "BITS": c.fields["bits"]}
    return _weighted(FORM_BLENDED, c, CAPTURED, **own)


def _merging(c: Constants) -> dict[str, str | int]:
    return {name.upper(): int(c.fields[name]) for name in ("quantized", "by_energy")}


@passes_for("adaptive")
def _adaptive(c: Constants) -> Passes:
    nodes = c.fields["count"]
    return Passes(
        "adaptive.glsl",
        {"STEPS": nodes, **_merging(c)},
        state=2 * nodes,
        iterations=(6 if c.fields["by_energy"] else 3) * nodes + 16,
        normalize=c.fields["normalize"],
        exceeds=True,
        coloured="totals",
    )


@passes_for("mlab")
def _mlab(c: Constants) -> Passes:
    layers, buckets = c.fields["count"], c.fields["buckets"]
    least = {"least": "min_alpha"}
    if buckets:
        least |= {"front_least": "front_alpha", "back_least": "back_alpha"}
    alphas = {name: c.fields[option] for name, option in least.items()}
    return Passes(
        "mlab.glsl",
        {"STEPS": layers, "BUCKETS": int(buckets), **_merging(c)},
        state=5 * layers,
        factors=2 * layers,
        stages=(Stage(CAPTURE), Stage(FACTOR)),
        iterations=(6 if c.fields["by_energy"] else 2) * layers + 16,
        uniforms={name: x if c.double else _at_least(x) for name, x in alphas.items()},
    )


@passes_for("depth-peeling")
def _depth_peeling(c: Constants) -> Passes:
    return Passes(
        "depth_peeling.glsl",
        {"LAYERS": c.fields["count"], "EXACT": int(c.fields["normalize"])},
        normalize=c.fields["normalize"],
        iterations=c.fields["count"] + 16,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE)),
        asks="from",
    )


@passes_for("hybrid")
def _hybrid(c: Constants) -> Passes:
    exact, least = int(c.fields["normalize"]), c.fields["core_alpha"]
    defines: dict[str, str | int] = {"LAYERS": c.fields["count"], "EXACT": exact}
    if least > 0:  # as arrays hold it
        defines["CORE_ALPHA"] = repr(least if c.double else float(np.float32(least)))
    return Passes(
        "hybrid.glsl",
        defines,
        iterations=(1 + exact) * c.fields["count"] + 16,
        factors=1,
        doubles=3,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE), Stage(FACTOR, double=True)),
    )


@passes_for("kbuffer")
def _kbuffer(c: Constants) -> Passes:
    return Passes(
        "kbuffer.glsl",
        {"LAYERS": c.fields["count"]},
        state_of_fragment=1,
        indices=1,
        stages=CAPTURED_AND_FACTORED,
        iterations=c.fields["count"] + 16,
    )


@passes_for("deep-shadow")
def _deep_shadow(c: Constants) -> Passes:
    return Passes(
        "deep_shadow.glsl",
        state=6,
        state_of_fragment=6,
        doubles=1,
        indices=1,
        stages=(Stage(RANK), Stage(CAPTURE, double=True)),
        iterations=32,
        uniforms={"tolerance": c.fields["tolerance"]},
        double=True,
        asks="exact",
        normalize=c.fields["normalize"],
        coloured="curve",
    )


@passes_for("wavelet")
def _wavelet(c: Constants) -> Passes:
    coefficients = c.fields["count"]
    return Passes(
        "wavelet.glsl",
        {
            "LEVELS": coefficients.bit_length() - 1,
            "DENSITY": int(c.fields["density"]),
            "BITS": c.fields["bits"],
        },
        state=coefficients,
        factors=coefficients,
        stages=CAPTURED_AND_FACTORED,
        block_weights=_of_last_cell(coefficients, c.fields["density"]),
        iterations=2 * coefficients + 8,
        normalize=c.fields["normalize"],
        absorbs=True,
        coloured="curve",
    )


def _of_last_cell(coefficients: int, density: bool) -> list[float]:
    """The mean over the last cell; of densities the scaling coefficient is the total."""
    weights = [1.0, *([0.0] * (coefficients - 1))]
    wavelets, height = 1, 1.0
    while not density and wavelets < coefficients:
        weights[2 * wavelets - 1] = height
        wavelets, height = 2 * wavelets, height * math.sqrt(2)
    return weights


SAMPLED = (Stage(KEY), Stage(COVER), Stage(CAPTURE))


@passes_for("stochastic")
def _stochastic(c: Constants) -> Passes:
    samples = c.fields["count"]
    return Passes(
        "stochastic.glsl",
        {"SAMPLES": samples, "STRATIFIED": int(c.fields["stratified"]), "HASHED_ALPHA": 0},
        state=samples,
        indices=3,
        stages=SAMPLED,
        iterations=samples + 16,
        uniforms={"seed": c.fields["seed"]},
        asks="from",
        normalize=c.fields["normalize"],
        coloured="curve",
    )


@passes_for("hashed-alpha")
def _hashed_alpha(c: Constants) -> Passes:
    return Passes(
        "stochastic.glsl",
        {"SAMPLES": 1, "STRATIFIED": 0, "HASHED_ALPHA": 1},
        state=1,
        indices=3,
        stages=SAMPLED,
        uniforms={"seed": c.fields["seed"]},
        asks="from",
    )


@passes_for("anchors")
def _anchors(c: Constants) -> Passes:
    kept, cells, large = c.fields["count"], c.fields["cells"], c.fields["large_keys"]
    return Passes(
        "anchors.glsl",
        {"ANCHORS": kept, "CELLS": cells, "LARGE_KEYS": int(large)},
        factors=2 + 3 * kept + cells,
        indices=2 + (2 + large) * kept + cells,
        stages=(
            Stage(NOTHING_KEPT),
            *(() if large else (Stage(KEEP),)),
            Stage(ADD_TO_CELLS),
            Stage(CAPTURE),
            Stage(FACTOR, double=True),
        ),
        iterations=4 * kept + 3 * cells + 16,
        uniforms={"importance_decay": c.fields["gamma"], "shrink": 1.0 - c.max_alpha},
        normalize=c.fields["normalize"],
        coloured="curve",
    )


def _at_least(x: float) -> float:
    """The least float that is not below x."""
    near = np.float32(x)  # which NumPy would compare with x in float32
    return float(near if float(near) >= x else np.nextafter(near, np.float32(np.inf)))
