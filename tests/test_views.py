# SPDX-License-Identifier: Apache-2.0
"""RViz and Foxglove show what the nodes publish: no toggle without a concept, none without one."""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from intersection_msgs.msg import Decision, Explanation

from risk_dqn_planner.decision import Reason, fault_decision
from risk_dqn_planner.ros.markers import decision_markers, situation_markers
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.inputs import EgoPose, Perception, object_arrays
from risk_dqn_planner.situation.report import SituationReport, Status
from risk_dqn_planner.situation.warm_up import crossing_model, square
from sim_bridge.ros import topics

PACKAGE = Path(__file__).resolve().parents[1] / "src" / "risk_dqn_planner"
RVIZ = yaml.safe_load((PACKAGE / "rviz" / "planner.rviz").read_text("utf-8"))
FOXGLOVE = json.loads((PACKAGE / "foxglove" / "planner.json").read_text("utf-8"))
MARKERS = "/{}/debug/markers"


def published() -> dict[str, set[str]]:
    """Namespaces of each topic of markers, as the nodes fill them."""
    seen = Perception(
        EgoPose(-20.0, 0.0, 0.0, 4.0), object_arrays([[0.0, -30.0, 1.57, 5.0]]), square(40.0)
    )
    situations = SituationBuilder(crossing_model()).build(*seen)
    report = SituationReport(0, Status.OK, "", (10,), situations=situations)
    shown = {
        "situation": situation_markers(crossing_model(), report, seen, "map"),
        "policy": decision_markers(fault_decision(Reason.POLICY_FAILED, "x"), 0, "base_link"),
    }
    return {MARKERS.format(node): {m.ns for m in msg.markers} for node, msg in shown.items()}


def marker_publishers() -> list[str]:
    """Private names of the topics that nodes publish markers on, by scanning the sources."""
    calls = [
        call
        for path in (PACKAGE / "risk_dqn_planner" / "ros").glob("*.py")
        for call in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(call, ast.Call)
        and any(isinstance(each, ast.Name) and each.id == "MarkerArray" for each in call.args)
    ]
    names = [each.value for call in calls for each in call.args if isinstance(each, ast.Constant)]
    return [str(name) for name in names]


def test_both_nodes_publish_markers_where_they_are_looked_for() -> None:
    assert marker_publishers() == [MARKERS.format("~").removeprefix("/")] * len(published())


def test_rviz_has_a_toggle_for_every_namespace_and_no_other() -> None:
    displays = [
        each
        for each in RVIZ["Visualization Manager"]["Displays"]
        if each["Class"] == "rviz_default_plugins/MarkerArray"
    ]
    toggles = {each["Topic"]["Value"]: set(each["Namespaces"]) for each in displays}
    assert toggles == published()
    assert all(all(each["Namespaces"].values()) for each in displays)


def test_foxglove_has_a_toggle_for_every_namespace_and_no_other() -> None:
    shown = FOXGLOVE["configById"]["3D!scene"]["topics"]
    assert {topic: set(each["namespaces"]) for topic, each in shown.items()} == published()


def test_both_look_from_above_in_the_frame_of_the_map() -> None:
    assert RVIZ["Visualization Manager"]["Global Options"]["Fixed Frame"] == "map"
    assert FOXGLOVE["configById"]["3D!scene"]["followTf"] == "map"


def panels(layout: Any) -> Iterator[str]:  # noqa: ANN401 (nested as deeply as it likes)
    if isinstance(layout, str):
        yield layout
    else:
        yield from panels(layout["first"])
        yield from panels(layout["second"])


def test_foxglove_lays_out_every_panel_once() -> None:
    laid_out = list(panels(FOXGLOVE["layout"]))
    assert sorted(laid_out) == sorted(FOXGLOVE["configById"])


def paths(config: dict[str, Any]) -> Iterator[str]:
    yield from (each["value"] for each in config.get("paths", []))
    yield from (config[name] for name in ("topicPath", "topicToRender") if name in config)


@pytest.mark.parametrize(
    "path", [path for config in FOXGLOVE["configById"].values() for path in paths(config)]
)
def test_foxglove_reads_fields_that_messages_have(path: str) -> None:
    topic, *fields = path.split(".")
    known = {each.name for each in topics.ALL} | {"/diagnostics"}
    assert topic in known
    message: Any = Decision() if topic == topics.DECISION.name else None
    for field in fields:
        name, index = re.fullmatch(r"(\w+)(?:\[(\d)\])?", field).groups()  # type: ignore[union-attr]
        assert name in message.get_fields_and_field_types()
        message = getattr(message, name)
        if index is not None:
            assert int(index) < len(message)
    assert isinstance(Decision().explanation, Explanation)
