# SPDX-License-Identifier: Apache-2.0
"""Why episodes time out: impossible, the price of soundness, or missed."""

from collections.abc import Iterable
from typing import NamedTuple

SUCCESS, COLLISION, TIMEOUT = "S", "C", "T"


class Timeouts(NamedTuple):
    """Numbers of timeouts among so many episodes.

    impossible: no way to the goal is known; price: there is one, but none that is sound;
    missed: there is a sound one.
    """

    episodes: int
    impossible: int
    price: int
    missed: int


def united(outcomes: Iterable[str]) -> str:
    """Return S for each episode that ended so for anyone, else what the first one got."""
    first, *others = outcomes
    return "".join(
        SUCCESS if SUCCESS in (own, *theirs) else own
        for own, *theirs in zip(first, *others, strict=True)
    )


def classified(policy: str, physical: str, sound: str) -> Timeouts:
    """Count the timeouts of a policy by what the limits reached in the same episodes.

    All are letters of `summarise_first`; a way that is sound is a way.
    """
    timeouts = [
        (SUCCESS in (possible, soundly), soundly == SUCCESS)
        for own, possible, soundly in zip(policy, physical, sound, strict=True)
        if own == TIMEOUT
    ]
    return Timeouts(
        episodes=len(policy),
        impossible=sum(not possible for possible, _ in timeouts),
        price=sum(possible and not soundly for possible, soundly in timeouts),
        missed=sum(soundly for _, soundly in timeouts),
    )
