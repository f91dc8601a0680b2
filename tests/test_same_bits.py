"""Answers are the same bits for any number of threads and any instruction set."""

import json
import os
import platform
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from digests import digests, picture_digests

# Some of the fragments are more than half floats hold.
pytestmark = pytest.mark.filterwarnings("ignore:.*keep sums beyond 65504")


@cache
def with_one_thread(dtype: str) -> dict[str, str]:
    return digests(dtype, threads=1)


@pytest.mark.parametrize("threads", [2, 4])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_threads_change_no_bit(dtype, threads):
    assert digests(dtype, threads) == with_one_thread(dtype)


@cache
def with_instruction_set(name: str) -> dict[str, str]:
    """Digests of a process that MOIT_ISA restricts; skips where the machine lacks the set."""
    run = in_process(MOIT_ISA=name)
    if run.returncode and name != "base" and lacks(name):
        pytest.skip(f"this machine has no {name}")
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)["digests"]


def in_process(**environment: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, Path(__file__).with_name("digests.py")],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )


def lacks(name: str) -> bool:
    flag = {"avx2": "avx2", "avx512": "avx512f"}[name]
    cpuinfo = Path("/proc/cpuinfo")
    return not cpuinfo.exists() or flag not in cpuinfo.read_text().split()


@cache
def of_pictures() -> dict[str, str]:
    return picture_digests()


@pytest.mark.parametrize("name", ["base", "avx2", "avx512"])
def test_instruction_sets_change_no_bit(name):
    there = with_instruction_set(name)
    for dtype in ("float32", "float64"):
        here = with_one_thread(dtype)
        assert {key: value for key, value in there.items() if key.endswith(dtype)} == here
    pictures = of_pictures()
    assert {key: there[key] for key in pictures} == pictures


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
@pytest.mark.parametrize("byte", ["0xff", "0x7f"])
def test_what_memory_held_before_changes_no_bit(byte, tmp_path):
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or platform.libc_ver()[0] != "glibc" or os.environ.get("LD_PRELOAD"):
        pytest.skip("needs a C compiler, glibc and no other LD_PRELOAD")
    source, library = tmp_path / "litter.c", tmp_path / "litter.so"
    source.write_text(LITTER)
    flags = ["-O1", "-fno-builtin", "-shared", "-fPIC", f"-DBYTE={byte}"]
    subprocess.run([compiler, *flags, source, "-o", library], check=True)
    run = in_process(LD_PRELOAD=str(library))
    assert run.returncode == 0, run.stderr
    found = json.loads(run.stdout)["digests"]
    answers = {**with_one_thread("float32"), **with_one_thread("float64"), **of_pictures()}
    assert found == answers
