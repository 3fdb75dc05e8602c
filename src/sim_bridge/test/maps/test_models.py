# SPDX-License-Identifier: Apache-2.0
import pytest

from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.model import ConflictKind, IntersectionModel
from risk_dqn_planner.map.loader import load_map
from sim_bridge.maps import map_names, shipped_map


def model(name: str) -> IntersectionModel:
    shipped = shipped_map(name)
    return build_intersection(load_map(shipped.path, shipped.origin), shipped.route)


@pytest.mark.parametrize(
    ("name", "crossing", "merging"),
    [
        ("four_way", [11, 12], []),
        # Left turns of others and the near lane are crossed, the far lane is joined.
        ("t_junction", [12, 9], [10]),
        # Four lanes through, the left turn from the east; turns into the ego's exit merge.
        ("multi_lane", [16, 15, 19, 17, 18], [20, 21]),
        # The ring where the ego enters it, and the entry that it passes.
        ("roundabout", [], [10, 13]),
    ],
)
def test_the_ego_meets_these_lanes(name: str, crossing: list[int], merging: list[int]) -> None:
    lanes = model(name).lanes
    assert [lane.lane_id for lane in lanes if lane.kind is ConflictKind.CROSSING] == crossing
    assert [lane.lane_id for lane in lanes if lane.kind is ConflictKind.MERGING] == merging


def test_the_four_way_crossing_is_that_of_the_paper() -> None:
    built = model("four_way")
    # The lanes' middles lie 1.75 m before and past the crossing's, 150 m along the ego's path.
    assert [lane.ego_zone_center_m for lane in built.lanes] == pytest.approx(
        [148.25, 151.75], abs=1e-3
    )
    for lane in built.lanes:
        assert lane.ego_zone_length_m == pytest.approx(6.0, abs=1e-3)
        assert lane.zone_length_m == pytest.approx(6.0, abs=1e-3)
    # 5.5 m before the first lane's middle, which is 2.5 m before the zone.
    assert built.stop_line.position_m == pytest.approx(148.25 - 5.5, abs=1e-3)

    assert built.goal_m == pytest.approx(151.75 + 3.0 + 17.0, abs=1e-3)


@pytest.mark.parametrize("name", map_names())
def test_every_map_has_a_stop_line_before_the_first_zone_and_lacks_nothing(name: str) -> None:
    built = model(name)
    first = min(lane.ego_zone_center_m - 0.5 * lane.ego_zone_length_m for lane in built.lanes)
    assert not built.stop_line.derived
    assert first - built.stop_line.position_m == pytest.approx(2.5, abs=0.3)
    assert built.notes == ()
    assert {round(lane.speed_limit_mps, 9) for lane in built.lanes} == {7.0}


@pytest.mark.parametrize("name", map_names())
def test_there_is_room_to_approach_to_leave_and_to_come_from(name: str) -> None:
    built = model(name)
    assert built.stop_line.position_m > 60.0
    assert built.goal_m < built.ego_path.centerline.length_m
    for lane in built.lanes:
        upstream = [path.zone_center_m - 0.5 * lane.zone_length_m for path in lane.paths]
        assert max(upstream) > 70.0
