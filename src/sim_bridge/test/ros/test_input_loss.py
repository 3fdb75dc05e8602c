# SPDX-License-Identifier: Apache-2.0
import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.input_loss import InputLoss


@pytest.mark.parametrize(
    ("since_start_s", "silent"), [(3.9, False), (4.0, True), (5.9, True), (6.0, False)]
)
def test_an_input_is_silent_from_its_loss_until_it_is_back(
    since_start_s: float, silent: bool
) -> None:
    loss = InputLoss("odometry", after_s=4.0, for_s=2.0)
    assert loss.silences("/odometry", round(since_start_s * SECOND_NS)) is silent
    assert not loss.silences("/objects", round(since_start_s * SECOND_NS))


def test_nothing_is_lost_unless_asked_for() -> None:
    assert not any(InputLoss().silences(f"/{name}", 6 * SECOND_NS) for name in ("", "objects"))
    assert InputLoss().note() == ""


def test_a_loss_survives_the_way_into_a_bags_notes_and_back() -> None:
    loss = InputLoss("visible_area", 4.5, 0.3)
    assert loss.note() == "visible_area,4.5,0.3"
    assert InputLoss.from_text(loss.note()) == loss
    assert InputLoss.from_text("") == InputLoss()


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("clock,1,2", "loss.input is 'clock'"),
        ("objects,-1,2", "loss.after_s is -1"),
        ("objects,1,inf", "loss.for_s is inf"),
        ("objects,soon,2", "expected INPUT,AFTER_S,FOR_S"),
        ("objects", "expected INPUT,AFTER_S,FOR_S"),
    ],
)
def test_a_loss_that_makes_no_sense_is_refused(text: str, complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        InputLoss.from_text(text)
