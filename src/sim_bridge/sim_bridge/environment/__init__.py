# SPDX-License-Identifier: Apache-2.0
"""The simulator as a learning problem: states, rewards, episodes one after the other."""
