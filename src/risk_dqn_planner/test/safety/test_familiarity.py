# SPDX-License-Identifier: Apache-2.0
from collections.abc import Callable

import numpy as np

from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.familiarity import Familiarity
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
NEW, KEPT = np.array([True]), np.array([False])


def test_only_who_was_in_sight_a_reaction_time_ago_has_reacted(situation: Make) -> None:
    memory = Familiarity(SafetyAssumptions())  # 1 s, two decisions
    inside = situation([{"id": 3, "ego_m": 3.0, "hidden_m": 40.0, "merging": True}])
    assert memory.reacted_m(inside, NEW).tolist() == [[-np.inf]]
    assert memory.reacted_m(inside, KEPT).tolist() == [[-np.inf]]
    # Seen up to 40 m then; whoever was further has come 7 m nearer at most.
    nearer = situation([{"id": 3, "ego_m": 2.0, "hidden_m": 10.0, "merging": True}])
    assert memory.reacted_m(nearer, KEPT).tolist() == [[33.0]]
    assert memory.reacted_m(nearer, KEPT).tolist() == [[33.0]]
    assert memory.reacted_m(nearer, KEPT).tolist() == [[3.0]]


def test_nobody_reacts_to_an_ego_before_the_zone_nor_at_a_crossing(situation: Make) -> None:
    for lane in ({"ego_m": 3.1, "merging": True}, {"ego_m": 2.0, "merging": False}):
        memory = Familiarity(SafetyAssumptions())
        s = situation([{"id": 3} | lane])
        assert {memory.reacted_m(s, KEPT)[0, 0] for _ in range(5)} == {-np.inf}


def test_a_new_episode_forgets(situation: Make) -> None:
    memory = Familiarity(SafetyAssumptions())
    s = situation([{"id": 3, "ego_m": 3.0, "merging": True}])
    for _ in range(3):
        assert memory.reacted_m(s, KEPT)[0, 0] in (-np.inf, 63.0)
    assert memory.reacted_m(s, NEW)[0, 0] == -np.inf
    assert memory.reacted_m(s, KEPT)[0, 0] == -np.inf
    assert memory.reacted_m(s, KEPT)[0, 0] == 63.0


def test_without_a_reaction_time_everyone_in_sight_has_reacted(situation: Make) -> None:
    memory = Familiarity(SafetyAssumptions(follower_reaction_s=0.0))
    s = situation([{"id": 3, "ego_m": 3.0, "merging": True}])
    assert memory.reacted_m(s, NEW)[0, 0] == 70.0
