# SPDX-License-Identifier: Apache-2.0
"""Decisions against episodes: what was missing or doubtful, in plain Python without ROS 2.

Between episodes no inputs are sent and time jumps, so there a Stop for want of inputs, or none at
all, is right; within an episode neither is. Topics are not ordered against each other, so an
episode is judged once a decision of a later time has arrived.
"""

from collections import Counter
from dataclasses import dataclass, field
from itertools import pairwise

from risk_dqn_planner.ros.streams import SECOND_NS


@dataclass
class Ledger:
    """What happened so far, episodes that have not ended left out.

    episodes: how many ended by how. decisions: how many were taken within them. faults: how many
    of these were Stop for a fault, by its reason. longest_gap_s: longest simulated time within an
    episode without decision, its ends counted. late: decisions that the simulator called late.
    """

    episodes: Counter[str] = field(default_factory=Counter)
    decisions: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    longest_gap_s: float = 0.0
    late: int = 0
    _waiting: list[tuple[int, str | None]] = field(default_factory=list)
    _started_ns: int | None = None
    _ended_ns: int | None = None
    _result: str = ""

    def started(self, stamp_ns: int) -> None:
        """Take the start of an episode."""
        self._close()
        self._started_ns, self._ended_ns = stamp_ns, None

    def decided(self, stamp_ns: int, fault: str | None) -> None:
        """Take a decision; `fault` is the reason of a Stop that no policy asked for."""
        if self._ended_ns is not None and stamp_ns > self._ended_ns:
            self._close()
        self._waiting.append((stamp_ns, fault))

    def ended(self, stamp_ns: int, result: str, late: int) -> None:
        """Take the end of an episode."""
        self._ended_ns, self._result = stamp_ns, result
        self.late += late

    def _close(self) -> None:
        """Judge the episode that has ended, if one has."""
        begin_ns, end_ns = self._started_ns, self._ended_ns
        if begin_ns is None or end_ns is None:
            return
        own = [(stamp, fault) for stamp, fault in self._waiting if begin_ns <= stamp <= end_ns]
        stamps = sorted({begin_ns, *(stamp for stamp, _ in own), end_ns})
        gaps_ns = [after - before for before, after in pairwise(stamps)]
        self.longest_gap_s = max([self.longest_gap_s, *(gap / SECOND_NS for gap in gaps_ns)])
        self.episodes[self._result] += 1
        self.decisions += len(own)
        self.faults.update(fault for _, fault in own if fault is not None)
        self._waiting = [(stamp, fault) for stamp, fault in self._waiting if stamp > end_ns]
        self._started_ns = self._ended_ns = None
