# SPDX-License-Identifier: Apache-2.0
"""Simulated occluded intersections: batches for training and evaluation, a batch of one for ROS."""
