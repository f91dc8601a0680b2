"""Compilers of shaders, begun as seldom as can be: most of what they take is their beginning."""

from __future__ import annotations

import ctypes
import importlib.util
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import pytest
from small import PATIENCE

from moit.gpu import texts as shaders


def tool(name: str, package: str) -> str:
    found = shutil.which(name)
    if not found:
        pytest.skip(f"needs {name} (Debian's {package})")
    return found


def run_tool(*command: object) -> str:
    done = subprocess.run(
        [str(one) for one in command], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def refused_by_glslang(stages: Mapping[str, str]) -> list[str]:
    """What glslang says of those texts that are not GLSL, in lines of our files.

    stages : by text: "comp", "vert", "frag".

    One process for all: it reads what GLSL has built in, a tenth of a second, before it reads us.
    """
    glslang = tool("glslangValidator", "glslang-tools")
    assert stages, "no texts to look at"
    with tempfile.TemporaryDirectory() as folder:
        paths = {Path(folder, f"{i}.{stages[text]}"): text for i, text in enumerate(stages)}
        for path, text in paths.items():
            path.write_text(text)
        done = subprocess.run(
            [glslang, *paths], capture_output=True, text=True, timeout=PATIENCE, check=False
        )
    # a file's name, and what is said of it
    words = re.split(rf"^({re.escape(folder)}/\S+)\n", done.stdout, flags=re.MULTILINE)[1:]
    said = dict(zip(words[::2], words[1::2], strict=True))
    assert {str(path) for path in paths} <= said.keys(), done.stdout + done.stderr
    found = [shaders.explain(said[str(path)], text) for path, text in paths.items()]
    refused = [one for one in found if "ERROR" in one]
    assert bool(refused) == bool(done.returncode), done.stdout + done.stderr
    return refused


def slangc() -> str:
    """Slang's compiler, which PyPI's slangtorch brings."""
    named = os.environ.get("MOIT_SLANGC", "") or shutil.which("slangc")
    if not named:
        found = importlib.util.find_spec("slangtorch")
        if found is None or not found.submodule_search_locations:
            pytest.skip("needs slangc: on the PATH, by MOIT_SLANGC, or of PyPI's slangtorch")
        named = os.path.join(found.submodule_search_locations[0], "bin", "slangc")
    return named


class _Slang:
    """Slang's library, with its own modules read once: four fifths of what slangc takes."""

    def __init__(self, library: Path) -> None:
        self.library = ctypes.CDLL(str(library))
        pointer, number = ctypes.c_void_p, ctypes.c_int
        for name, given, made in (
            ("spCreateSession", [ctypes.c_char_p], pointer),
            ("spCreateCompileRequest", [pointer], pointer),
            ("spDestroyCompileRequest", [pointer], None),
            ("spProcessCommandLineArguments", [pointer, pointer, number], number),
            ("spCompile", [pointer], number),
            ("spGetDiagnosticOutput", [pointer], ctypes.c_char_p),
            ("spGetEntryPointCodeBlob", [pointer, number, number, pointer], number),
        ):
            function = getattr(self.library, name)
            function.argtypes, function.restype = given, made
        self.session = self.library.spCreateSession(None)
        assert self.session, f"{library} begins no session"

    def run(self, arguments: Sequence[str], targets: int) -> list[str]:
        """What its one entry point becomes for each target, by slangc's words."""
        request = self.library.spCreateCompileRequest(self.session)
        try:
            words = (ctypes.c_char_p * len(arguments))(*(one.encode() for one in arguments))
            failed = self.library.spProcessCommandLineArguments(request, words, len(words)) < 0
            failed = failed or self.library.spCompile(request) < 0
            said = self.library.spGetDiagnosticOutput(request) or b""
            assert not failed, said.decode() or f"slangc {' '.join(arguments)} fails"
            return [self._made(request, target) for target in range(targets)]
        finally:
            self.library.spDestroyCompileRequest(request)

    def _made(self, request: int, target: int) -> str:
        blob = ctypes.POINTER(ctypes.POINTER(ctypes.c_void_p))()
        found = self.library.spGetEntryPointCodeBlob(request, 0, target, ctypes.byref(blob))
        assert found >= 0 and blob, f"slang makes nothing for target {target}"
        # ISlangBlob: three functions of an IUnknown, of which the third releases; pointer, size
        release, start, size = (
            ctypes.CFUNCTYPE(made, ctypes.c_void_p)(blob.contents[at])
            for at, made in ((2, ctypes.c_uint32), (3, ctypes.c_void_p), (4, ctypes.c_size_t))
        )
        try:
            return ctypes.string_at(start(blob), size(blob)).rstrip(b"\0").decode()
        finally:
            release(blob)


@cache
def _slang(compiler: str) -> _Slang | None:
    found = sorted(Path(compiler).resolve().parent.glob("libslang-compiler.so*"))
    return _Slang(found[0]) if found else None


def from_slang(text: str, stage: str, *targets: str) -> list[str]:
    """The text in other languages, by Slang's library where it lies beside its compiler, else by
    the compiler."""
    compiler = slangc()
    library = _slang(compiler)
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "text.slang")
        source.write_text(text)
        words = [str(source), "-entry", "main", "-stage", stage]
        if library:
            named = [word for target in targets for word in ("-target", target)]
            return library.run([*words, *named], len(targets))
        made = [Path(folder, f"text.{target}") for target in targets]
        named = [
            str(word)
            for target, path in zip(targets, made, strict=True)
            for word in ("-target", target, "-o", path)
        ]
        run_tool(compiler, *words, *named)
        return [path.read_text() for path in made]
