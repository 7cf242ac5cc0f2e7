"""Decoder and client for the serial protocol of a toposlam robot.

The specification is `docs/wire.md`; frame version 2, protocol version 5. The module needs only the standard library, and
pyserial for serial ports.

    from toposlam_stream import Decoder, MapReplica, open_line

    decoder, replica = Decoder(), MapReplica()
    with open_line("tcp:127.0.0.1:7070") as line:      # or "/dev/ttyACM0", or a file of raw bytes
        while not replica.is_converged():
            for event in decoder.feed(line.read()):
                replica.apply(event)
    print(replica.edges())

`python -m toposlam_stream LINE` prints every event as a line of JSON. `Client` sends commands to a robot.

Lengths are in millimetres, logarithms natural and times 65536, probabilities in thousandths.
"""

from __future__ import annotations

import argparse
import dataclasses
import enum
import json
import os
import random
import re
import socket
import struct
import sys
import time
import typing
import zlib
from dataclasses import dataclass
from typing import Annotated, Any, Callable, Iterable, Iterator, Optional, Union

FRAME_VERSION = 2
"""The first byte of every frame of a robot; in a frame to a robot 128 is added."""
PROTOCOL_VERSION = 7
"""The version of the messages."""
SCHEMA_HASH = 0xFF77_031D_62C1_94A5
"""The 64-bit FNV-1a hash of the schema in `docs/wire.md`."""
CHUNK_BYTES = 64
"""The most bytes of a snapshot in one request or reply."""
NAME_BYTES = 16
"""The most bytes of the name of a vertex."""

_TO_ROBOT = FRAME_VERSION | 1 << 7
_HEADER_BYTES = 3
_CRC_BYTES = 4
_RAW_BYTES_MAX = 110
_VERTICES_MAX = 64
_WAYS_MAX = 7
_TURN_MRAD = 6283
_LATE_WINDOW = 64
_COUNT_MAX = 0xFFFF_FFFF


# The encoding of values: postcard's format.


class _UnknownPayload(ValueError):
    """The payload is unknown."""


@dataclass(frozen=True)
class _Codec:
    """The encoding of one type."""

    read: Callable[[bytes, int], tuple[Any, int]]
    """Decodes the value at an offset of a payload; returns it and the offset after it. IndexError if the payload is too short."""
    write: Callable[[Any, bytearray], None]
    """Appends a value. ValueError if it is out of its range."""


def _unsigned(bits: int) -> _Codec:
    """A varint: seven bits a byte, lowest first."""
    limit = 1 << bits
    bytes_max = (bits + 6) // 7

    def read(payload: bytes, at: int) -> tuple[int, int]:
        value = payload[at]
        if value < 0x80:
            return value, at + 1
        value &= 0x7F
        for shift in range(7, 7 * bytes_max, 7):
            at += 1
            byte = payload[at]
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                if value >= limit:
                    raise _UnknownPayload
                return value, at + 1
        raise _UnknownPayload

    def write(value: int, out: bytearray) -> None:
        if not 0 <= value < limit:
            raise ValueError(f"{value} is not within 0 to {limit - 1}")
        while value >= 0x80:
            out.append(value & 0x7F | 0x80)
            value >>= 7
        out.append(value)

    return _Codec(read, write)


def _signed(bits: int) -> _Codec:
    """Zigzag, then a varint."""
    unsigned = _unsigned(bits)
    limit = 1 << bits - 1

    def read(payload: bytes, at: int) -> tuple[int, int]:
        value, at = unsigned.read(payload, at)
        return value >> 1 ^ -(value & 1), at

    def write(value: int, out: bytearray) -> None:
        if not -limit <= value < limit:
            raise ValueError(f"{value} is not within {-limit} to {limit - 1}")
        unsigned.write(value << 1 if value >= 0 else ~(value << 1), out)

    return _Codec(read, write)


def _byte() -> _Codec:
    def write(value: int, out: bytearray) -> None:
        out.append(value)

    return _Codec(lambda payload, at: (payload[at], at + 1), write)


def _flag() -> _Codec:
    def read(payload: bytes, at: int) -> tuple[bool, int]:
        if payload[at] > 1:
            raise _UnknownPayload
        return payload[at] == 1, at + 1

    return _Codec(read, lambda value, out: out.append(bool(value)))


def _kind(of: type[enum.IntEnum]) -> _Codec:
    """An enum that is one byte; an unknown number decodes to the first member."""
    kinds = [of(number) for number in range(256)]
    return _Codec(lambda payload, at: (kinds[payload[at]], at + 1), lambda value, out: out.append(value))


def _optional(codec: _Codec) -> _Codec:
    def read(payload: bytes, at: int) -> tuple[Any, int]:
        if payload[at] > 1:
            raise _UnknownPayload
        if payload[at]:
            return codec.read(payload, at + 1)
        return None, at + 1

    def write(value: Any, out: bytearray) -> None:
        out.append(value is not None)
        if value is not None:
            codec.write(value, out)

    return _Codec(read, write)


def _or_zero(codec: _Codec) -> _Codec:
    """The last number of a payload; 0 if an older sender leaves it out."""

    def read(payload: bytes, at: int) -> tuple[int, int]:
        try:
            return codec.read(payload, at)
        except (_UnknownPayload, IndexError):
            return 0, len(payload)

    return _Codec(read, codec.write)


def _list(codec: _Codec, most: int, build: Callable[[Iterable[Any]], Any] = tuple) -> _Codec:
    """A list: the number of elements, at most `most`, then the elements."""
    number = _unsigned(64)

    def read(payload: bytes, at: int) -> tuple[Any, int]:
        count, at = number.read(payload, at)
        if count > most:
            raise _UnknownPayload
        elements = []
        for _ in range(count):
            element, at = codec.read(payload, at)
            elements.append(element)
        return build(elements), at

    def write(elements: Any, out: bytearray) -> None:
        if len(elements) > most:
            raise ValueError(f"{len(elements)} elements where {most} have room")
        number.write(len(elements), out)
        for element in elements:
            codec.write(element, out)

    return _Codec(read, write)


