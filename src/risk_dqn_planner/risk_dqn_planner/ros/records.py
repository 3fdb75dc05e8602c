# SPDX-License-Identifier: Apache-2.0
"""Long lists of numbers, read from a serialised message at once.

rclpy makes an object of every corner and of every perceived vehicle, which takes longer than all
that is done with them. A message that consists of a header and one list of records of numbers is
laid out plainly on the wire (XCDR1, DDS-XTypes 7.4.3), so that numpy reads the list as an array.
"""

import struct
from typing import Any, Literal, NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

_NUMBERS = {"int64": "i8", "float": "f4", "double": "f8"}
_BODY = 4  # bytes before the message, which say how it is encoded
_ORDERS: dict[bytes, Literal["<", ">"]] = {b"\0\0": ">", b"\0\1": "<"}


class RecordList(NamedTuple):
    """A message: its header, and its list as an array (N,) with the fields of a record."""

    header: Header
    records: NDArray[Any]

    def column(self, name: str, kind: type = np.float64) -> NDArray[Any]:
        """Return a field of all records (N,), one after the other in memory."""
        return self.records[name].astype(kind)


class RecordReader:
    """Reads messages that hold a header and a list of one type of records."""

    def __init__(self, record: Any) -> None:  # noqa: ANN401 (the class of a message)
        """`record`: the type of the list's elements, all of whose fields are numbers."""
        fields = record.get_fields_and_field_types()
        layout = [(name, _NUMBERS[kind]) for name, kind in fields.items()]
        native = np.dtype(layout, align=True)
        self._alignment = native.alignment
        self._layouts = {order: native.newbyteorder(order) for order in _ORDERS.values()}

    def of(self, message: Any) -> RecordList:  # noqa: ANN401 (of any such type)
        """Return a message as it arrives."""
        return self(bytes(serialize_message(message)))

    def __call__(self, data: bytes) -> RecordList:
        """Return a serialised message.

        Raises:
            ValueError: it is encoded in another way, or ends too early.
        """
        order = _ORDERS.get(data[:2])
        if order is None:
            raise ValueError(f"a message is encoded as {data[:2].hex()}, expected 0000 or 0001")
        try:
            seconds, nanoseconds, length = struct.unpack_from(f"{order}iII", data, _BODY)
            begin = _BODY + 12
            frame_id = data[begin : begin + length].rstrip(b"\0").decode(errors="replace")
            at = _aligned(begin + length, 4)
            (count,) = struct.unpack_from(f"{order}I", data, at)
        except struct.error as error:
            raise ValueError(f"a message ends too early: {error}") from error
        # Without records there is nothing behind their number, not even what aligns them.
        begin = _aligned(at + 4, self._alignment) if count else 0
        records = np.frombuffer(data, self._layouts[order], count, begin)
        stamp = Time(sec=seconds, nanosec=nanoseconds)
        return RecordList(Header(stamp=stamp, frame_id=frame_id), records)


def _aligned(at: int, alignment: int) -> int:
    """Return the next place that is a multiple of the alignment, counted from the body's begin."""
    return at + (_BODY - at) % alignment
