# SPDX-License-Identifier: Apache-2.0
"""Quality of service of the topics: reliable, the newest message only."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

# Streams (odometry, objects, visible area, situation, decision): what is late is worthless.
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
# Map-like topics (route): a node that starts later still gets the last message.
LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# Diagnostics: readers collect the statuses of several nodes on one topic.
DIAGNOSTICS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
