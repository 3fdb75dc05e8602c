# SPDX-License-Identifier: Apache-2.0
"""Messages with long lists of numbers, read from their serialised form.

rclpy makes an object of every corner and of every vehicle, which takes longer than all that is
done with them. On the wire (XCDR1, DDS-XTypes 7.4.3) a list of records of numbers is laid out
plainly, so that numpy reads it as an array.
"""

import struct
from typing import Any, Literal, NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

_NUMBERS = {"uint8": "u1", "int64": "i8", "float": "f4", "double": "f8"}
_BODY = 4  # bytes before the message, which say how it is encoded
_ORDERS: dict[bytes, Literal["<", ">"]] = {b"\0\0": ">", b"\0\1": "<"}


class Layout:
    """How the elements of a list lie in memory."""

    def __init__(self, native: np.dtype[Any]) -> None:
        """Take how they lie in the memory of this computer."""
        self.alignment = native.alignment
        self._of_order = {order: native.newbyteorder(order) for order in _ORDERS.values()}

    @classmethod
    def of_records(cls, record: Any) -> "Layout":  # noqa: ANN401 (the class of a message)
        """Return the layout of messages all of whose fields are numbers.

        Raises:
            ValueError: one is not, or they lie elsewhere on the wire than in memory.
        """
        fields = record.get_fields_and_field_types()
        others = sorted(set(fields.values()) - set(_NUMBERS))
        if others:
            raise ValueError(f"{record.__name__} has fields of {', '.join(others)}, not numbers")
        native = np.dtype([(name, _NUMBERS[kind]) for name, kind in fields.items()], align=True)
        # On the wire a record begins where its first field may, and ends with its last.
        (*_, name), first, last = fields, native[0], native[len(fields) - 1]
        end = (native.fields or {})[name][1] + last.itemsize
        if first.itemsize < native.alignment or end < native.itemsize:
            raise ValueError(f"{record.__name__} begins or ends with a field that is too small")
        return cls(native)

    def in_order(self, order: Literal["<", ">"]) -> np.dtype[Any]:
        """Return how they lie in the memory of a computer of this order of bytes."""
        return self._of_order[order]


class Cursor:
    """Reads a serialised message, one field after the other."""

    def __init__(self, data: bytes) -> None:
        """Begin before the first field.

        Raises:
            ValueError: the message is encoded in another way. So does whatever reads on where it
                ends too early.
        """
        order = _ORDERS.get(data[:2])
        if order is None:
            raise ValueError(f"a message is encoded as {data[:2].hex()}, expected 0000 or 0001")
        self._data, self._order = data, order
        self._at = _BODY

    def numbers(self, kinds: str) -> tuple[Any, ...]:
        """Return numbers of the same size, one after the other; `kinds` as in `struct`."""
        return self._unpack(kinds, struct.calcsize(kinds[0]))

    def time(self) -> Time:
        """Return a point in time."""
        seconds, nanoseconds = self.numbers("iI")
        return Time(sec=seconds, nanosec=nanoseconds)

    def text(self) -> str:
        """Return a string; what is no UTF-8 is replaced."""
        (length,) = self.numbers("I")
        (text,) = self._unpack(f"{length}s", 1)
        return str(text.rstrip(b"\0").decode(errors="replace"))

    def header(self) -> Header:
        """Return a header."""
        return Header(stamp=self.time(), frame_id=self.text())

    def array(self, layout: Layout) -> NDArray[Any]:
        """Return a list (N,) whose elements lie like this."""
        (count,) = self.numbers("I")
        if count == 0:
            # There is nothing behind the number, not even what aligns elements.
            return np.empty(0, layout.in_order(self._order))
        at = self._aligned(layout.alignment)
        found = np.frombuffer(self._data, layout.in_order(self._order), count, at)
        self._at = at + found.nbytes
        return found

    def _unpack(self, kinds: str, alignment: int) -> tuple[Any, ...]:
        form, at = f"{self._order}{kinds}", self._aligned(alignment)
        try:
            found = struct.unpack_from(form, self._data, at)
        except struct.error as error:
            raise ValueError(f"a message ends too early: {error}") from error
        self._at = at + struct.calcsize(form)
        return found

    def _aligned(self, alignment: int) -> int:
        """Return the next place that is a multiple of the alignment, from the body's begin on."""
        return self._at + (_BODY - self._at) % alignment


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
        """`record`: the type of the list's elements, as in `Layout.of_records`."""
        self._layout = Layout.of_records(record)

    def of(self, message: Any) -> RecordList:  # noqa: ANN401 (of any such type)
        """Return a message as it arrives."""
        return self(bytes(serialize_message(message)))

    def __call__(self, data: bytes) -> RecordList:
        """Return a serialised message.

        Raises:
            ValueError: it is encoded in another way, or ends too early.
        """
        cursor = Cursor(data)
        return RecordList(cursor.header(), cursor.array(self._layout))
