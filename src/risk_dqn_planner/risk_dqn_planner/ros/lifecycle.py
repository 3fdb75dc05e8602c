# SPDX-License-Identifier: Apache-2.0
"""Managed nodes: configured and activated on request, or by themselves for a plain `ros2 run`.

Callbacks, timers and lifecycle services run in a thread of their own. Transitions are carried out
in another, one after the other: there they may take their time, and a request to end the process
need not wait for them.
"""

import queue
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import ChangeState
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.task import Future

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.ros.declaration import Declared
from risk_dqn_planner.ros.settling import settle

_SUCCESS, _FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
# The answer to a last request is on its way for so long at most.
_FAREWELL_S = 0.5
# How often a node looks whether it is asked to end.
LOOK_AGAIN_S = 0.2


@dataclass(frozen=True)
class LifecycleParameters:
    """Who takes a node through its life."""

    autostart: bool = field(
        default=True,
        metadata={
            "description": "Configure and activate at the start; else a lifecycle manager does",
            "fixed": True,
        },
    )


class _Request(NamedTuple):
    request: ChangeState.Request
    response: ChangeState.Response
    done: Future


class ManagedNode(LifecycleNodeMixin, Node):
    """A lifecycle node; what it does in transitions is told by `configure` and the like."""

    def __init__(self, name: str) -> None:
        Node.__init__(self, name)
        # A group of their own, in which one service may wait while the others answer.
        LifecycleNodeMixin.__init__(self, callback_group=ReentrantCallbackGroup())
        self._requests: queue.SimpleQueue[_Request] = queue.SimpleQueue()
        self._carry_out = self._service_change_state.callback
        # A coroutine: rclpy goes on with other callbacks while it waits.
        self._service_change_state.callback = self._on_request  # type: ignore[assignment]
        self.declared = Declared(self, self.state_name, self.reconfigure)
        self.declared.add(LifecycleParameters)
        self.autostart = self.declared.read(LifecycleParameters).autostart

    def configure(self) -> None:
        """Read the parameters, load and check what they name.

        Raises:
            PlannerError: it cannot be used; the node stays unconfigured.
        """

    def refuse(self, error: PlannerError) -> None:
        """Take note that the node could not be configured."""

    def reconfigure(self) -> None:
        """Go by changed parameters from now on."""

    def activate(self) -> None:
        """Begin to work."""

    def deactivate(self) -> None:
        """Cease to work."""

    def clean_up(self) -> None:
        """Forget what `configure` has loaded."""

    def state_name(self) -> str:
        """The name of the node's state, such as "unconfigured"."""
        return str(self._state_machine.current_state[1])

    def serve(self, executor: Executor, asked_to_end: Callable[[], bool]) -> None:
        """Carry out transitions until the last one, `shutdown`, or until asked to end."""
        if self.autostart and self.trigger_configure() == _SUCCESS:
            self.trigger_activate()
        while not asked_to_end():
            with suppress(queue.Empty):
                self._serve_one(self._requests.get(timeout=LOOK_AGAIN_S))
                executor.wake()
            if self._state_machine.current_state[0] == State.PRIMARY_STATE_FINALIZED:
                time.sleep(_FAREWELL_S)
                return

    def _serve_one(self, one: _Request) -> None:
        try:
            response = self._carry_out(one.request, one.response)
        except Exception as error:  # noqa: BLE001 (rclpy raises where a state has no such transition)
            self.get_logger().warning(
                f"transition {one.request.transition.label or one.request.transition.id} refused "
                f"while {self.state_name()}: {' '.join(str(error).split())}"
            )
            response = one.response
            response.success = False
        one.done.set_result(response)

    async def _on_request(
        self, request: ChangeState.Request, response: ChangeState.Response
    ) -> Any:  # noqa: ANN401 (a response)
        done = Future()
        self._requests.put(_Request(request, response, done))
        return await done

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer to the transition `configure`."""
        try:
            self.configure()
        except PlannerError as error:
            problem = error
        except Exception as error:  # noqa: BLE001 (the node lives on and says what is wrong)
            self.get_logger().error(traceback.format_exc())
            problem = PlannerError(f"internal error: {error!r}")
        else:
            settle()
            return super().on_configure(state)
        self.get_logger().error(f"not configured: {' '.join(str(problem).split())}")
        self.refuse(problem)
        return _FAILURE

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer to the transition `activate`."""
        self._do(self.activate)
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer to the transition `deactivate`."""
        self._do(self.deactivate)
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer to the transition `cleanup`."""
        self._do(self.clean_up)
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer to the transition `shutdown`, after which the process ends."""
        self.deactivate()
        self.clean_up()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to unconfigured after a transition that failed."""
        text = f"a transition from {state.label} failed; unconfigured now"
        self.get_logger().error(text)
        self.deactivate()
        self.clean_up()
        if self.autostart:
            self.refuse(PlannerError(text))
        return _SUCCESS

    def _do(self, what: Callable[[], None]) -> None:
        """Do a transition's work; rclpy keeps to itself what goes wrong."""
        try:
            what()
        except Exception:
            self.get_logger().error(traceback.format_exc())
            raise
