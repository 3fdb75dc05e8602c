# SPDX-License-Identifier: Apache-2.0
"""An input of the planner that falls silent for a while, so that its reaction can be recorded."""

from dataclasses import dataclass, field

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.topics import OBJECTS, ODOMETRY, VISIBLE_AREA

_LOSABLE = tuple(topic.name.strip("/") for topic in (ODOMETRY, VISIBLE_AREA, OBJECTS))


@dataclass(frozen=True)
class InputLoss:
    """Which input is not sent, and when, in each episode."""

    input: str = field(
        default="",
        metadata={"description": f"Input that is not sent: {', '.join(_LOSABLE)}; empty for none"},
    )
    after_s: float = field(
        default=5.0,
        metadata={
            "description": "It falls silent so long after the start of an episode [s]",
            "minimum": 0.0,
            "maximum": 3600.0,
        },
    )
    for_s: float = field(
        default=2.0,
        metadata={
            "description": "It is back after so long [s]",
            "minimum": 0.0,
            "maximum": 3600.0,
        },
    )

    def __post_init__(self) -> None:
        if self.input not in ("", *_LOSABLE):
            raise ConfigurationError(
                f"loss.input is {self.input!r}, expected one of {', '.join(_LOSABLE)}, or nothing"
            )
        for name in ("after_s", "for_s"):
            if not 0.0 <= getattr(self, name) < float("inf"):
                raise ConfigurationError(
                    f"loss.{name} is {getattr(self, name)}, expected a finite number, 0 or more"
                )

    def silences(self, topic_name: str, since_start_ns: int) -> bool:
        """Tell whether a topic is silent, so long after the start of an episode [ns]."""
        begin_ns = round(self.after_s * SECOND_NS)
        end_ns = begin_ns + round(self.for_s * SECOND_NS)
        named = bool(self.input) and topic_name == f"/{self.input}"
        return named and begin_ns <= since_start_ns < end_ns

    def note(self) -> str:
        """Return a text from which `from_text` builds the same; empty if nothing is lost."""
        return f"{self.input},{self.after_s:g},{self.for_s:g}" if self.input else ""

    @classmethod
    def from_text(cls, text: str) -> "InputLoss":
        """Read "objects,5,2": this input, after so many seconds, for so many.

        Raises:
            ConfigurationError: the text says something else.
        """
        if not text:
            return cls()
        try:
            name, after_s, for_s = text.split(",")
            return cls(name, float(after_s), float(for_s))
        except ValueError as error:
            raise ConfigurationError(
                f"{text!r} is no loss, expected INPUT,AFTER_S,FOR_S such as objects,5,2"
            ) from error
