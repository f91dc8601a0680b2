"""Measures the errors of texts that go home, in every language that this machine can run, and
writes them to moit/kit/measured.json and docs/kits.md: python tests/kit_errors.py [NAME ...]

What a machine cannot run keeps its number as long as the text is the same.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
# What is measured here, and how, is found from here on: so imports stand below a statement.
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from readings import kit_cases, kits  # noqa: E402

import moit  # noqa: E402
from moit.kit.including import LANGUAGES  # noqa: E402
from moit.kit.recipes import names_with_kits  # noqa: E402

FILE = ROOT / "moit" / "kit" / "measured.json"
PAGE = ROOT / "docs" / "kits.md"
MARKS = "<!-- errors -->\n", "<!-- end of errors -->"
DEVICES = {
    "glsl": "llvmpipe",
    "hlsl": "llvmpipe by way of glslang, SPIR-V and SPIRV-Cross",
    "wgsl": "llvmpipe by wgpu",
    "metal": "a CPU, compiled as C++ with a stand-in for Metal's library",
    "slang": "llvmpipe by way of Slang's GLSL",
}


# Of options that change a text as much as another technique would.
BESIDE = ("power4(depth_range='pixel')", "neural")


def measured_names(language: str = "glsl") -> tuple[str, ...]:
    """What is measured in a language."""
    return (*names_with_kits(language), *BESIDE)


def name_of(name: str) -> str:
    """Sums of a text's half floats are the engine's to round: its arithmetic is measured."""
    return f"{name}(bits=32)" if name.startswith("fourier") else name


def measured(name: str, language: str, case: kit_cases.Case) -> dict[str, object]:
    technique = moit.technique(name_of(name))
    what, error = kit_cases.errors(technique, language, case)
    golden = {}
    of_moments = technique.kind in ("power", "trig") and technique.bits == 32
    if of_moments and technique.base_name != "power2":
        found = kit_cases.golden_errors(technique, language)
        golden = {
            "problems": found.size,
            "golden_most": float(f"{found.max():.2g}"),
            "golden_most_of_999": float(f"{np.quantile(found, 0.999):.2g}"),
        }
    return {
        "digest": kits.include(moit.technique(name), language).digest,
        "device": DEVICES[language],
        "what": what,
        "fragments": len(error),
        "most": float(f"{error.max():.2g}"),
        "most_of_999": float(f"{np.quantile(error, 0.999):.2g}"),
        **golden,
    }


def table(stored: dict) -> str:
    """Of all that is stored: greatest error, and that of 99.9 %; and of golden problems."""
    lines = [["technique", "of", *LANGUAGES], ["---"] * (len(LANGUAGES) + 2)]
    for name, rows in stored.items():
        for of, prefix in (("held pixels", ""), ("golden problems", "golden_")):
            if any(f"{prefix}most" in row for row in rows.values()):
                lines.append([name, of, *(_cell(rows.get(one), prefix) for one in LANGUAGES)])
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def _cell(row: dict | None, prefix: str) -> str:
    if not row:
        return "-"
    return f"{row[f'{prefix}most']:.1e}, {row[f'{prefix}most_of_999']:.1e}"


def page_with(stored: dict) -> str:
    """docs/kits.md with this table."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(MARKS[0])
    return before + MARKS[0] + table(stored) + MARKS[1] + rest.partition(MARKS[1])[2]


def main(chosen: list[str]) -> None:
    before = json.loads(FILE.read_text(encoding="utf-8"))
    case = kit_cases.held_case()
    found: dict[str, dict[str, object]] = {}
    for name in measured_names():
        if chosen and name not in chosen and name in before:
            found[name] = before[name]
            continue
        for language in LANGUAGES:
            if name not in measured_names(language):
                continue
            try:
                row = measured(name, language, case)
            except pytest.skip.Exception as reason:
                print(f"{name} {language}: {reason}")
                row = before.get(name, {}).get(language)
                now = kits.include(moit.technique(name), language).digest
                row = row if row and row["digest"] == now else None
            if row:
                print(name, language, row["most_of_999"], row["most"])
                found.setdefault(name, {})[language] = row
    FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page_with(found), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
