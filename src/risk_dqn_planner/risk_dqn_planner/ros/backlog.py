# SPDX-License-Identifier: Apache-2.0
"""The messages of one input that objects yet to come may belong to. Plain Python, without ROS 2."""

from bisect import bisect_left, bisect_right
from operator import attrgetter

from risk_dqn_planner.ros.streams import Stamped

_stamp_of = attrgetter("stamp_ns")
# Beyond so many the oldest go, whatever their stamps say: a second at 1 kHz, and then some.
_MOST = 2000


class Backlog:
    """Messages by rising stamps, as far back as a message may be of use."""

    def __init__(self) -> None:
        self._messages: list[Stamped] = []

    def add(self, message: Stamped, max_age_ns: int) -> None:
        """Take a message, and forget those more than an age older than it.

        One with the same stamp takes the place of the one before; one with a lower stamp begins
        anew, as time went back.
        """
        messages = self._messages
        if messages and message.stamp_ns < messages[-1].stamp_ns:
            messages.clear()
        if messages and message.stamp_ns == messages[-1].stamp_ns:
            messages.pop()
        messages.append(message)
        oldest_ns = message.stamp_ns - max_age_ns
        # One older than that is kept: it may be the only one that is not too new.
        too_old = bisect_right(messages, oldest_ns, key=_stamp_of) - 1
        del messages[: max(too_old, len(messages) - _MOST, 0)]

    def up_to(self, stamp_ns: int) -> Stamped | None:
        """Return the newest message of this time or before; None if all are newer."""
        count = bisect_right(self._messages, stamp_ns, key=_stamp_of)
        return self._messages[count - 1] if count else None

    def around(self, stamp_ns: int) -> list[Stamped]:
        """Return the message of this time, or the last before and the first after it: up to two."""
        messages = self._messages
        at = bisect_left(messages, stamp_ns, key=_stamp_of)
        if at < len(messages) and messages[at].stamp_ns == stamp_ns:
            return messages[at : at + 1]
        return messages[max(at - 1, 0) : at + 1]

    def keep_newest(self) -> None:
        """Forget all messages but the newest."""
        del self._messages[:-1]

    def forget_later_than(self, latest_ns: int) -> None:
        """Forget messages of a time that has not come yet."""
        del self._messages[bisect_right(self._messages, latest_ns, key=_stamp_of) :]
