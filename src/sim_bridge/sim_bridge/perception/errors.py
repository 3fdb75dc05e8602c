# SPDX-License-Identifier: Apache-2.0
"""How a sensor errs beyond noise: speeds with a bias, vehicles missed, phantoms reported.

All depends on the seed, the inner step and the vehicle's id (or the lane) alone, so that who
looks twice finds the same. Scenarios without such errors do not come here.
"""

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Situations
from sim_bridge.perception.perception import View, match_vehicles
from sim_bridge.perception.phantoms import Reported, report_phantoms, report_vehicles
from sim_bridge.simulation.randomness import MISSED_STREAM, random_share
from sim_bridge.simulation.settings import Sensing, Settings
from sim_bridge.simulation.state import MOST_IDS, Episodes, Vehicles
from sim_bridge.world.matches import Matches
from sim_bridge.world.world import Lanes, Paths


@kernel
def err(sensing: Sensing, episodes: Episodes, vehicles: Vehicles, view: View) -> None:
    """Take the missed ones from those that the view has seen, and add the bias to all speeds.

    The places of the missed ones count as seen all the same.
    """
    seed, tick, ids, driving = episodes.seed, episodes.tick, vehicles.id, vehicles.driving
    seen, measured_mps = view.seen, view.measured_mps
    share, bias_mps = sensing.missed_share, sensing.bias_mps
    for b in range(seen.shape[0]):
        for i in range(seen.shape[1]):
            if not driving[b, i]:
                continue
            measured_mps[b, i] += bias_mps
            look = tick[b] * MOST_IDS + ids[b, i]
            if share > 0.0 and random_share(seed[b], MISSED_STREAM, look) < share:
                seen[b, i] = False


@kernel
def perceive_with_errors(
    paths: Paths,
    lanes: Lanes,
    matches: Matches,
    settings: Settings,
    sensing: Sensing,
    episodes: Episodes,
    vehicles: Vehicles,
    view: View,
    reported: Reported,
    situations: Situations,
) -> None:
    """Fill in the seen vehicles anew, with errors, after `perceive` has looked without."""
    err(sensing, episodes, vehicles, view)
    report_vehicles(vehicles, view, reported)
    if sensing.phantom_share > 0.0:
        report_phantoms(paths, lanes, settings, sensing, episodes, view, reported)
    path, s_m, ids = reported.path, reported.s_m, reported.id
    seen, measured_mps = reported.seen, reported.measured_mps
    match_vehicles(matches, path, s_m, ids, seen, measured_mps, situations)