def _text(bytes_max: int) -> _Codec:
    """The number of bytes, then UTF-8 without zeros."""
    encoded = _list(_byte(), bytes_max, bytes)

    def read(payload: bytes, at: int) -> tuple[str, int]:
        value, at = encoded.read(payload, at)
        try:
            text = value.decode()
        except UnicodeDecodeError:
            raise _UnknownPayload from None
        if "\0" in text:
            raise _UnknownPayload
        return text, at

    def write(value: str, out: bytearray) -> None:
        if "\0" in value:
            raise ValueError("a name has no zeros")
        encoded.write(value.encode(), out)

    return _Codec(read, write)


def _record(of: type) -> _Codec:
    """The fields of a dataclass, in order; their types say how each is encoded."""
    hints = typing.get_type_hints(of, include_extras=True)
    names = [field.name for field in dataclasses.fields(of)]
    codecs = [hints[name].__metadata__[0] for name in names]
    reads = [codec.read for codec in codecs]
    writes = list(zip(names, (codec.write for codec in codecs)))

    def read(payload: bytes, at: int) -> tuple[Any, int]:
        values = []
        for read_field in reads:
            value, at = read_field(payload, at)
            values.append(value)
        return of(*values), at

    def write(value: Any, out: bytearray) -> None:
        for name, write_field in writes:
            write_field(getattr(value, name), out)

    return _Codec(read, write)


def _choice(*classes: type) -> _Codec:
    """One of several dataclasses: its number in this order, then its fields."""
    number = _unsigned(32)
    records = [_record(of) for of in classes]
    places = {of: (place, record.write) for place, (of, record) in enumerate(zip(classes, records))}

    def read(payload: bytes, at: int) -> tuple[Any, int]:
        kind, at = number.read(payload, at)
        if kind >= len(records):
            raise _UnknownPayload
        record: _Codec = records[kind]
        return record.read(payload, at)

    def write(value: Any, out: bytearray) -> None:
        if type(value) not in places:
            raise TypeError(f"{value!r} is none of {', '.join(of.__qualname__ for of in classes)}")
        place, write_fields = places[type(value)]
        number.write(place, out)
        write_fields(value, out)

    return _Codec(read, write)


U8 = Annotated[int, _byte()]
U16 = Annotated[int, _unsigned(16)]
U32 = Annotated[int, _unsigned(32)]
U64 = Annotated[int, _unsigned(64)]
I16 = Annotated[int, _signed(16)]
I32 = Annotated[int, _signed(32)]
Flag = Annotated[bool, _flag()]
OptionalU8 = Annotated[Optional[int], _optional(_byte())]
Chunk = Annotated[bytes, _list(_byte(), CHUNK_BYTES, bytes)]
NameText = Annotated[str, _text(NAME_BYTES)]


# Messages of a robot.


class ResetCause(enum.IntEnum):
    """Why a robot started."""

    UNKNOWN = 0
    POWER_ON = 1
    BROWN_OUT = 2
    RESET_PIN = 3
    WATCHDOG = 4
    SOFTWARE = 5
    LOW_POWER = 6

    @classmethod
    def _missing_(cls, value: object) -> ResetCause:
        return cls.UNKNOWN


class FaultKind(enum.IntEnum):
    """The kinds of faults that a robot counts."""

    SONAR_SILENT = 0
    SONAR_OUT_OF_RANGE = 1
    BUS_ERROR = 2
    RING_BLIND = 3
    RADIUS_OUT_OF_RANGE = 4
    VERTICES_FULL = 5
    NGRAMS_FULL = 6
    HISTORY_FULL = 7
    WIRE_FULL = 8
    WIRE_CORRUPT = 9
    STORE_FAILED = 10
    SNAPSHOT_REJECTED = 11
    COMMAND_REFUSED = 12
    COMMAND_FLOOD = 13
    DRIVE_LOST = 14
    LOOP_LATE = 15
    INVALID_HINT = 16
    SONAR_IMPLAUSIBLE = 17


class GoalState(enum.IntEnum):
    """The state of a goal; all but ACTIVE are final."""

    OTHER = 0
    ACTIVE = 1
    REACHED = 2
    NO_ROUTE = 3
    VERTEX_REMOVED = 4
    TIMED_OUT = 5
    REPLACED = 6

    @classmethod
    def _missing_(cls, value: object) -> GoalState:
        return cls.OTHER


class Refusal(enum.IntEnum):
    """Why a request was refused."""

    OTHER = 0
    UNSUPPORTED = 1
    OUT_OF_RANGE = 2
    UNKNOWN_VERTEX = 3
    NO_ROUTE = 4
    NO_STORE = 5
    NOT_NOW = 6
    MISSING_CHUNK = 7
    TOO_LONG = 8
    BAD_CRC = 9
    BAD_SNAPSHOT = 10
    BUSY = 11
    RECORDING = 12
    BAD_NAME = 13
    NAME_TAKEN = 14

    @classmethod
    def _missing_(cls, value: object) -> Refusal:
        return cls.OTHER


@dataclass(frozen=True)
class Capacities:
    """The capacities of a robot."""

    vertices: U8
    hypotheses: U16
    history: U16
    ngram_length: U8
    fingerprint_step_mm: U8
    sonars: U8


@dataclass(frozen=True)
class Hello:
    """The introduction of a robot."""

    protocol_version: U16
    schema_hash: U64
    boot: U32
    """The number of the start; 0 if the robot does not count them."""
    reset_cause: Annotated[ResetCause, _kind(ResetCause)]
    seed: U64
    capacities: Annotated[Capacities, _record(Capacities)]
    session: Annotated[int, _or_zero(_unsigned(32))] = 0
    """The session id: differs from one start to the next and from robot to robot; 0 if there is none."""

    def start(self) -> tuple[int, int, int, int]:
        """What distinguishes this start of the robot from others."""
        return self.session, self.boot, self.reset_cause, self.seed

    def complaint(self) -> Optional[str]:
        """Why this module does not understand the robot fully; None if it does.

        Of another protocol version, the messages that both sides know are understood. With the same version and another
        schema hash the messages have other meanings: do not trust them.
        """
        if self.protocol_version != PROTOCOL_VERSION:
            return (
                f"the robot has protocol version {self.protocol_version}, this program {PROTOCOL_VERSION}: "
                "messages that only one of them knows are missing"
            )
        if self.schema_hash != SCHEMA_HASH:
            return (
                f"not understood: the schema hash of the robot is {self.schema_hash:#018x}, "
                f"that of this program {SCHEMA_HASH:#018x}"
            )
        return None


