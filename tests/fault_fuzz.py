# SPDX-License-Identifier: Apache-2.0
"""Messages that nobody should send: any field of a good one replaced by what its type allows."""

import copy
import math
import random
from typing import Any, TypeAlias

from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractString,
    Array,
    BasicType,
    NamespacedType,
)

Message: TypeAlias = Any  # or a type, a field, a list: what it is is only known when it comes

_FLOATS = (
    math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1e-9, -1.0, 1e9, 3e38, -3e38, 1e300, -1e300,
)  # fmt: skip
_FLOATS_32 = tuple(value for value in _FLOATS if not 3.4e38 < abs(value) < math.inf)
_INTEGERS = (0, 1, -1, 2, 7, 20, 36, 63, 99, 127, 128, 255, 2**31 - 1, -(2**31), 2**32 - 1,
             999_999_999, 1_000_000_000, 2**63 - 1, -(2**63) + 1)  # fmt: skip
_STRINGS = ("", "map", "odom", "a b", "\u00e4\u2603", "x" * 10_000, "%s %d {0}", "/map\n")
_LIMITS = {
    "uint8": (0, 255), "octet": (0, 255), "int8": (-128, 127), "uint16": (0, 65535),
    "int16": (-(2**15), 2**15 - 1), "int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**64 - 1),
}  # fmt: skip


def fuzzed(message: Message, chance: random.Random, changes: int = 2) -> Message:
    """Return a copy of a message with some of its fields replaced, at any depth."""
    changed = copy.deepcopy(message)
    for _ in range(chance.randint(1, changes)):
        _change(changed, chance)
    return changed


def _change(message: Message, chance: random.Random) -> None:
    names = list(message.get_fields_and_field_types())
    index = chance.randrange(len(names))
    name, kind = names[index], message.SLOT_TYPES[index]
    value = getattr(message, name)
    if isinstance(kind, AbstractNestedType):
        value = _changed_list(value, kind, chance)
    elif isinstance(kind, NamespacedType):
        _change(value, chance)
    else:
        value = _value(kind, chance)
    setattr(message, name, value)


def _changed_list(values: Message, kind: AbstractNestedType, chance: random.Random) -> Message:
    changed = list(values)
    inner = kind.value_type
    if changed and chance.random() < 0.7:
        index = chance.randrange(len(changed))
        if isinstance(inner, NamespacedType):
            changed[index] = copy.deepcopy(changed[index])
            _change(changed[index], chance)
        else:
            changed[index] = _value(inner, chance)
        return changed
    if isinstance(kind, Array):
        return values
    return chance.choice(
        ([], changed[:1], changed[:2], changed + changed, changed[::-1], changed * 30)
    )


def _value(kind: Message, chance: random.Random) -> object:
    if isinstance(kind, AbstractString):
        return chance.choice(_STRINGS)
    assert isinstance(kind, BasicType), kind
    if kind.typename == "double":
        return chance.choice((*_FLOATS, chance.uniform(-1e3, 1e3)))
    if kind.typename == "float":
        return chance.choice((*_FLOATS_32, chance.uniform(-1e3, 1e3)))
    if kind.typename == "boolean":
        return chance.random() < 0.5
    low, high = _LIMITS[kind.typename]
    return chance.choice([number for number in _INTEGERS if low <= number <= high])
