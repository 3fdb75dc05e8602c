# SPDX-License-Identifier: Apache-2.0
"""Starts simulator and planner together: an endless drive to watch in RViz or on the topics.

ros2 launch sim_bridge demo.launch.py rviz:=true
"""

from ament_index_python.packages import get_package_share_path
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

from launch import LaunchDescription


def include(
    package: str, name: str, **values: str | LaunchConfiguration
) -> IncludeLaunchDescription:
    """Another launch file, some of its arguments fixed; the others stay open to the user."""
    path = get_package_share_path(package) / "launch" / f"{name}.launch.py"
    return IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(path)), launch_arguments=list(values.items())
    )


def generate_launch_description() -> LaunchDescription:
    """Both packages' nodes; the arguments are those of both launch files."""
    return LaunchDescription(
        [
            # First: its defaults for map and topics then hold for the planner as well.
            include("sim_bridge", "simulator"),
            include(
                "risk_dqn_planner",
                "planner",
                map_file=LaunchConfiguration("map_file"),
                use_sim_time="true",
                # In lock-step the clock waits for the planner: twice decision_timeout_s at most.
                clock_timeout_s="10.0",
                sim_time_patience_s="1.0",
                autostart="true",  # the argument of that name is the simulator's
            ),
        ]
    )