@dataclass(frozen=True)
class Place:
    """A visit to a place, as measured by the detector."""

    place_index: U32
    frame_index: U32
    radius_mm: U16
    degree: OptionalU8
    """The number of ways that lead away; None if the detector could not count them."""


@dataclass(frozen=True)
class Map:
    """The size of the map and its digest."""

    vertices: U8
    edges: U16
    digest: U32


@dataclass(frozen=True)
class Vertex:
    """The label of a vertex."""

    vertex: U8
    radius_mm: U16
    visits: U32


@dataclass(frozen=True)
class Edge:
    """An edge was added or removed; a ≤ b."""

    a: U8
    b: U8
    present: Flag


@dataclass(frozen=True)
class Location:
    """The vertex that the robot is at."""

    place_index: U32
    vertex: U8


class Factors:
    """The factors of a weight, as logarithms: one of these."""

    @dataclass(frozen=True)
    class Robust:
        """The factors of the robust filter: labels, moves and size of the map."""

        ln_labels_q16: I32
        ln_moves_q16: I32
        ln_size_q16: I32

    @dataclass(frozen=True)
    class Paper:
        """The factors of the paper's filter: Eq. 7, 8 and 9."""

        ln_label_q16: I32
        ln_consistency_q16: I32
        ln_size_q16: I32

    @dataclass(frozen=True)
    class Ordered:
        """The factors of the ordered filter: labels, and moves with the prior of the map."""

        ln_labels_q16: I32
        ln_moves_q16: I32


AnyFactors = Union[Factors.Robust, Factors.Paper, Factors.Ordered]


@dataclass(frozen=True)
class Evidence:
    """Why the filter chose its best map."""

    place_index: U32
    consistency_mm: U16
    """65535 if it is infinite."""
    factors: Annotated[AnyFactors, _choice(*typing.get_args(AnyFactors))]
    lead_q16: I32
    distinct_hypotheses: U16


@dataclass(frozen=True)
class Row:
    """One vertex of the map; bit w of `neighbours` stands for vertex w."""

    vertex: U8
    radius_mm: U16
    visits: U32
    neighbours: U64


@dataclass(frozen=True)
class Fault:
    """The count of a kind of fault since the start; `kind` is the number of a `FaultKind`, or a later one."""

    kind: U8
    count: U32


@dataclass(frozen=True)
class Health:
    """The state of the firmware; a value that it does not measure is 0."""

    uptime_ms: U32
    loop_count: U32
    stack_high_water_bytes: U32
    worst_turn_us: U32


DEAD = "dead"
"""The echo of a dead sensor."""
SILENCE = "silence"
"""The echo of a sensor that measures no echo."""
Echo = Union[int, str]
"""A range in millimetres, `SILENCE` or `DEAD`."""


def _echo() -> _Codec:
    code = _unsigned(16)
    kinds = {DEAD: 0, SILENCE: 1}

    def read(payload: bytes, at: int) -> tuple[Echo, int]:
        value, at = code.read(payload, at)
        return (value - 2 if value > 1 else SILENCE if value else DEAD), at

    return _Codec(read, lambda echo, out: code.write(kinds[echo] if isinstance(echo, str) else echo + 2, out))


@dataclass(frozen=True)
class Ring:
    """One frame of the sonar ring, in the order of the ring."""

    frame_index: U32
    ranges_mm: Annotated[tuple[Echo, ...], _list(_echo(), 32)]


@dataclass(frozen=True)
class VertexProbability:
    """The probability that the robot is at a vertex."""

    vertex: U8
    permille: U16


@dataclass(frozen=True)
class Belief:
    """Where the robot may be, the most probable vertex first, and the probability of the map."""

    place_index: U32
    map_permille: U16
    vertices: Annotated[tuple[VertexProbability, ...], _list(_record(VertexProbability), 8)]

    def _remapped(self, remapped: Remapped) -> Belief:
        """Removed vertices are left out, the probabilities of merged ones are added."""
        permille_of: dict[int, int] = {}
        for at in self.vertices:
            now = remapped.now(at.vertex)
            if now is not None:
                permille_of[now] = min(permille_of.get(now, 0) + at.permille, 0xFFFF)
        vertices = tuple(VertexProbability(vertex, permille) for vertex, permille in permille_of.items())
        return dataclasses.replace(self, vertices=vertices)


@dataclass(frozen=True)
class Remapped:
    """The new id of each vertex by its id before, 255 if it was removed; vertices with the same new id were merged."""

    place_index: U32
    vertices: Annotated[tuple[int, ...], _list(_byte(), 64)]

    def now(self, before: int) -> Optional[int]:
        """The new id of a vertex by its id before; None if it was removed."""
        if before >= len(self.vertices):
            return before
        return None if self.vertices[before] == 255 else self.vertices[before]


@dataclass(frozen=True)
class Worst:
    """The n-gram that the map explains worst, and the nearest walk of the map."""

    place_index: U32
    distance_mm: U16
    newest_age: U16
    vertices: Annotated[tuple[int, ...], _list(_byte(), 7)]


@dataclass(frozen=True)
class Version:
    """The version of the library."""

    major: U8
    minor: U8
    patch: U8


class Setting(enum.IntEnum):
    """The settings that can be changed while a robot runs; `docs/wire.md` has the ranges."""

    NOISE_MM = 0
    HYPOTHESES = 1
    MOVES = 2
    WRONG_TURN_PERMILLE = 3
    WRONG_DEGREE_PERMILLE = 4
    EQUIDISTANCE_MM = 5
    LEAVE_MM = 6
    SPEED_PERMILLE = 7
    SNAPSHOT_EVERY_PLACES = 8


def _setting() -> _Codec:
    number = _unsigned(32)

    def read(payload: bytes, at: int) -> tuple[Setting, int]:
        setting, at = number.read(payload, at)
        if setting >= len(Setting):
            raise _UnknownPayload
        return Setting(setting), at

    return _Codec(read, lambda setting, out: number.write(setting, out))


@dataclass(frozen=True)
class SettingValue:
    """A setting and its value."""

    setting: Annotated[Setting, _setting()]
    value: U16


