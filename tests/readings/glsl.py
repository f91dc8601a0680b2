"""GLSL's reading of the kernels: the passes of moit.shaders, run on llvmpipe.

llvmpipe divides and takes roots exactly, so its bits can be C's. GPUs do not.
"""

from functools import cache
from typing import Any

import numpy as np
import pytest

from moit import shaders

GROUP = 64  # threads in a work group of every pass
# libEGL.so.1 finds every function of GL by itself; so no package but that and a driver is needed.
LIBRARIES = {"libegl": "libEGL.so.1", "libgl": "libEGL.so.1"}


@cache
def context() -> Any:
    """A moderngl context on llvmpipe; skips, with the reason, where there is none."""
    moderngl = pytest.importorskip("moderngl", reason="no moderngl, so no GL context")
    found = []
    for device in range(8):
        try:
            gl = moderngl.create_context(
                standalone=True, backend="egl", device_index=device, **LIBRARIES
            )
        except Exception as error:  # moderngl has no narrower one
            found.append(str(error))
            break
        if "llvmpipe" in gl.info["GL_RENDERER"] and gl.version_code >= 450:
            return gl
        found.append(gl.info["GL_RENDERER"])
        gl.release()
    pytest.skip(f"no llvmpipe with OpenGL 4.5 through EGL: {'; '.join(found)}")


@cache
def shader(name: str, **defines: str | float) -> Any:
    """A compiled pass; fails with the compiler's words about our lines."""
    gl = context()
    text = shaders.source(f"passes/{name}.comp.glsl", **defines)
    try:
        return gl.compute_shader(text)
    except Exception as error:
        raise AssertionError(shaders.explain(str(error), text)) from None


