"""What the command refuses, in one line, and how it ends."""

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small import ENVIRONMENT, PATIENCE, some_fragments

import moit
from moit.__main__ import main

pytestmark = pytest.mark.usefixtures("trees_and_rocks")

DEEP = Path(__file__).parent / "data" / "deep"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["compare", "nowhere.exr"], "nowhere.exr"),
        (["compare", "clowd"], "did you mean 'cloud'"),
        (["compare", "trees.npz", "-t", "powr4"], "power4"),
        (["compare", "trees.npz", "--repeat", "0"], "repeat"),
        (["compare", "bad.npz"], "bad.npz"),
        (["compare", "bad.exr"], "bad.exr"),
        (["compare", "--merge", "trees.npz", "bad.exr"], "bad.exr"),
        (["compare", "plain.npz"], "color"),
        (["compare", "trees.npz", "-o", "trees.npz"], "trees.npz"),
        (["composite", "trees.npz", "-t", "sorted", "-o", "out.tga"], "out.tga"),
        (["composite", "trees.npz", "-t", "sorted", "-o", "no/such/out.exr"], "no/such"),
        (["composite", "words.txt", "-t", "sorted", "-o", "out.exr"], "words.txt"),
        (["curve", "trees.npz", "--pixel", "99,0", "-o", "c.svg"], "pixel"),
        (["curve", "trees.npz", "-t", "wboit", "-o", "c.svg"], "wboit"),
        (["curve", "trees.npz", "-o", "no/such/c.svg"], "no/such"),
    ],
)
def test_a_users_error_is_one_line_and_exit_1(arguments, words, capsys):
    Path("bad.npz").write_bytes(b"not a zip file")
    Path("bad.exr").write_bytes(b"\x76\x2f\x31\x01 and no more")
    Path("words.txt").write_text("words")
    moit.save("plain.npz", some_fragments(color=False))
    assert main(arguments) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("moit: ") and words in err
    assert err.count("\n") == 1


def test_a_bad_thread_variable_is_a_users_error(monkeypatch, capsys):
    monkeypatch.setenv("MOIT_THREADS", "many")
    assert main(["composite", "trees.npz", "-t", "sorted", "-o", "out.exr"]) == 1
    assert "MOIT_THREADS" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["paint"],
        ["compare"],
        ["composite", "trees.npz"],
        ["curve", "trees.npz", "--pixel", "5"],
        ["curve", "trees.npz", "--pixel", "a,b"],
        ["composite", "trees.npz", "-t", "sorted", "-o", "x.exr", "--background", "1,2"],
        ["demo", "--size", "0x4"],
        ["demo", "--size", "4"],
        ["compare", "trees.npz", "--repeat", "two"],
    ],
)
def test_wrong_usage_is_exit_2(arguments, capsys):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    assert "usage: moit" in capsys.readouterr().err


def test_version_is_printed():
    done = subprocess.run(
        [sys.executable, "-m", "moit", "--version"],
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
    )
    assert (done.returncode, done.stdout) == (0, f"moit {moit.__version__}\n")