class Outcome:
    """The outcome of a request: one of these."""

    @dataclass(frozen=True)
    class Done:
        """The command was accepted."""

    @dataclass(frozen=True)
    class Info:
        """The state of the robot."""

        version: Annotated[Version, _record(Version)]
        boot: U32
        reset_cause: Annotated[ResetCause, _kind(ResetCause)]
        uptime_ms: U32
        paused: Flag
        localise_only: Flag
        goal: OptionalU8
        stored_bytes: U16
        stored_places_ago: U32

    @dataclass(frozen=True)
    class Snapshot:
        """A chunk of a snapshot; no bytes at its end."""

        total: U16
        offset: U16
        bytes: Chunk

    @dataclass(frozen=True)
    class Refused:
        """The command was refused; nothing has changed."""

        refusal: Annotated[Refusal, _kind(Refusal)]

    @dataclass(frozen=True)
    class Settings:
        """The settings of the robot."""

        settings: Annotated[tuple[SettingValue, ...], _list(_record(SettingValue), 16)]


AnyOutcome = Union[Outcome.Done, Outcome.Info, Outcome.Snapshot, Outcome.Refused, Outcome.Settings]


@dataclass(frozen=True)
class Reply:
    """The reply to a request."""

    request: U16
    outcome: Annotated[AnyOutcome, _choice(*typing.get_args(AnyOutcome))]


@dataclass(frozen=True)
class Velocity:
    """The velocity command of a ring frame: counter-clockwise from the zero of the ring's bearings."""

    frame_index: U32
    heading_mrad: I16
    speed_permille: I16
    state: U8


@dataclass(frozen=True)
class GoalStatus:
    """The status of the goal."""

    vertex: U8
    state: Annotated[GoalState, _kind(GoalState)]


@dataclass(frozen=True)
class WayId:
    """A way by its vertex and its position among the ways of that vertex."""

    vertex: U8
    way: U8


@dataclass(frozen=True)
class Way:
    """One way of a vertex."""

    bearing_mrad: U16
    """Counter-clockwise, 0 to 6282; only differences between the ways of one vertex have a meaning."""
    leads_to: Annotated[Optional[WayId], _optional(_record(WayId))]
    """The other end of the edge; None for a frontier, a way that nobody has driven."""
    travel_frames: Annotated[Optional[int], _optional(_unsigned(16))]
    """The mean travel time of the edge in ring frames, if it is known."""

    def _remapped(self, remapped: Remapped) -> Way:
        """The way under the new vertex ids; a frontier if the vertex it leads to was removed."""
        if self.leads_to is None:
            return self
        vertex = remapped.now(self.leads_to.vertex)
        return self._frontier() if vertex is None else dataclasses.replace(self, leads_to=WayId(vertex, self.leads_to.way))

    def _frontier(self) -> Way:
        return Way(self.bearing_mrad, None, None)

    def _canonical(self) -> bytes:
        end = self.leads_to or WayId(255, 255)
        return struct.pack("<HBBH", self.bearing_mrad, end.vertex, end.way, self.travel_frames or 0)


@dataclass(frozen=True)
class Ways:
    """The ways of one vertex in counter-clockwise order."""

    vertex: U8
    ways: Annotated[tuple[Way, ...], _list(_record(Way), _WAYS_MAX)]

    def __post_init__(self) -> None:
        if not self._is_possible():
            raise _UnknownPayload(f"no map has these ways: {self}")

    def _is_possible(self) -> bool:
        if self.vertex >= _VERTICES_MAX:
            return False
        before_mrad = 0
        for place, way in enumerate(self.ways):
            if not before_mrad <= way.bearing_mrad < _TURN_MRAD or way.travel_frames == 0:
                return False
            before_mrad = way.bearing_mrad
            if way.leads_to is None:
                if way.travel_frames is not None:
                    return False
                continue
            end, here = way.leads_to, WayId(self.vertex, place)
            if end.vertex >= _VERTICES_MAX or end.way >= _WAYS_MAX or end == here:
                return False
            # A loop joins two ways of this vertex, each to the other.
            if end.vertex == self.vertex and (end.way >= len(self.ways) or self.ways[end.way].leads_to != here):
                return False
        return True


@dataclass(frozen=True)
class Exploration:
    """How far the map is explored."""

    frontiers: U8
    complete: Flag
    """Whether the drive reaches no frontier any more."""


@dataclass(frozen=True)
class Name:
    """The name of a vertex."""

    vertex: U8
    name: NameText


@dataclass(frozen=True)
class Named:
    """The vertices with a name, as a set of bits; the others have none."""

    vertices: U64


Message = Union[
    Hello,
    Place,
    Map,
    Vertex,
    Edge,
    Location,
    Evidence,
    Row,
    Fault,
    Health,
    Ring,
    Belief,
    Remapped,
    Worst,
    Reply,
    Velocity,
    GoalStatus,
    Ways,
    Exploration,
    Name,
    Named,
]
_MESSAGE = _choice(*typing.get_args(Message))


# Requests to a robot.


class Command:
    """A command to a robot: one of these."""

    @dataclass(frozen=True)
    class Info:
        """Requests the state of the robot; the outcome is `Outcome.Info`."""

    @dataclass(frozen=True)
    class GetMap:
        """Requests the whole map."""

    @dataclass(frozen=True)
    class GetSnapshot:
        """Requests a chunk of a snapshot; offset 0 takes a new one. The outcome is `Outcome.Snapshot`."""

        offset: U16

    @dataclass(frozen=True)
    class RestoreBegin:
        """Starts the transfer of a snapshot with this CRC (`zlib.crc32`)."""

        length: U16
        crc: U32

    @dataclass(frozen=True)
    class RestoreChunk:
        """Transfers a chunk of the snapshot, in order; a chunk may be repeated."""

        offset: U16
        bytes: Chunk

    @dataclass(frozen=True)
    class RestoreCommit:
        """Restores the snapshot that was transferred."""

    @dataclass(frozen=True)
    class Reset:
        """Clears the map and starts again."""

    @dataclass(frozen=True)
    class SetConfig:
        """Changes one setting."""

        setting: Annotated[Setting, _setting()]
        value: U16

    @dataclass(frozen=True)
    class LocaliseOnly:
        """Switches between localisation in the present map and mapping."""

        on: Flag

    @dataclass(frozen=True)
    class GoTo:
        """Sends the robot to a vertex; `GoalStatus` reports the progress."""

        vertex: U8

    @dataclass(frozen=True)
    class Explore:
        """Makes the robot explore."""

    @dataclass(frozen=True)
    class Pause:
        """Pauses or resumes the robot."""

        on: Flag

    @dataclass(frozen=True)
    class GetSettings:
        """Requests the settings of the robot; the outcome is `Outcome.Settings`."""

    @dataclass(frozen=True)
    class Name:
        """Names a vertex, or clears its name with an empty one."""

        vertex: U8
        name: NameText