def _run(
    compiled: Any, arrays: list[np.ndarray], answer: np.ndarray, **uniforms: Any
) -> np.ndarray:
    """Binds arrays and the answer in this order, with a thread for each of `count`."""
    gl = context()
    for key, value in uniforms.items():
        compiled[key] = value
    buffers = [gl.buffer(np.ascontiguousarray(array).tobytes()) for array in arrays]
    buffers.append(gl.buffer(reserve=answer.nbytes))
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    compiled.run(-(-uniforms["count"] // GROUP))
    gl.finish()
    assert gl.error == "GL_NO_ERROR"
    got = np.frombuffer(buffers[-1].read(), answer.dtype).reshape(answer.shape)
    for buffer in buffers:
        buffer.release()
    return got


def _double(array: np.ndarray) -> int:
    return int(array.dtype.itemsize == 8)


def elementary(function: str, x: np.ndarray) -> np.ndarray:
    compiled = shader("elementary", DOUBLE=_double(x), FUNCTION=function)
    return _run(compiled, [x], np.empty_like(x), count=x.size)


def blend_weights(kind: int, fragments: np.ndarray) -> np.ndarray:
    """fragments : (n, 4), the struct of the pass."""
    compiled = shader("blend_weights", DOUBLE=_double(fragments), WEIGHT=kind)
    return _run(compiled, [fragments], np.empty_like(fragments[:, 0]), count=len(fragments))


def surface_points(asked: np.ndarray) -> np.ndarray:
    """(n, 3) z, attribute and light for (n, 19), the struct of the pass."""
    compiled = shader("surface", DOUBLE=_double(asked))
    answer = np.empty((len(asked), 3), asked.dtype)
    return _run(compiled, [asked], answer, count=len(asked))


def power_rules(
    b: np.ndarray, bias: float, safe: tuple[float, ...], least: float, stored: Any = np.float64
) -> np.ndarray:
    """(P, 3 nodes + 1) rules in dtype `stored`, of moments b (P, 2 nodes), which become float64."""
    nodes = b.shape[1] // 2
    word = {4: "float", 8: "double"}[np.dtype(stored).itemsize]
    compiled = shader("power_rules", DOUBLE=1, NODES=nodes, STORED=word)
    rules = np.empty((len(b), 3 * nodes + 1), stored)
    moments = b.astype(np.float64)
    return _run(compiled, [moments], rules, count=len(b), bias=bias, safe=safe, least=least)


def power_transmittance(
    rules: np.ndarray,
    b0: np.ndarray,
    ray_of: np.ndarray,
    z: np.ndarray,
    own: np.ndarray,
    beta: float,
) -> np.ndarray:
    compiled = shader("power_transmittance", DOUBLE=_double(z), NODES=rules.shape[1] // 3)
    arrays = [rules, b0, ray_of.astype(np.uint32), z, own]
    return _run(compiled, arrays, np.empty_like(z), count=z.size, beta=beta)


def trigonometric_rules(
    b: np.ndarray, zone: tuple[float, ...], bias: float, least: float, stored: Any = np.float64
) -> np.ndarray:
    """(P, 5 nodes + 3) rules in dtype `stored`, of complex moments b (P, nodes)."""
    nodes = b.shape[1]
    word = {4: "float", 8: "double"}[np.dtype(stored).itemsize]
    compiled = shader("trigonometric_rules", DOUBLE=1, NODES=nodes, STORED=word)
    rules = np.empty((len(b), 5 * nodes + 3), stored)
    given = {"bias": bias, "turns": zone[0], "edge": zone[1], "least": least}
    return _run(compiled, [b.astype(np.complex128)], rules, count=len(b), **given)


def trigonometric_transmittance(
    rules: np.ndarray,
    zone: tuple[float, ...],
    b0: np.ndarray,
    ray_of: np.ndarray,
    z: np.ndarray,
    own: np.ndarray,
    beta: float,
) -> np.ndarray:
    nodes = rules.shape[1] // 5
    compiled = shader("trigonometric_transmittance", DOUBLE=_double(z), NODES=nodes)
    arrays = [rules, b0, ray_of.astype(np.uint32), z, own]
    given = dict(zip(("turns", "edge", "scale"), zone, strict=True))
    return _run(compiled, arrays, np.empty_like(z), count=z.size, beta=beta, **given)


def power_bounds(
    rules: np.ndarray,
    b: np.ndarray,
    ray_of: np.ndarray,
    z: np.ndarray,
    blur: float,
    slack: float,
) -> np.ndarray:
    """(n, 2) shares in front of z that are proven: at least, at most."""
    compiled = shader("power_bounds", DOUBLE=1, NODES=b.shape[1] // 2)
    arrays = [rules, b, ray_of.astype(np.uint32), z]
    answer = np.empty((z.size, 2))
    return _run(compiled, arrays, answer, count=z.size, blur=blur, slack=slack)


def moment_words(
    offsets: np.ndarray,
    absorbance: np.ndarray,
    z: np.ndarray,
    words: int,
    half: bool,
    scale: float | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """(P, words) words and (P,) b0 that fragments leave, in the fragments' dtype; of powers of
    depth, or of points of the unit circle at angles scale (z + 1)."""
    circle = int(scale is not None)
    options = {"NODES": words // 2, "CIRCLE": circle, "B0_IS_HALF": int(half)}
    compiled = shader("moment_words", DOUBLE=_double(z), **options)
    answer = np.empty((len(offsets) - 1, words + 1), z.dtype)
    arrays = [offsets.astype(np.uint32), absorbance, z]
    uniforms = {"scale": scale} if circle else {}
    state = _run(compiled, arrays, answer, count=len(answer), **uniforms)
    return state[:, :-1], state[:, -1]


def words_decoded(words: np.ndarray, b0: np.ndarray, circle: bool) -> np.ndarray:
    """(P, m) float64 numbers that words (P, m) stand for."""
    nodes = words.shape[1] // 2
    compiled = shader("words_decoded", DOUBLE=1, NODES=nodes, CIRCLE=int(circle))
    state = np.column_stack([words, b0]).astype(np.float64)
    return _run(compiled, [state], np.empty(words.shape), count=len(words))


def weighted_targets(offsets: np.ndarray, fragments: np.ndarray) -> np.ndarray:
    """(P, 5) accumulation and revealage of fragments (N, 5), as the pass lays them out."""
    compiled = shader("weighted_targets", DOUBLE=_double(fragments))
    answer = np.empty((len(offsets) - 1, 5), fragments.dtype)
    return _run(compiled, [offsets.astype(np.uint32), fragments], answer, count=len(answer))


def haar_cells(
    levels: int, density: int, bits: int, offsets: np.ndarray, z: np.ndarray, absorbance: np.ndarray
) -> np.ndarray:
    """(P, 2^levels) absorbances at the ends of the cells of P rays."""
    coefficients = np.empty((len(offsets) - 1, 1 << levels), z.dtype)
    options = {"DOUBLE": _double(z), "LEVELS": levels, "DENSITY": density}
    compiled = shader("haar_coefficients", BITS=bits, **options)
    arrays = [offsets.astype(np.uint32), z, absorbance]
    coefficients = _run(compiled, arrays, coefficients, count=len(coefficients))
    compiled = shader("haar_cells", **options)
    return _run(compiled, [coefficients], np.empty_like(coefficients), count=len(coefficients))


def haar_transmittance(
    density: int, cells: np.ndarray, ray_of: np.ndarray, z: np.ndarray, own: np.ndarray
) -> np.ndarray:
    levels = cells.shape[1].bit_length() - 1
    compiled = shader("haar_transmittance", DOUBLE=_double(z), LEVELS=levels, DENSITY=density)
    arrays = [cells, ray_of.astype(np.uint32), z, own]
    return _run(compiled, arrays, np.empty_like(z), count=z.size)


def fourier_maps(harmonics: int, d: np.ndarray, own: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """(P, 1 + 2 harmonics) sums of the surfaces of each ray, in half floats."""
    compiled = shader("fourier_opacity", DOUBLE=_double(d), HARMONICS=harmonics, PASS=0)
    maps = np.empty((len(offsets) - 1, 1 + 2 * harmonics), d.dtype)
    return _run(compiled, [d, own, offsets.astype(np.uint32)], maps, count=len(maps))


def fourier_transmittance(
    maps: np.ndarray, d: np.ndarray, own: np.ndarray, ray_of: np.ndarray
) -> np.ndarray:
    harmonics = maps.shape[1] // 2
    compiled = shader("fourier_opacity", DOUBLE=_double(d), HARMONICS=harmonics, PASS=1)
    arrays = [d, own, ray_of.astype(np.uint32), maps]
    return _run(compiled, arrays, np.empty_like(d), count=d.size)


def function_terms(cosines: int, d: np.ndarray, w: np.ndarray) -> np.ndarray:
    """(N, cosines) terms of drops of the transmittance by w at d."""
    compiled = shader("transmittance_function", DOUBLE=_double(d), COSINES=cosines, HALF=0, PASS=0)
    return _run(compiled, [d, w], np.empty((d.size, cosines), d.dtype), count=d.size)


def function_transmittance(
    sums: np.ndarray,
    total: np.ndarray,
    d: np.ndarray,
    own: np.ndarray,
    ray_of: np.ndarray,
    half: bool,
) -> np.ndarray:
    compiled = shader(
        "transmittance_function",
        DOUBLE=_double(d),
        COSINES=sums.shape[1],
        HALF=int(half),
        PASS=1,
    )
    arrays = [d, own, ray_of.astype(np.uint32), sums, total]
    return _run(compiled, arrays, np.empty_like(d), count=d.size)


def deep_shadow_maps(
    offsets: np.ndarray, z: np.ndarray, alpha: np.ndarray, tolerance: float
) -> np.ndarray:
    """Maps of rays whose surfaces are sorted, as deep_shadow_map.comp.glsl lays them out."""
    compiled = shader("deep_shadow_map", DOUBLE=_double(z))
    maps = np.empty(6 * z.size + 7 * (len(offsets) - 1), z.dtype)
    arrays = [offsets.astype(np.uint32), z, alpha]
    return _run(compiled, arrays, maps, count=len(offsets) - 1, tolerance=tolerance)


def deep_shadow(
    offsets: np.ndarray, maps: np.ndarray, ray_of: np.ndarray, z: np.ndarray
) -> np.ndarray:
    compiled = shader("deep_shadow", DOUBLE=_double(z))
    arrays = [offsets.astype(np.uint32), maps, ray_of.astype(np.uint32), z]
    return _run(compiled, arrays, np.empty_like(z), count=z.size)


def stochastic_transmittance(f: Any, samples: int, stratified: bool, seed: int) -> np.ndarray:
    """What `Stochastic` gives for fragments `f`; (N,)."""
    double = _double(f.depth)
    compiled = shader("stochastic", DOUBLE=double, SAMPLES=samples, STRATIFIED=int(stratified))
    arrays = [f.offsets.astype(np.uint32), f.depth, f.alpha]
    top, left = (int(start) % 2**32 for start in f.origin)
    place = {"seed": seed, "top": top, "left": left, "width": f.shape[1]}
    return _run(compiled, arrays, np.empty_like(f.depth), count=len(f.counts), **place)


def scaled_absorbance(alpha: np.ndarray, shrink: float) -> np.ndarray:
    compiled = shader("scaled_absorbance", DOUBLE=_double(alpha))
    return _run(compiled, [alpha], np.empty_like(alpha), count=alpha.size, shrink=shrink)


def quantised_moments(b: np.ndarray, symmetric: bool) -> tuple[np.ndarray, np.ndarray]:
    """Words (P, 4) of moments, and what they decode to."""
    compiled = shader("quantised_moments", DOUBLE=1, SYMMETRIC=int(symmetric))
    kept = _run(compiled, [b.astype(np.float64)], np.empty((len(b), 8)), count=len(b))
    return kept[:, :4], kept[:, 4:]


def nonlinear_rules(rules: np.ndarray, low: float, extent: float, stored: Any) -> np.ndarray:
    """Rules as power_transmittance reads them, of what words keep of `rules`."""
    word = {4: "float", 8: "double"}[np.dtype(stored).itemsize]
    compiled = shader("nonlinear_moments", DOUBLE=1, NODES=2, STORED=word)
    arrays = [rules, np.empty((len(rules), 4), np.uint32)]
    answer = np.empty((len(rules), 7), stored)
    return _run(compiled, arrays, answer, count=len(rules), low=low, extent=extent)


def two_moments(
    b0: np.ndarray, second: np.ndarray, ray_of: np.ndarray, told: np.ndarray
) -> np.ndarray:
    compiled = shader("two_moments", DOUBLE=_double(told))
    arrays = [b0, second, ray_of.astype(np.uint32), told]
    return _run(compiled, arrays, np.empty_like(told), count=told.size)


def mlab(
    layers: int, quantized: bool, offsets: np.ndarray, fragments: np.ndarray, least: float
) -> np.ndarray:
    """(P, layers, 5) depth, premultiplied colour, transmittance; fragments (N, 5), the struct."""
    compiled = shader("mlab", DOUBLE=_double(fragments), LAYERS=layers, QUANTIZED=int(quantized))
    pixels = len(offsets) - 1
    answer = np.empty((pixels, layers, 5), fragments.dtype)
    arrays = [offsets.astype(np.uint32), fragments]
    return _run(compiled, arrays, answer, count=pixels, least=least)


def adaptive(nodes: int, quantized: bool, offsets: np.ndarray, fragments: np.ndarray) -> np.ndarray:
    """(P, nodes, 2) depth and transmittance behind it; fragments (N, 2), the struct of the pass."""
    compiled = shader("adaptive", DOUBLE=_double(fragments), NODES=nodes, QUANTIZED=int(quantized))
    answer = np.empty((len(offsets) - 1, nodes, 2), fragments.dtype)
    arrays = [offsets.astype(np.uint32), fragments]
    return _run(compiled, arrays, answer, count=len(offsets) - 1)


def steps(nodes: np.ndarray, ray_of: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Transmittance at z (n,) of rays ray_of (n,) with nodes (P, steps, 2)."""
    compiled = shader("steps", DOUBLE=_double(z), STEPS=nodes.shape[1])
    arrays = [nodes, ray_of.astype(np.uint32), z]
    return _run(compiled, arrays, np.empty_like(z), count=z.size)
