# SPDX-License-Identifier: Apache-2.0
"""Publishes a simulated episode: what the planner may perceive, and, apart, the truth."""

import numpy as np
from intersection_msgs.msg import EpisodeEvent, GroundTruth, SimulatedVehicle
from rclpy.node import Node

from risk_dqn_planner.ros import conversions
from risk_dqn_planner.situation.inputs import EgoPose, ObjectArrays
from sim_bridge.perception.poses import VehiclePoses
from sim_bridge.ros import topics
from sim_bridge.ros.input_loss import InputLoss
from sim_bridge.ros.transform import TransformPublisher
from sim_bridge.simulation.simulation import Simulation, StepResult

EGO_ID = 0
_NODE = "simulator"


def perceived(
    poses: VehiclePoses, phantoms: VehiclePoses, length_m: float, width_m: float
) -> ObjectArrays:
    """Return what the sensor reports of the first episode: hidden vehicles are absent."""
    groups = [(group, group.mask[0] & ~group.hidden[0]) for group in (poses, phantoms)]
    count = sum(int(seen.sum()) for _, seen in groups)
    return ObjectArrays(
        np.concatenate([group.id[0, seen] for group, seen in groups]),
        np.concatenate([group.x_m[0, seen] for group, seen in groups]),
        np.concatenate([group.y_m[0, seen] for group, seen in groups]),
        np.concatenate([group.heading_rad[0, seen] for group, seen in groups]),
        np.concatenate([group.measured_speed_mps[0, seen] for group, seen in groups]),
        np.full(count, length_m),
        np.full(count, width_m),
    )


def ground_truth(
    simulation: Simulation, ego: EgoPose, poses: VehiclePoses, seed: int, stamp_ns: int, frame: str
) -> GroundTruth:
    """Return the whole truth about the first episode."""
    traffic, own = simulation.model.traffic_dimensions, simulation.model.ego_dimensions
    vehicles = [
        SimulatedVehicle(
            id=int(poses.id[0, k]),
            x_m=float(poses.x_m[0, k]),
            y_m=float(poses.y_m[0, k]),
            heading_rad=float(poses.heading_rad[0, k]),
            speed_mps=float(poses.speed_mps[0, k]),
            length_m=traffic.length_m,
            width_m=traffic.width_m,
            hidden=bool(poses.hidden[0, k]),
        )
        for k in np.flatnonzero(poses.mask[0])
    ]
    return GroundTruth(
        header=conversions.header(stamp_ns, frame),
        seed=seed,
        ego=SimulatedVehicle(
            id=EGO_ID,
            x_m=ego.x_m,
            y_m=ego.y_m,
            heading_rad=ego.heading_rad,
            speed_mps=ego.speed_mps,
            length_m=own.length_m,
            width_m=own.width_m,
        ),
        vehicles=vehicles,
        obstacles=[conversions.polygon_to_message(corners) for corners in simulation.obstacles()],
    )


class FramePublisher:
    """Publishes simulations of a batch of one on the simulator's topics."""

    def __init__(self, node: Node, map_frame: str, loss: InputLoss) -> None:
        self._frame = map_frame
        self._loss = loss
        self._start_ns = 0
        self._transform = TransformPublisher(node)
        self._publishers = {
            topic.name: node.create_publisher(topic.message, topic.ends[_NODE], topic.qos)
            for topic in (*topics.INPUTS, topics.GROUND_TRUTH, topics.EPISODE)
        }

    def connected(self) -> bool:
        """Whether somebody reads every input of the planner."""
        inputs = (self._publishers[topic.name] for topic in topics.INPUTS)
        return all(publisher.get_subscription_count() > 0 for publisher in inputs)

    def _send(self, topic: topics.Topic, message: object) -> None:
        self._publishers[topic.name].publish(message)

    def publish_frame(self, simulation: Simulation, seed: int, stamp_ns: int) -> bool:
        """Publish everything about one moment; the objects complete the planner's inputs.

        Returns whether they were sent, so that the planner answers.
        """
        ego = EgoPose(*simulation.ego_poses()[0].tolist())
        poses = simulation.vehicle_poses()
        size = simulation.model.traffic_dimensions
        seen = perceived(poses, simulation.phantom_poses(), size.length_m, size.width_m)
        area = simulation.visible_area()
        truth = ground_truth(simulation, ego, poses, seed, stamp_ns, self._frame)
        odometry = conversions.ego_to_message(ego, stamp_ns, self._frame)
        self._send(topics.GROUND_TRUTH, truth)
        self._transform.publish(odometry)
        inputs = (
            (topics.ODOMETRY, odometry),
            (topics.VISIBLE_AREA, conversions.area_to_message(area, stamp_ns, self._frame)),
            (topics.OBJECTS, conversions.objects_to_message(seen, stamp_ns, self._frame)),
        )
        since_ns = stamp_ns - self._start_ns
        for topic, message in inputs:
            if not self._loss.silences(topic.name, since_ns):
                self._send(topic, message)
        return not self._loss.silences(topics.OBJECTS.name, since_ns)

    def publish_start(self, simulation: Simulation, seed: int, stamp_ns: int) -> None:
        """Announce an episode."""
        self._start_ns = stamp_ns
        self._send(
            topics.EPISODE,
            EpisodeEvent(
                header=conversions.header(stamp_ns, self._frame),
                seed=seed,
                scenario=simulation.scenario.name,
                event=EpisodeEvent.STARTED,
            ),
        )

    def publish_route(self, simulation: Simulation, stamp_ns: int) -> None:
        """Publish the ego's route, a new errand; it stays for whoever comes later."""
        route = conversions.route_to_message(simulation.model.route, stamp_ns, self._frame)
        self._send(topics.ROUTE, route)

    def publish_end(
        self,
        simulation: Simulation,
        seed: int,
        stamp_ns: int,
        result: StepResult,
        late_decisions: int,
    ) -> None:
        """Announce how an episode ended."""
        figures = simulation.statistics()
        event = EpisodeEvent.TIMEOUT
        if result.reached_goal[0]:
            event = EpisodeEvent.SUCCESS
        elif result.collided[0]:
            event = EpisodeEvent.COLLISION
        self._send(
            topics.EPISODE,
            EpisodeEvent(
                header=conversions.header(stamp_ns, self._frame),
                seed=seed,
                scenario=simulation.scenario.name,
                event=event,
                duration_s=float(figures.duration_s[0]),
                mean_speed_mps=float(figures.mean_speed_mps[0]),
                action_counts=figures.action_counts[0].astype(np.uint32),
                late_decisions=late_decisions,
            ),
        )
