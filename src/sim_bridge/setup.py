# SPDX-License-Identifier: Apache-2.0
"""Installs the package where ROS 2 looks for nodes, launch files and data."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = "sim_bridge"
# Under --symlink-install colcon runs a link to this file: the sources lie where the link points.
SOURCE = Path(__file__).resolve().parent


def data_files(*folders: str) -> list[tuple[str, list[str]]]:
    """List what lies below the folders, each file to go to its place under share/NAME."""
    by_folder: dict[str, list[str]] = {}
    for folder in folders:
        for path in sorted((SOURCE / folder).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                relative = path.relative_to(SOURCE)
                target = str(Path("share") / NAME / relative.parent)
                by_folder.setdefault(target, []).append(str(relative))
    return list(by_folder.items())


setup(
    name=NAME,
    version="0.1.0",
    description="Simulated intersections with hidden traffic, the demo and bag replay.",
    license="Apache-2.0",
    maintainer="risk-dqn-planner maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    packages=find_packages(exclude=["test", "test.*"]),
    package_data={"": ["py.typed", "**/*.yaml", "**/*.json"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *data_files("launch", "config", "rviz", "maps"),
    ],
    python_requires=">=3.10",
    install_requires=["setuptools"],
    # colcon test runs pytest only where this is named.
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "convert = sim_bridge.ros.convert:main",
            "demo = sim_bridge.ros.demo:main",
            "draw_maps = sim_bridge.maps.draw:main",
            "evaluate = sim_bridge.evaluation.evaluate:main",
            "record = sim_bridge.ros.record:main",
            "replay = sim_bridge.ros.replay:main",
            "ship = sim_bridge.learning.ship:main",
            "soak = sim_bridge.ros.soak.command:main",
            "simulator_node = sim_bridge.ros.simulator_node:main",
            "story = sim_bridge.ros.story.command:main",
            "train = sim_bridge.learning.train:main",
            "update_bags = sim_bridge.ros.update_bags:main",
        ],
    },
)
