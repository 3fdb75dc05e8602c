# SPDX-License-Identifier: Apache-2.0
"""The values that the paper's figures state (Kamran et al. 2020), to be set beside ours.

Success during training is a picture without numbers in the paper. Its policies are called here
as the project's shipped ones are.
"""

RULE_BASED = "rule_based"
COLLISION_AWARE = "collision_aware"
RISK_AWARE = "risk_aware"

# Figure "Comparing action usage": number of actions, normalised by the rule-based policy.
ACTION_USAGE = {
    RULE_BASED: {"fast": 1.0, "slow": 1.0, "stop": 1.0},
    COLLISION_AWARE: {"fast": 1.04, "slow": 0.11, "stop": 0.16},
    RISK_AWARE: {"fast": 0.94, "slow": 1.07, "stop": 0.13},
}

# Figure "four groups of challenging scenarios": success rate.
CHALLENGING = {
    COLLISION_AWARE: {
        "dense_traffic": 0.6,
        "severe_occlusion": 0.6,
        "sensor_noise": 0.5,
        "short_sensor_range": 0.9,
    },
    RISK_AWARE: {
        "dense_traffic": 0.8,
        "severe_occlusion": 1.0,
        "sensor_noise": 0.9,
        "short_sensor_range": 1.0,
    },
}

# Figure "Average velocity" [m/s] by sensor range [m].
MEAN_SPEED_MPS = {
    RULE_BASED: {40.0: 0.0, 60.0: 2.16, 90.0: 1.25},
    RISK_AWARE: {40.0: 2.32, 60.0: 2.27, 90.0: 2.28},
}


def paper_role(policy: str) -> str | None:
    """Return which of the paper's policies a policy of ours stands for, None for the others.

    Names as training gives them (risk_paper) and as shipped (risk_aware_paper).
    """
    if policy == RULE_BASED:
        return RULE_BASED
    if not policy.endswith("_paper"):
        return None
    for role, reward in ((COLLISION_AWARE, "collision"), (RISK_AWARE, "risk")):
        if policy in (f"{role}_paper", f"{reward}_paper"):
            return role
    return None
