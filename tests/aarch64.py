"""The C core and its suite for aarch64, on this machine: python tests/aarch64.py [PROGRAM ...]

Compiles them with a cross compiler, runs each program under an emulator of user processes, and
holds what it prints, a digest of every answer, against what this machine's own compiler makes of
it. An emulated program takes minutes, so it can be ended: what has passed is noted, and the same
command goes on from there until the programs themselves are others. On Debian: apt-get install
gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static. Exits with 1 where a program fails or
an answer differs.
"""

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Before what is found by it, so imports stand below a statement.
sys.path.insert(0, str(ROOT / "tests" / "c"))
from c_core import build, program_names  # noqa: E402

COMPILER = "aarch64-linux-gnu-gcc"
EMULATORS = ("qemu-aarch64-static", "qemu-aarch64")
LIBRARIES = Path("/usr/aarch64-linux-gnu")
# Cases of tests/c/hostile.c that are run, and noted, at once.
HOSTILE, AT_ONCE = "hostile", 500


def sources() -> str:
    """A digest of all that the programs are made of."""
    found = hashlib.sha256((ROOT / "setup.py").read_bytes())
    for folder in (ROOT / "csrc", ROOT / "tests" / "c"):
        for path in sorted(one for one in folder.rglob("*") if one.suffix in (".c", ".h", ".py")):
            found.update(path.read_bytes())
    return found.hexdigest()


def emulator(libraries: Path) -> list[str]:
    """The words before a program; SystemExit where something is not installed."""
    found = next(filter(shutil.which, EMULATORS), None)
    if found is None or shutil.which(COMPILER) is None:
        raise SystemExit(f"needed: {COMPILER} and one of {', '.join(EMULATORS)}")
    return [found, "-L", str(libraries)]


def output(command: list[str], seconds: float) -> tuple[list[str], str]:
    """The lines that a program prints, and what it says beside; RuntimeError where it fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"not done in {seconds:.0f} s") from None
    if done.returncode:
        raise RuntimeError(f"status {done.returncode}\n{done.stderr}")
    return done.stdout.splitlines(), done.stderr.strip()


def compare(ours: list[str], theirs: list[str]) -> None:
    """RuntimeError that names the answers which are not in both lists."""
    if other := sorted(set(ours) ^ set(theirs)):
        raise RuntimeError("\n".join([f"{len(other)} lines of two lists differ", *other]))


def runs(programs: list[str], cases: int) -> list[list[str]]:
    """The words of each run: a program by name, and its arguments."""
    pieces = [
        [HOSTILE, str(first), str(min(AT_ONCE, cases - first))]
        for first in range(0, cases, AT_ONCE)
    ]
    return [run for name in programs for run in (pieces if name == HOSTILE else [[name]])]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", nargs="*", default=program_names(), help="default: all")
    parser.add_argument("--into", type=Path, default=ROOT / "build" / "aarch64")
    parser.add_argument(
        "--objects", type=Path, help="this machine's of csrc, if compiled: build/temp.*/csrc"
    )
    parser.add_argument("--seconds", type=float, default=3600.0, help="that a run may take")
    parser.add_argument("--cases", type=int, default=5000, help="hostile ones")
    parser.add_argument("--libraries", type=Path, default=LIBRARIES, help="of that machine")
    options = parser.parse_args()
    before = emulator(options.libraries)
    native, cross = options.into / "native", options.into / "cross"
    built = options.into / "built"
    if not built.exists() or built.read_text() != sources():
        for compiler, into, objects in (("gcc", native, options.objects), (COMPILER, cross, None)):
            into.mkdir(parents=True, exist_ok=True)
            build(compiler, into, flags=[], objects=objects)
        built.write_text(sources())
    noted = options.into / "passed.json"
    passed = json.loads(noted.read_text()) if noted.exists() else {}
    failed = 0
    for name, *words in runs(options.programs, options.cases):
        title = " ".join([name, *words])
        programs = [native / name, cross / name]
        which = hashlib.sha256(b"".join(one.read_bytes() for one in programs)).hexdigest()
        if passed.get(title, {}).get("programs") != which:
            begun = time.monotonic()
            try:
                theirs, said = output([*before, str(programs[1]), *words], options.seconds)
                ours, _ = output([str(programs[0]), *words], options.seconds)
                compare(ours, theirs)
            except RuntimeError as error:
                failed += 1
                print(f"{title}: FAILED: {error}", flush=True)
                continue
            took = round(time.monotonic() - begun)
            line = f"passed in {took} s" + (f", {len(ours)} lines as here" if ours else "")
            line += f" ({said})" if said else ""
            passed[title] = {"programs": which, "line": line}
            noted.write_text(json.dumps(passed, indent=1))
        print(f"{title}: {passed[title]['line']}", flush=True)
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
