"""Where memory ends, a call raises MemoryError and loses nothing; a file is the old one or whole.

A library that stands before the C library's makes one allocation after the other fail.
"""

import json
from pathlib import Path

import pytest
import test_full_disk
import test_writers
from forked import Server, preloaded

LACK = Path(__file__).with_name("lack.c").read_text(encoding="ascii")

# How a process makes the n-th allocation fail, of those that libraries take well. NumPy looks at
# what it got for arrays, and not always for the buffers of its loops. OpenEXR reads on without what
# it asked for, and ends the process where Python has no memory for what it is given to write.
TOOLS = """
import ctypes, gc, json, sys
sys.path[:0] = [TESTS]

def number(name, kind=ctypes.c_int64):
    return kind.in_dll(ctypes.CDLL(None), "lack_" + name)

seen, live, after = number("seen"), number("live"), number("after")
first, last, least = (number(name, 3 * ctypes.c_size_t) for name in ("first", "last", "least"))

with open("/proc/self/maps") as file:
    MAPS = file.read().splitlines()

def of_module(k, module, size):
    spans = [line.split()[0].split("-") for line in MAPS if module in line]
    first[k], last[k] = (end(int(span[i], 16) for span in spans) for i, end in ((0, min), (1, max)))
    least[k] = size

def asked(call, n):
    seen.value, after.value = 0, n
    try:
        return call()
    finally:
        after.value = -1
"""

CORE = """
import numpy as np
import test_leaks
import moit
from moit import _core
from variants import EVERY

def flat(result):
    if isinstance(result, tuple | list) or getattr(result, "dtype", None) == object:
        return [flat(one) for one in result]
    if isinstance(result, np.ndarray):
        return result.shape, result.tobytes()
    return "held" if type(result).__name__ == "PyCapsule" else repr(result)

def calls():
    for name, several in test_leaks.RIGHT.items():
        for arguments in several if name not in TOLERANT else ():
            yield name, lambda: getattr(_core, name)(*arguments)
    F = test_leaks.F
    for technique in EVERY:
        if technique.engine == "core":
            fields = technique.fields_for(F)
            yield str(technique), lambda: _core.composite(F, fields, True, 1, np.zeros(3))

# These keep what Python says of names, or add to what they are given.
TOLERANT = ("use_instruction_set", "numbers", "technique_facts", "build_info")
TOLERANT += ("pull_splat_fragments",)
gc.disable()
gc.freeze()
found, failed = [], 0
for name, call in calls():
    call()
    right = flat(asked(call, -1))
    count, grown = seen.value, []
    for _ in range(3):
        before = live.value
        for n in range(count):
            try:
                if flat(asked(call, n)) != right:
                    found.append([name, n, "another result"])
            except MemoryError:
                failed += 1
            except Exception as error:
                found.append([name, n, repr(error)])
        grown.append(live.value - before)
    if min(grown) > 0:
        found.append([name, grown, "bytes are lost"])
    if flat(call()) != right:
        found.append([name, "another result afterwards"])
print(json.dumps({"found": found, "failed": failed}))
"""

# Each write in a process of its own, as one that dies is to be seen.
FILES = """
write()
write()
before = contents()
if not SPARED:
    least[0] = 4096
    of_module(1, "/_multiarray_umath.", 160 << 10)
else:
    least[0] = 1 << 62
    of_module(1, "/_core.", 1)
    shared = any("/libpython" in line for line in MAPS)
    of_module(2, "/libpython" if shared else os.path.realpath(sys.executable), SPARED)
asked(write, -1)
before, count, found, failed = contents(), seen.value, [], 0
for n in range(0, count, max(1, count // 12)):
    child = os.fork()
    if not child:
        code = 0
        try:
            asked(write, n)
        except (MemoryError, OSError) as error:
            code = 2 + (not str(error).rstrip().isprintable())
        except BaseException as error:
            print(repr(error))
            code = 1
        os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    now = contents()
    failed += code == 2
    if code not in (0, 2) or set(now) != set(before) or (code == 2 and now != before):
        found.append([n, code, sorted(now)])
    before = now
print(json.dumps({"found": found, "failed": failed}))
"""

