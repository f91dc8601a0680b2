"""Random hostile input for everything that takes input: python -m tests.fuzz --minutes 60

Fragments with every technique and question (hostile.py), images of twenty thousand pixels
(hostile_pixels.py: 500 cases are 10 million), damaged files of every kind that is read
(hostile_files.py), scenes and command lines (hostile_scenes.py), kits, deep verbs, derivatives and
trainings (hostile_uses.py) take turns, each in processes of their own, so that one that dies is
noticed. A case is a number. First come those of
tests/fuzz_corpus.json, ranges of (first, count) that are always tried; then new ones, from where
the last run ended (build/fuzz/state.json), so that hours add up. What is broken is printed, and
kept in build/fuzz/broken.jsonl; `--target NAME --case NUMBER` tries one again.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
if str(HERE) not in sys.path:
    sys.path.insert(0, str(HERE))
CORPUS = HERE / "fuzz_corpus.json"
TURN = 60.0  # seconds that a target has before the next one's turn

Tried = Callable[[int], list[str]]


def _fragments() -> Tried:
    import hostile

    return hostile.tried


def _files() -> Tried:
    import hostile_files

    def tried(number: int) -> list[str]:
        with tempfile.TemporaryDirectory() as folder:
            return hostile_files.tried(number, Path(folder))[1]

    return tried


def _scenes() -> Tried:
    import hostile_scenes

    return hostile_scenes.tried_scene


def _words() -> Tried:
    import hostile_scenes

    return hostile_scenes.tried_words


def _pixels() -> Tried:
    import hostile_pixels

    return hostile_pixels.tried


def _uses(name: str) -> Callable[[], Tried]:
    def found() -> Tried:
        import hostile_uses

        tried: Tried = getattr(hostile_uses, name)
        return tried

    return found


TARGETS = {
    "fragments": _fragments,
    "pixels": _pixels,
    "files": _files,
    "scenes": _scenes,
    "words": _words,
    "kits": _uses("tried_kit"),
    "deep": _uses("tried_deep"),
    "gradients": _uses("tried_gradients"),
    "doors": _uses("tried_doors"),  # nothing without JAX and PyTorch
    "trainings": _uses("tried_training"),
}


def work(target: str, numbers: Iterable[int], seconds: float, progress: Path) -> None:
    """Tries numbers until the time is over; the file names the present one, or that it is done."""
    tried, end = TARGETS[target](), time.monotonic() + seconds
    with progress.open("r+") as file:
        for number in numbers:
            file.seek(0)
            file.write(f"{number:020d}")
            file.flush()
            if time.monotonic() > end:
                return
            for what in tried(number):
                print(json.dumps({"target": target, "case": number, "what": what}), flush=True)


def turn(target: str, first: int, count: int, seconds: float) -> tuple[int, list[dict]]:
    """Tries up to `count` cases from `first` in processes of their own. Which case comes next, and
    what was broken."""
    end, last, broken = time.monotonic() + seconds, first + count, []
    with tempfile.TemporaryDirectory() as folder:
        progress = Path(folder) / "case"
        while first < last and (left := end - time.monotonic()) > 0:
            progress.write_text(f"{first:020d}")
            words = ["--target", target, "--first", str(first), "--count", str(last - first)]
            words += ["--seconds", str(left), "--progress", str(progress)]
            done = subprocess.run(
                [sys.executable, "-m", "tests.fuzz", *words],
                cwd=ROOT,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
            )
            broken += [json.loads(line) for line in done.stdout.splitlines() if line[:1] == "{"]
            reached = int(progress.read_text())
            if done.returncode:
                what = f"the process ended with {done.returncode}"
                broken.append({"target": target, "case": reached, "what": what})
            elif time.monotonic() < end:  # all were tried
                return last, broken
            first = reached + bool(done.returncode)
    return first, broken


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--target", choices=TARGETS, action="append", help="default: all")
    parser.add_argument("--case", type=int, help="of one target, alone")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "fuzz")
    for name in ("--first", "--count"):
        parser.add_argument(name, type=int, help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, help=argparse.SUPPRESS)
    parser.add_argument("--progress", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    targets = options.target or list(TARGETS)
    if options.case is not None:
        print(*TARGETS[targets[0]]()(options.case), sep="\n")
    elif options.progress:
        numbers = range(options.first, options.first + options.count)
        work(targets[0], numbers, options.seconds, options.progress)
    else:
        sys.exit(long_run(targets, 60 * options.minutes, options.out) > 0)


def long_run(targets: list[str], seconds: float, out: Path) -> int:
    """How many cases were broken."""
    out.mkdir(parents=True, exist_ok=True)
    kept = out / "state.json"
    state = json.loads(kept.read_text()) if kept.exists() else {}
    end, faults, count = time.monotonic() + seconds, 0, dict.fromkeys(targets, 0)

    def told(broken: list[dict]) -> None:
        nonlocal faults
        faults += len(broken)
        with open(out / "broken.jsonl", "a", encoding="utf-8") as file:
            for one in broken:
                print(json.dumps(one), flush=True)
                print(json.dumps(one), file=file)

    for target, ranges in json.loads(CORPUS.read_text(encoding="utf-8")).items():
        for first, length in ranges if target in targets else ():
            told(turn(target, first, length, 10 * TURN)[1])
    while (left := end - time.monotonic()) > 0:
        share = min(TURN, left / len(targets) + 1)
        for target in targets:
            first = int(state.get(target, 0))
            reached, broken = turn(target, first, 1 << 40, share)
            state[target] = reached
            count[target] += reached - first
            kept.write_text(json.dumps(state))
            told(broken)
    print(", ".join(f"{number} {target}" for target, number in count.items()), f"{faults} broken")
    return faults


if __name__ == "__main__":
    main()
