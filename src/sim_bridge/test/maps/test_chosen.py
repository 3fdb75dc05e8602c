# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest

from risk_dqn_planner.errors import ConfigurationError, MapFileError
from risk_dqn_planner.map.loader import MapOrigin
from sim_bridge.maps import chosen_map, route_and_origin, shipped_map


def test_an_own_map_brings_what_is_not_given() -> None:
    own = shipped_map("four_way")
    assert chosen_map("four_way") == (own.path, own.route, own.origin)
    elsewhere = MapOrigin(49.0, 8.4)
    assert chosen_map("four_way", (7,), elsewhere) == (own.path, (7,), elsewhere)


def test_a_file_needs_a_route_and_may_lack_an_origin() -> None:
    assert chosen_map("town.osm", (1, 2)) == (Path("town.osm"), (1, 2), None)
    with pytest.raises(ConfigurationError, match=r"town\.osm is no own map"):
        chosen_map("town.osm")


def test_other_names_are_refused() -> None:
    with pytest.raises(MapFileError, match="nowhere"):
        chosen_map("nowhere", (1, 2))


def test_options_that_are_not_given_say_nothing() -> None:
    assert route_and_origin(None, None) == (None, None)
    assert route_and_origin("1,9,4", "49.0,8.4") == ((1, 9, 4), MapOrigin(49.0, 8.4))
    with pytest.raises(ConfigurationError, match="1,x"):
        route_and_origin("1,x", None)
