# SPDX-License-Identifier: Apache-2.0
"""Nodes and all that touches messages: the only part of the planner that knows ROS 2."""
