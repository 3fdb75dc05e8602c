# SPDX-License-Identifier: Apache-2.0
"""Makes the environments known to Gymnasium, without loading them until one is made.

Gymnasium looks for no packages of its own accord, so the import comes first, in either form:

    import sim_bridge.environment
    gymnasium.make("sim_bridge/OccludedIntersection-v0", map="four_way", scenario="base")

    gymnasium.make("sim_bridge.environment:sim_bridge/OccludedIntersection-v0", scenario="base")

The second suits tools that are told an environment by its name alone.
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
