# SPDX-License-Identifier: Apache-2.0
import numpy as np

from risk_dqn_planner.safety.commitment import Commitments
from risk_dqn_planner.safety.course import BRAKE, GO
from risk_dqn_planner.safety.joint_check import NO_MANOEUVRE, JointCheck

STOP, SLOW, FAST = 0, 1, 2
NEW, KEPT = np.array([True]), np.array([False])


def found(*periods: int) -> JointCheck:
    """A check that finds these manoeuvres for the three actions."""
    table = np.array([periods])
    nobody = np.full((1, 3), -1)
    return JointCheck(table != NO_MANOEUVRE, table, np.zeros((1, 3)), nobody, nobody)


NOTHING = found(NO_MANOEUVRE, NO_MANOEUVRE, NO_MANOEUVRE)


def decide(memory: Commitments, check: JointCheck, action: int) -> int:
    """Decide, and return what the memory would do next."""
    memory.carry_on(check, np.array([action]))
    return int(memory.next_action()[0])


def test_braking_is_carried_on_with_stop_and_going_with_fast() -> None:
    memory = Commitments()
    assert memory.in_force(NEW).tolist() == [STOP]
    assert decide(memory, found(BRAKE, GO, BRAKE), FAST) == STOP
    assert decide(memory, found(BRAKE, GO, BRAKE), SLOW) == FAST
    assert memory.in_force(KEPT).tolist() == [SLOW]


def test_going_for_a_while_ends_in_braking() -> None:
    memory = Commitments()
    memory.in_force(NEW)
    assert decide(memory, found(BRAKE, 2, 2), SLOW) == FAST
    assert decide(memory, NOTHING, FAST) == FAST
    assert decide(memory, NOTHING, FAST) == STOP
    assert decide(memory, NOTHING, STOP) == STOP


def test_going_for_ever_never_ends() -> None:
    memory = Commitments()
    memory.in_force(NEW)
    decide(memory, found(-1, GO, GO), FAST)
    assert [decide(memory, NOTHING, FAST) for _ in range(50)] == [FAST] * 50


def test_who_acts_against_the_manoeuvre_loses_it() -> None:
    memory = Commitments()
    memory.in_force(NEW)
    decide(memory, found(-1, GO, GO), FAST)
    assert decide(memory, NOTHING, STOP) == STOP


def test_a_new_episode_begins_with_braking_and_leaves_other_rows_alone() -> None:
    memory = Commitments()
    memory.in_force(np.array([True, True]))
    both = JointCheck._make(np.repeat(array, 2, axis=0) for array in found(-1, GO, GO))
    memory.carry_on(both, np.array([FAST, FAST]))
    memory.in_force(np.array([True, False]))
    assert memory.next_action().tolist() == [STOP, FAST]
