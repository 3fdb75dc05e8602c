# SPDX-License-Identifier: Apache-2.0
from intersection_msgs.msg import Decision

from risk_dqn_planner.ros.conversions import header
from sim_bridge.ros.comparison import difference


def decision(**fields: object) -> Decision:
    common = {"critical_vehicle_id": Decision.NO_ID, "critical_lane_id": Decision.NO_ID}
    return Decision(header=header(12_500_000_000), **{**common, **fields})


def test_words_and_risks_alone_make_no_difference() -> None:
    before = decision(action=Decision.FAST, reason=Decision.CLEAR, text="the road is free")
    assert difference(before, decision(action=Decision.FAST, text="nothing in sight")) is None


def test_a_difference_says_when_what_and_why() -> None:
    before = decision(action=Decision.FAST, reason=Decision.CLEAR, text="free")
    now = decision(
        action=Decision.STOP,
        reason=Decision.VEHICLE,
        text="it comes",
        critical_vehicle_id=7,
        critical_lane_id=11,
    )
    assert str(difference(before, now)) == (
        "t = 12.5 s: recorded FAST, CLEAR (free); now STOP, VEHICLE, vehicle 7, lane 11 (it comes)"
    )


def test_another_reason_or_vehicle_is_a_difference() -> None:
    before = decision(action=Decision.STOP, reason=Decision.VEHICLE, critical_vehicle_id=7)
    other_reason = decision(action=Decision.STOP, reason=Decision.HIDDEN_VEHICLE)
    other_vehicle = decision(action=Decision.STOP, reason=Decision.VEHICLE, critical_vehicle_id=8)
    assert difference(before, other_reason) is not None
    assert difference(before, other_vehicle) is not None


def test_another_input_at_fault_is_a_difference_and_named() -> None:
    before = decision(action=Decision.STOP, reason=Decision.STALE_INPUT, faulty_input=1)
    other = decision(action=Decision.STOP, reason=Decision.STALE_INPUT, faulty_input=3)
    assert "STOP, STALE_INPUT, of odometry ()" in str(difference(before, other))
    assert "STOP, STALE_INPUT, of objects ()" in str(difference(before, other))


def test_another_verdict_of_the_supervisor_is_a_difference_and_named() -> None:
    before = decision(action=Decision.FAST, proposed=Decision.FAST, text="free")
    overruled = decision(
        action=Decision.FAST,
        supervisor=Decision.SUPERVISOR_OVERRULED,
        proposed=Decision.SLOW,
        text="gone",
    )
    assert str(difference(before, overruled)) == (
        "t = 12.5 s: recorded FAST, CLEAR (free); now FAST, CLEAR, SLOW OVERRULED (gone)"
    )


def test_a_decision_that_does_not_come_is_a_difference() -> None:
    missing = difference(decision(action=Decision.STOP), None)
    assert str(missing).endswith("now no decision in time")
