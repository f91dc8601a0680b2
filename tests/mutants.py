"""Small faults that tests have to find: python -m tests.mutants [--only WORD] [--out FOLDER]

tests/mutants.toml lists faults: a file, a text that it has once, what is put in its place, and the
tests that are asked. Each is made in a copy of the repository (of what is committed, with the
built extension), which is built again where it is C or GLSL; one that no test finds has survived.
A fault with a third text, the reason why nobody could find it, is listed and neither asked nor
counted.

Results are kept in a folder, by fault and commit, so that a run that was ended goes on where it
was; which test found a fault is kept for all commits, and asked first the next time; then come
quick tests (`pytest -m quick`), then all. A test that found one is asked once without any fault, so
that none is found by a test that fails anyway. It prints each survivor and a score per folder.
`--changed COMMIT` asks only of files that have changed since, `--at COMMIT` the tests of another
commit, `--quick` quick tests alone.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LIST = ROOT / "tests" / "mutants.toml"
SECONDS = 900  # of processor time that the tests of one fault may take
NONE_CHOSEN = 5  # what pytest ends with where no test was chosen
FOUND, SURVIVED, BROKEN = "found", "survived", "does not build"


@dataclass(frozen=True)
class Fault:
    """file : within the repository. find, put : what stands there once, and what does instead.
    tests : what pytest is given. reason : why no test could find it."""

    file: str
    find: str
    put: str
    tests: tuple[str, ...]
    reason: str = ""

    @property
    def key(self) -> str:
        text = "\0".join((self.file, self.find, self.put, *self.tests))
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    @property
    def is_compiled(self) -> bool:
        return self.file.endswith((".c", ".h", ".glsl"))

    @property
    def folder(self) -> str:
        return str(Path(self.file).parent)

    def made_in(self, text: str) -> str:
        """The file's text with the fault. ValueError where what it replaces is not there once."""
        count = text.count(self.find)
        if count != 1:
            raise ValueError(f"{self.file}: expected once, found {count} times: {self.find!r}")
        return text.replace(self.find, self.put)


def listed(path: Path = LIST) -> list[Fault]:
    """All faults; those of one file stand under its name."""
    with open(path, "rb") as file:
        groups = tomllib.load(file)["of"]
    return [
        Fault(group["file"], find, put, tuple(group["tests"]), *reason)
        for group in groups
        for find, put, *reason in group["faults"]
    ]


def copied(into: Path, commit: str) -> None:
    """What is committed, with what was built of it."""
    shutil.rmtree(into, ignore_errors=True)
    into.mkdir(parents=True)
    archive = subprocess.run(["git", "archive", commit], cwd=ROOT, capture_output=True, check=True)
    subprocess.run(["tar", "-x", "-C", str(into)], input=archive.stdout, check=True)
    for built in (ROOT / "moit").glob("*.so"):
        shutil.copy2(built, into / "moit")


def asked(fault: Fault, tree: Path, first: str = "", quick: bool = False) -> tuple[str, str]:
    """What becomes of a fault in a copy, which is put back afterwards, and the test that found it.
    first : a test that is asked before the others. quick : of these, each one's first case only."""
    path = tree / fault.file
    before = path.read_text(encoding="utf-8")
    extensions = {built: built.read_bytes() for built in (tree / "moit").glob("*.so")}
    path.write_text(fault.made_in(before), encoding="utf-8")
    try:
        if fault.is_compiled and not _built(tree):
            return BROKEN, ""
        rounds = [[first]] if first else []
        rounds += [[*fault.tests, "-m", "quick"], *([] if quick else [fault.tests])]
        for tests in rounds:
            found = failing(tests, tree)
            if found is not None:
                return FOUND, found
        return SURVIVED, ""
    finally:
        path.write_text(before, encoding="utf-8")
        for built, content in extensions.items():
            if built.read_bytes() != content:
                built.write_bytes(content)


def _built(tree: Path) -> bool:
    """All units are compiled again, which is quick where there is a ccache."""
    command = [sys.executable, "setup.py", "-q", "build_ext", "--inplace"]
    environment = os.environ | {"CCACHE_NOHASHDIR": "1", "CCACHE_BASEDIR": str(tree)}
    environment["PATH"] = f"/usr/lib/ccache:{environment['PATH']}"
    return subprocess.run(command, cwd=tree, env=environment, capture_output=True).returncode == 0


