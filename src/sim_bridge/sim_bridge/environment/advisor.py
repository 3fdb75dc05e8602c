# SPDX-License-Identifier: Apache-2.0
"""The look-ahead search as an adviser: what it would do in an environment's situations."""

import numpy as np

from risk_dqn_planner.policies.foresight.search import search_into
from risk_dqn_planner.policies.foresight.task import Work, work_fit_for, work_for
from risk_dqn_planner.policies.look_ahead import LookAheadConfig
from risk_dqn_planner.policies.outlook import Views
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.situations import Integers, Situations


class Advisor:
    """Searches from wherever somebody else has driven to; nothing is remembered."""

    def __init__(self, assumptions: SafetyAssumptions, config: LookAheadConfig) -> None:
        self._assumptions = assumptions.numbers()
        self._config = config.numbers()
        self._work: Work = work_for(self._config, self._assumptions, 0, 0)

    def best_actions(self, situations: Situations, views: Views) -> Integers:
        """Return the first action (B,) of the best plan that is found for each situation."""
        batch = len(situations.ego_speed_mps)
        self._work = work_fit_for(self._work, self._config, self._assumptions, situations)
        action = np.empty(batch, dtype=np.int64)
        search_into(
            situations,
            self._assumptions,
            self._config,
            views.known,
            views.corner_m,
            views.sound,
            views.in_force,
            self._work,
            action,
            np.empty((batch, 2), dtype=np.int64),
        )
        return action
