"""The core for systems that are not here, as a compiler reads it: python tests/portable.py

Clang reads every unit of the core as it would for Windows (with headers of mingw-w64) and for macOS
(with the stand-ins of tests/c/darwin), warnings being errors; wider lanes, whose text is that of
the base, are left out. Nothing is linked or run. On Debian: apt-get install clang
mingw-w64-x86-64-dev. Exits with 1 where something does not compile.
"""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Before what is found by it, so imports stand below a statement.
sys.path.insert(0, str(ROOT / "tests" / "c"))
from c_core import STRICT, core_flags  # noqa: E402

WINDOWS_HEADERS = Path("/usr/x86_64-w64-mingw32/include")
STAND_INS = ROOT / "tests" / "c" / "darwin"
# The words by which clang reads for a system, of a processor of which it has a base.
SYSTEMS = {
    "Windows": ["--target=x86_64-w64-mingw32", "-isystem", str(WINDOWS_HEADERS)],
    "macOS": ["--target=arm64-apple-macos11", "-nostdlibinc", "-isystem", str(STAND_INS)],
}


def missing(system: str) -> str | None:
    """What has to be installed to read for this system; None where all is there."""
    if not shutil.which("clang"):
        return "clang"
    if system == "Windows" and not (WINDOWS_HEADERS / "windows.h").exists():
        return "mingw-w64-x86-64-dev"
    return None


def units() -> list[Path]:
    """Of the core, without wider lanes."""
    found = sorted((ROOT / "csrc" / "core").glob("**/*.c"))
    return [unit for unit in found if not unit.stem.endswith(("_avx2", "_avx512"))]


def complaints(system: str, given: list[Path]) -> str:
    """What clang says of these units, read for this system."""
    flags = [flag for flag in core_flags() if flag != "-pthread"]  # a linker's, elsewhere
    command = ["clang", *SYSTEMS[system], *flags, *STRICT, f"-I{ROOT / 'csrc'}", "-fsyntax-only"]
    done = subprocess.run([*command, *map(str, given)], capture_output=True, text=True)
    return done.stderr or (f"status {done.returncode}" if done.returncode else "")


def main() -> None:
    failed = False
    workers = len(os.sched_getaffinity(0))
    for system in SYSTEMS:
        if needed := missing(system):
            sys.exit(f"{system}: needed: {needed}")
        parts = [units()[i::workers] for i in range(workers)]
        with ThreadPoolExecutor(workers) as pool:
            said = "".join(pool.map(complaints, [system] * workers, parts))
        failed = failed or bool(said)
        print(f"{system}: {said or 'every unit compiles'}")
    sys.exit(failed)


if __name__ == "__main__":
    main()
