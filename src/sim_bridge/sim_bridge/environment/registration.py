# SPDX-License-Identifier: Apache-2.0
"""Makes the environments known to Gymnasium, without loading them until one is made.

An installed sim_bridge is found by Gymnasium itself (entry point `gymnasium.envs`); from the
sources, call `register()` once.
"""

import gymnasium

ID = "sim_bridge/OccludedIntersection-v0"


def register() -> None:
    """Register the environment and its vector version, if they are not known yet."""
    if ID in gymnasium.registry:
        return
    gymnasium.register(
        id=ID,
        entry_point="sim_bridge.environment.gym:OccludedIntersectionEnv",
        vector_entry_point="sim_bridge.environment.gym:OccludedIntersectionVectorEnv",
    )
