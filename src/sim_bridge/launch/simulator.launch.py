# SPDX-License-Identifier: Apache-2.0
"""Starts the simulator, which plays episodes for a planner and owns the clock.

ros2 launch sim_bridge simulator.launch.py scenario:=dense_traffic real_time_factor:=2.0
"""

from ament_index_python.packages import get_package_share_path
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription

MAPS = get_package_share_path("sim_bridge") / "maps"
PARAMETERS: dict[str, type] = {
    "map_file": str,
    "map_origin_latitude": float,
    "map_origin_longitude": float,
    "map_projector": str,
    "route": list[int],
    "scenario": str,
    "seed": int,
    "autostart": bool,
    "lockstep": bool,
    "real_time_factor": float,
    "decision_timeout_s": float,
}
TOPICS = {
    "output/odometry": "odometry",
    "output/objects": "objects",
    "output/visible_area": "visible_area",
    "output/route": "route",
    "output/ground_truth": "ground_truth",
    "output/episode": "episode",
    "input/situation": "situation",
    "input/decision": "decision",
}


def arguments() -> list[DeclareLaunchArgument]:
    """Everything that can be set; `ros2 launch ... --show-args` prints it."""
    settings = (
        ("map_file", str(MAPS / "four_way.osm"), "Lanelet2 map, an .osm file"),
        ("map_origin_latitude", "49.0", "Latitude of the projection's origin [degrees]"),
        ("map_origin_longitude", "8.4", "Longitude of the projection's origin [degrees]"),
        ("map_projector", "utm", "utm, local_cartesian, mercator or local_xy"),
        ("route", "[1, 9, 4]", "Lanelets of the ego's route in driving order"),
        ("scenario", "base", "Name of a scenario, or a scenario file ending in .yaml"),
        ("seed", "0", "Seed of the first episode; the next ones count on"),
        ("autostart", "true", "Start episodes without being asked through ~/reset"),
        ("lockstep", "true", "Simulated time waits for the planner"),
        ("real_time_factor", "1.0", "Highest ratio of simulated to real time, 0 for no limit"),
        ("decision_timeout_s", "5.0", "In lock-step, a later decision is not waited for [s]"),
        ("namespace", "", "Namespace of the node"),
        ("log_level", "info", "debug, info, warn, error or fatal"),
    )
    topics = (
        ("odometry", "nav_msgs/Odometry of the ego, out"),
        ("objects", "intersection_msgs/PerceivedObjects, the vehicles that are seen, out"),
        ("visible_area", "geometry_msgs/PolygonStamped, the area that is seen, out"),
        ("route", "intersection_msgs/Route, out"),
        ("ground_truth", "intersection_msgs/GroundTruth, all vehicles and obstacles, out"),
        ("episode", "intersection_msgs/EpisodeEvent, starts and ends, out"),
        ("situation", "intersection_msgs/Situation, waited for in lock-step, in"),
        ("decision", "intersection_msgs/Decision, obeyed, in"),
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


def generate_launch_description() -> LaunchDescription:
    """The node and its arguments."""
    simulator = Node(
        package="sim_bridge",
        executable="simulator_node",
        name="simulator",
        namespace=LaunchConfiguration("namespace"),
        parameters=[
            {
                name: ParameterValue(LaunchConfiguration(name), value_type=kind)
                for name, kind in PARAMETERS.items()
            }
        ],
        remappings=[
            (f"~/{end}", LaunchConfiguration(f"{topic}_topic")) for end, topic in TOPICS.items()
        ],
        arguments=["--ros-args", "--log-level", LaunchConfiguration("log_level")],
        output="screen",
    )
    return LaunchDescription([*arguments(), simulator])
