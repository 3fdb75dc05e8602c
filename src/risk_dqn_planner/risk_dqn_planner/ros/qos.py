# SPDX-License-Identifier: Apache-2.0
"""Quality of service of the topics: reliable, and of most the newest message only."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

# Streams (odometry, objects, visible area, decision): what is late is worthless.
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
# From the situation to the policy node: a fault of a single frame must not be skipped for the good
# one after it, where the policy node is busy.
EACH = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
# Map-like topics (route): a node that starts later still gets the last message.
LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# Diagnostics: readers collect the statuses of several nodes on one topic.
DIAGNOSTICS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
