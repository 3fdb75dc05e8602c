# SPDX-License-Identifier: Apache-2.0
"""Draws an intersection and one moment of an episode from above."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon as Patch
from shapely.geometry import LineString

from risk_dqn_planner.decision import Action
from risk_dqn_planner.geometry.footprint import footprint_corners
from risk_dqn_planner.intersection.model import ConflictKind, IntersectionModel, LanePath
from sim_bridge.rendering.frames import Floats, Frame, VehicleFrame

ACTION_COLORS = {Action.STOP: "#c62828", Action.SLOW: "#ef9f1a", Action.FAST: "#2e7d32"}
_GROUND, _ROAD, _EGO_ROAD = "#dfe5dc", "#b9bfc6", "#a3aebb"
_SEEN, _OBSTACLE = "#fff3b0", "#5d6d7e"
_EGO, _OTHER = "#1565c0", "#37474f"
_ZONES = {ConflictKind.CROSSING: "#e57373", ConflictKind.MERGING: "#ba68c8"}
_ZONE_POINTS = 9


def draw_intersection(axes: Axes, model: IntersectionModel) -> None:
    """Draw lanes, conflict zones, stop line and goal; the axes keep the map's scale."""
    axes.set_facecolor(_GROUND)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    for lane in model.lanes:
        for path in lane.paths:
            _draw_lane(axes, path.path, _ROAD)
    _draw_lane(axes, model.ego_path, _EGO_ROAD)
    for lane in model.lanes:
        path = lane.paths[0]
        center, half = path.zone_center_m, 0.5 * lane.zone_length_m
        _draw_stretch(axes, path.path, center - half, center + half, _ZONES[lane.kind])
    stop_m = model.stop_line.position_m + 0.5 * model.ego_dimensions.length_m
    style = ":" if model.stop_line.derived else "-"
    axes.plot(*_across(model.ego_path, stop_m).T, style, color="#b71c1c", lw=2.0, zorder=3)
    axes.plot(*_across(model.ego_path, model.goal_m).T, "-", color="#2e7d32", lw=2.0, zorder=3)


def draw_frame(axes: Axes, frame: Frame) -> None:
    """Draw a moment: hidden vehicles hollow and dashed, the ego in its action's colour."""
    if frame.visible_area is not None:
        area = Patch(frame.visible_area, facecolor=_SEEN, edgecolor="#d4ac0d", lw=0.6)
        area.set(alpha=0.4, zorder=1.5)
        axes.add_patch(area)
    for corners in frame.obstacles:
        axes.add_patch(Patch(corners, facecolor=_OBSTACLE, edgecolor="#34495e", zorder=4))
    for vehicle in frame.vehicles:
        _draw_vehicle(axes, vehicle, _OTHER)
        _label(axes, vehicle)
    _draw_vehicle(axes, frame.ego, _EGO)


def look_at(axes: Axes, center: tuple[float, float], half_width_m: float) -> None:
    """Show a square about a point."""
    x, y = center
    axes.set_xlim(x - half_width_m, x + half_width_m)
    axes.set_ylim(y - half_width_m, y + half_width_m)


def zone_center(model: IntersectionModel) -> tuple[float, float]:
    """Return the middle of the conflict zones on the ego's path."""
    middle = np.mean([lane.ego_zone_center_m for lane in model.lanes])
    return model.ego_path.centerline.position(float(middle))


def _draw_lane(axes: Axes, path: LanePath, color: str) -> None:
    outline = LineString(path.centerline.xy).buffer(path.half_width_m, cap_style="flat")
    axes.add_patch(Patch(np.array(outline.exterior.coords), facecolor=color, zorder=1))
    axes.plot(*path.centerline.xy.T, color="white", lw=0.6, dashes=(6, 6), zorder=1)


def _draw_stretch(axes: Axes, path: LanePath, start: float, end: float, color: str) -> None:
    line = np.array([path.centerline.position(s) for s in np.linspace(start, end, _ZONE_POINTS)])
    outline = LineString(line).buffer(path.half_width_m, cap_style="flat")
    patch = Patch(np.array(outline.exterior.coords), facecolor=color, alpha=0.35, zorder=2)
    axes.add_patch(patch)


def _across(path: LanePath, s: float) -> Floats:
    """Return the ends (2, 2) of a line across a lane."""
    x, y = path.centerline.position(s)
    heading = path.centerline.heading_at(s)
    left = path.half_width_m * np.array([-np.sin(heading), np.cos(heading)])
    ends: Floats = np.array([x, y]) + np.outer([1.0, -1.0], left)
    return ends


def _draw_vehicle(axes: Axes, vehicle: VehicleFrame, color: str) -> None:
    corners = footprint_corners(
        vehicle.x_m, vehicle.y_m, vehicle.heading_rad, vehicle.length_m, vehicle.width_m
    )
    if vehicle.hidden:
        outline = Patch(corners, facecolor="none", edgecolor=color, ls=(0, (2, 1.5)), lw=1.2)
    else:
        outline = Patch(corners, facecolor=color, edgecolor="black", lw=0.6)
    outline.set_zorder(5)
    axes.add_patch(outline)
    reach = 0.5 * vehicle.length_m + 0.6 * abs(vehicle.speed_mps)
    ahead = reach * np.array([np.cos(vehicle.heading_rad), np.sin(vehicle.heading_rad)])
    x, y = vehicle.x_m, vehicle.y_m
    axes.plot([x, x + ahead[0]], [y, y + ahead[1]], color=color, lw=1.0, zorder=5)


def _label(axes: Axes, vehicle: VehicleFrame) -> None:
    text = axes.annotate(
        f"{vehicle.id}",
        (vehicle.x_m, vehicle.y_m),
        xytext=(0, 5),
        textcoords="offset points",
        ha="center",
        fontsize=6.5,
        color="#78909c" if vehicle.hidden else "#263238",
        zorder=6,
    )
    text.set_clip_on(True)
