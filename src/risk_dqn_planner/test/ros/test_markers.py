# SPDX-License-Identifier: Apache-2.0
"""Every concept has a namespace, and its marker lies where the thing is."""

import math

import numpy as np
import pytest
from visualization_msgs.msg import Marker, MarkerArray

from risk_dqn_planner.decision import Action, Decision, Reason
from risk_dqn_planner.policies.base import Supervision
from risk_dqn_planner.risk.risk import assess_into
from risk_dqn_planner.ros.markers import Places, decision_markers, situation_markers, warm_up
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.inputs import EgoPose, Perception, object_arrays
from risk_dqn_planner.situation.report import SituationReport, Status
from risk_dqn_planner.situation.warm_up import crossing_model, square

NORTH = math.pi / 2
STAMP_NS = 5_000_000_000


def shown(
    rows: list[list[float]],
    half_size_m: float = 40.0,
    ego_x_m: float = -20.0,
    places: Places = (),
) -> dict[str, list[Marker]]:
    """Markers by namespace for an ego before the crossing."""
    seen = Perception(EgoPose(ego_x_m, 0.0, 0.0, 4.0), object_arrays(rows), square(half_size_m))
    situations = SituationBuilder(crossing_model()).build(*seen)
    report = SituationReport(STAMP_NS, Status.OK, "", (10,), situations=situations)
    message = situation_markers(crossing_model(), report, seen, "map", places)
    return by_namespace(message)


def by_namespace(message: MarkerArray) -> dict[str, list[Marker]]:
    result: dict[str, list[Marker]] = {}
    for marker in message.markers:
        assert marker.header.frame_id == "map"
        assert marker.header.stamp.sec == 5
        result.setdefault(marker.ns, []).append(marker)
    return result


def box(marker: Marker) -> tuple[float, float, float, float]:
    xs, ys = [p.x for p in marker.points], [p.y for p in marker.points]
    return min(xs), min(ys), max(xs), max(ys)


def test_each_concept_has_its_namespace() -> None:
    assert set(shown([[0.0, -30.0, NORTH, 5.0]])) == {
        "ego_path", "stop_line", "goal", "lanes", "zones", "ego", "visible_area", "objects",
        "vehicles", "vehicle_distances", "vehicle_risks", "hidden", "hidden_distances",
        "hidden_risks", "hidden_places",
    }  # fmt: skip


def test_ids_are_unique_within_a_namespace() -> None:
    for markers in shown([[0.0, -30.0, NORTH, 5.0], [0.0, -9.0, NORTH, 5.0]]).values():
        assert [marker.id for marker in markers] == list(range(len(markers)))


def test_a_relevant_vehicle_is_outlined_and_told_with_its_distance() -> None:
    markers = shown([[0.0, -30.0, NORTH, 5.0], [30.0, 30.0, 0.0, 5.0]])
    (vehicle,), (text,) = markers["vehicles"], markers["vehicle_distances"]
    # 4 m long and 2 m wide where its size is unknown.
    assert box(vehicle) == pytest.approx((-1.0, -32.0, 1.0, -28.0))
    assert text.text == "vehicle 1\nlane 1: 30.0 m, 5.0 m/s"
    assert len(markers["objects"][0].points) == 2 * len(vehicle.points)


def test_a_risk_is_told_by_colour_and_number() -> None:
    # 5 m before its zone at 5 m/s; the ego, 20 m before it, can still stop: no risk.
    area, text = shown([[0.0, -8.0, NORTH, 5.0]])["vehicle_risks"]
    assert box(area) == pytest.approx((-1.0, -10.0, 1.0, -6.0))
    assert text.text == "risk 0.00"
    assert area.colors[0].g > area.colors[0].r
    # 4 m before it at 4 m/s it cannot: 1 m before the zone it needs 2.3 m.
    area, text = shown([[0.0, -8.0, NORTH, 5.0]], ego_x_m=-4.0)["vehicle_risks"]
    assert text.text == "risk 1.00"
    assert area.colors[0].r > area.colors[0].g


def test_places_that_a_memory_calls_hidden_are_lines_on_the_lane() -> None:
    places = shown([], places=[[(20.0, 30.0), (50.0, 60.0)]])["hidden_places"][0]
    assert [p.y for p in places.points] == [-30.0, -20.0, -60.0, -50.0]
    assert [m.action for m in shown([])["hidden_places"]] == [Marker.DELETE]


def test_without_vehicles_their_marker_is_deleted() -> None:
    markers = shown([])
    assert [m.action for m in markers["vehicles"]] == [Marker.DELETE]
    assert "vehicle_distances" not in markers


def test_the_hidden_place_lies_where_the_lane_is_no_longer_seen() -> None:
    markers = shown([], half_size_m=25.0)
    assert box(markers["hidden"][0]) == pytest.approx((-1.0, -27.0, 1.0, -23.0))
    assert markers["hidden_distances"][0].text == "hidden 25.0 m"


def test_the_stop_line_lies_across_the_path_at_the_egos_front() -> None:
    # The centre stops at -6 m, so the front does at -4 m.
    assert box(shown([])["stop_line"][0]) == pytest.approx((-4.0, -1.75, -4.0, 1.75))


def test_a_zone_reaches_from_its_start_to_its_end() -> None:
    assert box(shown([])["zones"][0]) == pytest.approx((0.0, -3.0, 0.0, 3.0))


def test_the_visible_area_is_closed() -> None:
    points = shown([])["visible_area"][0].points
    assert len(points) == 5
    assert points[0] == points[-1]


def test_the_decision_is_written_at_the_origin_of_its_frame() -> None:
    none = np.full(3, math.nan)
    decision = Decision(
        Action.STOP, 0.0, Reason.VEHICLE, "STOP: vehicle 17", none, none, 17, 3, "p", ""
    )
    (marker,) = by_namespace(decision_markers(decision, STAMP_NS, "map"))["decision"]
    assert marker.text == "STOP: vehicle 17"
    assert (marker.pose.position.x, marker.pose.position.y) == (0.0, 0.0)
    assert marker.lifetime.sec == 1


def test_a_long_reason_is_written_on_several_lines() -> None:
    none = np.full(3, math.nan)
    text = (
        "STOP: vehicle 17 reaches conflict zone of lane 3 in 2.1 s, leaving takes 3.4 s with SLOW"
    )
    decision = Decision(Action.STOP, 0.0, Reason.VEHICLE, text, none, none, 17, 3, "p", "")
    (marker,) = by_namespace(decision_markers(decision, STAMP_NS, "map"))["decision"]
    assert " ".join(marker.text.split("\n")) == text
    assert max(map(len, marker.text.split("\n"))) <= 56


def test_the_verdict_of_a_supervisor_is_written_below_the_decision() -> None:
    none = np.full(3, math.nan)
    decision = Decision(
        Action.STOP, 0.0, Reason.VEHICLE, "STOP: vehicle 17", none, none, 17, 3, "p", "",
        supervision=Supervision.OVERRULED, proposed=Action.FAST,
    )  # fmt: skip
    (marker,) = by_namespace(decision_markers(decision, STAMP_NS, "map"))["decision"]
    assert marker.text == "STOP: vehicle 17\nsupervisor: OVERRULED"


def test_everything_is_compiled_beforehand() -> None:
    warm_up()
    signatures = len(assess_into.signatures)
    shown([[0.0, -30.0, NORTH, 5.0]])
    assert len(assess_into.signatures) == signatures > 0
