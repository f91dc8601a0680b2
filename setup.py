"""The C core and the pass driver as extensions; everything static is in pyproject.toml.

Units named *_avx2.c and *_avx512.c ask for their instruction set themselves, so all files
share one set of flags. MOIT_CFLAGS and MOIT_LDFLAGS add flags (sanitizers, coverage, -Werror).
"""

import os
import re
import shlex
from concurrent.futures import ThreadPoolExecutor
from glob import glob

import numpy
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

FLAGS = [
    "-std=gnu11",
    "-O3",
    "-g0",  # what a debugger needs takes a fifth of a compiler's time; MOIT_CFLAGS=-g asks for it
    "-fno-math-errno",
    "-fno-trapping-math",
    "-ffp-contract=off",  # the same bits for every instruction set
    "-fvisibility=hidden",
    "-pthread",
    "-Wall",
    "-Wextra",
    "-Wdouble-promotion",
    "-Wno-psabi",  # wide vectors pass between functions of one unit only
]

# Texts of numbers that C, GLSL and Python share.
SHARED = ["csrc/kernels/options.h", "shaders/arrays/bindings.glsl"]


def shader_texts():
    """The files that moit.gpu.texts can read, by the names it has for them."""
    found = {
        os.path.relpath(path, "shaders"): path for path in glob("shaders/**/*.glsl", recursive=True)
    }
    for path in glob("csrc/kernels/*.h") + glob("csrc/kernels/*.glsl"):
        found[f"kernels/{os.path.basename(path)}"] = path
    return {name.replace(os.sep, "/"): found[name] for name in sorted(found)}


def write_texts(path):
    """Puts all shader texts into a C file."""

    def literal(line):
        named = {b"\\"[0]: "\\\\", b'"'[0]: '\\"', b"\n"[0]: "\\n", b"\t"[0]: "\\t"}
        return "".join(
            named.get(byte, chr(byte) if 32 <= byte < 127 else f"\\{byte:03o}") for byte in line
        )

    lines = [
        "/* Written by setup.py. */",
        '#include "binding.h"',
        "const shader_text shader_texts[] = {",
    ]
    for name, source in shader_texts().items():
        with open(source, "rb") as file:
            lines += [f'{{"{name}",', *(f'"{literal(line)}"' for line in file), '""},']
    write(path, [*lines, "{0, 0}};"])


def write_numbers(path):
    """Puts what these texts define into a C file, by name: C knows their values."""
    lines = ["/* Written by setup.py. */", '#include "python/shared_numbers.h"']
    names = []
    for source in SHARED:
        lines.append(f'#include "{os.path.relpath(source, "csrc")}"'.replace(os.sep, "/"))
        with open(source, encoding="ascii") as file:
            names += re.findall(r"^#define (\w+) \S", file.read(), re.MULTILINE)
    lines += ["const shared_number shared_numbers[] = {", *(f'{{"{n}", {n}}},' for n in names)]
    write(path, [*lines, "{0, 0}};"])


def write(path, lines):
    """A file of these lines, unless it is that already."""
    text = "\n".join([*lines, ""])
    os.makedirs(os.path.dirname(path), exist_ok=True)
    try:
        with open(path, encoding="ascii") as file:
            if file.read() == text:
                return
    except OSError:
        pass
    with open(path, "w", encoding="ascii") as file:
        file.write(text)


# Of each extension the unit that the build writes.
WRITTEN = {
    "moit._core": ("shared_numbers.c", write_numbers),
    "moit._gl": ("shader_texts.c", write_texts),
}


def by_length(sources):
    """The units of vectors first: they take longest, and none is left alone at the end."""
    return sorted(sources, key=lambda source: ("stages" not in source, source))


class ParallelBuild(build_ext):
    """Compiles the units of one extension side by side: the widest take long.

    In an order of its own: that of `sources` is lost, which build_ext sorts by name."""

    def build_extension(self, ext):
        name, write_source = WRITTEN[ext.name]
        written = os.path.join(self.build_temp, name)
        write_source(written)
        # once, where one process builds twice, as `build` and then `bdist_wheel` may
        ext.sources = [*(source for source in ext.sources if source != written), written]
        compile_one = self.compiler.compile

        def compile_all(sources, **options):
            jobs = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
            with ThreadPoolExecutor(jobs) as pool:
                begun = {s: pool.submit(compile_one, [s], **options) for s in by_length(sources)}
                return [one for source in sources for one in begun[source].result()]

        self.compiler.compile = compile_all
        try:
            super().build_extension(ext)
        finally:
            self.compiler.compile = compile_one


setup(
    ext_modules=[
        Extension(
            "moit._core",
            sources=sorted(glob("csrc/core/**/*.c", recursive=True) + glob("csrc/python/*.c")),
            depends=sorted({*glob("csrc/**/*.h", recursive=True), *SHARED}),
            include_dirs=["csrc", numpy.get_include()],
            define_macros=[
                ("NPY_NO_DEPRECATED_API", "NPY_2_0_API_VERSION"),
                ("NPY_TARGET_VERSION", "NPY_2_0_API_VERSION"),
            ],
            extra_compile_args=FLAGS + shlex.split(os.environ.get("MOIT_CFLAGS", "")),
            extra_link_args=["-pthread", "-lm", *shlex.split(os.environ.get("MOIT_LDFLAGS", ""))],
        ),
        Extension(
            "moit._gl",
            sources=sorted(glob("csrc/gl/*.c") + glob("csrc/python/gl/*.c")),
            depends=sorted([*glob("csrc/**/*.h", recursive=True), *shader_texts().values()]),
            include_dirs=["csrc", "csrc/python/gl"],
            extra_compile_args=FLAGS + shlex.split(os.environ.get("MOIT_CFLAGS", "")),
            extra_link_args=["-pthread", "-ldl", *shlex.split(os.environ.get("MOIT_LDFLAGS", ""))],
        ),
    ],
    cmdclass={"build_ext": ParallelBuild},
)
