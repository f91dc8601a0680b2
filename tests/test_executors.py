"""compare in other processes: whose death costs a cell, not the others."""

import os
import pickle
import signal
import threading
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from small import some_fragments

import moit
from moit.catalog import WeightedBlended


def killed(depth, alpha, color):
    os.kill(os.getpid(), signal.SIGKILL)


def killed_once(depth, alpha, color):
    mark = Path(os.environ["MOIT_TEST_MARK"])
    if not mark.exists():
        mark.touch()
        killed(depth, alpha, color)
    return np.ones_like(depth)


def compare(executor, techniques, **options):
    return moit.compare(
        some_fragments(),
        techniques,
        executor=executor,
        **{"repeat": 1, "progress": False, "metrics": ["mse"], **options},
    )


def processes(count):
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))


def test_a_worker_that_dies_loses_only_its_own_cell(tmp_path):
    with processes(2) as executor:
        report = compare(
            executor, ["power4", WeightedBlended(killed), "wboit", "trig2"], out=tmp_path
        )
    rows = {row["technique"]: row for row in report.rows}
    failed = rows.pop("wboit(weight=killed)")
    assert failed["mse"] is None
    assert failed["note"].startswith("BrokenProcessPool")
    assert failed["note"].endswith("(twice)")
    assert all(row["mse"] is not None and row["note"] == "" for row in rows.values())
    # what was measured is kept
    again = compare(None, ["power4", "trig2"], out=tmp_path)
    assert [row["seconds"] for row in again.rows] == [
        rows[n]["seconds"] for n in ("power4", "trig2")
    ]


def test_a_cell_that_dies_once_is_measured_again(tmp_path, monkeypatch):
    monkeypatch.setenv("MOIT_TEST_MARK", str(tmp_path / "mark"))
    with processes(1) as executor:
        rows = compare(executor, ["power4", WeightedBlended(killed_once)]).rows
    assert [row["note"] for row in rows] == ["", ""]
    assert rows[1]["mse"] is not None


class Waiting(Executor):
    """As dask's: who cannot unpickle what they are sent say nothing, and are waited for."""

    def submit(self, function, /, *args):
        future = Future()
        sent = pickle.dumps((function, args))
        try:
            with pytest.MonkeyPatch.context() as elsewhere:
                elsewhere.setenv("MOIT_TEST_WORKER", "1")
                function, args = pickle.loads(sent)
        except AttributeError:
            pytest.fail("this would be waited for, for ever")
        try:
            with pytest.MonkeyPatch.context() as elsewhere:
                elsewhere.setenv("MOIT_TEST_WORKER", "1")
                future.set_result(function(*args))
        except Exception as error:
            future.set_exception(error)
        return future


class AtHome:
    """A weight that no worker can unpickle."""

    def __call__(self, depth, alpha, color):
        return np.ones_like(depth)

    def __reduce__(self):
        return made_at_home, ()


def made_at_home():
    if "MOIT_TEST_WORKER" in os.environ:
        raise AttributeError("no module of the worker's has it")
    return AtHome()


def test_what_a_worker_cannot_unpickle_is_told():
    rows = compare(Waiting(), ["power4", WeightedBlended(AtHome())]).rows
    assert rows[0]["mse"] is not None and rows[0]["note"] == ""
    assert rows[1]["mse"] is None
    assert rows[1]["note"] == "AttributeError: no module of the worker's has it (twice)"


def test_what_nobody_can_pickle_is_measured_by_threads_of_ones_own():
    class Threads(Executor):
        def submit(self, function, /, *args):
            future = Future()
            future.set_result(function(*args))
            return future

    lock = threading.Lock()  # which has no pickle

    def weight(depth, alpha, color):
        with lock:
            return np.ones_like(depth)

    rows = compare(Threads(), [WeightedBlended(weight)]).rows
    assert [row["note"] for row in rows] == [""]


def test_a_cluster_of_dask_is_an_executor():
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    options = {"processes": True, "threads_per_worker": 1, "dashboard_address": None}
    with (
        distributed.LocalCluster(n_workers=2, **options) as cluster,
        distributed.Client(cluster) as client,
    ):
        rows = compare(client.get_executor(), ["power4", "wboit", "trig2"]).rows
    here = compare(None, ["power4", "wboit", "trig2"]).rows
    assert [row["technique"] for row in rows] == ["power4", "wboit", "trig2"]
    assert [row["mse"] for row in rows] == [row["mse"] for row in here]
    assert all(row["note"] == "" for row in rows)
