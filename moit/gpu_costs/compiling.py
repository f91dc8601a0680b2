"""Shaders given to a driver's compiler: what it makes of each, on GPUs that need not be here."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from moit.checks.exceptions import GpuError, in_one_line
from moit.gpu_costs.cost import WAVE, Cost

INSTALL = "on Debian and Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1 glslang-tools"
UNIFORMS = "60"  # binding of the block that they become, which Vulkan has instead
SECONDS = 600  # that a compiler may take for all shaders of a family

# Where drivers are registered, in the loader's order.
FOLDERS = ("/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/usr/share/vulkan/icd.d")

# The driver's names of what is kept.
NAMES = {
    "cycles": "Inverse Throughput",
    "instructions": "Instructions",
    "registers": "VGPRs",
    "spilled": "Spilled VGPRs",
}


@dataclasses.dataclass(frozen=True)
class Compiled:
    """What a family costs: the driver's version, the compiler's to SPIR-V, and by shader."""

    driver: str
    glslang: str
    costs: Mapping[str, Cost]


def compiled(shaders: Mapping[str, str], family: str) -> Compiled:
    """What the code of compute shaders costs on a family of AMD's GPUs.

    shaders : GLSL 4.5 by name; storage buffers of bindings 0 to 59; uniforms become one more.
    family : as Mesa's radv calls it, such as "navi21".

    Each family is compiled for in a process of its own. Loops whose turns the compiler does not
    know are counted as some turns.

    Raises GpuError where glslang or the driver is missing, does not know the family, refuses a
    shader or crashes at it; the message says which.
    """
    if not re.fullmatch(r"[a-z0-9_]+", family):
        raise ValueError(f"family: expected a name such as 'navi21', got {family!r:.80}")
    with tempfile.TemporaryDirectory() as folder:
        glslang = glslang_version()
        names, files = list(shaders), []
        for name, text in shaders.items():
            files.append(_spirv(name, text, Path(folder)))
            if len(files) == 1:  # a family that there is not, before all others are made
                _told(files, names[:1], family)
        driver, found = _told(files, names, family)
    return Compiled(driver, glslang, {name: cost_of(told, name) for name, told in found.items()})


def cost_of(told: Mapping[str, Any], name: str = "shader") -> Cost:
    """Of a driver's statistics by its own names; GpuError where one is not told."""
    missing = [one for one in NAMES.values() if not isinstance(told.get(one), int)]
    if missing:
        raise GpuError(
            f"{name}: the driver tells {', '.join(told) or 'nothing'}; needed are "
            f"{', '.join(missing)}, as Mesa's radv has them"
        )
    if told.get("subgroup") != WAVE:
        raise GpuError(
            f"{name}: expected waves of {WAVE}, the driver compiled for {told.get('subgroup')!r}"
        )
    return Cost(**{field: told[one] for field, one in NAMES.items()})


def glslang_version() -> str:
    """Such as "12.0.0"."""
    said = _glslang("--version")
    found = re.search(r"Glslang Version: \d+:(\S+)", said.stdout)
    return found[1] if found else in_one_line(said.stdout)[:80]


def driver_file() -> str:
    """The file that registers radv with Vulkan's loader; GpuError where there is none."""
    found = [path for folder in FOLDERS for path in sorted(Path(folder).glob("radeon_icd*.json"))]
    if not found:
        raise GpuError(
            f"Mesa's Vulkan driver for AMD is not there (no radeon_icd*.json in "
            f"{', '.join(FOLDERS)}); {INSTALL}"
        )
    return str(found[0])


def _glslang(*arguments: str) -> subprocess.CompletedProcess[str]:
    program = shutil.which("glslangValidator") or shutil.which("glslang")
    if not program:
        raise GpuError(f"glslangValidator is not there, which makes SPIR-V of GLSL; {INSTALL}")
    return subprocess.run(
        [program, *arguments], capture_output=True, text=True, timeout=SECONDS, check=False
    )


def _spirv(name: str, text: str, folder: Path) -> Path:
    number = len(list(folder.glob("*.comp")))
    source, target = folder / f"{number}.comp", folder / f"{number}.spv"
    source.write_text(text, encoding="utf-8")
    uniforms = ("-R", "--set-default-uniform-block", "uniforms", "0", UNIFORMS)
    done = _glslang("-V", "--target-env", "vulkan1.2", *uniforms, str(source), "-o", str(target))
    if done.returncode or not target.exists():
        raise GpuError(f"{name}: glslang refuses it: {_refusal(done)}")
    return target


def _refusal(done: subprocess.CompletedProcess[str]) -> str:
    """The first error that a compiler tells, else all that it says, else how it ended."""
    errors = [line for line in done.stdout.splitlines() if "ERROR" in line]
    said = in_one_line(errors[0] if errors else f"{done.stderr} {done.stdout}")[:300]
    return said or f"it says nothing, and ended with {done.returncode}"


def _told(
    files: Sequence[Path], names: Sequence[str], family: str
) -> tuple[str, dict[str, dict[str, int]]]:
    root = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))
    registered = driver_file()
    environment = os.environ | {
        "PYTHONPATH": path,
        "RADV_FORCE_FAMILY": family,
        "VK_ICD_FILENAMES": registered,
        "VK_DRIVER_FILES": registered,  # what newer loaders read
        "MESA_SHADER_CACHE_DISABLE": "true",
    }
    try:
        done = subprocess.run(
            [sys.executable, "-m", "moit.gpu_costs.vulkan"],
            input="".join(f"{file}\n" for file in files),
            capture_output=True,
            text=True,
            env=environment,
            timeout=SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise GpuError(f"the driver's compiler for {family} took over {SECONDS} s") from None
    return understood(done.stdout, done.stderr, done.returncode, names, family)


def understood(
    output: str, errors: str, code: int, names: Sequence[str], family: str
) -> tuple[str, dict[str, dict[str, int]]]:
    """The driver's version, and statistics by shader, from what the process printed.

    code : with which it ended; below 0: killed by that signal.

    Raises GpuError where that is not of all shaders, and says at which it ended.
    """
    lines = [json.loads(line) for line in output.splitlines() if line.startswith("{")]
    for line in lines:
        if "error" in line:
            raise GpuError(f"{family}: {line['error']}; {INSTALL}")
    said = in_one_line(errors)[-300:]
    if not lines:
        raise GpuError(
            f"family: the driver makes no device of {family!r}"
            f"{': ' + said if said else ''} (it ended with {code})"
        )
    head, *told = lines
    if len(told) < len(names) or code:
        at = names[len(told)] if len(told) < len(names) else "the end"
        raise GpuError(
            f"{at}: the driver's compiler for {family} ended with {code}{': ' * bool(said)}{said}"
        )
    return str(head["driver"]), dict(zip(names, told, strict=True))
