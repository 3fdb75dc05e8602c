# SPDX-License-Identifier: Apache-2.0
"""What a training run is: its description, from which everything else follows."""

from dataclasses import asdict, dataclass, field
from typing import Any

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.map.loader import DEFAULT_PROJECTOR
from risk_dqn_planner.policies.outlook import OutlookConfig
from risk_dqn_planner.policies.supervised import SupervisorMode, supervisor_mode
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.config import INSTANTANEOUS, require_memory
from sim_bridge.learning.config import TrainingConfig
from sim_bridge.options import LARGEST_SEED


@dataclass(frozen=True)
class Run:
    """What is trained: all that decides the result, but for the maps' files.

    map_name, scenario: one name, or several with commas between them. supervisor: `enforce` lets
    only actions be taken, learned from and validated that are sound under `assumptions`; `off`
    lets all be. memory: how the planner tells where hidden vehicles may be, see SituationConfig.
    route, origin, projector: how a map of one's own is read, as on the command line; None: the
    only way that there is.
    """

    config: TrainingConfig
    reward: str
    seed: int
    map_name: str
    scenario: str
    supervisor: str = SupervisorMode.OFF.value
    memory: str = INSTANTANEOUS
    assumptions: SafetyAssumptions = field(default_factory=SafetyAssumptions)
    route: str | None = None
    origin: str | None = None
    projector: str = DEFAULT_PROJECTOR

    def __post_init__(self) -> None:
        if not 0 <= self.seed <= LARGEST_SEED:
            raise ConfigurationError(f"seed is {self.seed}, expected 0 to {LARGEST_SEED}")
        require_memory(self.memory)
        if supervisor_mode(self.supervisor) is SupervisorMode.REPORT:
            raise ConfigurationError(
                "supervisor is 'report', which changes nothing in training, "
                "expected one of: off, enforce"
            )
        if self.config.outlook and not self.supervised:
            raise ConfigurationError(
                f"supervisor is '{self.supervisor}', expected enforce for preset "
                f"{self.config.preset}, whose network is told which actions are sound"
            )

    @property
    def supervised(self) -> bool:
        """Whether the supervisor enforces sound actions."""
        return supervisor_mode(self.supervisor) is SupervisorMode.ENFORCE

    @property
    def outlook_size(self) -> int:
        """How many numbers the network is told beyond the paper's state."""
        return OutlookConfig().size if self.config.outlook else 0

    def description(self) -> dict[str, Any]:
        """Return all of it as JSON; what is not used is left out.

        So a run without supervisor, memory and repeated exploration is described, and its
        policy's file written, as before there was any of them.
        """
        found = asdict(self)
        if not self.supervised:
            del found["supervisor"], found["assumptions"]
        if self.memory == INSTANTANEOUS:
            del found["memory"]
        if self.config.exploration.repeat == 0.0:
            del found["config"]["exploration"]["repeat"]
        if not self.config.outlook:
            del found["config"]["outlook"]
        if self.config.advice is None:
            del found["config"]["advice"]
        for name, usual in (("route", None), ("origin", None), ("projector", DEFAULT_PROJECTOR)):
            if found[name] == usual:
                del found[name]
        return found

    @property
    def map_names(self) -> list[str]:
        """The maps' names, one by one."""
        return self.map_name.split(",")

    @property
    def scenarios(self) -> list[str]:
        """The scenarios' names, one by one."""
        return self.scenario.split(",")
