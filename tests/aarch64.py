"""The C core and its suite for aarch64, on this machine: python tests/aarch64.py [--objects FOLDER]

Compiles them with a cross compiler, runs each program under an emulator of user processes, and
holds the digests of every answer against those of this machine's own compiler. On Debian:
apt-get install gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static. Exits with 1 where a
program fails or an answer differs.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Before what is found by it, so imports stand below a statement.
sys.path.insert(0, str(ROOT / "tests" / "c"))
from c_core import build, program_names  # noqa: E402

COMPILER = "aarch64-linux-gnu-gcc"
EMULATORS = ("qemu-aarch64-static", "qemu-aarch64")
LIBRARIES = "/usr/aarch64-linux-gnu"
DIGESTS = "digests"


def emulator() -> list[str]:
    """The words before a program; SystemExit where something is not installed."""
    found = next(filter(shutil.which, EMULATORS), None)
    if found is None or shutil.which(COMPILER) is None:
        raise SystemExit(f"needed: {COMPILER} and one of {', '.join(EMULATORS)}")
    return [found, "-L", LIBRARIES]


def output(command: list[str], seconds: float) -> str:
    """What a program prints; RuntimeError where it fails."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=seconds)
    if done.returncode:
        raise RuntimeError(f"{command[-1]}: status {done.returncode}\n{done.stderr}")
    return done.stdout


def differing(ours: str, theirs: str) -> list[str]:
    """Lines of two lists of digests that are not in both."""
    return sorted(set(ours.splitlines()) ^ set(theirs.splitlines()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", nargs="*", default=program_names(), help="default: all")
    parser.add_argument("--into", type=Path, default=ROOT / "build" / "aarch64")
    parser.add_argument(
        "--objects", type=Path, help="this machine's of csrc, if compiled: build/temp.*/csrc"
    )
    parser.add_argument("--seconds", type=float, default=3600.0, help="that a program may take")
    options = parser.parse_args()
    before = emulator()
    for compiler, folder, objects in (
        ("gcc", "native", options.objects),
        (COMPILER, "cross", None),
    ):
        into = options.into / folder
        into.mkdir(parents=True, exist_ok=True)
        build(compiler, into, flags=[], objects=objects)
    failed = 0
    for name in options.programs:
        try:
            output([*before, str(options.into / "cross" / name)], options.seconds)
            print(f"{name}: passed", flush=True)
        except RuntimeError as error:
            failed += 1
            print(f"{name}: FAILED: {error}", flush=True)
    ours = output([str(options.into / "native" / DIGESTS)], options.seconds)
    theirs = output([*before, str(options.into / "cross" / DIGESTS)], options.seconds)
    other = differing(ours, theirs)
    print("\n".join(other))
    print(f"{len(ours.splitlines())} answers, of which {len(other) // 2} have other bits")
    sys.exit(bool(failed or other))


if __name__ == "__main__":
    main()
