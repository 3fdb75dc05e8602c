# SPDX-License-Identifier: Apache-2.0
"""The arrows between packages and rooms point one way; this scans every import statement."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PLANNER = ROOT / "src/risk_dqn_planner/risk_dqn_planner"
BRIDGE = ROOT / "src/sim_bridge/sim_bridge"

ROS_MODULES = {
    "action_msgs", "ament_index_python", "builtin_interfaces", "diagnostic_msgs",
    "diagnostic_updater", "geometry_msgs", "intersection_msgs", "launch", "launch_ros",
    "lifecycle_msgs", "mcap", "mcap_ros2", "nav_msgs", "rcl_interfaces", "rclpy", "rosbags",
    "rosgraph_msgs", "rosidl_parser",
    "rosidl_runtime_py", "sensor_msgs", "std_msgs", "std_srvs", "tf2_msgs", "tf2_ros",
    "visualization_msgs",
}  # fmt: skip

# A room may import from itself and from what stands before it.
FOUNDATION = ("faults", "errors", "compiled_cache", "compiled", "settled", "vehicle", "geometry")
ROOMS = (
    *FOUNDATION, "map", "intersection", "situation", "risk", "safety", "state", "policies",
    "explanation", "decision",
)  # fmt: skip


def sources(package: Path) -> list[Path]:
    found = sorted(package.rglob("*.py"))
    assert found, f"no source files under {package}"
    return found


def absolute_name(node: ast.ImportFrom, path: Path, package: Path) -> str:
    """Module named by a from-import, relative ones resolved."""
    if node.level == 0:
        return node.module or ""
    parts = (package.name, *path.relative_to(package).parent.parts)
    base = parts[: len(parts) - node.level + 1]
    return ".".join([*base, *([node.module] if node.module else [])])


def imports(path: Path, package: Path) -> Iterator[str]:
    """Every module that a file imports, wherever in the file it does so."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = absolute_name(node, path, package)
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)


def room_of(path: Path, package: Path) -> str:
    return path.relative_to(package).with_suffix("").parts[0]


def in_ros(path: Path, package: Path) -> bool:
    return room_of(path, package) == "ros"


@pytest.mark.parametrize("package", [PLANNER, BRIDGE], ids=lambda p: p.name)
def test_nothing_outside_ros_folders_imports_ros(package: Path) -> None:
    offences = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in sources(package)
        if not in_ros(path, package)
        for name in imports(path, package)
        if name.split(".")[0] in ROS_MODULES
    ]
    assert offences == []


@pytest.mark.parametrize("package", [PLANNER, BRIDGE], ids=lambda p: p.name)
def test_nothing_outside_ros_folders_imports_a_ros_folder(package: Path) -> None:
    offences = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in sources(package)
        if not in_ros(path, package)
        for name in imports(path, package)
        if name.split(".")[:2] in (["risk_dqn_planner", "ros"], ["sim_bridge", "ros"])
    ]
    assert offences == []


def test_the_planner_never_imports_the_simulation() -> None:
    offences = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in sources(PLANNER)
        for name in imports(path, PLANNER)
        if name.split(".")[0] == "sim_bridge"
    ]
    assert offences == []


def backward_imports() -> Iterator[str]:
    for path in sources(PLANNER):
        room = room_of(path, PLANNER)
        if room in {"ros", "__init__"}:
            continue
        for name in imports(path, PLANNER):
            parts = name.split(".")
            if parts[0] != PLANNER.name or len(parts) < 2 or parts[1] == room:
                continue
            target = parts[1]
            both_known = room in ROOMS and target in ROOMS
            if not both_known or (
                ROOMS.index(target) > ROOMS.index(room)
                and not (room in FOUNDATION and target in FOUNDATION)
            ):
                yield f"{path.relative_to(ROOT)} imports {name}"


def test_rooms_of_the_core_import_only_what_stands_before_them() -> None:
    assert list(backward_imports()) == []


def test_the_scan_sees_imports_inside_functions_and_relative_ones(tmp_path: Path) -> None:
    package = tmp_path / "risk_dqn_planner"
    (package / "state").mkdir(parents=True)
    file = package / "state" / "x.py"
    file.write_text("def f():\n    import rclpy.node\n    from ..policies import base\n")
    names = set(imports(file, package))
    assert "rclpy.node" in names
    assert "risk_dqn_planner.policies.base" in names
