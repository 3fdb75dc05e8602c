# SPDX-License-Identifier: Apache-2.0
"""Fields of other stacks' messages, for bags that do not bring their definitions along.

Only names and types of the fields, which fix how messages are serialised.
"""

_RULE = "\n" + "=" * 80 + "\nMSG: "

_TRACKED_OBJECTS = _RULE.join(
    (
        "std_msgs/Header header\nautoware_perception_msgs/TrackedObject[] objects",
        """autoware_perception_msgs/TrackedObject
unique_identifier_msgs/UUID object_id
float32 existence_probability
autoware_perception_msgs/ObjectClassification[] classification
autoware_perception_msgs/TrackedObjectKinematics kinematics
autoware_perception_msgs/Shape shape""",
        "autoware_perception_msgs/ObjectClassification\nuint8 label\nfloat32 probability",
        """autoware_perception_msgs/TrackedObjectKinematics
geometry_msgs/PoseWithCovariance pose_with_covariance
geometry_msgs/TwistWithCovariance twist_with_covariance
geometry_msgs/AccelWithCovariance acceleration_with_covariance
uint8 orientation_availability
bool is_stationary""",
        """autoware_perception_msgs/Shape
uint8 type
geometry_msgs/Polygon footprint
geometry_msgs/Vector3 dimensions""",
    )
)

_OBJECT_ARRAY = _RULE.join(
    (
        "std_msgs/Header header\nderived_object_msgs/Object[] objects",
        """derived_object_msgs/Object
std_msgs/Header header
uint32 id
uint8 detection_level
bool object_classified
geometry_msgs/Pose pose
geometry_msgs/Twist twist
geometry_msgs/Accel accel
geometry_msgs/Polygon polygon
shape_msgs/SolidPrimitive shape
uint8 classification
uint8 classification_certainty
uint32 classification_age""",
    )
)

# Definition of each type, followed by those it is made of, as bags hold them.
FOREIGN_TYPES = {
    "autoware_perception_msgs/msg/TrackedObjects": _TRACKED_OBJECTS,
    "derived_object_msgs/msg/ObjectArray": _OBJECT_ARRAY,
}
