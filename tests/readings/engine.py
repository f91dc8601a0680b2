"""The texts for engines (shaders/engine), run on llvmpipe: a thread a pixel.

A text says by its structs what a pixel keeps: `sums` what blending adds up, `factors` what the
factor pass makes of it. A member is a target, an array here (P,) or (P, 2 .. 4).
"""

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from gpu import software_device

from moit.gpu import texts

FOLDER = Path(__file__).parents[2] / "shaders" / "engine"
WIDTH = {"float": 1, "vec2": 2, "vec3": 3, "vec4": 4}
GROUP = 64

_MAIN = """#version 450
layout(local_size_x = {group}) in;
{text}
{buffers}
uniform uint count;
void main() {{
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
{body}
}}
"""


def text_of(name: str) -> str:
    """A text with its includes, without line marks."""
    lines = texts.source(FOLDER / f"{name}.glsl").splitlines()
    return "\n".join(line for line in lines if not line.startswith("#line"))


def members(name: str, struct: str) -> list[tuple[str, str]]:
    """(type, name) of a struct's members, () where the text has no such struct.

    Of a text that has several, by what is defined, the first: what it has with nothing defined.
    """
    found = re.search(rf"^struct {struct} \{{([^}}]*)\}};", text_of(name), re.MULTILINE)
    return re.findall(r"(\w+) (\w+);", found[1]) if found else []


@cache
def fma_is_fused() -> bool:
    """What an engine asks at start: whether the device's fma rounds once."""
    x = np.full(GROUP, 1 + 2.0**-12, np.float32)
    answer = _run((FOLDER / "probe.glsl").read_text(), {}, "float", "lost_by_fma(v0[i])", [x])
    return bool((answer != 0).all())


def _run(
    text: str,
    defines: dict[str, str | float],
    result: str,
    expression: str,
    given: Sequence[np.ndarray],
    members: Sequence[tuple[str, str]] = (),
) -> np.ndarray | list[np.ndarray]:
    """`expression` for each thread; given[k] is v{k}[i] there, of float32 (n,) or (n, 2 .. 4)."""
    count = len(given[0])
    kinds = {1: "float", 2: "vec2", 3: "float", 4: "vec4"}
    wide = [np.ascontiguousarray(a, np.float32).reshape(count, -1) for a in given]
    declared = [
        f"layout(std430, binding = {k}) readonly buffer Given{k} {{ {kinds[a.shape[1]]} v{k}[]; }};"
        for k, a in enumerate(wide)
    ]
    outputs = list(members) or [(result, "")]
    body = [f"    {result} answer = {expression};"]
    for k, (kind, name) in enumerate(outputs, len(wide)):
        declared.append(f"layout(std430, binding = {k}) buffer Made{k} {{ float v{k}[]; }};")
        n = WIDTH[kind]
        for c in range(n):
            place = "answer" + (f".{name}" if name else "") + (f"[{c}]" if n > 1 else "")
            body.append(f"    v{k}[{n} * i + {c}] = {place};")
    head = "".join(f"#define {key} {value}\n" for key, value in sorted(defines.items()))
    source = _MAIN.format(
        group=GROUP, text=head + text, buffers="\n".join(declared), body="\n".join(body)
    )
    with software_device() as device:
        program = _compiled(source)
        buffers = [device.buffer(a.nbytes, a) for a in wide]
        made = [np.empty((count, WIDTH[kind]), np.float32) for kind, _ in outputs]
        buffers += [device.buffer(a.nbytes) for a in made]
        device.dispatch(
            program,
            (-(-count // GROUP), 1, 1),
            buffers=dict(enumerate(buffers)),
            uniforms={"count": count},
        )
        for buffer, array in zip(buffers[len(wide) :], made, strict=True):
            buffer.read(array)
    made = [a[:, 0] if a.shape[1] == 1 else a for a in made]
    return made if members else made[0]


@cache
def _compiled(source: str):
    return software_device().compile(compute=source)


def _with_probe(defines: dict[str, str | float]) -> dict[str, str | float]:
    return {"NOT_FUSED": int(not fma_is_fused()), **defines}


def _struct(name: str, struct: str, first: int = 0) -> str:
    places = [f"v{k}[i]" for k, _ in enumerate(members(name, struct), first)]
    return f"{struct}({', '.join(places)})"


def sums_of(name: str, z: np.ndarray, alpha: np.ndarray, **defines: str | float):
    """What pixels keep of their fragments, z and alpha (P, K): blended one after the other."""
    given = [z.ravel(), alpha.ravel()]
    terms = _run(
        text_of(name),
        _with_probe(defines),
        "sums",
        "accumulate(v0[i], v1[i])",
        given,
        members(name, "sums"),
    )
    kept = []
    for term in terms:
        rows = term.reshape(*z.shape, *term.shape[1:])
        total = np.zeros_like(rows[:, 0])
        for k in range(z.shape[1]):
            total = total + rows[:, k]
        kept.append(total)
    return kept


def factors_of(name: str, sums: Sequence[np.ndarray], **defines: str | float):
    return _run(
        text_of(name),
        _with_probe(defines),
        "factors",
        f"factor({_struct(name, 'sums')})",
        sums,
        members(name, "factors"),
    )


def transmittance_of(
    name: str,
    sums: Sequence[np.ndarray],
    z: np.ndarray,
    alpha: np.ndarray | None = None,
    *,
    fused: bool = False,
    **defines: str | float,
) -> np.ndarray:
    """(P, K) for depths z (P, K) of fragments of opacity alpha, by factors or in one pass."""
    made = sums if fused else factors_of(name, sums, **defines)
    struct = "sums" if fused else "factors"
    alpha = np.zeros_like(z) if alpha is None else alpha
    given = [np.repeat(a, z.shape[1], axis=0) for a in made] + [z.ravel(), alpha.ravel()]
    n = len(made)
    function = "transmittance_of_sums" if fused else "transmittance"
    expression = f"{function}({_struct(name, struct)}, v{n}[i], v{n + 1}[i])"
    found = _run(text_of(name), _with_probe(defines), "float", expression, given)
    return found.reshape(z.shape)
