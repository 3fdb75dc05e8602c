# SPDX-License-Identifier: Apache-2.0
"""Takes a managed node through its life over its services, as a lifecycle manager does."""

from collections.abc import Callable
from typing import Any

from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter as NodeParameter

from sim_bridge.ros.session import wait_until

ANSWER_S = 120.0


class LifecycleDriver:
    """A client of one managed node; `check` raises if that node has ended."""

    def __init__(self, node: Node, target: str, check: Callable[[], None]) -> None:
        self._check = check
        self._change = node.create_client(ChangeState, f"/{target}/change_state")
        self._get = node.create_client(GetState, f"/{target}/get_state")
        self._set = node.create_client(SetParameters, f"/{target}/set_parameters")
        for client in (self._change, self._get, self._set):
            wait_until(client.service_is_ready, client.srv_name, ANSWER_S, check)

    def request(self, transition: str) -> Any:  # noqa: ANN401 (a future)
        """Ask for a transition by its name; the future of its answer."""
        request = ChangeState.Request()
        request.transition.label = transition
        return self._change.call_async(request)

    def change(self, transition: str) -> bool:
        """Ask for a transition and return whether it was carried out."""
        return bool(self._await(self.request(transition)).success)

    def state(self) -> str:
        """The name of the node's state."""
        return str(self._await(self._get.call_async(GetState.Request())).current_state.label)

    def set(self, name: str, value: object) -> str:
        """Set a parameter; why that was refused, or "ok"."""
        parameter: Parameter = NodeParameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[parameter])
        result = self._await(self._set.call_async(request)).results[0]
        return "ok" if result.successful else str(result.reason)

    def await_state(self, name: str) -> None:
        """Wait until the node is in a state."""
        wait_until(lambda: self.state() == name, f"state {name}", ANSWER_S, self._check)

    def _await(self, future: Any) -> Any:  # noqa: ANN401 (and its answer)
        wait_until(future.done, "the node's answer", ANSWER_S, self._check)
        return future.result()
