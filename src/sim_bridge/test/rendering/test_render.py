# SPDX-License-Identifier: Apache-2.0
"""What pictures show."""

from dataclasses import replace
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from risk_dqn_planner.decision import Action
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import load_map
from sim_bridge.maps import shipped_map
from sim_bridge.rendering.frames import Frame, VehicleFrame
from sim_bridge.rendering.render import frame_image, key_moments, save_episode_picture


@pytest.fixture(scope="module")
def model() -> IntersectionModel:
    place = shipped_map("four_way")
    return build_intersection(load_map(place.path, place.origin), place.route)


def ego_at(model: IntersectionModel, s: float) -> VehicleFrame:
    x, y = model.ego_path.centerline.position(s)
    heading = model.ego_path.centerline.heading_at(s)
    return VehicleFrame(0, x, y, heading, 5.0, 4.0, 2.0)


def frame(model: IntersectionModel, s: float, *vehicles: VehicleFrame) -> Frame:
    return Frame(s / 5.0, ego_at(model, s), Action.FAST, vehicles, ())


def crossing(model: IntersectionModel, hidden: bool) -> VehicleFrame:
    path = model.lanes[0].paths[0]
    x, y = path.path.centerline.position(path.zone_center_m - 15.0)
    return VehicleFrame(7, x, y, path.path.centerline.heading_at(0.0), 5.0, 4.0, 2.0, hidden)


def test_key_moments_are_hidden_line_zone_and_end(model: IntersectionModel):
    stop, zone = model.stop_line.position_m, model.lanes[0].ego_zone_center_m
    places = (stop - 30.0, stop - 20.0, stop - 2.0, zone + 1.0, model.goal_m)
    frames = [frame(model, s) for s in places]
    frames[1] = frame(model, places[1], crossing(model, hidden=True))
    assert key_moments(model, frames) == [frames[1], frames[2], frames[3], frames[4]]


def test_an_episode_that_never_reaches_the_line_still_has_four_moments(model: IntersectionModel):
    frames = [frame(model, 10.0), frame(model, 11.0)]
    assert len(key_moments(model, frames)) == 4


def test_a_seen_vehicle_is_filled_and_a_hidden_one_is_not(model: IntersectionModel):
    seen = crossing(model, hidden=False)
    views = ((), (seen,), (replace(seen, hidden=True),))
    empty, filled, hollow = (
        int((frame_image(model, frame(model, 100.0, *view)).sum(axis=2) < 250).sum())
        for view in views
    )
    assert filled - empty > 2 * (hollow - empty) > 0


def test_the_picture_is_a_png_of_some_size(model: IntersectionModel, tmp_path: Path):
    path = tmp_path / "episode.png"
    save_episode_picture(model, [frame(model, 100.0), frame(model, 140.0)], path, "title")
    image = matplotlib.image.imread(path)
    assert image.shape[0] > 400
    assert image.shape[1] > 1000
    assert np.ptp(image[..., :3]) > 0.5


def test_no_frames_no_picture(model: IntersectionModel, tmp_path: Path):
    with pytest.raises(ValueError, match="without frames"):
        save_episode_picture(model, [], tmp_path / "x.png")
