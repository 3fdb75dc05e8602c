# SPDX-License-Identifier: Apache-2.0
import gc
import weakref
from collections.abc import Iterator

import pytest

from risk_dqn_planner.ros.settling import settle


@pytest.fixture(autouse=True)
def thawed() -> Iterator[None]:
    yield
    gc.unfreeze()


class Ring:
    """Garbage that only the collector finds."""

    def __init__(self) -> None:
        self.myself = self


def test_what_exists_is_not_looked_at_by_later_collections() -> None:
    kept = [Ring() for _ in range(1000)]
    settle()
    assert gc.get_freeze_count() > 1000
    assert len(gc.get_objects()) < 1000
    assert kept


def test_what_became_garbage_since_the_last_time_is_collected() -> None:
    ring = Ring()
    settle()
    there = weakref.ref(ring)
    del ring
    gc.collect()
    assert there() is not None  # exempt
    settle()
    assert there() is None
