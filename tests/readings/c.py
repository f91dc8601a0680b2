"""C's reading of the kernels, built without moit: functions on arrays, named as in glsl.py."""

import ctypes
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "c"))
from c_core import ROOT, STRICT, core_flags  # noqa: E402

COMPILERS = ["gcc", "clang"]


def compile_text(
    text: str | Path, compiler: str, *options: str | Path
) -> subprocess.CompletedProcess[str]:
    """What a compiler says to C that includes kernels; skips where there is no such compiler."""
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not installed")
    flags = [*core_flags(), "-O1", *STRICT, f"-I{ROOT / 'csrc'}", "-fvisibility=default"]
    given = [text] if isinstance(text, Path) else ["-x", "c", "-"]
    return subprocess.run(
        [compiler, *flags, *options, *given],
        input=None if isinstance(text, Path) else text,
        capture_output=True,
        text=True,
    )


@cache
def _library(dtype: np.dtype) -> ctypes.CDLL:
    """kernels.c in one precision."""
    compiler = next(filter(shutil.which, COMPILERS), COMPILERS[0])
    scalar = {4: "float", 8: "double"}[dtype.itemsize]
    with TemporaryDirectory() as folder:
        library, unit = Path(folder) / "kernels.so", Path(folder) / "kernels.o"
        # by itself, so that a cache of compilations has it for the next process
        build = compile_text(
            HERE / "kernels.c", compiler, f"-DSCALAR={scalar}", "-fPIC", "-c", "-o", unit
        )
        assert build.returncode == 0, build.stderr
        subprocess.run([compiler, "-shared", unit, "-o", library], check=True)
        return ctypes.CDLL(str(library))


def _run(name: str, dtype: np.dtype, *given: float | np.ndarray) -> None:
    """Calls a function of kernels.c: arrays as pointers, int as int, float as SCALAR."""
    scalar = {4: ctypes.c_float, 8: ctypes.c_double}[dtype.itemsize]
    converted = [
        one.ctypes
        if isinstance(one, np.ndarray)
        else ctypes.c_int(one)
        if isinstance(one, int)
        else scalar(one)
        for one in given
    ]
    function = getattr(_library(dtype), name)
    function.restype = None
    function(*converted)


def elementary(function: str, x: np.ndarray) -> np.ndarray:
    y = np.empty_like(x)
    _run(f"{function}s", x.dtype, x.size, x, y)
    return y


def circle_points(x: np.ndarray) -> np.ndarray:
    """(n, 2) cosines and sines of angles."""
    found = np.empty((x.size, 2), x.dtype)
    _run("circle_points", x.dtype, x.size, x, found)
    return found


def blend_weights(kind: int, fragments: np.ndarray) -> np.ndarray:
    weights = np.empty_like(fragments[:, 0])
    _run("blend_weights", fragments.dtype, kind, weights.size, fragments, weights)
    return weights


def surface_points(asked: np.ndarray) -> np.ndarray:
    found = np.empty((len(asked), 3), asked.dtype)
    _run("surface_points", asked.dtype, len(asked), asked, found)
    return found


def upsampling_shares(asked: np.ndarray) -> np.ndarray:
    found = np.empty((len(asked), 8), asked.dtype)
    _run("upsampling_shares", asked.dtype, len(asked), asked, found)
    return found


def power_rules(
    b: np.ndarray, bias: float, safe: tuple[float, ...], least: float, floats: bool = False
) -> np.ndarray:
    nodes = b.shape[1] // 2
    rules = np.empty((len(b), 3 * nodes + 1))
    _run(f"power_rules{nodes}", b.dtype, int(floats), len(b), b, bias, np.array(safe), least, rules)
    return rules


def power_bounds(
    rules: np.ndarray,
    b: np.ndarray,
    ray_of: np.ndarray,
    z: np.ndarray,
    blur: float,
    slack: float,
) -> np.ndarray:
    shares = np.empty((z.size, 2))
    ray_of = ray_of.astype(np.int32)
    given = [z.size, rules, b, ray_of, z, blur, slack, shares]
    _run(f"power_bounds{b.shape[1] // 2}", b.dtype, *given)
    return shares


def quantised_moments(b: np.ndarray, symmetric: bool) -> tuple[np.ndarray, np.ndarray]:
    """Words (P, 4) of moments (P, 4), and what they decode to."""
    kept = np.empty((len(b), 8), b.dtype)
    _run("quantised_moments", b.dtype, len(b), np.ascontiguousarray(b), int(symmetric), kept)
    return kept[:, :4], kept[:, 4:]


def mixed(h: np.ndarray) -> np.ndarray:
    answer = np.empty_like(h)
    _run("mixed_words", np.dtype("f4"), h.size, h, answer)
    return answer


def random_shares(dtype: np.dtype, keys: np.ndarray, each: int) -> np.ndarray:
    """(n, each) numbers of keys (n,)."""
    answer = np.empty((keys.size, each), dtype)
    _run("random_shares", np.dtype(dtype), keys.size, keys, each, answer)
    return answer


def fragment_keys(
    seed: int, row: np.ndarray, column: np.ndarray, depth: np.ndarray, alpha: np.ndarray
) -> np.ndarray:
    answer = np.empty(depth.shape, np.uint32)
    place = row.astype(np.uint32), column.astype(np.uint32)
    _run("fragment_keys", depth.dtype, depth.size, seed, *place, depth, alpha, answer)
    return answer


def coverages(
    keys: np.ndarray, twins: np.ndarray, alpha: np.ndarray, samples: int, stratified: bool
) -> np.ndarray:
    """(n, samples) booleans."""
    words = np.empty((keys.size, 2), np.uint32)
    given = [keys, twins.astype(np.uint32), alpha, samples, int(stratified), words]
    _run("coverages", alpha.dtype, keys.size, *given)
    bit = np.arange(samples)
    return (words[:, bit // 32] >> (bit % 32).astype(np.uint32) & 1).astype(bool)


def nonlinear_share(
    support: np.ndarray, weight: np.ndarray, offset: np.ndarray, z: np.ndarray, beta: np.ndarray
) -> np.ndarray:
    """The share in front of z, of two nodes (n, 2), the weight of the second and an offset."""
    share = np.empty_like(z)
    _run("nonlinear_share", z.dtype, z.size, support, weight, offset, z, beta, share)
    return share
