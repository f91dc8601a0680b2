"""compare in other processes: whose death costs a cell, not the others."""

import os
import signal
from concurrent.futures import ProcessPoolExecutor
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
