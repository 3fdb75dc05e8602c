# SPDX-License-Identifier: Apache-2.0
"""Pictures of driven episodes, from what was said on the topics."""

from pathlib import Path

from geometry_msgs.msg import PolygonStamped
from intersection_msgs.msg import Decision, GroundTruth, SimulatedVehicle
from rclpy.serialization import deserialize_message

from risk_dqn_planner.decision import Action
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.map.loader import load_map
from risk_dqn_planner.ros.conversions import polygon_from_message
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.rendering.frames import Floats, Frame, VehicleFrame
from sim_bridge.rendering.render import save_episode_picture
from sim_bridge.ros.drive import DrivenEpisode
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.ros.summary import episode_result
from sim_bridge.ros.topics import DECISION, GROUND_TRUTH, VISIBLE_AREA


class EpisodePictures:
    """Draws episodes on one map."""

    def __init__(self, settings: RunSettings) -> None:
        """Load the map.

        Raises:
            MapError, RouteError: the map or the route cannot be used.
        """
        road_map = load_map(settings.map_file, settings.origin, settings.projector)
        self._model = build_intersection(road_map, settings.route)
        self._title = f"{settings.policy} on {settings.map_name}, {settings.scenario}"

    def draw(self, episode: DrivenEpisode, path: Path) -> None:
        """Write the picture of an episode."""
        result = episode_result(episode.end)
        title = f"{self._title}, seed {result.seed}: {result.result}"
        save_episode_picture(self._model, frames(episode), path, title)


def frames(episode: DrivenEpisode) -> list[Frame]:
    """Put together what belongs to each moment; decisions hold until the next one."""
    truths, areas, decisions = (
        {m.stamp_ns: m.data for m in episode.messages if m.topic == topic.name}
        for topic in (GROUND_TRUTH, VISIBLE_AREA, DECISION)
    )
    start_ns = min(truths)
    decision: Decision | None = None
    result = []
    for stamp_ns, data in sorted(truths.items()):
        truth = deserialize_message(data, GroundTruth)
        if stamp_ns in decisions:
            decision = deserialize_message(decisions[stamp_ns], Decision)
        result.append(
            Frame(
                time_s=(stamp_ns - start_ns) / SECOND_NS,
                ego=_vehicle(truth.ego),
                action=None if decision is None else Action(decision.action),
                vehicles=tuple(_vehicle(vehicle) for vehicle in truth.vehicles),
                obstacles=tuple(polygon_from_message(polygon) for polygon in truth.obstacles),
                visible_area=_area(areas[stamp_ns]) if stamp_ns in areas else None,
                reason="" if decision is None else decision.text,
            )
        )
    return result


def _area(data: bytes) -> Floats:
    message = deserialize_message(data, PolygonStamped)
    return polygon_from_message(message.polygon)


def _vehicle(message: SimulatedVehicle) -> VehicleFrame:
    return VehicleFrame(
        id=message.id,
        x_m=message.x_m,
        y_m=message.y_m,
        heading_rad=message.heading_rad,
        speed_mps=message.speed_mps,
        length_m=message.length_m,
        width_m=message.width_m,
        hidden=message.hidden,
    )
