"""Long calls: signals get through and stop them, and meanwhile other Python threads run."""

import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np
import pytest
from small import ENVIRONMENT, PATIENCE, some_fragments
from variants import EVERY

import moit

pytestmark = pytest.mark.skipif(
    not hasattr(signal, "setitimer"), reason="signals and timers are POSIX's"
)

# A curve looks at each fragment for each depth: here ten thousand million times, which takes many
# seconds, in pieces of less than one, between which the core asks.
PIXELS, FRAGMENTS, DEPTHS = 40_000, 500, 500


def long_question() -> tuple[moit.Fragments, np.ndarray]:
    f = moit.Fragments(
        np.arange(0, PIXELS * FRAGMENTS + 1, FRAGMENTS),
        np.tile(np.linspace(1, 2, FRAGMENTS, dtype=np.float32), PIXELS),
        np.full(PIXELS * FRAGMENTS, 0.001, np.float32),
    )
    return f, np.linspace(1, 2, DEPTHS)


class EnoughError(Exception):
    pass


@contextmanager
def called_every(seconds: float, handler):
    """While the core asks, which is now and then; otherwise once, after the call into it."""

    def alarm(number, frame):
        try:
            handler()
        except BaseException:
            signal.setitimer(signal.ITIMER_REAL, 0)  # or it raises again while the first one leaves
            raise

    before = signal.signal(signal.SIGALRM, alarm)
    signal.setitimer(signal.ITIMER_REAL, seconds, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("threads", [1, 3])
def test_signals_are_handled_while_a_call_lasts_and_may_stop_it(threads):
    f, depth = long_question()
    handled = []

    def handler():
        handled.append(None)
        if len(handled) == 3:
            raise EnoughError

    with called_every(0.05, handler), pytest.raises(EnoughError):
        moit.transmittance(f, "sorted", depth, threads=threads)
    assert moit.transmittance(f[0, :2], "sorted", [1.5], threads=threads).shape == (1, 2, 1)


def test_the_core_asks_many_times_in_a_call_of_a_few_seconds():
    """Bounds of many small pixels, in pieces of milliseconds. Were it seconds between questions,
    the call would be over before so many signals were heard."""
    rng = np.random.default_rng(0)
    n = 10_000_000
    f = moit.Fragments(
        np.arange(0, n + 1, 4), rng.uniform(1, 2, n).astype("f4"), np.full(n, 0.25, "f4")
    )
    handled = []

    def handler():
        handled.append(None)
        if len(handled) == 15:
            raise EnoughError

    with called_every(0.01, handler), pytest.raises(EnoughError):
        moit.bounds(f, "power8", threads=1)


CONTROL_C = """
from test_interrupt import long_question
import moit

f, depth = long_question()
try:
    print("ready", flush=True)
    moit.transmittance(f, "sorted", depth, threads=2)  # of many cores it would be over soon
except KeyboardInterrupt:
    print("interrupted")
print(moit.transmittance(f[0, :2], "sorted", [1.5]).shape)
"""


def test_ctrl_c_is_a_keyboard_interrupt_and_moit_goes_on():
    process = subprocess.Popen(
        [sys.executable, "-c", CONTROL_C],
        env={
            **ENVIRONMENT,
            "PYTHONPATH": ":".join([ENVIRONMENT["PYTHONPATH"], *filter(None, sys.path)]),
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout.readline() == "ready\n", process.stderr.read()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert (process.returncode, out) == (0, "interrupted\n(1, 2, 1)\n"), err


def test_other_python_threads_run_while_a_call_lasts():
    # What the other thread does between two questions of the core, it does while the core works.
    f, depth = long_question()
    done, left_at = threading.Event(), None
    steps = 0

    def other():
        nonlocal steps
        while not done.is_set():
            steps += 1

    def handler():
        nonlocal left_at
        if left_at is not None and steps > left_at:
            raise EnoughError
        left_at = steps

    thread = threading.Thread(target=other)
    thread.start()
    try:
        with called_every(0.05, handler), pytest.raises(EnoughError):
            moit.transmittance(f, "sorted", depth, threads=1)
    finally:
        done.set()
        thread.join()


def test_python_threads_that_call_at_once_get_equal_results():
    f = some_fragments(height=70, width=70)  # several pieces of work for a thread
    questions = [
        lambda technique=technique: (
            moit.composite(f, technique, threads=2),
            *moit.bounds(f, technique, threads=2),
            moit.total_transmittance(f, technique, threads=2),
        )
        for technique in EVERY
    ]
    alone = [question() for question in questions]
    with ThreadPoolExecutor(4) as pool:
        together = [pool.submit(question) for question in questions * 3]
        for needed, found in zip(alone * 3, together, strict=True):
            for a, b in zip(needed, found.result(), strict=True):
                np.testing.assert_array_equal(a, b)
