"""The cells of a comparison, measured here or by an executor, each kept as soon as it is there."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from moit.checks.exceptions import told
from moit.comparing.measurement import Job, empty_row, measure
from moit.comparing.results_folder import ResultsFolder
from moit.comparing.rows import Result, Scene

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future

Outcome = Scene | Result


@dataclass(frozen=True)
class Cell:
    """A piece of the work."""

    function: Callable[[Job], Outcome]
    job: Job
    fingerprint: str


def results(
    cells: list[Cell],
    executor: Executor | None,
    folder: ResultsFolder | None,
    begins: Callable[[Cell], None],
) -> Iterator[tuple[int, Outcome]]:
    """Each cell's number and result: those the folder has, then the others as they come.

    begins : called with a cell before it is measured here.
    """
    left = []
    for index, cell in enumerate(cells):
        kept = None
        if folder is not None and cell.function is measure:
            kept = folder.find(cell.job, cell.fingerprint)
        if kept is None:
            left.append(index)
        else:
            yield index, kept
    measured = _here(cells, left, begins) if executor is None else _elsewhere(cells, left, executor)
    for index, result in measured:
        if folder is not None and isinstance(result, Result):
            folder.save(cells[index].job, cells[index].fingerprint, result)
        yield index, result


def _here(
    cells: list[Cell], indices: list[int], begins: Callable[[Cell], None]
) -> Iterator[tuple[int, Outcome]]:
    for index in indices:
        begins(cells[index])
        yield index, cells[index].function(cells[index].job)


def _elsewhere(
    cells: list[Cell], indices: list[int], executor: Executor
) -> Iterator[tuple[int, Outcome]]:
    """By the executor. A technique's own errors are in its result; what else goes wrong (a worker
    that died, a pool that broke with it) is tried again, and failing again is told in the row."""
    lost: dict[int, Exception] = {}
    yield from _submitted(cells, indices, executor, lost)
    again: dict[int, Exception] = {}
    usable = [index for index, error in lost.items() if not _is_broken(error)]
    yield from _submitted(cells, usable, executor, again)
    # Of a pool that broke nobody knows which cell did it: each gets a process of its own.
    broken = [index for index in lost if index not in usable] + [
        index for index, error in again.items() if _is_broken(error)
    ]
    for index in broken:
        again.pop(index, None)
        with _one_process() as process:
            yield from _submitted(cells, [index], process, again)
    for index, error in again.items():
        if cells[index].function is not measure:
            raise error
        row = empty_row(cells[index].job)
        row["note"] = f"{told(error)} (twice)"
        yield index, Result(row)


def _submitted(
    cells: list[Cell], indices: list[int], executor: Executor, lost: dict[int, Exception]
) -> Iterator[tuple[int, Outcome]]:
    """What comes back, in the order in which it does; of the others their errors, in `lost`."""
    from concurrent.futures import as_completed

    futures: dict[Future[Outcome], int] = {}
    try:
        for index in indices:
            try:
                futures[_submit(executor, cells[index])] = index
            except Exception as error:  # a pool that broke meanwhile takes no more
                lost[index] = error
        for future in as_completed(futures):
            index = futures[future]
            try:
                result = future.result()
            except Exception as error:
                lost[index] = error
            else:
                yield index, result
    finally:
        for future in futures:
            future.cancel()


class _Call:
    """Whoever unpickles this calls the function, and has what it returns."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell

    def __reduce__(self) -> tuple[Callable[[Job], Outcome], tuple[Job]]:
        return self.cell.function, (self.cell.job,)


def _submit(executor: Executor, cell: Cell) -> Future[Outcome]:
    """A worker of dask's that cannot unpickle what it is sent, as it lacks a module, asks for it
    again and again, and nobody is told. So others than Python's own executors send bytes, which
    any Python unpickles, and what is wrong with these is an error of the task."""
    from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

    if not isinstance(executor, ProcessPoolExecutor | ThreadPoolExecutor):
        try:
            try:
                from cloudpickle import dumps  # dask's, which knows what stands in __main__
            except ImportError:
                from pickle import dumps
            sent = dumps(_Call(cell))
        except Exception:  # nobody can pickle it: of threads nobody has to
            pass
        else:
            return executor.submit(pickle.loads, sent)
    return executor.submit(cell.function, cell.job)


def _is_broken(error: Exception) -> bool:
    from concurrent.futures import BrokenExecutor

    return isinstance(error, BrokenExecutor)


def _one_process() -> Executor:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    return ProcessPoolExecutor(1, mp_context=get_context("spawn"))
