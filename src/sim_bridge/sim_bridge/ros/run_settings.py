# SPDX-License-Identifier: Apache-2.0
"""What a run needs to know, from the command line or from the notes in a bag, and as parameters."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from risk_dqn_planner.errors import BagError, ConfigurationError, PlannerError
from risk_dqn_planner.map.loader import LOCAL_XY, MapOrigin
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY, DEFAULT_SUPERVISOR
from risk_dqn_planner.policies.supervised import supervisor_mode
from risk_dqn_planner.situation.config import SituationConfig, require_memory
from sim_bridge.maps import add_map_file_options, chosen_map, map_names, route_and_origin
from sim_bridge.ros.input_loss import InputLoss
from sim_bridge.ros.process import NodeCommand, ParameterValue
from sim_bridge.ros.topics import remappings
from sim_bridge.scenarios.loading import load_scenario

DEFAULT_MAP = "four_way"
DEFAULT_SCENARIO = "base"
DEFAULT_MEMORY = SituationConfig.memory

# Lock-step has time: on a busy computer a situation may reach the policy long after the clock,
# which stands until both have answered.
_LOCKSTEP: dict[str, ParameterValue] = {
    "use_sim_time": True,
    "sim_time_patience_s": 1.0,
    "clock_timeout_s": 30.0,
}


@dataclass(frozen=True)
class RunSettings:
    """What is driven where, by which policy.

    map_name: name of an own map or path of another. supervisor, memory: parameters of the policy
    and of the situation node. overrides: other parameters of these nodes that differ from their
    defaults. loss: an input that the simulator does not send for a while.
    """

    map_name: str
    map_file: Path
    route: tuple[int, ...]
    origin: MapOrigin
    projector: str
    policy: str
    scenario: str
    supervisor: str = DEFAULT_SUPERVISOR
    memory: str = DEFAULT_MEMORY
    overrides: Mapping[str, ParameterValue] = field(default_factory=dict)
    loss: InputLoss = field(default_factory=InputLoss)

    def notes(self) -> dict[str, str]:
        """Texts from which `from_notes` builds the same settings, but for a loss of input."""
        return {
            "map": self.map_name,
            "route": ",".join(str(lanelet_id) for lanelet_id in self.route),
            "origin": f"{self.origin.latitude_deg!r},{self.origin.longitude_deg!r}",
            "projector": self.projector,
            "policy": self.policy,
            "scenario": self.scenario,
            "supervisor": self.supervisor,
            "memory": self.memory,
            **({"loss": self.loss.note()} if self.loss.input else {}),
        }

    def _map_parameters(self) -> dict[str, ParameterValue]:
        return {
            "map_file": str(self.map_file.resolve()),
            "map_origin_latitude": self.origin.latitude_deg,
            "map_origin_longitude": self.origin.longitude_deg,
            "map_projector": self.projector,
        }

    def planner_commands(self) -> list[NodeCommand]:
        """Situation and policy node, in simulated time.

        Raises:
            ScenarioError: there is no such scenario.
        """
        sensor_range_m = load_scenario(self.scenario).sensor.range_m
        situation = {
            **self._map_parameters(),
            **_LOCKSTEP,
            "sensor_range_m": sensor_range_m,
            "memory": self.memory,
            **self.overrides,
        }
        policy = {
            **_LOCKSTEP,
            "policy": self.policy,
            "supervisor": self.supervisor,
            **self.overrides,
        }
        package = "risk_dqn_planner"
        return [
            NodeCommand(package, "situation_node", situation, remappings("situation")),
            NodeCommand(package, "policy_node", policy, remappings("policy")),
        ]

    def simulator_command(self, real_time_factor: float) -> NodeCommand:
        """Simulator in lock-step, waiting for the reset service."""
        parameters = {
            **self._map_parameters(),
            "use_sim_time": False,  # it is the clock
            "route": list(self.route),
            "scenario": self.scenario,
            "real_time_factor": real_time_factor,
            "lockstep": True,
            "autostart": False,
            "loss.input": self.loss.input,
            "loss.after_s": self.loss.after_s,
            "loss.for_s": self.loss.for_s,
        }
        return NodeCommand("sim_bridge", "simulator_node", parameters, remappings("simulator"))


def add_run_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options that say what is driven where."""
    names = ", ".join(map_names())
    parser.add_argument(
        "--map", default=DEFAULT_MAP, help=f"own map ({names}) or an .osm file [%(default)s]"
    )
    add_map_file_options(parser)
    parser.add_argument(
        "--policy", default=DEFAULT_POLICY, help="name or policy file [%(default)s]"
    )
    parser.add_argument("--scenario", default=DEFAULT_SCENARIO, help="name [%(default)s]")
    parser.add_argument(
        "--supervisor",
        default=DEFAULT_SUPERVISOR,
        help="around the policy: off, report or enforce [%(default)s]",
    )
    parser.add_argument(
        "--memory",
        default=DEFAULT_MEMORY,
        help="of hidden space: instantaneous or tracked [%(default)s]",
    )


def own_map_settings(
    name: str = DEFAULT_MAP,
    policy: str = DEFAULT_POLICY,
    scenario: str = DEFAULT_SCENARIO,
    supervisor: str = DEFAULT_SUPERVISOR,
) -> RunSettings:
    """Return what is driven on an own map when nothing else is asked for."""
    parser = argparse.ArgumentParser()
    add_run_arguments(parser)
    options = ["--map", name, "--policy", policy, "--scenario", scenario]
    options += ["--supervisor", supervisor]
    return run_settings(parser.parse_args(options))


def run_settings(arguments: argparse.Namespace) -> RunSettings:
    """Complete the options: an own map brings its file, route and origin.

    Raises:
        ConfigurationError: a file without route, or an option that is none of its values.
        MapFileError: no such own map. Both name it.
    """
    supervisor_mode(arguments.supervisor)
    require_memory(arguments.memory)
    # Whoever names a file wants it loaded, which runs its code; a bag's notes name none like that.
    named_file = {"allow_unlisted_policy": True} if arguments.policy.endswith(".pt") else {}
    name = str(arguments.map)
    chosen = chosen_map(name, *route_and_origin(arguments.route, arguments.origin))
    # Maps in local coordinates are projected from nowhere.
    origin = MapOrigin(0.0, 0.0) if arguments.projector == LOCAL_XY else chosen.origin
    if origin is None:
        raise ConfigurationError(f"{name} is no own map, so its origin must be given")
    return RunSettings(
        map_name=name,
        map_file=chosen.path,
        route=chosen.route,
        origin=origin,
        projector=arguments.projector,
        policy=arguments.policy,
        scenario=arguments.scenario,
        supervisor=arguments.supervisor,
        memory=arguments.memory,
        overrides=named_file,
    )


def from_notes(
    path: Path, notes: Mapping[str, str], overrides: Mapping[str, ParameterValue]
) -> RunSettings:
    """Read the settings with which a bag was recorded.

    Raises:
        BagError: the notes are incomplete or make no sense.
    """
    expected = (
        "map", "route", "origin", "projector", "policy", "scenario", "supervisor", "memory"
    )  # fmt: skip
    missing = [name for name in expected if name not in notes]
    if missing:
        raise BagError(f"{path} does not say with which {missing[0]} it was recorded")
    try:
        settings = run_settings(argparse.Namespace(**{name: notes[name] for name in expected}))
    except PlannerError as error:
        raise BagError(f"{path} cannot be replayed: {error}") from error
    return replace(settings, overrides=overrides)
