# SPDX-License-Identifier: Apache-2.0
"""Objects as other stacks perceive them, made into those that the planner knows."""
