# SPDX-License-Identifier: Apache-2.0
import pytest

from sim_bridge.evaluation.soundness.timeouts import Timeouts, classified, united


def test_timeouts_are_counted_by_what_the_limits_reached() -> None:
    #           impossible, price, missed, missed; successes and collisions are no timeouts.
    policy, physical, sound = "TTTTSC", "TSSTSS", "TTSSST"
    assert classified(policy, physical, sound) == Timeouts(6, impossible=1, price=1, missed=2)


def test_where_every_way_ends_in_a_collision_nothing_was_possible() -> None:
    assert classified("T", "C", "T") == Timeouts(1, impossible=1, price=0, missed=0)


def test_what_anyone_reached_can_be_reached() -> None:
    assert united(["TTCS", "TSTT", "TTST"]) == "TSSS"


def test_all_must_have_driven_the_same_episodes() -> None:
    with pytest.raises(ValueError, match="shorter"):
        classified("TT", "S", "SS")
