"""Chooses the quick tests: of every test function its first case, but for few that take long.

And what tests of several files set up before they begin.
"""

import gc
import itertools
import os
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from hypothesis import settings

# Training multiplies small matrices: threads that wait for one another, beside as many processes of
# tests as there are processors, take twenty times as long. NumPy is not loaded yet.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# llvmpipe computes the same without LLVM's optimisations, and a third of the tests that ask it is
# compiling: most shaders run once, over little.
os.environ.setdefault("GALLIVM_PERF", "nopt")

# LLVM compiles vectors of four floats by a tenth faster than of eight, which the CPU would hold.
os.environ.setdefault("LP_NATIVE_VECTOR_WIDTH", "128")

# The same examples in each run, on however slow a machine: a suite that fails by chance tells
# nothing of the commit that it fails on. `pytest --hypothesis-profile=default` looks for others.
settings.register_profile("same", derandomize=True, deadline=None)
settings.load_profile("same")

# What takes seconds, by file: test functions, and fixtures that do for all who ask for them.
LONG = {
    "test_c_core.py": {"programs"},  # compiles the core twice
    "test_deep_bands.py": {"test_memory_is_bounded"},  # needs an image larger than memory's noise
    "test_gpu_errors.py": {"test_nothing_is_kept"},  # memory grows over many calls or does not
    "test_interrupt.py": {  # calls that last long enough to be interrupted
        "test_signals_are_handled_while_a_call_lasts_and_may_stop_it",
        "test_other_python_threads_run_while_a_call_lasts",
        "test_the_core_asks_many_times_in_a_call_of_a_few_seconds",
    },
    "test_notebooks.py": {"test_a_notebook_runs_and_puts_out_what_is_committed_with_it"},  # Jupyter
    "test_per_pixel.py": {"test_a_gpu_composites_what_the_cpu_chose"},  # a choice for each pixel
    "test_same_bits.py": {  # digests of everything, in processes of their own
        "test_neither_instructions_nor_threads_nor_what_memory_held_change_a_bit",
    },
    "test_stability.py": {"everything", "of_moments"},  # measure all techniques on many rays
}


def takes_long(item: pytest.Item) -> bool:
    asked_for = {item.originalname, *item.fixturenames}
    return not asked_for.isdisjoint(LONG.get(item.path.name, ()))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    seen = set()
    for item in items:
        function = item.nodeid.partition("[")[0]
        if function not in seen and not takes_long(item):
            item.add_marker(pytest.mark.quick)
        seen.add(function)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    gc.disable()  # what is made for all tests stays, so that looking for garbage finds none
    try:
        return (yield)
    finally:
        gc.freeze()  # else each collection of garbage looks at all tests that are to come
        gc.enable()


@pytest.fixture
def no_two_seconds_alike(monkeypatch):
    """A clock in compare by which no two measurements last equally long.

    A test that asks whether something was measured anew looks whether its seconds have changed,
    and by the machine's own clock two short measurements are equal now and then.
    """
    readings = (n * n for n in itertools.count())
    clock = SimpleNamespace(perf_counter=lambda: float(next(readings)))
    monkeypatch.setattr("moit.comparing.measurement.time", clock)


@pytest.fixture
def trees_and_rocks(tmp_path, monkeypatch):
    """A folder of its own for what commands write, with two files to read."""
    from small import some_fragments

    import moit

    monkeypatch.chdir(tmp_path)
    moit.save("trees.npz", some_fragments())
    moit.save("rocks.npz", some_fragments(seed=5))
