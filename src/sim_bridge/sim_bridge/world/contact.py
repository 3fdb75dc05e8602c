# SPDX-License-Identifier: Apache-2.0
"""Where footprints can touch at all, so that elsewhere nobody has to look for collisions."""

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.geometry.footprint import footprints_overlap
from risk_dqn_planner.situation.situations import Booleans, Floats
from risk_dqn_planner.vehicle import VehicleDimensions
from sim_bridge.world.path_geometry import SPACING_M

# Added to both footprints for what happens between the samples: each moves half a spacing at most,
# and turns a little.
_LENGTH_MARGIN_M = 2.0 * SPACING_M
_WIDTH_MARGIN_M = 0.5


def contact_intervals(
    ego: Floats, tables: Floats, own: VehicleDimensions, other: VehicleDimensions
) -> tuple[tuple[float, float], Floats]:
    """Return the least and greatest arc length of the ego's centre and of the others' (P, 2).

    ego (K, 3) and tables (P, K, 3) are poses every SPACING_M. The end of a table stands for all
    that lies beyond it.
    """
    touched = np.zeros(tables.shape[:2], dtype=np.bool_)
    ego_touched = np.zeros(len(ego), dtype=np.bool_)
    _touches(
        ego,
        tables,
        own.length_m + _LENGTH_MARGIN_M,
        own.width_m + _WIDTH_MARGIN_M,
        other.length_m + _LENGTH_MARGIN_M,
        other.width_m + _WIDTH_MARGIN_M,
        touched,
        ego_touched,
    )
    return _interval(ego_touched), np.array([_interval(row) for row in touched])


def touching_paths(tables: Floats, vehicle: VehicleDimensions) -> Booleans:
    """Tell which pairs (P, P) of paths have footprints that touch somewhere; tables (P, K, 3)."""
    count = len(tables)
    result = np.zeros((count, count), dtype=np.bool_)
    for p in range(count):
        _, intervals = contact_intervals(tables[p], tables, vehicle, vehicle)
        result[p] = intervals[:, 0] < np.inf
    return result


def _interval(touched: Booleans) -> tuple[float, float]:
    where = np.flatnonzero(touched)
    if len(where) == 0:
        return np.inf, -np.inf
    last = np.inf if where[-1] == len(touched) - 1 else (where[-1] + 1) * SPACING_M
    return (where[0] - 1) * SPACING_M, last


@kernel
def _touches(
    ego: Floats,
    tables: Floats,
    own_length: float,
    own_width: float,
    length: float,
    width: float,
    touched: Booleans,
    ego_touched: Booleans,
) -> None:
    """Mark the samples of the ego's path and of the others at which two footprints overlap."""
    for k in range(len(ego)):
        for p in range(tables.shape[0]):
            for j in range(tables.shape[1]):
                if footprints_overlap(
                    ego[k, 0],
                    ego[k, 1],
                    ego[k, 2],
                    own_length,
                    own_width,
                    tables[p, j, 0],
                    tables[p, j, 1],
                    tables[p, j, 2],
                    length,
                    width,
                ):
                    touched[p, j] = True
                    ego_touched[k] = True
