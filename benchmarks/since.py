"""How much faster this tree is than an older commit of it, and what was to be reached.

    python benchmarks/since.py                    # builds 9602156 under build/since, then measures
    python benchmarks/since.py --instructions     # counts instructions too, with valgrind
    python benchmarks/since.py --compare          # with `moit.compare` of one scene, too

Both trees are asked in turn, each in a process of its own, so that whatever else the machine does
falls on both alike. Of each question the best time of the rounds counts: by the clock, and of
processors, which says more where others use the machine. Beside composites that do little and the
checks of Fragments stands at what share of the rate at which a thread reads memory, in the same
rounds, they read and write what they have to.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
COMMIT = "9602156"
SIMPLE = ("unsorted", "weighted-average", "wboit")
DENSE, SPARSE, SINGLE = "16", "geometric 4", "1"  # fragments a pixel
MEMORY = "memory"  # the question that reads so many bytes
READ = 256 << 20
SIZE = (640, 360)
COMPARED = (
    *("unsorted", "weighted-average", "wboit", "sorted", "power4", "power6", "power8", "trig2"),
    *("trig3", "moment-transparency", "fourier7", "mlab4", "adaptive4", "wavelet8", "hybrid4"),
)


@dataclasses.dataclass(frozen=True)
class Row:
    """What is asked of both trees, and how many times as fast this one was to be.

    against : a question of this tree alone that the row is held against; None: the older tree.
    bound : it may be bound by memory.
    """

    what: str
    questions: tuple[str, ...]
    floor: float
    aim: float
    against: str | None = None
    bound: bool = False


def _composites(names: tuple[str, ...], layout: str) -> tuple[str, ...]:
    return tuple(f"composite/{name}/{layout}" for name in names)


def _rows(compared: bool) -> Iterator[Row]:
    for name in SIMPLE:
        yield Row(f"{name}, 16 a pixel", _composites((name,), DENSE), 2.0, 3.0, bound=True)
    for name in SIMPLE:
        asked = _composites((name,), SPARSE)
        yield Row(f"{name}, geometric mean 4", asked, 2.5, 4.0, bound=True)
    for layout in (DENSE, SPARSE):
        yield Row(f"sorted, {_said(layout)}", _composites(("sorted",), layout), 1.5, 2.0)
    for layout, floor, aim in ((DENSE, 1.25, 1.6), (SPARSE, 1.6, 2.0), (SINGLE, 2.5, 4.0)):
        yield Row(f"power4, {_said(layout)}", _composites(("power4",), layout), floor, aim)
    for name in ("power6", "trig3", "neural-bounded"):
        yield Row(f"{name}, geometric mean 4", _composites((name,), SPARSE), 1.4, 1.8)
    for layout in (DENSE, SINGLE):
        asked = (f"fragments/{layout}",)
        yield Row(f"Fragments(...), {_said(layout)}", asked, 3.0, 3.0, bound=True)
    for name, floor, aim in (("power4", 12, 20), ("power6", 20, 40), ("power8", 20, 40)):
        yield Row(
            f"bare {name}, one depth a pixel, against diffmoments",
            (f"bare/{name}",),
            floor,
            aim,
            f"diffmoments/{name}",
        )
    if compared:
        yield Row("compare panes", ("compare",), 3.0, 6.0)


def _said(layout: str) -> str:
    return f"{layout} a pixel" if layout.isdigit() else layout.replace(" ", " mean ")


# ---- In each tree's own process ------------------------------------------------------------------


class Asked:
    """What can be asked of the moit that this process imports."""

    def __init__(self, count: int, threads: int) -> None:
        self.count, self.threads = count, threads
        self.calls: dict[str, Callable[[], Any]] = {}
        self.inputs: dict[str, tuple[Any, ...]] = {}

    def arrays(self, layout: str) -> tuple[Any, ...]:
        """Offsets, depth, alpha and colour of random fragments in float32."""
        import numpy as np

        if layout not in self.inputs:
            rng = np.random.default_rng(0)
            mean = int(re.findall(r"\d+", layout)[0])
            pixels = max(1, self.count // mean)
            each = np.full(pixels, mean)
            if not layout.isdigit():
                each = rng.geometric(1 / (mean + 1), pixels) - 1
            offsets = np.concatenate([[0], np.cumsum(each)])
            n = int(offsets[-1])
            depth = rng.uniform(1, 100, n).astype(np.float32)
            alpha = rng.uniform(0, 0.9, n).astype(np.float32)
            self.inputs[layout] = offsets, depth, alpha, rng.random((n, 3), np.float32)
        return self.inputs[layout]

    def call(self, question: str) -> Callable[[], Any]:
        if question not in self.calls:
            kind, *rest = question.split("/")
            self.calls[question] = getattr(self, f"_{kind}")(*rest)
        return self.calls[question]

    def _fragments(self, layout: str) -> Callable[[], Any]:
        import moit

        arrays = self.arrays(layout)
        return lambda: moit.Fragments(*arrays, depth_range=(1, 100))

    def _composite(self, name: str, layout: str) -> Callable[[], Any]:
        import moit

        f = self._fragments(layout)()
        return lambda: moit.composite(f, name, threads=self.threads)

    def _moments(self, name: str) -> tuple[Any, ...]:
        import numpy as np

        import moit

        b0, b = moit.moments.gather(self._fragments(DENSE)(), name)
        z = np.random.default_rng(1).uniform(-1, 1, (len(b0), 1)).astype(np.float32)
        return b0, b, z

    def bytes_of(self, question: str) -> int:
        """What that question has to read and write: arrays of fragments, offsets, the image."""
        kind, *rest = question.split("/")
        offsets, depth, alpha, color = self.arrays(rest[-1])
        read = int(offsets.nbytes + alpha.nbytes + color.nbytes)
        if kind == "fragments":
            return read + int(depth.nbytes)
        by_depth = rest[0] not in ("unsorted", "weighted-average")
        return read + by_depth * int(depth.nbytes) + 16 * (len(offsets) - 1)

    def _memory(self) -> Callable[[], Any]:
        from moit.benching import rivals

        try:
            return rivals.bytes_read(READ >> 20, self.threads)
        except rivals.Missing as missing:
            raise LookupError(str(missing)) from None

    def _bare(self, name: str) -> Callable[[], Any]:
        import moit

        b0, b, z = self._moments(name)
        return lambda: moit.moments.transmittance(name, b0, b, z, threads=self.threads)

    def _diffmoments(self, name: str) -> Callable[[], Any]:
        from moit.benching import rivals

        try:
            return rivals.diffmoments_transmittance(*self._moments(name))
        except rivals.Missing as missing:
            raise LookupError(str(missing)) from None

    def _compare(self) -> Callable[[], Any]:
        import moit

        f = moit.scenes.load("panes", SIZE)
        # The older tree takes no `threads`: its process has MOIT_THREADS.
        return lambda: moit.compare(f, COMPARED, progress=False)


def serve(count: int, threads: int) -> None:
    """Answers questions, a line each: seconds of clock and processors, or what is missing."""
    asked = Asked(count, threads)
    for line in sys.stdin:
        question = line.strip()
        try:
            call = asked.call(question)
        except LookupError as error:
            print(json.dumps(str(error)), flush=True)
            continue
        start, used = time.perf_counter(), time.process_time()
        call()
        print(json.dumps([time.perf_counter() - start, time.process_time() - used]), flush=True)


# ---- Both trees ----------------------------------------------------------------------------------


def built(commit: str) -> Path:
    """A folder with that commit, built; made where it is not there yet."""
    folder = ROOT / "build" / "since" / commit
    if not list(folder.glob("moit/_core*.so")):
        folder.mkdir(parents=True, exist_ok=True)
        archive = subprocess.check_output(["git", "archive", commit], cwd=ROOT)
        subprocess.run(["tar", "-x", "-C", str(folder)], input=archive, check=True)
        command = [sys.executable, "setup.py", "-q", "build_ext", "--inplace"]
        subprocess.run(command, cwd=folder, check=True)
    return folder


def environment(root: Path) -> dict[str, str]:
    path = os.pathsep.join(filter(None, [str(root), os.environ.get("PYTHONPATH")]))
    return os.environ | {"PYTHONPATH": path}


class Tree:
    """A process that answers questions with a tree's moit."""

    def __init__(self, root: Path, count: int, threads: int) -> None:
        command = [sys.executable, __file__, "--serve", "--fragments", str(count)]
        self.process = subprocess.Popen(
            [*command, "--threads", str(threads)],
            cwd=root,
            env=environment(root) | {"MOIT_THREADS": str(threads)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def seconds(self, question: str) -> tuple[float, float] | str:
        assert self.process.stdin and self.process.stdout
        self.process.stdin.write(question + "\n")
        self.process.stdin.flush()
        found = json.loads(self.process.stdout.readline())
        return found if isinstance(found, str) else (found[0], found[1])

    def end(self) -> None:
        assert self.process.stdin
        self.process.stdin.close()
        self.process.wait()


# What callgrind counts of a question.
COUNTED = {"composite": "moit_composite", "fragments": "check_fragments"}


def instructions(root: Path, question: str, count: int) -> float | None:
    """Instructions that the core takes for a fragment, AVX2 on one thread; None: not counted."""
    kind = question.split("/")[0]
    if kind not in COUNTED:
        return None
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [
                "valgrind",
                "--tool=callgrind",
                f"--callgrind-out-file={folder}/counted",
                f"--toggle-collect={COUNTED[kind]}",
                *(sys.executable, __file__, "--serve", "--fragments", str(count), "--threads", "1"),
            ],
            cwd=root,
            env=environment(root) | {"MOIT_ISA": "avx2", "MOIT_THREADS": "1"},
            input=question + "\n",
            capture_output=True,
            text=True,
        )
    found = re.search(r"Collected : (\d+)", done.stderr)
    # a composite's fragments have been checked before, outside of what is counted
    return int(found[1]) / count if found and not done.returncode else None


def measured(rows: list[Row], args: argparse.Namespace) -> Iterator[list[str]]:
    """The table's rows, in `args.rounds` rounds over both trees."""
    old, new = built(args.commit), ROOT
    trees = {"old": Tree(old, args.fragments, args.threads)}
    trees["new"] = Tree(new, args.fragments, args.threads)
    asked = [(row, question) for row in rows for question in row.questions]
    best: dict[tuple[str, str], tuple[float, float] | str] = {}
    sizes = Asked(args.fragments, args.threads)
    for _ in range(args.rounds + 1):  # the first warms up
        best["new", MEMORY] = _better(best.get(("new", MEMORY)), trees["new"].seconds(MEMORY))
        for row, question in asked:
            pairs = [("new", question), ("old", question)]
            if row.against:
                pairs = [("new", question), ("new", row.against)]
            for side, one in pairs:
                best[side, one] = _better(best.get((side, one)), trees[side].seconds(one))
    for tree in trees.values():
        tree.end()
    for row in rows:
        (question,) = row.questions
        ours = best["new", question]
        theirs = best["new", row.against] if row.against else best["old", question]
        wanted = [f"{row.floor:g}", f"{row.aim:g}"]
        if isinstance(ours, str) or isinstance(theirs, str):
            yield [row.what, "-", "-", "-", "-", *wanted]
            continue
        memory, share = best["new", MEMORY], "-"
        if row.bound and isinstance(memory, tuple):
            share = f"{sizes.bytes_of(question) / ours[1] / (READ / memory[1]):.0%}"
        counts = "-"
        if args.instructions and not row.against:
            both = [instructions(root, question, 1 << 16) for root in (old, new)]
            if both[0] and both[1]:
                counts = f"{both[0]:.1f} to {both[1]:.1f}"
        ratios = [f"{theirs[k] / ours[k]:.2f}" for k in (0, 1)]
        yield [row.what, *ratios, counts, share, *wanted]


def _better(
    before: tuple[float, float] | str | None, found: tuple[float, float] | str
) -> tuple[float, float] | str:
    if isinstance(found, str) or not isinstance(before, tuple):
        return found
    return min(found[0], before[0]), min(found[1], before[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--commit", default=COMMIT)
    parser.add_argument("--fragments", type=int, default=4 << 20)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--instructions", action="store_true")
    parser.add_argument("--compare", action="store_true")
    parser.add_argument("--only", default="", help="rows whose name has this in it")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.serve:
        serve(args.fragments, args.threads)
        return
    rows = [row for row in _rows(args.compare) if args.only in row.what]
    head = ["what", "by the clock", "of processors", "instructions", "of memory", "floor", "aim"]
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for row in measured(rows, args):
        print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
