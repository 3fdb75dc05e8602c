# SPDX-License-Identifier: Apache-2.0
"""The simulator as a learning problem: states, rewards, episodes one after the other.

Importing it makes its environments known to Gymnasium.
"""

from sim_bridge.environment.registration import register

register()