AnyCommand = Union[
    Command.Info,
    Command.GetMap,
    Command.GetSnapshot,
    Command.RestoreBegin,
    Command.RestoreChunk,
    Command.RestoreCommit,
    Command.Reset,
    Command.SetConfig,
    Command.LocaliseOnly,
    Command.GoTo,
    Command.Explore,
    Command.Pause,
    Command.GetSettings,
    Command.Name,
]


@dataclass(frozen=True)
class Request:
    """A command with an id, different from that of the previous request; the reply repeats it."""

    id: U16
    command: Annotated[AnyCommand, _choice(*typing.get_args(AnyCommand))]


_REQUEST = _record(Request)


# Frames.


class Arrival(enum.Enum):
    """How the sequence number of a frame follows on the previous ones."""

    FIRST = "First"
    """The first intact frame."""
    IN_ORDER = "InOrder"
    """The next one."""
    AFTER_GAP = "AfterGap"
    """Frames in between are missing."""
    LATE = "Late"
    """One of the last 64 numbers: the frame was repeated or overtaken; ignore it."""
    RESTART = "Restart"
    """The sender has restarted: everything received before is void."""


@dataclass(frozen=True)
class Received:
    """A message or a request, and how its frame follows on the previous ones."""

    sequence: int
    arrival: Arrival
    lost: int
    """How many frames are missing before it."""
    message: Union[Message, Request]


class DecodeError(enum.Enum):
    """Why the bytes between two zeros are no message."""

    CORRUPT = "the CRC of the frame is wrong"
    CUT = "the frame ends too early"
    TOO_LONG = "the frame is longer than any message"
    UNKNOWN_VERSION = "the frame has a version which this listener does not know"
    UNKNOWN_MESSAGE = "the frame holds no message that this listener knows"


@dataclass(frozen=True)
class Damaged:
    """Bytes that are no message; they are counted."""

    error: DecodeError
    version: Optional[int] = None
    """The version of the frame, with `DecodeError.UNKNOWN_VERSION`."""

    def __str__(self) -> str:
        if self.version is not None:
            return f"the frame has version {self.version}, which this listener does not know"
        return self.error.value


Event = Union[Received, Damaged]


@dataclass
class Counters:
    """The counts of a decoder; each saturates at 32 bits."""

    messages: int = 0
    lost: int = 0
    """Frames that are missing according to the sequence numbers; a corrupt frame is one of them."""
    corrupt: int = 0
    cut: int = 0
    too_long: int = 0
    unknown_version: int = 0
    unknown_message: int = 0
    restarts: int = 0
    """Restarts of the sender."""


_COUNTER_OF = {
    DecodeError.CORRUPT: "corrupt",
    DecodeError.CUT: "cut",
    DecodeError.TOO_LONG: "too_long",
    DecodeError.UNKNOWN_VERSION: "unknown_version",
    DecodeError.UNKNOWN_MESSAGE: "unknown_message",
}


def _clock(message: Union[Message, Request]) -> Optional[tuple[str, int]]:
    """A number that ascends from the start of the robot on, with the name of its clock."""
    if isinstance(message, (Ring, Velocity)):
        return "frames", message.frame_index
    if isinstance(message, Health):
        return "uptime_ms", message.uptime_ms
    return None


class Decoder:
    """Decodes a stream of bytes, in pieces of any length, into messages.

    The next zero ends every frame, whatever is wrong inside it. No input raises an exception, and at most one frame is
    buffered. With `requests` it decodes requests to a robot.
    """

    def __init__(self, requests: bool = False) -> None:
        self.counters = Counters()
        self._version, self._codec = (_TO_ROBOT, _REQUEST) if requests else (FRAME_VERSION, _MESSAGE)
        self._begun = b""
        self._last_sequence: Optional[int] = None
        self._reopened = False
        self._start: Optional[tuple[int, int, int, int]] = None
        self._clocks: dict[str, int] = {}

    def reconnected(self) -> None:
        """Prepares for a reopened line: drops an incomplete frame. No frame is late on a new line, so a number that does not
        follow the last one shows a restart."""
        self._begun = b""
        self._reopened = True

    def feed(self, data: bytes) -> list[Event]:
        """Decodes bytes; returns the events that they complete, in order."""
        *frames, rest = bytes(data).split(b"\0")
        if frames:
            frames[0] = self._begun + frames[0]
            self._begun = b""
        # One byte more than the longest frame shows that a frame is too long.
        self._begun = (self._begun + rest)[: _RAW_BYTES_MAX + 2]
        return [self._judge(frame) for frame in frames if frame]

    def _judge(self, stuffed: bytes) -> Event:
        length = len(stuffed)
        if length > _RAW_BYTES_MAX + 1:
            return self._damaged(DecodeError.TOO_LONG)
        # Every code byte gives the distance to the next; all but the first stand for a zero.
        raw = bytearray(stuffed)
        at = 0
        while at < length:
            step = raw[at]
            raw[at] = 0
            at += step
        if length <= _CRC_BYTES or at > length:
            return self._damaged(DecodeError.CUT)
        body = bytes(raw[1:-_CRC_BYTES])
        if zlib.crc32(body) != int.from_bytes(raw[-_CRC_BYTES:], "little"):
            return self._damaged(DecodeError.CORRUPT)
        if len(body) < _HEADER_BYTES:
            return self._damaged(DecodeError.CUT)
        if body[0] != self._version:
            return self._damaged(DecodeError.UNKNOWN_VERSION, body[0])
        sequence = body[1] | body[2] << 8
        try:
            message, end = self._codec.read(body, _HEADER_BYTES)
        except (_UnknownPayload, IndexError):
            end = None
        # A Hello may grow: it is read as far as it is known.
        if end != len(body) and not (end is not None and isinstance(message, Hello)):
            # A newer sender's messages must not look like lost frames; after a gap the next message reports it.
            if self._last_sequence is not None and (self._last_sequence + 1) & 0xFFFF == sequence:
                self._last_sequence = sequence
            return self._damaged(DecodeError.UNKNOWN_MESSAGE)
        return self._received(sequence, message)

    def _damaged(self, error: DecodeError, version: Optional[int] = None) -> Damaged:
        self._count(_COUNTER_OF[error])
        return Damaged(error, version)

    def _received(self, sequence: int, message: Union[Message, Request]) -> Received:
        has_other_start = False
        if isinstance(message, Hello):
            has_other_start = self._start is not None and self._start != message.start()
            self._start = message.start()
        is_reopened, self._reopened = self._reopened, False
        lost = 0
        ahead = None if self._last_sequence is None else (sequence - self._last_sequence) & 0xFFFF
        if ahead is None:
            arrival = Arrival.FIRST
        elif has_other_start:
            arrival = Arrival.RESTART
        elif ahead == 1:
            arrival = Arrival.IN_ORDER
        elif 2 <= ahead <= 0x7FFF:
            arrival = Arrival.AFTER_GAP
        elif -ahead & 0xFFFF < _LATE_WINDOW and not is_reopened:
            arrival = Arrival.LATE
        else:
            arrival = Arrival.RESTART
        if arrival is not Arrival.LATE:
            self._last_sequence = sequence
            clock = _clock(message)
            if clock is not None:
                name, now = clock
                if now - self._clocks.get(name, now) & 0xFFFF_FFFF > 0x7FFF_FFFF:
                    arrival = Arrival.RESTART
            if arrival is Arrival.AFTER_GAP and ahead is not None:
                lost = ahead - 1
                self._count("lost", lost)
            elif arrival is Arrival.RESTART:
                self._count("restarts")
                self._clocks = {}
                # The next Hello is that of the new start.
                self._start = message.start() if isinstance(message, Hello) else None
            if clock is not None:
                self._clocks[clock[0]] = clock[1]
        self._count("messages")
        return Received(sequence, arrival, lost, message)

    def _count(self, name: str, more: int = 1) -> None:
        setattr(self.counters, name, min(getattr(self.counters, name) + more, _COUNT_MAX))


