"""The core without Python: C programs against csrc/moit.h alone, by every compiler there is.

They link the objects of the extension: the core that is tested is the one that is shipped, a cache
of compilations may have it already, and no compiler has a warning for the binding either.
"""

import os
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import elementary_tables
import pytest
from small import PATIENCE

sys.path.insert(0, str(Path(__file__).parent / "c"))
from c_core import build, build_extensions, compile_header_alone, program_names

# By gcc without assertions, as Python's flags have it; by clang with them, and in half the time:
# AVX2's lanes, whose text is that of AVX-512's, are gcc's alone.
COMPILERS = {"gcc": [], "clang": ["-UNDEBUG", "-O1", "-DMOIT_NO_AVX2"]}
CORE = Path(__file__).parent.parent / "csrc" / "core"


def needs(compiler: str) -> None:
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not installed")


@pytest.fixture(scope="session")
def programs(tmp_path_factory):
    """The programs as a compiler builds them, with warnings as errors: once for all processes of
    a session, of which the first builds and the others wait."""
    fcntl = pytest.importorskip("fcntl")
    shared = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        shared = shared.parent

    @cache
    def built(compiler: str) -> dict[str, Path]:
        needs(compiler)
        into, done = shared / compiler, shared / f"{compiler}.built"
        with open(shared / f"{compiler}.lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not done.exists():
                into.mkdir(exist_ok=True)
                objects = build_extensions(compiler, into, COMPILERS[compiler])
                build(compiler, into, flags=[], objects=objects)
                done.touch()
        return {name: into / name for name in program_names()}

    return built


# By clang all answers of these lanes and the base's are those of gcc's, see below; and a thread
# sanitizer of clang's asks this program of the base's.
GCC_ALONE = {"same_bits"}


@pytest.mark.parametrize(
    ("compiler", "name"),
    [
        (compiler, name)
        for compiler in COMPILERS
        for name in program_names()
        if compiler == "gcc" or name not in GCC_ALONE
    ],
)
def test_the_core_keeps_what_its_header_says(programs, compiler, name):
    run = subprocess.run(
        [programs(compiler)[name]], capture_output=True, text=True, timeout=PATIENCE
    )
    assert run.returncode == 0, run.stderr


# A processor without fused products, as the GNU C library sees it: its exp has other last bits.
NOT_FUSED = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-FMA_Usable,-AVX2,-AVX2_Usable"}


def test_compilers_and_math_libraries_change_no_bit(programs):
    def digests(compiler: str, more: dict[str, str], *lanes: str) -> list[str]:
        run = subprocess.run(
            [programs(compiler)["digests"], *lanes],
            env={**os.environ, **more},
            capture_output=True,
            text=True,
            check=True,
            timeout=PATIENCE,
        )
        return run.stdout.splitlines()

    found = digests("gcc", {})
    assert len(found) > 1000
    assert digests("gcc", NOT_FUSED) == found
    assert digests("clang", {}) == found
    assert digests("clang", {}, "base") == found


def test_tables_are_right_to_all_digits():
    """Each number of core/elementary_tables.h, and how many there are of each kind."""
    text = re.sub(r"/\*.*?\*/", "", elementary_tables.FILE.read_text(), flags=re.DOTALL)
    written = [float.fromhex(one) for one in re.findall(r"-?0x[01]\.[0-9a-f]*p[+-]\d+", text)]
    assert written == elementary_tables.tables()


# Of a math library; its other functions (sqrt, ldexp, rint, fmin, ...) have one right answer.
INEXACT = (
    "exp exp2 exp10 expm1 log log2 log10 log1p pow cbrt hypot sin cos tan asin acos atan atan2"
)
INEXACT += " sinh cosh tanh asinh acosh atanh erf erfc tgamma lgamma"


def test_the_core_asks_no_math_library():
    """Whose last bits differ: core/elementary.h has what it needs."""
    names = "|".join(INEXACT.split())
    found = []
    for file in sorted([*CORE.rglob("*.[ch]"), *CORE.parent.glob("kernels/*.h")]):
        code = re.sub(r"/\*.*?\*/|//[^\n]*", "", file.read_text(), flags=re.DOTALL)
        found += [
            (file.name, one)
            for one in re.findall(rf"(?<![\w.])(?:__builtin_)?(?:{names})[fl]?\(", code)
        ]
    assert found == []


@pytest.mark.parametrize(
    ("compiler", "name"),
    [
        ("gcc", "header.c"),
        ("clang", "header.c"),
        ("g++", "header.cpp"),
        ("clang++", "header.cpp"),
    ],
)
def test_the_header_alone_is_strict_c11_and_cpp(compiler, name, tmp_path):
    needs(compiler)
    compile_header_alone(compiler, name, tmp_path)
