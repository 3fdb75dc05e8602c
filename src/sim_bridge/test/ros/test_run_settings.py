# SPDX-License-Identifier: Apache-2.0
import argparse
from dataclasses import replace

import pytest

from risk_dqn_planner.errors import BagError, ConfigurationError, MapFileError
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY
from sim_bridge.ros.input_loss import InputLoss
from sim_bridge.ros.run_settings import (
    RunSettings,
    add_run_arguments,
    from_notes,
    own_map_settings,
    run_settings,
)


def parse(*options: str) -> RunSettings:
    parser = argparse.ArgumentParser()
    add_run_arguments(parser)
    return run_settings(parser.parse_args(options))


def test_an_own_map_brings_its_file_route_and_origin() -> None:
    settings = parse("--map", "t_junction")
    assert settings.map_file.name == "t_junction.osm"
    assert settings.route == (1, 7, 4)
    assert str(settings.origin) == "49,8.4"


def test_route_and_origin_of_an_own_map_can_be_replaced() -> None:
    settings = parse("--route", "5,-6,9000000000000000000", "--origin=48.5,-9.25")
    assert settings.route == (5, -6, 9000000000000000000)
    assert (settings.origin.latitude_deg, settings.origin.longitude_deg) == (48.5, -9.25)


def test_a_map_in_local_coordinates_needs_no_origin() -> None:
    options = ["--map", "x.osm", "--route", "1,2", "--projector", "local_xy"]
    settings = parse(*options)
    assert settings.projector == "local_xy"
    assert from_notes(settings.map_file, settings.notes(), {}) == settings


@pytest.mark.parametrize(
    ("options", "error", "complaint"),
    [
        (["--map", "x.osm", "--origin", "1,2"], ConfigurationError, "its route must be given"),
        (["--map", "x.osm", "--route", "1,2"], ConfigurationError, "its origin must be given"),
        (["--map", "x"], MapFileError, "no map 'x'"),
        (["--route", "1;2"], ConfigurationError, "route is '1;2'"),
        (["--origin", "north"], ConfigurationError, "'north'"),
    ],
)
def test_a_wrong_option_is_named(
    options: list[str], error: type[Exception], complaint: str
) -> None:
    with pytest.raises(error, match=complaint):
        parse(*options)


def test_a_bag_s_notes_give_the_settings_back() -> None:
    options = ["--origin", "49.00000001,8.4", "--scenario", "base", "--policy", "always_slow"]
    settings = parse(*options, "--supervisor", "report", "--memory", "tracked")
    assert from_notes(settings.map_file, settings.notes(), {}) == settings


def test_a_bag_without_notes_cannot_be_replayed() -> None:
    settings = own_map_settings()
    notes = {key: value for key, value in settings.notes().items() if key != "policy"}
    with pytest.raises(BagError, match="does not say with which policy"):
        from_notes(settings.map_file, notes, {})
    with pytest.raises(BagError, match="no map 'atlantis'"):
        from_notes(settings.map_file, settings.notes() | {"map": "atlantis"}, {})


def test_nodes_get_their_parameters_and_topics_on_the_command_line() -> None:
    settings = own_map_settings()
    simulator = settings.simulator_command(2.0).arguments()
    assert "route:=[1, 9, 4]" in simulator
    assert "real_time_factor:=2.0" in simulator
    assert "lockstep:=true" in simulator
    assert "~/output/objects:=/objects" in simulator
    situation, policy = (command.arguments() for command in settings.planner_commands())
    assert "~/input/objects:=/objects" in situation
    assert "~/output/situation:=/situation" in situation
    assert "~/input/situation:=/situation" in policy
    assert f'policy:="{DEFAULT_POLICY}"' in policy


def test_supervisor_and_memory_reach_the_node_that_they_belong_to() -> None:
    commands = parse("--supervisor", "report", "--memory", "tracked").planner_commands()
    situation, policy = (command.parameters for command in commands)
    assert (situation.get("memory"), situation.get("supervisor")) == ("tracked", None)
    assert (policy.get("memory"), policy.get("supervisor")) == (None, "report")


def test_a_loss_of_input_is_noted_and_handed_to_the_simulator() -> None:
    settings = replace(own_map_settings(), loss=InputLoss("objects", 6.0, 3.0))
    assert settings.notes()["loss"] == "objects,6,3"
    given = settings.simulator_command(0.0).parameters
    assert (given["loss.input"], given["loss.after_s"], given["loss.for_s"]) == (
        "objects",
        6.0,
        3.0,
    )
    assert "loss" not in own_map_settings().notes()
