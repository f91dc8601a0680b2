"""Costs as they are measured: texts, compiled for each family."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from moit.catalog import Technique, listed, technique
from moit.gpu.bindings import FACTOR as FACTOR_PASS
from moit.gpu.bindings import TRANSMITTANCE as READ_PASS
from moit.gpu.described import Constants
from moit.gpu.passes import passes_of
from moit.gpu.texts import source
from moit.gpu_costs.compiling import compiled
from moit.gpu_costs.cost import FAMILIES
from moit.gpu_costs.frames import FACTOR, TRANSMITTANCE
from moit.gpu_costs.probes import given_bytes, probes
from moit.gpu_costs.published import published_texts
from moit.gpu_costs.stored import ENGINE, EXACT, PUBLISHED, ROW, Costs
from moit.kit.including import LANGUAGES, include_of
from moit.kit.recipe import DEPTH_RANGE
from moit.kit.recipes import names_with_kits, recipe_of
from moit.system.progress import Progress, steps
from moit.system.version import VERSION

# Of options that change passes as another technique would.
BESIDE = (
    "front2(key_bits=32)",
    # means of blocks of more numbers than four and a total (moit.gpu_costs.stored)
    "power6(resolution=4,total='full')",
    "power8(resolution=4,total='full')",
    "wavelet16(resolution=4)",
)
EXACT_ONES = ("power4", "power6", "power8", "trig2", "trig3", "trig4")

# Families before RDNA: there the compiler makes of fma what rounds twice, so that a program which
# asks its device, as kits say, splits exact products.
ROUND_TWICE = ("polaris", "vega")

# By text, technique and pass.
Texts = Mapping[tuple[str, str, str], str]


def texts(techniques: Iterable[Technique | str] | None = None) -> Texts:
    """GLSL of compute shaders: what is exported, and the published and the exact passes beside.

    techniques : techniques or names, with options too; None: all that there are.

    Raises ValueError for what has none of these.
    """
    if techniques is None:
        return {**_exported((*names_with_kits(), *BESIDE)), **_others()}
    chosen = {str(one): one for one in listed(techniques)}
    found = {key: text for key, text in _others().items() if key[1] in chosen}
    kits = [name for name in chosen if name in names_with_kits() or name not in _named(found)]
    return {**_exported(kits), **found}


def _named(given: Texts) -> set[str]:
    return {name for _, name, _ in given}


def _exported(names: Iterable[str]) -> dict[tuple[str, str, str], str]:
    return {
        (ENGINE, name, key): text for name in names for key, text in probes(exported(name)).items()
    }


def _others() -> dict[tuple[str, str, str], str]:
    found = {(PUBLISHED, *key): text for key, text in published_texts().items()}
    return found | {(EXACT, *key): text for key, text in _exact_texts()}


def _exact_texts() -> Iterator[tuple[tuple[str, str], str]]:
    """The passes over arrays of fragments that make factors, in double, and that read them."""
    for name in EXACT_ONES:
        one = technique(name)
        fields = one.fields_for_core(np.dtype(np.float32))
        passes = passes_of(one, Constants.of(fields, False, DEPTH_RANGE))
        for key, number, double in ((FACTOR, FACTOR_PASS, 1), (TRANSMITTANCE, READ_PASS, 0)):
            given = {**passes.defines, "SCALAR": "float", "DOUBLE": double, "PASS": number}
            yield (name, key), source(f"techniques/{passes.shader}", **given)


def exported(name: str) -> str:
    """The include that `moit.export` writes of a technique in GLSL, before it is laid out."""
    one = technique(name)
    return include_of(one, recipe_of(one, DEPTH_RANGE), LANGUAGES["glsl"]).plain


def digest(text: str) -> str:
    """Of a shader's words: comments, blanks and, but for directives, lines do not count."""
    lines = (line.partition("//")[0].strip() for line in text.splitlines())
    kept = "".join(f"\n{line}\n" if line.startswith("#") else f" {line} " for line in lines if line)
    words = re.sub(r"[ \t]*([^\w\s]|\n|[ \t])[ \t]*", r"\1", kept)
    return hashlib.sha256(words.encode()).hexdigest()[:16]


def digests(given: Texts) -> dict[str, str]:
    return {" ".join(key): digest(text) for key, text in given.items()}


def _for(family: str, text: str) -> str:
    """A shader as a program would compile it on a family."""
    if not family.startswith(ROUND_TWICE):
        return text
    return text.replace("#version 450\n", "#version 450\n#define MOIT_NOT_FUSED 1\n", 1)


def measured(given: Texts, families: Iterable[str] = FAMILIES, progress: Progress = True) -> Costs:
    """Compiles all for each family. Raises GpuError where that cannot be done."""
    named = {" ".join(key): text for key, text in given.items()}
    chosen = list(dict.fromkeys(families))
    rows: list[dict[str, Any]] = []
    driver = glslang = ""
    with steps(progress, len(chosen), "families") as done:
        for family in chosen:
            found = compiled({key: _for(family, text) for key, text in named.items()}, family)
            driver, glslang = found.driver, found.glslang
            for text, one, name in given:
                cost = found.costs[f"{text} {one} {name}"]
                size = given_bytes(exported(one), name) if text == ENGINE else 0
                numbers = (cost.cycles, cost.instructions, cost.registers, cost.spilled, size)
                values = (one, text, family, name, *numbers)
                rows.append(dict(zip(ROW, values, strict=True)))
            done(family)
    return Costs(driver, glslang, VERSION, digests(given), tuple(rows))
