# SPDX-License-Identifier: Apache-2.0
"""What the planner gets to know of a simulated situation."""
