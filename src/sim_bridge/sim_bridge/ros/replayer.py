# SPDX-License-Identifier: Apache-2.0
"""Plays a bag's inputs to the real planner nodes and collects the decisions they take now."""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path

from intersection_msgs.msg import Decision
from rclpy.node import Node
from rclpy.parameter_client import AsyncParameterClient
from rclpy.serialization import deserialize_message

from risk_dqn_planner.errors import BagError, ConfigurationError
from sim_bridge.ros.comparison import Difference, difference
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.pacing import LockStep, WallPace
from sim_bridge.ros.planner_link import DECISION_PERIOD_NS, EPISODE_GAP_NS, PlannerLink
from sim_bridge.ros.process import ParameterValue
from sim_bridge.ros.recording import Bag, Stored, read_bag
from sim_bridge.ros.run_settings import from_notes
from sim_bridge.ros.session import SilentPlannerError, ros_session, wait_until
from sim_bridge.ros.topics import DECISION, INPUTS, OBJECTS, ROUTE, SITUATION

_START_S = 240.0
_LOOK_AGAIN_S = 1.0
# Nobody drives by these decisions, so a starved computer gets time to take them.
_ANSWER_S = 30.0


@dataclass(frozen=True)
class Frame:
    """The inputs of one time."""

    stamp_ns: int
    inputs: list[Stored] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether objects are among them, so that there will be a situation."""
        return any(message.topic == OBJECTS.name for message in self.inputs)


def frames(messages: Sequence[Stored]) -> Iterator[Frame]:
    """Group a bag's inputs by time."""
    inputs = [message for message in messages if message.topic != DECISION.name]
    ordered = sorted(inputs, key=lambda message: message.stamp_ns)
    for stamp_ns, group in groupby(ordered, key=lambda message: message.stamp_ns):
        parts = list(group)
        yield Frame(stamp_ns, [m for topic in INPUTS for m in parts if m.topic == topic.name])


@dataclass(frozen=True)
class Replayed:
    """What came of a replay: the bag, the decisions taken now, and what differs.

    decisions: at each time at which one was due, None where none came in time. compared: how many
    decisions are recorded.
    """

    bag: Bag
    decisions: Mapping[int, Decision | None]
    compared: int
    differences: list[Difference]


class Replayer:
    """Plays frames to a running planner in lock-step."""

    def __init__(self, node: Node) -> None:
        self._publishers = {
            topic.name: node.create_publisher(topic.message, topic.name, topic.qos)
            for topic in INPUTS
        }
        self._link = PlannerLink(node, SITUATION.name, DECISION.name)
        self._pacing = LockStep(self._link, WallPace(0.0), _ANSWER_S)

    def meet_planner(self, check: Callable[[], None]) -> None:
        """Wait until the planner reads the inputs and answers.

        Raises:
            SilentPlannerError: it does not.
        """
        deadline = time.monotonic() + _START_S
        while self._link.meet(self._inputs_are_read, _LOOK_AGAIN_S) is None:
            check()
            if time.monotonic() > deadline:
                raise SilentPlannerError(f"the planner has decided nothing for {_START_S:g} s")

    def _inputs_are_read(self) -> bool:
        return all(p.get_subscription_count() > 0 for p in self._publishers.values())

    def _send(self, frame: Frame, *, routes: bool) -> None:
        """Send the frame's routes or its other inputs: a route takes the planner a while."""
        for message in frame.inputs:
            if (message.topic == ROUTE.name) is routes:
                self._publishers[message.topic].publish(message.data)

    def play(self, recorded: Sequence[Frame]) -> Iterator[tuple[int, Decision | None]]:
        """Yield the time [ns] of each decision that is due, and the decision."""
        before_ns: int | None = None
        for frame in recorded:
            self._send(frame, routes=True)
            if before_ns is None:
                # After the warm-up there is a pause too, as there was before the recording.
                self._pacing.pause(frame.stamp_ns - EPISODE_GAP_NS, frame.stamp_ns)
                before_ns = frame.stamp_ns - 1
            yield from self._decisions_between(before_ns, frame.stamp_ns)
            self._send(frame, routes=False)
            self._pacing.reach(frame.stamp_ns, complete=frame.complete)
            if frame.stamp_ns % DECISION_PERIOD_NS == 0:
                yield frame.stamp_ns, self._pacing.decision(frame.stamp_ns)
            before_ns = frame.stamp_ns

    def _decisions_between(
        self, before_ns: int, until_ns: int
    ) -> Iterator[tuple[int, Decision | None]]:
        """Yield the decisions that fall between two frames."""
        first_ns = (before_ns // DECISION_PERIOD_NS + 1) * DECISION_PERIOD_NS
        for stamp_ns in range(first_ns, until_ns, DECISION_PERIOD_NS):
            self._pacing.reach(stamp_ns, complete=False)
            yield stamp_ns, self._pacing.decision(stamp_ns)


def replay(path: Path, overrides: Mapping[str, ParameterValue], log_folder: Path) -> Replayed:
    """Replay one bag through node processes.

    Raises:
        BagError: the bag cannot be used. PlannerError: the nodes cannot.
    """
    bag = read_bag(path, (*INPUTS, DECISION))
    recorded = list(frames(bag.messages))
    if not any(frame.complete for frame in recorded):
        raise BagError(f"{path} holds no objects, nothing to decide on")
    commands = from_notes(path, bag.notes, overrides).planner_commands()
    now: dict[int, Decision | None] = {}
    with ros_session("replay") as node, NodeGroup(commands, log_folder) as planner:
        replayer = Replayer(node)
        replayer.meet_planner(planner.check)
        _refuse_unknown(node, overrides, planner.check)
        for stamp_ns, decision in replayer.play(recorded):
            planner.check()
            now[stamp_ns] = decision
    return _compared(bag, now)


def _compared(bag: Bag, now: Mapping[int, Decision | None]) -> Replayed:
    before = {m.stamp_ns: deserialize_message(m.data, Decision) for m in bag.of(DECISION)}
    found = [difference(decision, now.get(stamp_ns)) for stamp_ns, decision in before.items()]
    return Replayed(bag, now, len(before), [d for d in found if d is not None])


def _refuse_unknown(node: Node, names: Iterable[str], check: Callable[[], None]) -> None:
    """Raise ConfigurationError for a parameter that no node has: nodes just ignore those."""
    known: set[str] = set()
    for target in ("situation", "policy"):
        client = AsyncParameterClient(node, target)
        answer = client.list_parameters()
        wait_until(answer.done, f"the parameters of {target}", _ANSWER_S, check)
        known.update(answer.result().result.names)
    for name in names:
        if name not in known:
            raise ConfigurationError(f"no node of the planner has a parameter {name}")
