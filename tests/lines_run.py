"""Which lines and branches of the C core run: python -m tests.lines_run [--minutes 5] [TEST ...]

Builds the extension by clang with counters (build/lines_run; the base's lanes alone, which are the
text of all), runs the programs of `tests/fuzz.py` for so many minutes, and pytest with what else is
given, such as `-m quick` or a file of tests; then prints lines and branches of each file, least
first, and functions that nobody called. Runs add up; `--fresh` forgets them. `--show FILE` prints
the lines of one file that never ran. Needs clang, llvm-profdata and llvm-cov.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "build" / "lines_run"
COUNTERS = "-fprofile-instr-generate"
FLAGS = f"-O1 -g0 {COUNTERS} -fcoverage-mapping -DMOIT_NO_AVX2 -DMOIT_NO_AVX512"
CSRC = ROOT / "csrc"


def built() -> Path:
    """The folder of the extension with counters."""
    command = [sys.executable, "setup.py", "-q", "build", "--build-base", str(OUT / "extension")]
    ccache = {"CCACHE_NOHASHDIR": "1", "PATH": f"/usr/lib/ccache:{os.environ['PATH']}"}
    flags = {"CC": "clang", "MOIT_CFLAGS": FLAGS, "MOIT_LDFLAGS": COUNTERS}
    subprocess.run(command, cwd=ROOT, env=os.environ | ccache | flags, check=True)
    return next((OUT / "extension").glob("lib.*"))


def run(library: Path, tests: list[str], minutes: float) -> None:
    """Fuzz and tests, each process writing what it counted."""
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(map(str, (library, ROOT / "tests", ROOT))),
        "LLVM_PROFILE_FILE": str(OUT / "counted" / "%4m.profraw"),
        "MOIT_ISA": "base",
    }
    if minutes > 0:
        fuzz = [str(ROOT / "tests" / "fuzz.py"), "--minutes", str(minutes), "--out"]
        subprocess.run([sys.executable, "-P", *fuzz, str(OUT / "fuzz")], env=environment, cwd=OUT)
    if tests:
        words = ["-q", "-p", "no:cacheprovider", *tests]
        subprocess.run([sys.executable, "-P", "-m", "pytest", *words], env=environment, cwd=ROOT)


def merged() -> Path:
    into = OUT / "all.profdata"
    counted = sorted((OUT / "counted").glob("*.profraw"))
    if not counted:
        sys.exit("nothing was counted: give it tests or minutes")
    subprocess.run(["llvm-profdata", "merge", "-sparse", *counted, "-o", into], check=True)
    return into


def asked(library: Path, *words: str) -> str:
    """What llvm-cov says of the extension."""
    (extension,) = (library / "moit").glob("_core.*.so")
    command = ["llvm-cov", words[0], str(extension), f"-instr-profile={merged()}", *words[1:]]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout


def never_called(functions: list[dict[str, Any]]) -> Iterator[tuple[str, str]]:
    """(file, function); one that several units have has run where any of them ran it."""
    ran: dict[tuple[str, str], int] = {}
    for one in functions:
        key = one["filenames"][0], one["name"].rpartition(":")[2]
        ran[key] = ran.get(key, 0) + one["count"]
    return (key for key, count in ran.items() if not count)


def report(found: dict[str, Any]) -> str:
    """Lines and branches of each file, least lines first, and functions that nobody called."""
    rows, total = [], {"lines": [0, 0], "branches": [0, 0]}
    for file in found["files"]:
        if CSRC not in Path(file["filename"]).parents or not file["summary"]["lines"]["count"]:
            continue  # NumPy's, or of definitions alone
        name = os.path.relpath(file["filename"], ROOT)
        cells = []
        for kind, of_all in total.items():
            summary = file["summary"][kind]
            of_all[0] += summary["covered"]
            of_all[1] += summary["count"]
            cells.append((summary["covered"], summary["count"]))
        rows.append((name, *cells))
    rows.sort(key=lambda row: row[1][0] / max(row[1][1], 1))
    lines = [f"{'':44}  lines           branches"]
    for name, *cells in [*rows, ("all", *map(tuple, total.values()))]:
        shown = (f"{100 * ran / max(count, 1):5.1f} % {ran:5} of {count:5}" for ran, count in cells)
        lines.append(f"{name:44} {'  '.join(shown)}")
    for name, function in sorted(set(never_called(found["functions"]))):
        if CSRC in Path(name).parents:
            lines.append(f"never called: {os.path.relpath(name, ROOT)}: {function}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=0.0, help="of fuzz")
    parser.add_argument("--fresh", action="store_true")
    parser.add_argument("--show", metavar="FILE")
    options, tests = parser.parse_known_args()
    (OUT / "counted").mkdir(parents=True, exist_ok=True)
    if options.fresh:
        for counted in (OUT / "counted").glob("*.profraw"):
            counted.unlink()
    library = built()
    run(library, tests, options.minutes)
    if options.show:
        text = asked(library, "show", options.show, "-show-line-counts-or-regions=false")
        print(*(line for line in text.splitlines() if "|      0|" in line), sep="\n")
        return
    print(report(json.loads(asked(library, "export", "-skip-expansions"))["data"][0]))


if __name__ == "__main__":
    main()
