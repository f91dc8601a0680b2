"""A training that was interrupted goes on to the same bits."""

import signal
import subprocess
import sys
import time
from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest
from small import ENVIRONMENT, PATIENCE
from test_training import SIZES, SMALL, random_examples, single

import moit
from moit.__main__ import main
from moit.neural import checkpoint, training
from moit.neural.checkpoint import CheckpointError
from moit.neural.fitting import Schedule, State, fit


def test_a_fit_that_goes_on_is_the_fit_that_did_not_stop():
    examples = random_examples("absorbance", pixels=200)
    examples = replace(examples, features=examples.features.astype("f4"))
    schedule = Schedule(6, 64, 1e-2, True, "color", 5)
    whole = State.start(SIZES, 5)
    fit(whole, examples, None, schedule)

    class Stop(Exception):
        pass

    def stop(state):
        if state.epoch == 3:
            raise Stop

    part = State.start(SIZES, 5)
    with pytest.raises(Stop):
        fit(part, examples, None, schedule, stop)
    part = part.copy()
    fit(part, examples, None, schedule)
    assert np.array_equal(part.network.parameters, whole.network.parameters)
    assert np.array_equal(part.losses, whole.losses, equal_nan=True)


def interrupted_after(epochs):
    def listener(done, total, label):
        if done == epochs:
            raise KeyboardInterrupt

    return listener


def test_an_interrupted_training_goes_on_to_the_same_network(tmp_path):
    path = tmp_path / "kept.npz"
    whole = moit.train("neural-bounded", "surfaces", **SMALL)
    options = {**SMALL, "progress": interrupted_after(2)}
    with pytest.raises(KeyboardInterrupt, match=r"2 of 4 epochs.*resume=True.*kept\.npz"):
        moit.train("neural-bounded", "surfaces", checkpoint=path, **options)
    again = moit.train("neural-bounded", "surfaces", checkpoint=path, resume=True, **SMALL)
    assert np.array_equal(again.packed(), whole.packed())
    assert again.recipe == whole.recipe and again.scores == whole.scores
    assert list(tmp_path.iterdir()) == [path]  # and nothing half written


def test_a_checkpoint_gives_back_all_of_a_state(tmp_path):
    path, plan = tmp_path / "kept.npz", {"sizes": list(SIZES), "seed": 3}
    state = State.start(SIZES, 1)
    fit(state, single(random_examples("share")), None, Schedule(2, 26, 0.1, True, "color", 3))
    checkpoint.write(path, state, plan)
    again = checkpoint.read(path, plan)
    assert np.array_equal(again.network.parameters, state.network.parameters)
    assert np.array_equal(again.adam.first, state.adam.first)
    assert np.array_equal(again.adam.second, state.adam.second)
    assert (again.adam.steps, again.epoch) == (state.adam.steps, 2) and state.adam.steps > 2
    assert np.array_equal(again.losses, state.losses, equal_nan=True)
    with np.load(path) as archive:
        kept = dict(archive)
    for changes, words in (
        ({"version": np.int64(2)}, "found version 2; needed 1"),
        ({"first": kept["first"][:-1]}, "damaged"),
        ({"second": np.full_like(kept["second"], np.nan)}, "damaged"),
        ({"parameters": kept["parameters"].astype(float)}, "damaged"),
        ({"losses": kept["losses"].ravel()}, "damaged"),
    ):
        np.savez(path, **kept | changes)
        with pytest.raises(CheckpointError, match=words):
            checkpoint.read(path, plan)


def test_a_checkpoint_is_kept_every_ten_seconds_and_at_the_end(tmp_path, monkeypatch):
    clock, kept = count(0, 3), []
    monkeypatch.setattr(training, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    write = training.checkpoints.write
    monkeypatch.setattr(
        training.checkpoints, "write", lambda *a: kept.append(a[1].epoch) or write(*a)
    )
    options = {**SMALL, "fragments": 200, "epochs": 8, "checkpoint": tmp_path / "kept.npz"}
    moit.train("neural-bounded", "surfaces", **options)
    # an epoch takes three seconds of this clock, and so does looking at it once more
    assert kept == [4, 8, 8]


def test_the_same_seed_gives_the_same_bits_and_another_does_not():
    first, second = (moit.train("neural-bounded", "surfaces", **SMALL) for _ in range(2))
    assert np.array_equal(first.packed(), second.packed())
    other = moit.train("neural-bounded", "surfaces", seed=1, **SMALL)
    assert not np.array_equal(first.packed(), other.packed())
    assert first.data_hash == second.data_hash != other.data_hash


def test_a_checkpoint_of_another_training_is_refused(tmp_path):
    path = tmp_path / "kept.npz"
    moit.train("neural-bounded", "surfaces", checkpoint=path, **SMALL)
    with pytest.raises(CheckpointError, match="another training: rate was"):
        moit.train("neural-bounded", "surfaces", checkpoint=path, resume=True, rate=0.1, **SMALL)
    with pytest.raises(CheckpointError, match="another training: technique"):
        moit.train("neural-bounded6", "surfaces", checkpoint=path, resume=True, **SMALL)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(CheckpointError, match="not a readable checkpoint"):
        moit.train("neural-bounded", "surfaces", checkpoint=path, resume=True, **SMALL)
    with pytest.raises(FileNotFoundError):
        moit.train("neural-bounded", checkpoint=tmp_path / "none", resume=True, **SMALL)


def test_the_command_writes_a_network_and_takes_its_checkpoint_away(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ["train", "neural-bounded", "--data", "surfaces", "--fragments", "2000"]
    assert main([*arguments, "--epochs", "2", "-o", "made.npz"]) == 0
    assert "made.npz" in capsys.readouterr().out
    assert moit.Network.read("made.npz").recipe["epochs"] == 2
    assert [path.name for path in tmp_path.iterdir()] == ["made.npz"]
    assert main(["train", "power4", "-o", "made.npz"]) == 1
    assert "runs no network" in capsys.readouterr().err


def test_ctrl_c_leaves_a_checkpoint_and_says_how_to_go_on(tmp_path):
    code = (
        "import sys\n"
        "from moit.__main__ import main\n"
        "from moit.neural import training\n"
        "training.SECONDS_BETWEEN_CHECKPOINTS = 0.0\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    command = [sys.executable, "-c", code, "train", "neural-bounded", "--data", "surfaces"]
    command += ["--fragments", "20000", "--epochs", "100000", "-o", str(tmp_path / "made.npz")]
    run = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
    while not (tmp_path / "made.checkpoint.npz").exists():  # then it is at work, and far from done
        assert run.poll() is None
        time.sleep(0.1)
    run.send_signal(signal.SIGINT)
    said = run.communicate(timeout=PATIENCE)[1]
    assert run.returncode == 130
    assert "--resume" in said and "Traceback" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["made.checkpoint.npz"]
