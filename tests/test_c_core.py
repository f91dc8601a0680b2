"""The core without Python: C programs against csrc/moit.h alone, by every compiler there is."""

import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "c"))
from c_core import build, compile_header_alone, program_names

COMPILERS = ["gcc", "clang"]
by_every_compiler = pytest.mark.parametrize("compiler", COMPILERS)


def needs(compiler: str) -> None:
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not installed")


@pytest.fixture(scope="session")
def programs(tmp_path_factory):
    """The programs as a compiler builds them, once a session, with warnings as errors."""

    @cache
    def built(compiler: str) -> dict[str, Path]:
        needs(compiler)
        return build(compiler, tmp_path_factory.mktemp(compiler), flags=[])

    return built


@by_every_compiler
@pytest.mark.parametrize("name", program_names())
def test_the_core_keeps_what_its_header_says(programs, compiler, name):
    run = subprocess.run([programs(compiler)[name]], capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr


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
