# SPDX-License-Identifier: Apache-2.0
"""Starts the planner: the situation node, the policy node and, if wanted, RViz.

ros2 launch risk_dqn_planner planner.launch.py map_file:=four_way.osm \
    map_origin_latitude:=49.0 map_origin_longitude:=8.4 policy:=rule_based
"""

from ament_index_python.packages import get_package_share_path
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY, DEFAULT_SUPERVISOR
from risk_dqn_planner.situation.config import SituationConfig

SHARE = get_package_share_path("risk_dqn_planner")
INPUTS = ("odometry", "objects", "visible_area", "route")


def arguments() -> list[DeclareLaunchArgument]:
    """Everything that can be set; `ros2 launch ... --show-args` prints it."""
    settings = (
        ("map_file", None, "Lanelet2 map, an .osm file (required)"),
        ("map_origin_latitude", ".nan", "Latitude of the projection's origin [degrees]"),
        ("map_origin_longitude", ".nan", "Longitude of the projection's origin [degrees]"),
        ("map_projector", "utm", "utm, local_cartesian, mercator or local_xy"),
        ("policy", DEFAULT_POLICY, "Name of a built-in or trained policy, or a policy file"),
        ("supervisor", DEFAULT_SUPERVISOR, "Around the policy: off, report or enforce"),
        ("memory", SituationConfig.memory, "Of hidden space: instantaneous or tracked"),
        ("parameters", str(SHARE / "config" / "planner.yaml"), "File of all other parameters"),
        ("use_sim_time", "false", "Take the time from /clock"),
        ("clock_timeout_s", "0.5", "A /clock that stands for longer in real time is a fault [s]"),
        ("sim_time_patience_s", "0.2", "With /clock, inputs of one time may be so far apart [s]"),
        ("autostart", "true", "Configure and activate the nodes; else a lifecycle manager does"),
        ("namespace", "", "Namespace of the nodes"),
        ("log_level", "info", "debug, info, warn, error or fatal"),
        ("rviz", "false", "Start RViz with the planner's view"),
    )
    topics = (
        ("odometry", "nav_msgs/Odometry of the ego, twist in the child frame"),
        ("objects", "intersection_msgs/PerceivedObjects, the vehicles that are seen"),
        ("visible_area", "geometry_msgs/PolygonStamped, the area that is seen"),
        ("route", "intersection_msgs/Route, the ego's lanelets"),
        ("situation", "intersection_msgs/Situation, between the two nodes"),
        ("decision", "intersection_msgs/Decision, the result"),
    )
    return [
        *(
            DeclareLaunchArgument(name, default_value=default, description=text)
            for name, default, text in settings
        ),
        *(
            DeclareLaunchArgument(f"{name}_topic", default_value=name, description=f"Topic: {text}")
            for name, text in topics
        ),
    ]


def node(name: str, parameters: dict[str, ParameterValue], topics: list[tuple[str, str]]) -> Node:
    """One of the package's nodes; `topics` maps its private names to launch arguments."""
    return Node(
        package="risk_dqn_planner",
        executable=f"{name}_node",
        name=name,
        namespace=LaunchConfiguration("namespace"),
        parameters=[LaunchConfiguration("parameters"), parameters],
        remappings=[(f"~/{end}", LaunchConfiguration(f"{topic}_topic")) for end, topic in topics],
        arguments=["--ros-args", "--log-level", LaunchConfiguration("log_level")],
        output="screen",
    )


def parameter(name: str, kind: type) -> ParameterValue:
    """A parameter from the launch argument of the same name."""
    return ParameterValue(LaunchConfiguration(name), value_type=kind)


def generate_launch_description() -> LaunchDescription:
    """Nodes and their arguments."""
    sim_time = {"use_sim_time": parameter("use_sim_time", bool)}
    common = sim_time | {
        "autostart": parameter("autostart", bool),
        "sim_time_patience_s": parameter("sim_time_patience_s", float),
    }
    situation_parameters = common | {
        "map_file": parameter("map_file", str),
        "map_origin_latitude": parameter("map_origin_latitude", float),
        "map_origin_longitude": parameter("map_origin_longitude", float),
        "map_projector": parameter("map_projector", str),
        "memory": parameter("memory", str),
    }
    situation = node(
        "situation",
        situation_parameters,
        [(f"input/{name}", name) for name in INPUTS] + [("output/situation", "situation")],
    )
    policy = node(
        "policy",
        common
        | {name: parameter(name, str) for name in ("policy", "supervisor")}
        | {"clock_timeout_s": parameter("clock_timeout_s", float)},
        [("input/situation", "situation"), ("output/decision", "decision")],
    )
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        name="rviz",
        arguments=["--display-config", str(SHARE / "rviz" / "planner.rviz")],
        parameters=[sim_time],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    return LaunchDescription([*arguments(), situation, policy, rviz])