def failing(tests: Iterable[str], tree: Path) -> str | None:
    """The first test that fails, None where all pass; an empty name where it cannot be told."""
    words = ["-q", "-x", "-rfE", "-p", "no:cacheprovider", "-p", "no:randomly", *tests]
    environment = os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", *words]
    # One that never ends is found, and one that a busy machine makes wait is not.
    limited = ["bash", "-c", f'ulimit -t {SECONDS}; exec "$@"', "-", *command]
    done = subprocess.run(limited, cwd=tree, env=environment, capture_output=True, text=True)
    if done.returncode in (0, NONE_CHOSEN):
        return None
    named = [line.split(" - ")[0] for line in done.stdout.splitlines()]
    named = [line.partition(" ")[2] for line in named if line.startswith(("FAILED ", "ERROR "))]
    return named[0] if named and done.returncode == 1 else ""


def scores(results: dict[str, tuple[Fault, str]]) -> str:
    """Found of all, per folder, what survived, and why some are not counted."""
    counted = [(fault, what) for fault, what in results.values() if not fault.reason]
    lines = []
    for folder in [*sorted({fault.folder for fault, _ in counted}), ""]:
        those = [what for fault, what in counted if folder in ("", fault.folder)]
        found = sum(what == FOUND for what in those)
        lines.append(f"{folder or 'all':32} {found:4} of {len(those):4}")
    lines += [
        f"{what}: {fault.file}: {fault.find!r} -> {fault.put!r}"
        for fault, what in counted
        if what != FOUND
    ]
    lines += [
        f"not counted: {fault.file}: {fault.put!r}: {fault.reason}"
        for fault, _ in results.values()
        if fault.reason
    ]
    return "\n".join(lines)


def changed_since(commit: str) -> set[str]:
    command = ["git", "diff", "--name-only", commit]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return set(said.split())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", metavar="WORD", help="of files with it in their name")
    parser.add_argument("--changed", metavar="COMMIT")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "mutants")
    parser.add_argument("--at", default="HEAD", metavar="COMMIT")
    parser.add_argument("--quick", action="store_true", help="of each test its first case alone")
    options = parser.parse_args()
    head = ["git", "rev-parse", options.at]
    commit = subprocess.run(head, cwd=ROOT, capture_output=True, text=True, check=True).stdout[:12]
    options.out.mkdir(parents=True, exist_ok=True)
    kept = options.out / f"{commit}{'-quick' if options.quick else ''}.json"
    finders = options.out / "found_by.json"
    known = json.loads(kept.read_text()) if kept.exists() else {}
    found_by = json.loads(finders.read_text()) if finders.exists() else {}
    files = changed_since(options.changed) if options.changed else None
    wanted = [
        fault
        for fault in listed()
        if options.only in fault.file and (files is None or fault.file in files)
    ]
    tree = options.out / "tree"
    copied(tree, options.at)
    sound: set[str] = set()  # tests that pass without any fault
    results: dict[str, tuple[Fault, str]] = {}
    for fault in sorted(wanted, key=lambda one: one.is_compiled):  # those that take long at last
        if fault.key not in known and not fault.reason:
            try:
                what, by = asked(fault, tree, found_by.get(fault.key, ""), options.quick)
            except ValueError as error:  # another commit's text
                print(error)
                continue
            if what == FOUND and by not in sound:
                if failing([by] if by else fault.tests, tree) is not None:
                    sys.exit(f"without any fault this does not pass: {by or fault.tests}")
                sound.add(by)
            known[fault.key] = what
            kept.write_text(json.dumps(known, indent=1))
            if by:
                finders.write_text(json.dumps(found_by := found_by | {fault.key: by}, indent=1))
            print(f"{what}: {fault.file}: {fault.put!r} {by}", flush=True)
        results[fault.key] = (fault, known.get(fault.key, ""))
    print(scores(results))
    sys.exit(any(what != FOUND for fault, what in results.values() if not fault.reason))


if __name__ == "__main__":
    main()
