# SPDX-License-Identifier: Apache-2.0
"""When messages arrive, and what a list of waits comes to."""

import gc
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from sim_bridge.ros.recording import stamp_of
from sim_bridge.ros.topics import Topic

_DEPTH = 100


class Spread(NamedTuple):
    """How long something takes: how often it was timed; median, 99th percentile, longest [ms]."""

    timed: int
    p50_ms: float
    p99_ms: float
    max_ms: float


def spread(waits_ms: Sequence[float]) -> Spread:
    """Return what matters of many waits.

    Raises:
        ValueError: there is none.
    """
    if not waits_ms:
        raise ValueError("nothing was timed")
    p50_ms, p99_ms, max_ms = np.percentile(waits_ms, [50.0, 99.0, 100.0])
    return Spread(len(waits_ms), float(p50_ms), float(p99_ms), float(max_ms))


def typical(rounds: Sequence[Spread]) -> Spread:
    """Return the medians of several rounds: what else the computer does spoils some of them.

    All that was timed counts, and the longest is that of all rounds.
    """
    p50_ms, p99_ms = (np.median([each[k] for each in rounds]) for k in (1, 2))
    timed, max_ms = sum(each.timed for each in rounds), max(each.max_ms for each in rounds)
    return Spread(timed, float(p50_ms), float(p99_ms), max_ms)


def uneven(arrivals_s: Sequence[float], period_s: float) -> list[float]:
    """Return by how much each interval between arrivals differs from the period [ms]."""
    return [1e3 * abs(step - period_s) for step in np.diff(arrivals_s).tolist()]


class Arrival(NamedTuple):
    """A message as it came: its own stamp [ns], when it came [s of the steady clock], its bytes."""

    stamp_ns: int
    at_s: float
    data: bytes


class Ear:
    """Notes when each message of a topic arrives; they are read only afterwards."""

    def __init__(self, node: Node, topic: Topic) -> None:
        self._topic = topic
        self._arrivals: list[Arrival] = []
        self._changed = threading.Condition()
        qos = QoSProfile(depth=_DEPTH, reliability=topic.qos.reliability)
        node.create_subscription(topic.message, topic.name, self._hear, qos, raw=True)

    def _hear(self, data: bytes) -> None:
        at_s = time.perf_counter()
        with self._changed:
            self._arrivals.append(Arrival(stamp_of(data), at_s, data))
            self._changed.notify_all()

    def wait(self, stamp_ns: int, timeout_s: float) -> Arrival | None:
        """Return the newest message once it bears this stamp, None if it does not in time."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest_ns() == stamp_ns, timeout_s)
            return self._arrivals[-1] if self._newest_ns() == stamp_ns else None

    def _newest_ns(self) -> int | None:
        return self._arrivals[-1].stamp_ns if self._arrivals else None

    def newest(self) -> Any:  # noqa: ANN401 (a message of any type)
        """Return the newest message, None if there is none."""
        with self._changed:
            last = self._arrivals[-1] if self._arrivals else None
        return None if last is None else self.read(last)

    def read(self, arrival: Arrival) -> Any:  # noqa: ANN401 (a message of any type)
        """Return the message itself."""
        return deserialize_message(arrival.data, self._topic.message)

    def clear(self) -> None:
        """Forget what has come so far."""
        with self._changed:
            self._arrivals.clear()

    def all(self) -> list[Arrival]:
        """Return everything since the beginning."""
        with self._changed:
            return list(self._arrivals)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Collect no garbage in this process, whose pauses would count as the nodes' own."""
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()
