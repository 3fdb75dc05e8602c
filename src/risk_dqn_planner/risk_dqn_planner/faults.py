# SPDX-License-Identifier: Apache-2.0
"""The names of all faults: what kind of fault it is, and what is at fault.

One table for errors, situations and decisions; the codes are those of intersection_msgs/Situation
and intersection_msgs/Decision. Errors bear them (errors.py), so nobody reads sentences.
"""

import enum


class Status(enum.IntEnum):
    """Whether there is a situation, or the kind of fault for which there is none."""

    OK = 0
    MISSING_INPUT = 20  # has never arrived
    STALE_INPUT = 21  # older than allowed
    FUTURE_INPUT = 22  # ahead of the clock
    OUT_OF_ORDER_INPUT = 23  # stamps went back
    FROZEN_INPUT = 24  # stamps, ego or clock stand still although they should not
    WRONG_FRAME = 25
    NOT_FINITE = 26
    IMPLAUSIBLE_SPEED = 27
    IMPLAUSIBLE_JUMP = 28  # moved further between two messages than its speed allows
    DUPLICATE_ID = 29
    INVALID_VISIBLE_AREA = 30  # empty, without extent, or crossing itself
    INVALID_SIZE = 31  # a footprint no road vehicle has, or far too many objects
    MALFORMED_INPUT = 32  # a field means nothing, such as an orientation of norm 0
    BAD_ROUTE = 33  # does not fit the map
    OFF_ROUTE = 34  # the ego is beside its route, before it or beyond it
    WRONG_WAY = 35  # the ego faces the wrong way
    NOT_CONFIGURED = 36  # no usable map or parameters
    INTERNAL_ERROR = 37  # a bug


class FaultyInput(enum.IntEnum):
    """What is at fault."""

    NO_INPUT = 0
    ODOMETRY = 1
    VISIBLE_AREA = 2
    OBJECTS = 3
    ROUTE = 4
    SITUATION = 5
    POLICY = 6
    CLOCK = 7
    MAP = 8
    PARAMETERS = 9

    def __str__(self) -> str:
        """Its name in sentences, such as "visible area"."""
        return self.name.lower().replace("_", " ")
