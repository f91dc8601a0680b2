"""Builds the C programs of this folder, with the core and the pass driver: no Python headers.

    python tests/c/c_core.py --into FOLDER [--compiler gcc] [--flags=-g] [--objects FOLDER]

prints the programs' paths, one a line.
"""

import argparse
import ast
import os
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
STRICT = ["-Wall", "-Wextra", "-Wdouble-promotion", "-Werror"]
HEADER_ALONE = ["header.c", "header.cpp"]


def core_flags() -> list[str]:
    """What setup.py compiles the core with, so that the core tested is the core shipped."""
    for node in ast.parse((ROOT / "setup.py").read_text()).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "FLAGS":
            return ast.literal_eval(node.value)
    raise LookupError("setup.py has no FLAGS")


def program_names() -> list[str]:
    return sorted(p.stem for p in HERE.glob("*.c") if p.name not in HEADER_ALONE)


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{shlex.join(command)}\n{done.stdout}{done.stderr}")


def compile_header_alone(compiler: str, name: str, into: Path) -> None:
    """The public headers as strict C11 (header.c) or as C++ (header.cpp)."""
    standard = "c++11" if name.endswith(".cpp") else "c11"
    flags = [f"-std={standard}", "-pedantic-errors", *STRICT, f"-I{ROOT / 'csrc'}"]
    _run([compiler, *flags, "-c", str(HERE / name), "-o", str(into / f"{name}.o")])


def build_extensions(compiler: str, into: Path, flags: list[str]) -> Path:
    """The folder with the objects of csrc that setup.py makes.

    RuntimeError with the compiler's words where it has any, since warnings are errors.
    """
    command = [sys.executable, "setup.py", "-q", "build_ext"]
    command += ["--build-lib", str(into / "lib"), "--build-temp", str(into / "temp")]
    # as .ci/run has it, so that a cache has what is compiled
    words = shlex.join(["-Werror", *flags])
    done = subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, "CC": compiler, "MOIT_CFLAGS": words},
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(f"{shlex.join(command)}\n{done.stdout}{done.stderr}")
    return into / "temp" / "csrc"


def build(
    compiler: str, into: Path, flags: list[str], objects: Path | None = None
) -> dict[str, Path]:
    """The programs by name; RuntimeError with the compiler's words where it has any.

    objects : those of csrc, to link instead of compiling the core and the driver.
    """
    csrc = ROOT / "csrc"
    sources = sorted([*csrc.glob("core/**/*.c"), *csrc.glob("gl/*.c")])
    compiled = {
        source: (objects or into) / source.relative_to(csrc).with_suffix(".o") for source in sources
    }
    common = [f"-I{csrc}", *STRICT, *flags]
    jobs: dict[Path, list[str]] = {}
    # the core as it is shipped; the programs as somebody else's strict C11
    if not objects:
        for source, out in compiled.items():
            jobs[out] = [*core_flags(), *common, "-c", str(source)]
    for name in program_names():
        options = ["-std=c11", "-D_POSIX_C_SOURCE=200809L", "-O1", "-pthread"]
        jobs[into / f"{name}.o"] = [*options, *common, "-c", str(HERE / f"{name}.c")]
    for out in jobs:
        out.parent.mkdir(parents=True, exist_ok=True)
    workers = len(os.sched_getaffinity(0))
    with ThreadPoolExecutor(workers) as pool:
        # the units of vectors take longest: they go first
        by_length = sorted(jobs, key=lambda out: "stages" not in out.parts)
        list(pool.map(lambda out: _run([compiler, *jobs[out], "-o", str(out)]), by_length))
        programs = {name: into / name for name in program_names()}
        rest = [*map(str, compiled.values()), *flags, "-pthread", "-lm", "-ldl"]
        list(
            pool.map(
                lambda out: _run([compiler, f"{out}.o", *rest, "-o", str(out)]), programs.values()
            )
        )
    return programs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--into", type=Path, required=True)
    parser.add_argument("--compiler", default="gcc")
    parser.add_argument("--flags", default="", help="in one word, as a shell would split it")
    parser.add_argument("--objects", type=Path, help="folder of csrc's objects, if compiled")
    given = parser.parse_args()
    try:
        programs = build(given.compiler, given.into, shlex.split(given.flags), given.objects)
    except RuntimeError as error:
        sys.exit(str(error))
    print("\n".join(map(str, programs.values())))


if __name__ == "__main__":
    main()
