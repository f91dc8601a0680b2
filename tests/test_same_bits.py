"""Answers are the same bits for any number of threads and any instruction set."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from forked import preloaded
from variants import EVERY

import moit

# Some of the fragments are more than half floats hold.
pytestmark = pytest.mark.filterwarnings("ignore:.*keep sums beyond 65504")


def lacks(name: str) -> bool:
    flag = {"avx2": "avx2", "avx512": "avx512f"}[name]
    cpuinfo = Path("/proc/cpuinfo")
    return not cpuinfo.exists() or flag not in cpuinfo.read_text().split()


# glibc's malloc and aligned_alloc, but large pieces come filled with a byte.
LITTER = """
#include <stddef.h>
#include <string.h>
void *__libc_malloc(size_t);
void *__libc_memalign(size_t, size_t);
static void *filled(void *piece, size_t size) {
    return piece && size >= 512 ? memset(piece, BYTE, size) : piece;
}
void *malloc(size_t size) { return filled(__libc_malloc(size), size); }
void *aligned_alloc(size_t to, size_t size) { return filled(__libc_memalign(to, size), size); }
"""


# 0xff.. is not a number, 0x7f.. a huge one, in both precisions
RUNS = [("base", "4", "0xff"), ("avx2", "3", "0x7f"), ("avx512", "1", "0xff"), ("base", "1", "0")]


def test_neither_instructions_nor_threads_nor_what_memory_held_change_a_bit(tmp_path):
    """Each in a process of its own: what changes a bit does so whatever it is beside, and which one
    it was is asked by hand. A base of one thread stands for instructions that a machine lacks."""
    sets = {name for name, _, _ in RUNS if name == "base" or not lacks(name)}
    runs = [run for run in RUNS if run[0] in sets][:3]
    found = []
    for name, threads, byte in runs:
        run = subprocess.run(
            [sys.executable, Path(__file__).with_name("digests.py"), "--few"],
            env={
                **os.environ,
                "MOIT_ISA": name,
                "MOIT_THREADS": threads,
                **preloaded(LITTER, tmp_path, f"-DBYTE={byte}"),
            },
            capture_output=True,
            text=True,
        )
        assert run.returncode == 0, run.stderr
        said = json.loads(run.stdout)
        assert f"instruction set in use  {name}" in said["info"]
        found.append(said["digests"])
    first, *rest = found
    assert len(first) > 2 * len(EVERY)
    for other, run in zip(rest, runs[1:], strict=True):
        assert other == first, f"{run} and {runs[0]} differ"


# Counts that four pixels or those of all lanes have in common, some of them, or none.
COUNTS_OF_PIXELS = {
    "even": np.full(41, 5),
    "few": np.random.default_rng(0).geometric(0.2, 700) - 1,
    "many": np.random.default_rng(1).integers(0, 90, 60),
    "single": np.full(600, 1),
    "far apart": np.tile([2, 3, 3, 3000], 5),
}


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("counts", COUNTS_OF_PIXELS)
def test_neighbours_change_no_bit_of_a_pixel(counts, dtype):
    offsets = np.concatenate([[0], np.cumsum(COUNTS_OF_PIXELS[counts])])
    rng = np.random.default_rng(2)
    n = offsets[-1]
    f = moit.Fragments(
        offsets,
        rng.integers(1, 40, n).astype(dtype),  # some are equally far
        rng.uniform(0, 0.95, n).astype(dtype),
        rng.random((n, 3)).astype(dtype),
        depth_range=(1, 40),
    )
    for name in ("sorted", "unsorted", "weighted-sum", "weighted-average", "wboit", "power4"):
        image = moit.composite(f, name, background=(0.1, 0.2, 0.3))[0]
        some = [
            moit.composite(f[:, x : x + 3], name, background=(0.1, 0.2, 0.3))[0]
            for x in range(0, len(image), 3)
        ]
        if name == "power4":  # pixels with one fragment are asked another way where they are many
            np.testing.assert_allclose(np.concatenate(some), image, rtol=4 * np.finfo(dtype).eps)
        else:
            np.testing.assert_array_equal(np.concatenate(some), image, err_msg=name)


# Says at the end how many threads a process has begun.
COUNTED_THREADS = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
static int begun;
int pthread_create(pthread_t *t, const pthread_attr_t *a, void *(*f)(void *), void *x) {
    int (*next)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *) =
        (int (*)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *))dlsym(
            RTLD_NEXT, "pthread_create");
    ++begun;
    return next(t, a, f, x);
}
__attribute__((destructor)) static void say(void) { printf("%d\\n", begun); }
"""


def test_no_call_begins_more_threads_than_processors_work(tmp_path):
    environment = preloaded(COUNTED_THREADS, tmp_path)
    if not environment:
        pytest.skip("needs a C compiler, glibc and no other LD_PRELOAD")
    code = (
        "import moit, numpy as np\n"
        "f = moit.Fragments(np.arange(65537), np.ones(65536), np.full(65536, 0.5))\n"
        "for _ in range(3): moit.total_transmittance(f, 'sorted', threads=200)"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        env={
            **os.environ,
            **environment,
            "MOIT_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        },
        capture_output=True,
        text=True,
        check=True,
    )
    most = max(2, len(os.sched_getaffinity(0)))
    assert 3 <= int(run.stdout) <= 3 * (most - 1)
