"""GLSL's reading of the kernels, run on llvmpipe: techniques by their own passes, as moit.gpu runs
them, and kernels that no technique has for itself by those in passes/.
"""

from pathlib import Path
from typing import Any

import numpy as np
from gpu import software_device

import moit
from moit.gpu import bindings
from moit.gpu import questions as arrays

PASSES = Path(__file__).parent / "passes"


# ---- Techniques ----------------------------------------------------------------------------------


class _Pixels:
    """A technique's passes over the pixels of some fragments, to be run one by one."""

    def __init__(self, f: moit.Fragments, technique: Any) -> None:
        fields = technique.fields_for(f)
        device = software_device()
        question = arrays.Question(device, f, technique, fields, cull_opaque=False, threads=1)
        self.dtype, self.passes = question.dtype, question.passes
        [self.chunk] = question._chunks()

    def run(self, *stages: int) -> None:
        """Those that make state, all of them unless some are named."""
        for stage in self.passes.stages:
            if not stages or stage.number in stages:
                threads, buffers = self.chunk.pixels, {}
                if stage.number >= bindings.FRAGMENTS:
                    threads, buffers = self.chunk.fragments, {bindings.ASKED: self.chunk._rays}
                self.chunk._run(stage.number, stage.double, threads, {}, buffers)

    def read(self, binding: int, numbers: int) -> np.ndarray:
        found = np.empty((self.chunk.pixels, numbers), self.dtype)
        self.chunk.buffers[binding].read(found)
        return found

    def curve(self, z: np.ndarray) -> np.ndarray:
        """Of what state there is, at depths z (P, K)."""
        given = {"depths_asked": z.shape[1], "asked_of_pixel": 1}
        asked = self.chunk._buffer(np.ascontiguousarray(z, np.float64))
        return self.chunk._ask(bindings.CURVE, asked, z.size, 1, given).reshape(z.shape)


def _with_state(technique: Any, state: np.ndarray) -> _Pixels:
    """Pixels whose fragments are gone, and their state (P, n) made up."""
    nothing = np.empty(0, state.dtype)
    offsets = np.zeros(len(state) + 1, int)
    given = {"depth_range": technique.unit_range, "dtype": state.dtype}
    f = moit.Fragments(offsets, nothing, nothing, **given)
    pixels = _Pixels(f, technique)
    assert technique.warp == "none" and state.shape[1] == pixels.passes.state
    pixels.chunk.buffers[bindings.STATE].write(np.ascontiguousarray(state))
    return pixels


def state_of(f: moit.Fragments, technique: Any) -> np.ndarray:
    """(P, n) numbers that fragments leave in pixels, as the technique's shader lays them out."""
    with software_device():
        pixels = _Pixels(f, technique)
        pixels.run()
        return pixels.read(bindings.STATE, pixels.passes.state)


def curves(f: moit.Fragments, technique: Any, z: np.ndarray) -> np.ndarray:
    """What reaches depths z (P, K), each pixel's own."""
    with software_device():
        pixels = _Pixels(f, technique)
        pixels.run()
        return pixels.curve(z)


def factors_of(technique: Any, state: np.ndarray) -> np.ndarray:
    """(P, n) numbers that fragments read, of a state (P, n)."""
    with software_device():
        pixels = _with_state(technique, state)
        pixels.run(bindings.FACTOR)
        return pixels.read(bindings.FACTORS, pixels.passes.factors)


def curves_of_state(technique: Any, state: np.ndarray, z: np.ndarray) -> np.ndarray:
    """What reaches warped depths z (P, K), by a state (P, n)."""
    with software_device():
        pixels = _with_state(technique, state)
        pixels.run(bindings.FACTOR, bindings.RATIO_PASS)
        return pixels.curve(z)


# ---- Kernels by themselves -----------------------------------------------------------------------


def program(name: str, **defines: str | float) -> Any:
    return software_device().program(PASSES / f"{name}.comp.glsl", **defines)


def _run(
    name: str,
    defines: dict[str, str | float],
    given: list[np.ndarray],
    answer: np.ndarray,
    **uniforms: Any,
) -> np.ndarray:
    """Binds what is given and the answer in this order, with a thread for each of `count`."""
    with software_device() as device:
        compiled = program(name, **defines)
        held = [np.ascontiguousarray(array) for array in given]
        buffers = [device.buffer(array.nbytes, array) for array in held]
        buffers.append(device.buffer(answer.nbytes))
        groups = -(-uniforms["count"] // bindings.GROUP), 1, 1
        device.dispatch(compiled, groups, buffers=dict(enumerate(buffers)), uniforms=uniforms)
        buffers[-1].read(answer)
    return answer


def _double(array: np.ndarray) -> int:
    return int(array.dtype.itemsize == 8)


def elementary(function: str, x: np.ndarray) -> np.ndarray:
    defines = {"DOUBLE": _double(x), "FUNCTION": function}
    return _run("elementary", defines, [x], np.empty_like(x), count=x.size)


def blend_weights(kind: int, fragments: np.ndarray) -> np.ndarray:
    """fragments : (n, 4), the struct of the pass."""
    answer = np.empty(len(fragments), fragments.dtype)
    defines = {"DOUBLE": _double(fragments), "WEIGHT": kind}
    return _run("blend_weights", defines, [fragments], answer, count=len(fragments))


def surface_points(asked: np.ndarray) -> np.ndarray:
    """(n, 3) z, attribute and light for (n, 19), the struct of the pass."""
    answer = np.empty((len(asked), 3), asked.dtype)
    return _run("surface", {"DOUBLE": _double(asked)}, [asked], answer, count=len(asked))


def upsampling_shares(asked: np.ndarray) -> np.ndarray:
    """(n, 8) shares, bilinear and depth-aware, for (n, 7) of the pass."""
    answer = np.empty((len(asked), 8), asked.dtype)
    return _run("upsampling", {"DOUBLE": _double(asked)}, [asked], answer, count=len(asked))


def power_bounds(
    rules: np.ndarray,
    b: np.ndarray,
    ray_of: np.ndarray,
    z: np.ndarray,
    blur: float,
    slack: float,
) -> np.ndarray:
    """(n, 2) shares in front of z that are proven: at least, at most."""
    defines = {"DOUBLE": 1, "NODES": b.shape[1] // 2}
    given = [rules, b, ray_of.astype(np.uint32), z]
    answer = np.empty((z.size, 2))
    return _run("power_bounds", defines, given, answer, count=z.size, blur=blur, slack=slack)
