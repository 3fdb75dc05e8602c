# SPDX-License-Identifier: Apache-2.0
"""Decides Stop, Slow or Fast at occluded intersections; ROS only in `ros/`."""
