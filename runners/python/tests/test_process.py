"""What a process sees: interrupts, memory, the lock of the interpreter."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import fredholm

# Nothing is open: pilots have no results.
SETTINGS = {"walks": 10**11, "cells": 8, "degree": 1, "pairs": "default", "last_step": False}
LONG = fredholm.Cube("0.5 * exp(-(x1-y1)^2 - (x2-y2)^2)", "1 + x1", dimension=2)


def interrupted(after: float, **settings) -> tuple[fredholm.Interrupted, float]:
    """The exception of an interrupt so many seconds after a long run began, and the seconds until it came."""
    sent = []

    def send() -> None:
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(after, send)
    timer.start()
    with pytest.raises(fredholm.Interrupted) as error:
        LONG.solve(mean=True, progress=False, **settings)
    return error.value, time.monotonic() - sent[0]


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_an_interrupt_has_the_results_so_far() -> None:
    error, _ = interrupted(0.5, method="walks", **SETTINGS)
    assert isinstance(error, KeyboardInterrupt)
    assert error.result is not None and error.result["mean"].walks > 0
    assert np.isfinite(error.result["mean"].value)


@pytest.mark.skipif(not os.environ.get("FREDHOLM_LONG"), reason="tests never assert times by day")
def test_an_interrupt_is_seen_soon() -> None:
    methods = ["walks", "resolvent"]
    delays = [interrupted(0.1 + 0.07 * i, walks=10**11, cells=8, method=methods[i % 2])[1] for i in range(20)]
    print(f"slowest of 20 interrupts: {max(delays):.3f} s")
    assert max(delays) < 0.2


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.filterwarnings("ignore::fredholm.ScalarFunctionWarning")
@pytest.mark.parametrize("vectorized", [True, False])
def test_an_interrupt_ends_a_set_up(vectorized: bool) -> None:
    calls = []

    def slow(x, y):
        calls.append("waits" if u is None else "counts")
        if calls.count("counts") == 3:
            os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.01)
        return 0.5 * x * y

    u = None
    u = fredholm.Cube(slow, lambda x: 1.0 * x, vectorized=vectorized)
    calls.clear()
    with pytest.raises(fredholm.Interrupted) as error:
        u.solve(mean=True, target_error=1e-9)
    assert error.value.result is None
    # It is seen after 50 ms, or some more where a machine has much to do.
    assert len(calls) < 200


def test_progress_is_shown_on_terminals_alone() -> None:
    source = """
import fredholm
fredholm.problems.PATIENCE = 0.0
u = fredholm.Cube("0.5 * exp(-(x1-y1)^2 - (x2-y2)^2)", "1 + x1", dimension=2)
u.solve(mean=True, method="walks", walks=3_000_000, cells=8, threads=1{})
"""
    for more, shown in (("", False), (", progress=True", True)):
        command = [sys.executable, "-c", source.format(more)]
        ran = subprocess.run(command, capture_output=True, text=True, check=True)
        assert ("fredholm: " in ran.stderr) is shown, ran.stderr


def test_other_threads_go_on() -> None:
    ticks = []
    done = threading.Event()

    def tick() -> None:
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.monotonic()
    LONG.solve(mean=True, walks=3_000_000, cells=8, threads=1, progress=False, method="walks")
    end = time.monotonic()
    done.set()
    thread.join()
    # If the lock were kept, there would be none.
    assert len([t for t in ticks if begin < t < end]) > 3


def test_progress_may_end_it() -> None:
    seen = []

    def progress(walks: int, expected: int) -> None:
        seen.append((walks, expected))
        if walks > 0:
            raise StopIteration("enough")

    with pytest.raises(StopIteration, match="enough"):
        LONG.solve(mean=True, walks=10**10, cells=8, progress=progress)
    assert seen[-1][0] > 0 and seen[-1][1] == 10**10


# Solves of another formula each, and of functions that raise now and then: what the process has more than after a tenth of them.
SOLVES = """
import os, sys, tracemalloc
import fredholm

def memory():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

def solve(i):
    u = fredholm.Cube(f"0.{i % 400 + 100} * x * y", f"x + {i}")
    u.solve(mean=True, cells=3, walks=64, batch=64, threads=1)
    if i % 10 == 0:
        v = fredholm.Cube(lambda x, y: 0.1 * x * y if i % 20 else 1 / 0, lambda x: x, vectorized=True)
        try:
            v.solve(mean=True, cells=3, walks=64, batch=64, threads=1)
        except ZeroDivisionError:
            pass

count = int(sys.argv[1])
for i in range(count // 10):
    solve(i)
tracemalloc.start()
first, own = memory(), tracemalloc.get_traced_memory()[0]
for i in range(count // 10, count):
    solve(i)
print(memory() - first, tracemalloc.get_traced_memory()[0] - own)
"""


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="Linux")
def test_nothing_leaks() -> None:
    """10,000 solves with FREDHOLM_LONG, 400 by day."""
    count = 10_000 if os.environ.get("FREDHOLM_LONG") else 400
    # With an arena for every thread the allocator keeps up to 13 MB of threads that have ended, now more and now less.
    one_arena = {**os.environ, "MALLOC_ARENA_MAX": "1"}
    ran = subprocess.run(
        [sys.executable, "-c", SOLVES, str(count)], env=one_arena, capture_output=True, text=True, check=True
    )
    more, of_python = map(int, ran.stdout.split())
    print(f"{count} solves: {more / 1e6:.2f} MB more than after a tenth of them, {of_python / 1e3:.1f} kB of Python's")
    # With one arena it comes and goes by 2.5 MB. A model and its text take 4 kB.
    assert more < 1e7 and of_python < 1e5