class Encoder:
    """Encodes requests, and messages for tests, as numbered frames.

    Send one zero byte before the first frame, so that earlier noise does not corrupt it.
    """

    def __init__(self, first_sequence: int = 0) -> None:
        self._sequence = first_sequence

    def encode(self, message: Union[Request, Message]) -> bytes:
        """The frame with its closing zero. ValueError if a field is out of its range."""
        version, codec = (_TO_ROBOT, _REQUEST) if isinstance(message, Request) else (FRAME_VERSION, _MESSAGE)
        raw = bytearray(struct.pack("<BH", version, self._sequence))
        codec.write(message, raw)
        raw += zlib.crc32(raw).to_bytes(_CRC_BYTES, "little")
        self._sequence = (self._sequence + 1) & 0xFFFF
        return b"".join(bytes([len(block) + 1]) + block for block in raw.split(b"\0")) + b"\0"


# The map replica.


class MapReplica:
    """A replica of the robot's map, and the newest of its other messages.

    Messages may be lost, repeated or late: late ones are ignored, and the robot repeats its map in turn.
    """

    def __init__(self) -> None:
        self._forget()

    def _forget(self) -> None:
        self.vertices = 0
        """The number of known vertices."""
        self.hello: Optional[Hello] = None
        self.location: Optional[Location] = None
        self.evidence: Optional[Evidence] = None
        self.health: Optional[Health] = None
        self.belief: Optional[Belief] = None
        self.worst: Optional[Worst] = None
        self.goal_status: Optional[GoalStatus] = None
        self.exploration: Optional[Exploration] = None
        self.place: Optional[Place] = None
        self.ring: Optional[Ring] = None
        self.velocity: Optional[Velocity] = None
        self.names: dict[int, str] = {}
        """The names of the vertices that have one."""
        self.faults: dict[FaultKind, int] = {kind: 0 for kind in FaultKind}
        self._labels: dict[int, tuple[int, int]] = {}
        """Radius and visits of the vertices with a known label."""
        self._neighbours = [0] * _VERTICES_MAX
        self._ways: dict[int, tuple[Way, ...]] = {}
        self._digest: Optional[int] = None
        """The digest of the robot's map, unless a message was lost since it was received."""

    def apply(self, event: Event) -> None:
        """Applies one event of a decoder."""
        if isinstance(event, Damaged) or event.arrival is Arrival.LATE:
            return
        if event.arrival is Arrival.AFTER_GAP:
            self._digest = None
        elif event.arrival is Arrival.RESTART:
            self._forget()
        message = event.message
        if isinstance(message, Map):
            self._resize(message.vertices)
            self._digest = message.digest
        elif isinstance(message, Vertex):
            self._set_label(message)
        elif isinstance(message, Edge):
            self._set_edge(message.a, message.b, message.present)
        elif isinstance(message, Row):
            self._set_label(message)
            if message.vertex < _VERTICES_MAX:
                for other in _bits(self._neighbours[message.vertex] ^ message.neighbours):
                    self._set_edge(message.vertex, other, bool(message.neighbours >> other & 1))
                self.vertices = max(self.vertices, message.neighbours.bit_length())
        elif isinstance(message, Fault):
            if message.kind < len(FaultKind):
                self.faults[FaultKind(message.kind)] = message.count
        elif isinstance(message, Remapped):
            self._remap(message)
        elif isinstance(message, Name):
            self._set_name(message.vertex, message.name)
        elif isinstance(message, Named):
            self.names = {vertex: name for vertex, name in self.names.items() if message.vertices >> vertex & 1}
        elif isinstance(message, GoalStatus):
            self.goal_status = message
        elif isinstance(message, Ways):
            self._ways[message.vertex] = message.ways
            self.vertices = max(self.vertices, message.vertex + 1)
        elif not isinstance(message, (Reply, Request)):
            setattr(self, type(message).__name__.lower(), message)

    def is_converged(self) -> bool:
        """Whether the replica equals the robot's map: its digest is the one that the robot sent last, and no frame was lost
        since."""
        rows = filter(None, map(self.row, range(self.vertices)))
        canonical = b"".join(struct.pack("<HIQ", row.radius_mm, row.visits, row.neighbours) for row in rows)
        if any(self._ways.values()):
            for ways in map(self.ways, range(self.vertices)):
                canonical += bytes([len(ways)]) + b"".join(way._canonical() for way in ways)
        return self._digest == zlib.crc32(bytes([self.vertices]) + canonical)

    def is_complete(self) -> bool:
        """Whether the label of every known vertex was received. Edges may be missing."""
        return self._labels.keys() == set(range(self.vertices))

    def row(self, vertex: int) -> Optional[Row]:
        """The label and the neighbours of a vertex; None until its label was received."""
        label = self._labels.get(vertex)
        return None if label is None else Row(vertex, *label, self._neighbours[vertex])

    def edges(self) -> list[tuple[int, int]]:
        """Every edge once, the smaller vertex first, in ascending order; equal ends are a corridor that returns to its place."""
        return [(a, b) for a in range(self.vertices) for b in _bits(self._neighbours[a]) if a <= b]

    def ways(self, vertex: int) -> tuple[Way, ...]:
        """The ways of a vertex in counter-clockwise order; none for an unknown vertex, and for a robot that knows edges only."""
        return self._ways.get(vertex, ())

    def way_edges(self) -> list[tuple[WayId, WayId]]:
        """Every edge between two ways once, the smaller first: parallel edges and loops each count. An edge of which only one end
        is known is left out."""
        ends = {WayId(vertex, place): way.leads_to for vertex in range(self.vertices) for place, way in enumerate(self.ways(vertex))}
        before = lambda one, other: (one.vertex, one.way) < (other.vertex, other.way)
        return [(here, end) for here, end in ends.items() if end is not None and before(here, end) and ends.get(end) == here]

    def frontiers(self) -> list[WayId]:
        """Every frontier, a way that nobody has driven."""
        ways = ((vertex, place, way) for vertex in range(self.vertices) for place, way in enumerate(self.ways(vertex)))
        return [WayId(vertex, place) for vertex, place, way in ways if way.leads_to is None]

    def _set_name(self, vertex: int, name: str) -> None:
        """Another vertex with this name loses it."""
        self.names = {other: known for other, known in self.names.items() if other != vertex and known != name}
        if name and vertex < _VERTICES_MAX:
            self.names[vertex] = name

    def _set_label(self, label: Union[Vertex, Row]) -> None:
        if label.vertex < _VERTICES_MAX:
            self._labels[label.vertex] = (label.radius_mm, label.visits)
            self.vertices = max(self.vertices, label.vertex + 1)

    def _set_edge(self, a: int, b: int, present: bool) -> None:
        if max(a, b) >= _VERTICES_MAX:
            return
        for one, other in ((a, b), (b, a)):
            if present:
                self._neighbours[one] |= 1 << other
            else:
                self._neighbours[one] &= ~(1 << other)
        if present:
            self.vertices = max(self.vertices, a + 1, b + 1)

    def _resize(self, vertices: int) -> None:
        """Removes the vertices from `vertices` on and their edges."""
        self.vertices = min(vertices, _VERTICES_MAX)
        kept = (1 << self.vertices) - 1
        self.names = {vertex: name for vertex, name in self.names.items() if vertex < self.vertices}
        for vertex in range(_VERTICES_MAX):
            self._neighbours[vertex] &= kept if vertex < self.vertices else 0
        self._labels = {vertex: label for vertex, label in self._labels.items() if vertex < self.vertices}
        self._ways = {vertex: tuple(map(self._kept, ways)) for vertex, ways in self._ways.items() if vertex < self.vertices}

    def _kept(self, way: Way) -> Way:
        """The way; a frontier if it leads to a vertex that the map does not have."""
        return way._frontier() if way.leads_to is not None and way.leads_to.vertex >= self.vertices else way

    def _remap(self, remapped: Remapped) -> None:
        """Applies new vertex ids. The digest is unknown until the size of the new map follows."""
        self._digest = None
        names = [remapped.now(vertex) for vertex in range(_VERTICES_MAX)]
        self.vertices = min(max((now + 1 for now in names[: self.vertices] if now is not None), default=0), _VERTICES_MAX)
        labels, self._labels = self._labels, {}
        neighbours, self._neighbours = self._neighbours, [0] * _VERTICES_MAX
        ways, self._ways = self._ways, {}
        for before, now in enumerate(names):
            if now is None or now >= _VERTICES_MAX:
                continue
            for other in (names[other] for other in _bits(neighbours[before])):
                if other is not None and other < _VERTICES_MAX:
                    self._neighbours[now] |= 1 << other
            # Merged vertices keep the first label.
            if before in labels:
                self._labels.setdefault(now, labels[before])
            # And the first ways.
            self._ways.setdefault(now, tuple(way._remapped(remapped) for way in ways.get(before, ())))
        # Of merged vertices the one that keeps its id keeps its name, otherwise the first one.
        named, self.names = self.names, {}
        for before in sorted(named, key=lambda vertex: (names[vertex] != vertex, vertex)):
            now = names[before]
            if now is not None and now < _VERTICES_MAX:
                self.names.setdefault(now, named[before])
        if self.location:
            self.location = _with_vertex(self.location, remapped.now(self.location.vertex))
        if self.goal_status:
            self.goal_status = _with_vertex(self.goal_status, remapped.now(self.goal_status.vertex))
        if self.belief:
            self.belief = self.belief._remapped(remapped)
        if self.worst:
            walk = self.worst.vertices
            kept = tuple(vertex for vertex in map(remapped.now, walk) if vertex is not None)
            self.worst = dataclasses.replace(self.worst, vertices=kept) if len(kept) == len(walk) else None


