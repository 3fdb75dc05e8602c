# SPDX-License-Identifier: Apache-2.0
"""Nodes, commands and files of the simulation under ROS 2."""
