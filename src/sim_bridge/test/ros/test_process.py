# SPDX-License-Identifier: Apache-2.0
import os
import signal
import socket

import pytest

from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.ros.node_group import uninterrupted
from sim_bridge.ros.process import NodeCommand, own_domain


def test_a_package_that_is_not_installed_is_named() -> None:
    with pytest.raises(ConfigurationError, match="package no_such_package is not installed"):
        NodeCommand("no_such_package", "node").arguments()


def test_an_executable_that_does_not_exist_is_named() -> None:
    with pytest.raises(ConfigurationError, match=r"lib/sim_bridge/no_such_node does not exist"):
        NodeCommand("sim_bridge", "no_such_node").arguments()


def test_a_domain_that_is_in_use_is_not_taken() -> None:
    with own_domain() as first:
        pass
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("", 7400 + 250 * first + 10))
        with own_domain() as other:
            assert other != first
    assert 1 <= first <= 100


def test_two_that_look_at_the_same_time_take_different_domains() -> None:
    with own_domain() as one, own_domain() as other:  # nobody listens in either yet
        assert one != other
    with own_domain() as again:
        assert again == one


@pytest.mark.parametrize("request_to_end", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_request_to_end_waits_for_the_end_of_the_block(request_to_end: signal.Signals) -> None:
    reached = []

    def block() -> None:
        with uninterrupted():
            os.kill(os.getpid(), request_to_end)
            reached.append("end of the block")

    with pytest.raises(KeyboardInterrupt):
        block()
    assert reached == ["end of the block"]
