"""Small faults that tests have to find: python -m tests.mutants [--only WORD] [--out FOLDER]

tests/mutants.toml lists faults: a file, a text that it has once, what is put in its place, and the
tests that are asked. Each is made in a copy of the repository (of what is committed, with the
built extension), which is built again where it is C or GLSL; one that no test finds has survived.
Results are kept in a folder, by fault and commit, so that a run that was ended goes on where it
was. It prints each survivor and a score per folder. `--changed COMMIT` asks only of files that
have changed since.
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
SECONDS = 900.0  # that the tests of one fault may take
FOUND, SURVIVED, BROKEN = "found", "survived", "does not build"


@dataclass(frozen=True)
class Fault:
    """file : within the repository. find, put : what stands there once, and what does instead.
    tests : what pytest is given."""

    file: str
    find: str
    put: str
    tests: tuple[str, ...]

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
        Fault(group["file"], find, put, tuple(group["tests"]))
        for group in groups
        for find, put in group["faults"]
    ]


def copied(into: Path) -> None:
    """What is committed, with what was built of it."""
    shutil.rmtree(into, ignore_errors=True)
    into.mkdir(parents=True)
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, capture_output=True, check=True)
    subprocess.run(["tar", "-x", "-C", str(into)], input=archive.stdout, check=True)
    for built in (ROOT / "moit").glob("*.so"):
        shutil.copy2(built, into / "moit")
    if (ROOT / "build").exists():
        for temporary in (ROOT / "build").glob("temp.*"):
            shutil.copytree(temporary, into / "build" / temporary.name)


def asked(fault: Fault, tree: Path) -> str:
    """What becomes of a fault in a copy, which is put back afterwards."""
    path = tree / fault.file
    before = path.read_text(encoding="utf-8")
    extensions = {built: built.read_bytes() for built in (tree / "moit").glob("*.so")}
    path.write_text(fault.made_in(before), encoding="utf-8")
    try:
        if fault.is_compiled and not _built(tree):
            return BROKEN
        return SURVIVED if _passes(fault.tests, tree) else FOUND
    finally:
        path.write_text(before, encoding="utf-8")
        for built, content in extensions.items():
            if built.read_bytes() != content:
                built.write_bytes(content)
        if fault.is_compiled:
            for made in (tree / "build").rglob(f"{path.stem}.o"):
                made.unlink()


def _built(tree: Path) -> bool:
    command = [sys.executable, "setup.py", "-q", "build_ext", "--inplace"]
    return subprocess.run(command, cwd=tree, capture_output=True).returncode == 0


def _passes(tests: Iterable[str], tree: Path) -> bool:
    words = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:randomly", *tests]
    environment = os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", *words]
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return False  # one that never ends is found
    return done.returncode == 0


def scores(results: dict[str, tuple[Fault, str]]) -> str:
    """Found of all, per folder, and what survived."""
    folders = sorted({fault.folder for fault, _ in results.values()})
    lines = []
    for folder in [*folders, ""]:
        those = [what for fault, what in results.values() if folder in ("", fault.folder)]
        found = sum(what != SURVIVED for what in those)
        lines.append(f"{folder or 'all':32} {found:4} of {len(those):4}")
    lines += [
        f"survived: {fault.file}: {fault.find!r} -> {fault.put!r}"
        for fault, what in results.values()
        if what == SURVIVED
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
    options = parser.parse_args()
    head = ["git", "rev-parse", "HEAD"]
    commit = subprocess.run(head, cwd=ROOT, capture_output=True, text=True, check=True).stdout[:12]
    options.out.mkdir(parents=True, exist_ok=True)
    kept = options.out / f"{commit}.json"
    known = json.loads(kept.read_text()) if kept.exists() else {}
    files = changed_since(options.changed) if options.changed else None
    wanted = [
        fault
        for fault in listed()
        if options.only in fault.file and (files is None or fault.file in files)
    ]
    tree = options.out / "tree"
    copied(tree)
    results: dict[str, tuple[Fault, str]] = {}
    for fault in sorted(wanted, key=lambda one: one.is_compiled):  # those that take long at last
        if fault.key not in known:
            if fault.tests not in {one.tests for one, _ in results.values()}:
                if not _passes(fault.tests, tree):
                    sys.exit(f"without any fault these do not pass: {' '.join(fault.tests)}")
            known[fault.key] = asked(fault, tree)
            kept.write_text(json.dumps(known, indent=1))
            print(f"{known[fault.key]}: {fault.file}: {fault.put!r}", flush=True)
        results[fault.key] = (fault, known[fault.key])
    print(scores(results))
    sys.exit(any(what == SURVIVED for _, what in results.values()))


if __name__ == "__main__":
    main()