def _with_vertex(message: Any, vertex: Optional[int]) -> Any:
    return None if vertex is None else dataclasses.replace(message, vertex=vertex)


def _bits(row: int) -> Iterator[int]:
    while row:
        yield (row & -row).bit_length() - 1
        row &= row - 1


# JSON.


def to_json(event: Event) -> dict[str, Any]:
    """An event as plain data, as the `toposlam` command prints it: `event` is the name of the message, `Damaged`, or
    `Unknown` for an intact frame of another version, with the fields of the message beside it. `lost` is present if frames
    are missing before it, `late` if the frame was repeated or overtaken, and `restart` if the robot has restarted."""
    if isinstance(event, Damaged):
        is_unknown = event.error in (DecodeError.UNKNOWN_VERSION, DecodeError.UNKNOWN_MESSAGE)
        return {"event": "Unknown" if is_unknown else "Damaged", "error": str(event)}
    plain: dict[str, Any] = {**_plain(event.message), "event": type(event.message).__name__, "sequence": event.sequence}
    if event.arrival is Arrival.AFTER_GAP:
        plain["lost"] = event.lost
    elif event.arrival in (Arrival.LATE, Arrival.RESTART):
        plain[event.arrival.name.lower()] = True
    return plain


def json_line(plain: Any) -> str:
    """Plain data as one line of JSON: keys sorted, no spaces."""
    return json.dumps(plain, sort_keys=True, separators=(",", ":"), ensure_ascii=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Outcome.Refused):
        return {"Refused": value.refusal.value}
    if isinstance(value, SettingValue):
        return {value.setting.name.title().replace("_", ""): value.value}
    if isinstance(value, Command.SetConfig):
        return {"SetConfig": _plain(SettingValue(value.setting, value.value))}
    if dataclasses.is_dataclass(value):
        plain = {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
        if type(value).__qualname__ == type(value).__name__:
            return plain
        # A nested class is a variant: its name is the key.
        return {type(value).__name__: plain} if plain else type(value).__name__
    if isinstance(value, (tuple, bytes)):
        return [_plain(element) for element in value]
    return value.value if isinstance(value, enum.IntEnum) else value


# Lines.

READ_TIMEOUT_S = 0.02
"""The timeout of one read."""


class Line:
    """A line to a robot."""

    def __init__(self, read: Callable[[], bytes], write: Callable[[bytes], object], close: Callable[[], None]) -> None:
        self.read = read
        """Returns the received bytes, none after a timeout. EOFError at the end of the line."""
        self.write = write
        """Sends bytes."""
        self.close = close

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_line(name: str, baud: int = 115_200) -> Line:
    """Opens a line by its name: `tcp:HOST:PORT`, a serial port, or a file of recorded bytes.

    OSError if it cannot be opened, ImportError for a serial port without pyserial, ValueError for an invalid name.
    """
    if name.startswith("tcp:"):
        address = re.fullmatch(r"tcp:(.+):(\d+)", name)
        if not address:
            raise ValueError(f"{name} is not tcp:HOST:PORT")
        return _tcp_line(address[1].strip("[]"), int(address[2]))
    if os.path.isfile(name):
        file = open(name, "rb")
        return Line(lambda: _unless_ended(file.read(4096)), _refuse_to_write, file.close)
    try:
        import serial
    except ImportError as error:
        raise ImportError(f"for the serial port {name} install pyserial: pip install pyserial") from error
    port = serial.Serial(name, baud, timeout=READ_TIMEOUT_S)
    return Line(lambda: port.read(max(1, port.in_waiting)), port.write, port.close)


def _tcp_line(host: str, port: int) -> Line:
    connection = socket.create_connection((host, port), timeout=5)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.settimeout(READ_TIMEOUT_S)

    def read() -> bytes:
        try:
            return _unless_ended(connection.recv(4096))
        except socket.timeout:
            return b""

    def write(data: bytes) -> None:
        connection.settimeout(5)
        try:
            connection.sendall(data)
        finally:
            connection.settimeout(READ_TIMEOUT_S)

    return Line(read, write, connection.close)


def _unless_ended(data: bytes) -> bytes:
    if not data:
        raise EOFError("the line has ended")
    return data


def _refuse_to_write(_: bytes) -> None:
    raise OSError("cannot write to a recording")


class NoReply(Exception):
    """The robot did not reply: it is absent, or does not know the command."""


class Client:
    """Sends commands to a robot on a line, and listens meanwhile.

        with open_line("tcp:127.0.0.1:7070") as line:
            client = Client(line)
            print(client.request(Command.Info()))
            outcome = client.request(Command.GoTo(vertex=3))
            if isinstance(outcome, Outcome.Refused):
                print(outcome.refusal.name)

    A request without a reply in time is sent again; the robot executes it once.
    """

    def __init__(self, line: Line, on_event: Callable[[Event], object] = lambda event: None) -> None:
        self.line = line
        self.decoder = Decoder()
        self.replica = MapReplica()
        self.on_event = on_event
        """Called with every event after it was applied to the replica."""
        self.timeout_s = 1.0
        self.attempts = 5
        self._encoder = Encoder()
        # It should differ from the last id of the previous client.
        self._next_id = random.randrange(1 << 16)

    def listen(self) -> list[Event]:
        """Reads the line once and applies what was received. EOFError or OSError if the line ends or fails."""
        events = self.decoder.feed(self.line.read())
        for event in events:
            self.replica.apply(event)
            self.on_event(event)
        return events

    def request(self, command: AnyCommand) -> AnyOutcome:
        """Sends a command and waits for its outcome; a refusal is an outcome. NoReply after the last attempt."""
        request = Request(self._next_id, command)
        self._next_id = (self._next_id + 1) & 0xFFFF
        for _ in range(self.attempts):
            self.line.write(b"\0" + self._encoder.encode(request))
            deadline = time.monotonic() + self.timeout_s
            while time.monotonic() < deadline:
                for event in self.listen():
                    if isinstance(event, Received) and isinstance(event.message, Reply) and event.message.request == request.id:
                        return event.message.outcome
        raise NoReply(f"no reply to {self.attempts} requests: {command}")


def main() -> int:
    """`python -m toposlam_stream LINE`: prints every event as a line of JSON, and the counts at the end."""
    parser = argparse.ArgumentParser(prog="toposlam_stream", description="Prints the messages of a robot, one JSON object per line.")
    parser.add_argument("line", help="tcp:HOST:PORT, a serial port, or a file of raw bytes")
    parser.add_argument("--baud", type=int, default=115_200, help="speed of a serial port (default: %(default)s)")
    arguments = parser.parse_args()
    decoder = Decoder()
    complaint = None
    try:
        with open_line(arguments.line, arguments.baud) as line:
            while True:
                for event in decoder.feed(line.read()):
                    print(json_line(to_json(event)))
                    if isinstance(event, Received) and isinstance(event.message, Hello) and event.message.complaint() != complaint:
                        complaint = event.message.complaint()
                        print(complaint or "the robot is understood", file=sys.stderr)
                sys.stdout.flush()
    except (EOFError, KeyboardInterrupt):
        print(json_line(dataclasses.asdict(decoder.counters)), file=sys.stderr)
    except BrokenPipeError:
        # Who read the output has gone; the interpreter must not try to flush it once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, ImportError, ValueError) as error:
        print(f"toposlam_stream: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
