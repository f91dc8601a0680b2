"""A Python that has imported moit once, and forks for each text that a test has it run.

A process of its own costs half a second of importing; what tests of a process's limits ask of it is
only that no other test lives there.
"""

import json
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType, SimpleNamespace

from small import ENVIRONMENT, PATIENCE

SERVER = """
import json, os, sys, tempfile, traceback
import numpy, moit
from moit.__main__ import main

for name in moit.__all__:
    getattr(moit, name)
for line in sys.stdin:
    asked = json.loads(line)
    child = os.fork()
    if not child:
        code = 1
        try:
            for number, name in ((1, "stdout"), (2, "stderr")):
                os.dup2(os.open(asked[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
            os.chdir(asked["folder"])
            os.environ["TMPDIR"] = asked["temporary"]
            tempfile.tempdir = None
            exec(compile(asked["text"], "<text>", "exec"), {"__name__": "__main__"})
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


def preloaded(text: str, folder: Path, *flags: str) -> dict[str, str]:
    """What a process needs in its environment for functions of the C library to be those of a text
    in C; nothing without a compiler and glibc, or where there is another LD_PRELOAD."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or platform.libc_ver()[0] != "glibc" or os.environ.get("LD_PRELOAD"):
        return {}
    source, library = folder / "before.c", folder / "before.so"
    source.write_text(text)
    flags = ("-O1", "-fno-builtin", "-shared", "-fPIC", *flags)
    subprocess.run([compiler, *flags, source, "-o", library, "-ldl"], check=True)
    return {"LD_PRELOAD": str(library)}


class Server:
    """One process; its children one after the other.

    imports : statements that import what else its children need.
    """

    def __init__(
        self, environment: Mapping[str, str] = MappingProxyType({}), imports: str = ""
    ) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", f"{imports}\n{SERVER}"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**ENVIRONMENT, **environment},
        )  # fmt: skip

    def run(self, text: str, folder: Path, temporary: Path) -> SimpleNamespace:
        """What `subprocess.run` gives of a Python that runs the text there; temporary : a folder
        beside it, for what it says and for the text's own temporary files."""
        files = {name: str(temporary / name) for name in ("stdout", "stderr")}
        asked = {"text": text, "folder": str(folder), "temporary": str(temporary), **files}
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write(json.dumps(asked) + "\n")
        self.process.stdin.flush()
        code = int(self.process.stdout.readline())
        said = {name: Path(file).read_text(encoding="utf-8") for name, file in files.items()}
        for file in files.values():
            os.unlink(file)
        return SimpleNamespace(returncode=code, **said)

    def end(self) -> None:
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.close()
        self.process.wait(PATIENCE)
        self.process.stdout.close()
