# SPDX-License-Identifier: Apache-2.0
"""The topics between simulator and planner: their names, types, quality of service and owners.

Nodes use private names ("~/output/odometry"); whoever starts them remaps those to the plain
names below, so simulator, planner, recorder and replayer meet on one list.
"""

from dataclasses import dataclass

from geometry_msgs.msg import PolygonStamped
from intersection_msgs.msg import (
    Decision,
    EpisodeEvent,
    GroundTruth,
    PerceivedObjects,
    Route,
    Situation,
)
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile

from risk_dqn_planner.ros.qos import LATCHED, NEWEST


@dataclass(frozen=True)
class Topic:
    """One topic. `ends` maps a node's name to its private name for the topic."""

    name: str
    message: type
    ends: dict[str, str]
    qos: QoSProfile

    @property
    def type_name(self) -> str:
        """Full name of the message type, for example "nav_msgs/msg/Odometry"."""
        package = self.message.__module__.split(".", maxsplit=1)[0]
        return f"{package}/msg/{self.message.__name__}"


def _input(name: str, message: type, qos: QoSProfile = NEWEST) -> Topic:
    ends = {"simulator": f"~/output/{name}", "situation": f"~/input/{name}"}
    return Topic(f"/{name}", message, ends, qos)


ROUTE = _input("route", Route, LATCHED)
ODOMETRY = _input("odometry", Odometry)
VISIBLE_AREA = _input("visible_area", PolygonStamped)
OBJECTS = _input("objects", PerceivedObjects)
SITUATION = Topic(
    "/situation",
    Situation,
    {
        "situation": "~/output/situation",
        "policy": "~/input/situation",
        "simulator": "~/input/situation",
    },
    NEWEST,
)
DECISION = Topic(
    "/decision",
    Decision,
    {"policy": "~/output/decision", "simulator": "~/input/decision"},
    NEWEST,
)
GROUND_TRUTH = Topic("/ground_truth", GroundTruth, {"simulator": "~/output/ground_truth"}, NEWEST)
EPISODE = Topic("/episode", EpisodeEvent, {"simulator": "~/output/episode"}, NEWEST)

# In the order in which they are published; the objects come last because they complete a frame.
INPUTS = (ROUTE, ODOMETRY, VISIBLE_AREA, OBJECTS)
ALL = (*INPUTS, SITUATION, DECISION, GROUND_TRUTH, EPISODE)
RESET_SERVICE = "/simulator/reset"


def remappings(node: str) -> dict[str, str]:
    """Map the private topic names of a node to the plain ones."""
    return {topic.ends[node]: topic.name for topic in ALL if node in topic.ends}