# Of test_full_disk. Those that read deep files lack what the core asks for, and Python from so many
# bytes on; the others whatever anybody asks for.
WRITERS = {"exr": 0, "png": 0, "deep": 0, "npz": 0}
WRITERS |= {"bands": 4096, "moments": 4096, "simplified": 1 << 62}


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    environment = preloaded(LACK, tmp_path_factory.mktemp("lack"))
    if not environment:
        pytest.skip("needs a C compiler and glibc")
    made = Server(environment)
    yield made
    made.end()


def told(server, tmp_path, text: str) -> dict:
    folder = tmp_path / "files"
    folder.mkdir()
    run = server.run(text.replace("TESTS", repr(str(Path(__file__).parent))), folder, tmp_path)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1])


def test_the_core_survives_each_allocation_that_fails(server, tmp_path):
    result = told(server, tmp_path, TOOLS + CORE)
    assert result["found"] == []
    assert result["failed"] > 1500


@pytest.mark.parametrize("writer", WRITERS)
def test_who_cannot_allocate_keeps_the_old_file(server, tmp_path, writer):
    files = FILES.replace("SPARED", str(WRITERS[writer]))
    text = test_full_disk.BEGINNING + TOOLS + test_full_disk.WRITERS[writer] + files
    result = told(server, tmp_path, text)
    assert result["found"] == []
    assert result["failed"] > 0


# All of test_writers in one process, each try in a child of its own. Single results are measured
# anew where a run is not resumed.
COMMANDS = """
least[0] = 1 << 62
of_module(1, "/_core.", 1)
shared = any("/libpython" in line for line in MAPS)
of_module(2, "/libpython" if shared else os.path.realpath(sys.executable), 4096)
found, failed, clean = [], {}, sys.stderr
for COMMAND, WORDS in ALL:
    code, said = asked(lambda: run(COMMAND), -1)
    if code:
        found.append([COMMAND, code, said])
    count, before, failed[COMMAND] = seen.value, written(), 0
    out = COMMAND if "." in WORDS[-1] else COMMAND + "-again"  # what is kept is not asked again
    for n in sorted({0, count // 3}):
        child = os.fork()
        if not child:
            end = 1
            try:
                code, said = asked(lambda: run(out), n)
                is_told = said.startswith("moit: ") and said.rstrip().isprintable()
                end = 0 if code == 0 else 2 if code == 1 and is_told else 3
            except BaseException as error:
                print(repr(error), file=clean, flush=True)
            os._exit(end)
        end = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        now = written()
        failed[COMMAND] += end == 2
        whole = end in (0, 2) and broken(now) == []
        if out == COMMAND and end == 2:
            whole = whole and all(now.get(name) == content for name, content in before.items())
        lost = sorted(name for name in set(before) - set(now) if "/results/" not in name)
        if not whole or lost:
            found.append([COMMAND, n, end, broken(now), lost])
        found += [[COMMAND, n, "left behind", name] for folder, inner, files in os.walk(".")
                  for name in [*inner, *files] if name.startswith(".moit-")]
    made.update(name for _, inner, names in os.walk(".") for name in [*inner, *names])
print(json.dumps({"found": found, "failed": failed}))
"""


def test_commands_that_cannot_allocate_leave_whole_files_and_say_so(server, tmp_path):
    every = [(name, words.split()) for name, words in test_writers.COMMANDS.items()]
    names = f"ALL = {every!r}\nCOMMAND, WORDS = ALL[0]\n"
    result = told(server, tmp_path, names + TOOLS + test_writers.BEGINNING + COMMANDS)
    assert result["found"] == []
    assert min(result["failed"].values()) > 0, result["failed"]
