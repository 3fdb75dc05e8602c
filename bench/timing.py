# SPDX-License-Identifier: Apache-2.0
"""Rounds that take turns, and how long single calls take."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from statistics import median
from typing import NamedTuple

import numpy as np

from bench.progress import say


class Latency(NamedTuple):
    """How long a call takes: median and 99th percentile [ms]."""

    p50_ms: float
    p99_ms: float


class Stopwatch:
    """Processor time and time of day since it was made [s]."""

    def __init__(self) -> None:
        self._cpu, self._wall = time.process_time(), time.perf_counter()

    @contextmanager
    def stopped(self) -> Iterator[None]:
        """Leave out what happens inside."""
        cpu_s, wall_s = self.cpu_s, self.wall_s
        yield
        self._cpu, self._wall = time.process_time() - cpu_s, time.perf_counter() - wall_s

    @property
    def cpu_s(self) -> float:
        """Time that this process computed."""
        return time.process_time() - self._cpu

    @property
    def wall_s(self) -> float:
        """Time that passed."""
        return time.perf_counter() - self._wall


def in_turns(contestants: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, float]:
    """Let each contestant measure its speed once a round; return its median over the rounds.

    Taking turns, all of them meet the same moods of the machine.
    """
    results: dict[str, list[float]] = {name: [] for name in contestants}
    for number in range(1, rounds + 1):
        for name, measure in contestants.items():
            results[name].append(measure())
        speeds = ", ".join(f"{name} {values[-1]:,.0f}/s" for name, values in results.items())
        say(f"round {number} of {rounds}: {speeds}")
    return {name: median(values) for name, values in results.items()}


def repeat_for(work: Callable[[], object], limit_s: float) -> float:
    """Repeat some work until so much time was computed; return repetitions a second."""
    watch, count = Stopwatch(), 0
    while watch.cpu_s < limit_s:
        work()
        count += 1
    return count / watch.cpu_s


def latency(work: Callable[[], object], repetitions: int) -> Latency:
    """Return how long one call takes, after a few that do not count."""
    took_ms = np.empty(repetitions)
    for k in range(-10, repetitions):
        begin = time.thread_time()
        work()
        if k >= 0:
            took_ms[k] = 1e3 * (time.thread_time() - begin)
    p50_ms, p99_ms = np.percentile(took_ms, [50.0, 99.0])
    return Latency(float(p50_ms), float(p99_ms))
