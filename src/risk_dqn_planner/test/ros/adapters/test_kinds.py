# SPDX-License-Identifier: Apache-2.0
import math
import sys
from types import ModuleType

import pytest
from intersection_msgs.msg import PerceivedObject, PerceivedObjects

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.ros.adapters.config import AdapterConfig
from risk_dqn_planner.ros.adapters.kinds import CONVERTERS, OWN_TYPE, ObjectsAdapter

AUTOWARE = "autoware_perception_msgs/msg/TrackedObjects"


def test_own_objects_pass_as_they_are() -> None:
    message = PerceivedObjects(objects=[PerceivedObject(id=5, x_m=1.0, speed_mps=-2.0)])
    adapter = ObjectsAdapter(OWN_TYPE, AdapterConfig())
    assert adapter.message_type() is PerceivedObjects
    assert adapter.reader is not None
    objects = adapter(adapter.reader.of(message))
    assert (objects.id[0], objects.x_m[0], objects.speed_mps[0]) == (5, 1.0, -2.0)


def test_a_type_that_nobody_knows_is_refused_with_those_that_are_known() -> None:
    with pytest.raises(ConfigurationError, match="objects_type is 'cars/msg/Cars'") as refused:
        ObjectsAdapter("cars/msg/Cars", AdapterConfig())
    assert all(name in str(refused.value) for name in CONVERTERS)


@pytest.mark.parametrize(
    ("type_name", "apt_package"),
    [
        (AUTOWARE, "autoware-perception-msgs"),
        ("derived_object_msgs/msg/ObjectArray", "derived-object-msgs"),
    ],
)
def test_a_package_that_is_missing_is_named_as_apt_knows_it(
    type_name: str, apt_package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = type_name.partition("/")[0]
    for module in (package, f"{package}.msg"):
        monkeypatch.setitem(sys.modules, module, None)  # importing it fails
    with pytest.raises(ConfigurationError, match=f"apt install ros-.*-{apt_package}"):
        ObjectsAdapter(type_name, AdapterConfig()).message_type()


def test_a_package_that_is_there_gives_its_class(monkeypatch: pytest.MonkeyPatch) -> None:
    package, messages = ModuleType("autoware_perception_msgs"), ModuleType("messages")
    messages.TrackedObjects = PerceivedObjects  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "autoware_perception_msgs", package)
    monkeypatch.setitem(sys.modules, "autoware_perception_msgs.msg", messages)
    assert ObjectsAdapter(AUTOWARE, AdapterConfig()).message_type() is PerceivedObjects


@pytest.mark.parametrize(
    "wrong",
    [
        {"left_out": "everything"},
        {"min_certainty": 0.0},
        {"min_certainty": 1.5},
        {"min_certainty": math.nan},
        {"unknown_speed_mps": -1.0},
        {"unknown_speed_mps": math.inf},
    ],
)
def test_a_configuration_that_makes_no_sense_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ConfigurationError):
        AdapterConfig(**wrong)  # type: ignore[arg-type]
