# SPDX-License-Identifier: Apache-2.0
"""The transform from map to base_link, where tf2_ros is installed (it is not on PyPI)."""

import importlib
from typing import Any

from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node

try:
    tf2_ros: Any = importlib.import_module("tf2_ros")
except ImportError:
    tf2_ros = None


class TransformPublisher:
    """Publishes the ego's pose as a transform, or nothing."""

    def __init__(self, node: Node) -> None:
        self._broadcaster = tf2_ros.TransformBroadcaster(node) if tf2_ros else None

    def publish(self, odometry: Odometry) -> None:
        """Publish the pose of an odometry message as the transform to its child frame."""
        if self._broadcaster is None:
            return
        message = TransformStamped(header=odometry.header, child_frame_id=odometry.child_frame_id)
        position = odometry.pose.pose.position
        message.transform.translation.x = position.x
        message.transform.translation.y = position.y
        message.transform.rotation = odometry.pose.pose.orientation
        self._broadcaster.sendTransform(message)