def test_a_reader_that_has_enough_is_no_error():
    done = subprocess.run(
        f"'{sys.executable}' -m moit techniques | head -n 1; exit ${{PIPESTATUS[0]}}",
        shell=True,
        executable="/bin/bash",
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_ctrl_c_exits_130_and_keeps_what_was_written():
    moit.save("large.npz", some_fragments(300, 400, 8))
    process = subprocess.Popen(
        [sys.executable, "-m", "moit", "compare", "large.npz", "--repeat", "100000"],
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    )
    try:
        while not Path("report/results").exists() and process.poll() is None:
            time.sleep(0.05)
        time.sleep(0.5)  # at work, and for minutes to come
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 130
    assert re.fullmatch(r"(.*\n)?moit: interrupted.*\n", err, re.DOTALL)
    assert "Traceback" not in err
    assert not Path("report/report.html").exists()


def test_what_was_measured_before_ctrl_c_is_kept(monkeypatch, capsys):
    from moit.comparing import comparison

    measure, calls = comparison.measure, []

    def interrupted(job):
        if calls:
            raise KeyboardInterrupt
        calls.append(job)
        return measure(job)

    monkeypatch.setattr(comparison, "measure", interrupted)
    assert main(["compare", "trees.npz", "--repeat", "1"]) == 130
    assert "--resume" in capsys.readouterr().err
    assert os.listdir("report/results/trees")


def test_deep_images_are_merged_and_compared():
    files = sorted(str(path) for path in DEEP.glob("*.exr"))
    arguments = ["compare", "--merge", *files, "-t", "sorted", "-t", "power4", "--repeat", "1"]
    assert main(arguments) == 0
    rows = json.loads(Path("report/report.json").read_text())["rows"]
    assert [row["note"] for row in rows] == ["", ""]
    assert rows[0]["flip"] < 1e-6 and rows[1]["flip"] < 0.01


def said_by(capsys, *words):
    """The exit status and what is on stderr."""
    try:
        code = main(list(words))
    except SystemExit as error:
        code = error.code
    return code, capsys.readouterr().err


@pytest.mark.parametrize("output", ["o", "o.", ".png", "o.xyz", "o.exr", "png", ""])
def test_a_curve_needs_an_ending_and_leaves_nothing(output, capsys):
    before = sorted(os.listdir())
    code, said = said_by(capsys, "curve", "panes", "-t", "power4", "-o", output)
    assert code == 1 and "expected a name that ends in" in said
    assert sorted(os.listdir()) == before


@pytest.mark.parametrize("ending", ["svg", "PNG", "pdf", "eps", "jpg"])
def test_a_curve_is_written_as_its_ending_says(ending):
    pytest.importorskip("matplotlib")
    before = set(os.listdir())
    assert main(["curve", "panes", "-t", "power4", "-o", f"o.{ending}"]) == 0
    start = Path(f"o.{ending}").read_bytes()[:4]
    assert start in (b"<svg", b"<?xm", b"\x89PNG", b"%PDF", b"%!PS", b"\xff\xd8\xff\xe0")
    assert set(os.listdir()) == before | {f"o.{ending}"}


LONG = "x" * 5000


@pytest.mark.parametrize(
    "words",
    [
        ["composite", "panes", "-t", LONG, "-o", "o.png"],
        ["composite", "panes", "-t", f"power4({LONG}=1)", "-o", "o.png"],
        ["composite", "panes", "-t", f"power4(bias={LONG!r})", "-o", "o.png"],
        ["composite", LONG, "-t", "power4", "-o", "o.png"],
        ["composite", f"{LONG}.npz", "-t", "power4", "-o", "o.png"],
        ["composite", "panes", "-t", "power4", "-o", f"{LONG}.png"],
        ["composite", "panes", "-t", "power4", "-o", LONG],
        ["composite", "panes", "-t", "power4", "-o", "o.png", "--background", LONG],
        ["composite", "panes", "-t", "power4", "-o", "o.png", "--memory", LONG],
        ["composite", "panes", "-t", "power4", "-o", "o.png", "--device", LONG],
        ["curve", "panes", "-t", "power4", "-o", LONG],
        ["curve", "panes", "--pixel", LONG],
        ["compare", "panes", "-t", "power4", "--reference", LONG],
        ["compare", "panes", "--repeat", LONG],
        ["experiment", LONG],
        ["train", LONG, "-o", "n.npz"],
        ["train", "neural-bounded", "-o", "n.npz", "--loss", LONG],
        ["train", "neural-bounded", "-o", "n.npz", "--recipe", LONG],
        ["train", "neural-bounded", "-o", "n.npz", "--data", LONG],
        ["stability", "-f", LONG],
        ["stability", "-t", "power4", "-p", LONG],
        ["bench", "--size", LONG],
        ["bench", "--gpu-cost", "--stored", "--card", LONG],
        ["bench", "--gpu-cost", "--family", LONG],
        ["compare", "panes", "--gpu", LONG],
        ["demo", "--size", LONG],
        [LONG],
        ["info", LONG],
    ],
)
def test_what_is_long_is_not_echoed_whole(words, capsys):
    code, said = said_by(capsys, *words)
    assert code in (1, 2)
    assert 0 < len(said) < 2500
    assert "x" * 401 not in said


def test_messages_of_functions_cut_what_is_long():
    for call in (
        lambda: moit.technique(LONG),
        lambda: moit.technique(f"power4({LONG}=1)"),
        lambda: moit.scenes.load(LONG),
        lambda: moit.scenes.meshes(LONG),
        lambda: moit.experiment(LONG),
        lambda: moit.composite(LONG, "power4"),
        lambda: moit.compare("panes", "power4", metrics=[LONG]),
    ):
        with pytest.raises(ValueError, match=r"x{40}") as caught:
            call()
        assert len(str(caught.value)) < 1500


def test_a_full_standard_output_is_said_in_one_line():
    if not os.path.exists("/dev/full"):
        pytest.skip("there is no /dev/full")
    with open("/dev/full", "w") as full:
        run = subprocess.run(
            [sys.executable, "-m", "moit", "techniques"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            env=ENVIRONMENT,
        )
    assert run.returncode == 1
    assert run.stderr.startswith("moit: ") and run.stderr.count("\n") == 1


def test_names_that_are_no_text_are_shown():
    name = os.fsdecode(b"\xff.svg")
    run = subprocess.run(
        [sys.executable, "-m", "moit", "curve", "panes", "-t", "power4", "-o", name],
        capture_output=True,
        env=ENVIRONMENT,
    )
    assert (run.returncode, run.stdout, run.stderr) == (0, b"\\udcff.svg\n", b"")


# Words of every kind for every place.
WORDS = (
    *("trees.npz", "panes", "none.npz", "folder", "file", "", ".", "/", "/dev/null", "a\0b"),
    *("power4", "power4(", "power4(bias=nan)", "power0", "sorted(", "neural-bounded(network=no)"),
    *("0", "-1", "nan", "1e999", "9" * 30, "x", "\udcff", "٣", "1x1", "0x0", "0,0", "a,b,c", "-"),
    *("o.png", "o.exr", "o.svg", "folder/o.png", "file/o.png", "o", "--", "--nix", "-o", "-h"),
)
COMMAND_WORDS = {
    "composite": ["trees.npz", "-t", "power4", "-o", "o.png", "--background", "0,0,0"],
    "curve": ["trees.npz", "-t", "power4", "-o", "o.svg", "--pixel", "0,0"],
    "compare": ["trees.npz", "-t", "sorted", "-o", "out", "--repeat", "1", "--reference", "sorted"],
    "experiment": ["none", "-o", "out", "--size", "tiny"],
    "train": ["none", "-o", "n.npz", "--fragments", "9", "--epochs", "1", "--rate", "1", "--seed"],
    "bench": ["-t", "none", "--fragments", "9", "--repeat", "1", "--threads", "1"],
    "stability": ["-t", "power4", "-f", "none", "--rays", "1", "-o", "out"],
    "recommend": ["trees.npz", "-t", "sorted", "--max-error", "1", "--metric", "mse"],
    "scenes": [],
    "techniques": [],
}


@pytest.mark.parametrize("command", COMMAND_WORDS)
def test_nonsense_is_refused_in_one_line(command, capsys):
    r = random.Random(command)
    Path("file").write_text("")
    Path("folder").mkdir()
    for _ in range(40):
        words = list(COMMAND_WORDS[command])
        for _ in range(r.choice((1, 1, 2))):
            at = r.randrange(len(words) + 1)
            words[at : at + r.randrange(2)] = [r.choice(WORDS)]
        code, said = said_by(capsys, command, *words)
        assert code in (0, 1, 2), words
        assert "Traceback" not in said
        if code == 1:
            assert said.splitlines()[-1].startswith("moit: ")
        assert not [name for name in os.listdir() if name.startswith(".moit")], words


@pytest.mark.parametrize(("words", "code"), [("techniques", 0), ("export nope", 1)])
def test_a_closed_standard_output_is_no_error(words, code):
    done = subprocess.run(
        ["sh", "-c", f'"$0" -m moit {words} >&-', sys.executable],
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
        timeout=PATIENCE,
    )
    assert done.returncode == code and "Traceback" not in done.stderr
