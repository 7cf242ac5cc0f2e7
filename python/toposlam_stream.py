"""What a toposlam robot says over its line, decoded, and what it can be told, encoded.

The specification is `docs/wire.md`; frame version 1, protocol version 3. Nothing but the standard library is needed, but for
serial ports pyserial.

    from toposlam_stream import Decoder, Picture, open_line

    decoder, picture = Decoder(), Picture()
    with open_line("tcp:127.0.0.1:7070") as line:      # or "/dev/ttyACM0", or a file of raw bytes
        while not picture.is_converged():
            for event in decoder.feed(line.read()):
                picture.apply(event)
    print(picture.edges())

`python -m toposlam_stream LINE` prints every event as a line of JSON. To tell a robot what to do, see `Client`.

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

FRAME_VERSION = 1
"""The first byte of every frame of a robot; in a frame to a robot 128 is added."""
PROTOCOL_VERSION = 3
"""The version of the messages known here."""
SCHEMA_HASH = 0x06A5_446B_0B1D_C83D
"""FNV-1a (64 bit) of the description of the messages known here, see `docs/wire.md`."""
CHUNK_BYTES = 64
"""The most bytes of a snapshot that one request or reply carries."""

_TO_ROBOT = FRAME_VERSION | 1 << 7
_HEADER_BYTES = 3
_CRC_BYTES = 4
_RAW_BYTES_MAX = 110
_VERTICES_MAX = 64
_LATE_WINDOW = 64
_COUNT_MAX = 0xFFFF_FFFF


# How values travel: postcard's format.


class _UnknownPayload(Exception):
    """The payload is none that is known here."""


@dataclass(frozen=True)
class _Codec:
    """How one type travels."""

    read: Callable[[bytes, int], tuple[Any, int]]
    """The value that begins at a place of a payload, and the place after it. IndexError when the payload ends before."""
    write: Callable[[Any, bytearray], None]
    """Appends a value. ValueError when it is out of its range."""


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
    """A kind that is one byte; one that is not known here is read as the first."""
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


def _list(codec: _Codec, most: int, build: Callable[[Iterable[Any]], Any] = tuple) -> _Codec:
    """Up to so many elements: their number, then each."""
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


def _record(of: type) -> _Codec:
    """The fields of a dataclass, in order. Their types say how each travels."""
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
    """One of some dataclasses: its number in this order, then its fields."""
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


# What a robot says.


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
    """What a robot counts that went wrong."""

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


class JourneyState(enum.IntEnum):
    """How the way to a vertex goes; all but UNDERWAY are the end of it."""

    OTHER = 0
    UNDERWAY = 1
    ARRIVED = 2
    NO_ROUTE = 3
    VERTEX_GONE = 4
    LOST = 5
    REPLACED = 6

    @classmethod
    def _missing_(cls, value: object) -> JourneyState:
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

    @classmethod
    def _missing_(cls, value: object) -> Refusal:
        return cls.OTHER


@dataclass(frozen=True)
class Capacities:
    """What a robot has room for."""

    vertices: U8
    hypotheses: U16
    history: U16
    ngram_length: U8
    fingerprint_step_mm: U8
    sonars: U8


@dataclass(frozen=True)
class Hello:
    """Who is speaking."""

    protocol_version: U16
    schema_hash: U64
    boot: U32
    """Differs from one start to the next; 0 when the robot cannot tell its starts apart."""
    reset_cause: Annotated[ResetCause, _kind(ResetCause)]
    seed: U64
    capacities: Annotated[Capacities, _record(Capacities)]

    def complaint(self) -> Optional[str]:
        """What keeps this module from understanding the robot wholly; None when nothing does.

        Messages of another protocol version are understood as far as both know them. Under the same version with
        another schema hash they mean other things: do not trust what is shown.
        """
        if self.protocol_version != PROTOCOL_VERSION:
            return (
                f"the robot speaks protocol version {self.protocol_version}, this program {PROTOCOL_VERSION}: "
                "messages that only one knows are missing"
            )
        if self.schema_hash != SCHEMA_HASH:
            return (
                f"not understood: the robot's messages have schema hash {self.schema_hash:#018x}, "
                f"this program knows {SCHEMA_HASH:#018x}"
            )
        return None


@dataclass(frozen=True)
class Place:
    """The detector confirmed a place: what it saw, before any inference."""

    place_index: U32
    frame_index: U32
    radius_mm: U16
    degree: OptionalU8
    """How many ways lead away, when the detector could count them."""


@dataclass(frozen=True)
class Map:
    """How large the map now is, and a digest of it."""

    vertices: U8
    edges: U16
    digest: U32


@dataclass(frozen=True)
class Vertex:
    """The label of a vertex is now this."""

    vertex: U8
    radius_mm: U16
    visits: U32


@dataclass(frozen=True)
class Edge:
    """An edge now exists, or does no longer; a ≤ b."""

    a: U8
    b: U8
    present: Flag


@dataclass(frozen=True)
class Location:
    """The robot is at this vertex."""

    place_index: U32
    vertex: U8


@dataclass(frozen=True)
class Evidence:
    """Why the inference believes so."""

    place_index: U32
    consistency_mm: U16
    """65535 when it is infinite."""
    ln_label_q16: I32
    ln_consistency_q16: I32
    ln_size_q16: I32
    lead_q16: I32
    distinct_hypotheses: U16


@dataclass(frozen=True)
class Row:
    """All that the map says about a vertex; bit w of `neighbours` stands for vertex w."""

    vertex: U8
    radius_mm: U16
    visits: U32
    neighbours: U64


@dataclass(frozen=True)
class Fault:
    """How often a kind of fault was seen since the start; `kind` is the number of a `FaultKind`, or a later one."""

    kind: U8
    count: U32


@dataclass(frozen=True)
class Health:
    """How the firmware is doing; what it does not measure is 0."""

    uptime_ms: U32
    loop_count: U32
    stack_high_water_bytes: U32
    worst_update_us: U32


DEAD = "dead"
"""What a sonar says that does not work."""
SILENCE = "silence"
"""What a sonar says that hears no echo."""
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
    """One reading of the sonar ring, in the order of the ring."""

    frame_index: U32
    ranges_mm: Annotated[tuple[Echo, ...], _list(_echo(), 32)]


@dataclass(frozen=True)
class PlaceProbability:
    """How probable it is that the robot is at a vertex."""

    vertex: U8
    permille: U16


@dataclass(frozen=True)
class Belief:
    """Where the robot may be, the most probable first, and how far the map is to be trusted."""

    place_index: U32
    map_permille: U16
    places: Annotated[tuple[PlaceProbability, ...], _list(_record(PlaceProbability), 8)]

    def _renamed(self, renamed: Renamed) -> Belief:
        """A vertex that is gone is left out, and those that are one now are added up."""
        permille_of: dict[int, int] = {}
        for place in self.places:
            now = renamed.now(place.vertex)
            if now is not None:
                permille_of[now] = min(permille_of.get(now, 0) + place.permille, 0xFFFF)
        places = tuple(PlaceProbability(vertex, permille) for vertex, permille in permille_of.items())
        return dataclasses.replace(self, places=places)


@dataclass(frozen=True)
class Renamed:
    """The number now of each vertex by its number before, 255 when it is gone; two with one number were merged."""

    place_index: U32
    names: Annotated[tuple[int, ...], _list(_byte(), 64)]

    def now(self, before: int) -> Optional[int]:
        """The number now of a vertex by its number before; None when it is gone."""
        if before >= len(self.names):
            return before
        return None if self.names[before] == 255 else self.names[before]


@dataclass(frozen=True)
class Worst:
    """What the map explains worst, and the walk of the map that is nearest to it."""

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


class Outcome:
    """What comes of a request: one of these."""

    @dataclass(frozen=True)
    class Done:
        """It is done, or under way."""

    @dataclass(frozen=True)
    class Info:
        """Which robot this is and what it does."""

        version: Annotated[Version, _record(Version)]
        boot: U32
        reset_cause: Annotated[ResetCause, _kind(ResetCause)]
        uptime_ms: U32
        paused: Flag
        localise_only: Flag
        going_to: OptionalU8
        stored_bytes: U16
        stored_places_ago: U32

    @dataclass(frozen=True)
    class Snapshot:
        """A piece of a snapshot; no bytes at its end."""

        total: U16
        offset: U16
        bytes: Chunk

    @dataclass(frozen=True)
    class Refused:
        """It was not done, and everything is as it was."""

        refusal: Annotated[Refusal, _kind(Refusal)]


AnyOutcome = Union[Outcome.Done, Outcome.Info, Outcome.Snapshot, Outcome.Refused]


@dataclass(frozen=True)
class Reply:
    """The answer to a request."""

    request: U16
    outcome: Annotated[AnyOutcome, _choice(Outcome.Done, Outcome.Info, Outcome.Snapshot, Outcome.Refused)]


@dataclass(frozen=True)
class Drive:
    """Where the drive steers: counter-clockwise from where the bearings of the ring count from."""

    frame_index: U32
    heading_mrad: I16
    speed_permille: I16
    state: U8


@dataclass(frozen=True)
class Journey:
    """How the way to a vertex goes that the robot was told to go to."""

    vertex: U8
    state: Annotated[JourneyState, _kind(JourneyState)]


Message = Union[
    Hello, Place, Map, Vertex, Edge, Location, Evidence, Row, Fault, Health, Ring, Belief, Renamed, Worst, Reply, Drive, Journey
]
_MESSAGE = _choice(*typing.get_args(Message))


# What a robot can be told.


class Setting(enum.IntEnum):
    """What can be set while a robot runs; `docs/wire.md` has the ranges."""

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


class Command:
    """What a robot is told to do: one of these."""

    @dataclass(frozen=True)
    class Info:
        """Say which robot this is and what it does; the outcome is `Outcome.Info`."""

    @dataclass(frozen=True)
    class GetMap:
        """Send the whole rolling picture at once."""

    @dataclass(frozen=True)
    class GetSnapshot:
        """Send a piece of a snapshot; with offset 0 one is taken first. The outcome is `Outcome.Snapshot`."""

        offset: U16

    @dataclass(frozen=True)
    class RestoreBegin:
        """Get ready for a snapshot with that CRC (`zlib.crc32`)."""

        length: U16
        crc: U32

    @dataclass(frozen=True)
    class RestoreChunk:
        """Take a piece of the snapshot, in order; a piece may come again."""

        offset: U16
        bytes: Chunk

    @dataclass(frozen=True)
    class RestoreCommit:
        """Go on with the map of the snapshot that was sent."""

    @dataclass(frozen=True)
    class Reset:
        """Forget the map and start anew."""

    @dataclass(frozen=True)
    class SetConfig:
        """Go on with another value of a setting."""

        setting: Annotated[Setting, _setting()]
        value: U16

    @dataclass(frozen=True)
    class LocaliseOnly:
        """Keep the map as it is and only tell where the robot is, or go on mapping."""

        on: Flag

    @dataclass(frozen=True)
    class GoTo:
        """Drive to a vertex of the map; `Journey` tells how that goes."""

        vertex: U8

    @dataclass(frozen=True)
    class Explore:
        """Go on exploring."""

    @dataclass(frozen=True)
    class Pause:
        """Stand still and observe nothing, or go on."""

        on: Flag


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
]


@dataclass(frozen=True)
class Request:
    """A command with a number, which differs from that of the request before and by which its reply is known."""

    id: U16
    command: Annotated[AnyCommand, _choice(*typing.get_args(AnyCommand))]


_REQUEST = _record(Request)


# Frames.


class Arrival(enum.Enum):
    """How a frame follows on those before."""

    FIRST = "First"
    """The first intact frame."""
    IN_ORDER = "InOrder"
    """The one that was due."""
    AFTER_GAP = "AfterGap"
    """Frames in between are missing."""
    LATE = "Late"
    """One of the last 64 numbers again: it was repeated or overtaken; ignore it."""
    RESTART = "Restart"
    """The sender has started anew: what was heard before means nothing."""


@dataclass(frozen=True)
class Heard:
    """A message or a request, and how its frame follows on those before."""

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
    """Bytes that were no message; they are counted."""

    error: DecodeError
    version: Optional[int] = None
    """The version of the frame, with `DecodeError.UNKNOWN_VERSION`."""

    def __str__(self) -> str:
        if self.version is not None:
            return f"the frame has version {self.version}, which this listener does not know"
        return self.error.value


Event = Union[Heard, Damaged]


@dataclass
class Counters:
    """What a decoder has seen since it was made; every count saturates at 32 bits."""

    messages: int = 0
    lost: int = 0
    """Frames that are missing according to the sequence numbers; a corrupt one is among them."""
    corrupt: int = 0
    cut: int = 0
    too_long: int = 0
    unknown_version: int = 0
    unknown_message: int = 0


_COUNTER_OF = {
    DecodeError.CORRUPT: "corrupt",
    DecodeError.CUT: "cut",
    DecodeError.TOO_LONG: "too_long",
    DecodeError.UNKNOWN_VERSION: "unknown_version",
    DecodeError.UNKNOWN_MESSAGE: "unknown_message",
}


class Decoder:
    """Takes bytes in pieces of any length and hands out the messages.

    Whatever goes wrong inside a frame, the next zero ends it. No bytes make it raise, and it keeps at most one frame.
    With `requests` it is the robot's ear and hands out requests.
    """

    def __init__(self, requests: bool = False) -> None:
        self.counters = Counters()
        self._version, self._codec = (_TO_ROBOT, _REQUEST) if requests else (FRAME_VERSION, _MESSAGE)
        self._begun = b""
        self._last_sequence: Optional[int] = None
        self._last_boot: Optional[int] = None

    def feed(self, data: bytes) -> list[Event]:
        """Takes bytes, and gives what was completed by them, in order."""
        *frames, rest = bytes(data).split(b"\0")
        if frames:
            frames[0] = self._begun + frames[0]
            self._begun = b""
        # One byte more than the longest frame tells that a frame is too long.
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
        if end != len(body):
            # A newer sender's messages must not look like lost frames; after a gap the next message tells of it.
            if self._last_sequence is not None and (self._last_sequence + 1) & 0xFFFF == sequence:
                self._last_sequence = sequence
            return self._damaged(DecodeError.UNKNOWN_MESSAGE)
        return self._heard(sequence, message)

    def _damaged(self, error: DecodeError, version: Optional[int] = None) -> Damaged:
        self._count(_COUNTER_OF[error])
        return Damaged(error, version)

    def _heard(self, sequence: int, message: Union[Message, Request]) -> Heard:
        has_restarted = False
        if isinstance(message, Hello):
            has_restarted = self._last_boot is not None and self._last_boot != message.boot
            self._last_boot = message.boot
        lost = 0
        ahead = None if self._last_sequence is None else (sequence - self._last_sequence) & 0xFFFF
        if ahead is None:
            arrival = Arrival.FIRST
        elif has_restarted:
            arrival = Arrival.RESTART
        elif ahead == 1:
            arrival = Arrival.IN_ORDER
        elif 2 <= ahead <= 0x7FFF:
            arrival = Arrival.AFTER_GAP
            lost = ahead - 1
            self._count("lost", lost)
        elif -ahead & 0xFFFF < _LATE_WINDOW:
            arrival = Arrival.LATE
        else:
            arrival = Arrival.RESTART
        if arrival is not Arrival.LATE:
            self._last_sequence = sequence
        self._count("messages")
        return Heard(sequence, arrival, lost, message)

    def _count(self, name: str, more: int = 1) -> None:
        setattr(self.counters, name, min(getattr(self.counters, name) + more, _COUNT_MAX))


class Encoder:
    """Packs requests, and messages for who plays a robot, into frames and numbers them.

    Send one zero byte before the first frame, so that noise from before does not spoil it.
    """

    def __init__(self, first_sequence: int = 0) -> None:
        self._sequence = first_sequence

    def encode(self, message: Union[Request, Message]) -> bytes:
        """The frame, its closing zero included. ValueError when a field is out of its range."""
        version, codec = (_TO_ROBOT, _REQUEST) if isinstance(message, Request) else (FRAME_VERSION, _MESSAGE)
        raw = bytearray(struct.pack("<BH", version, self._sequence))
        codec.write(message, raw)
        raw += zlib.crc32(raw).to_bytes(_CRC_BYTES, "little")
        self._sequence = (self._sequence + 1) & 0xFFFF
        return b"".join(bytes([len(block) + 1]) + block for block in raw.split(b"\0")) + b"\0"


# The map as heard.


class Picture:
    """The map as heard so far, and whether it is the robot's; and the newest of everything else.

    Any message may be missing, doubled or late: late ones are ignored, and what is missing comes round with the rolling
    picture.
    """

    def __init__(self) -> None:
        self._forget()

    def _forget(self) -> None:
        self.vertices = 0
        """How many vertices the map has, as far as heard."""
        self.hello: Optional[Hello] = None
        self.location: Optional[Location] = None
        self.evidence: Optional[Evidence] = None
        self.health: Optional[Health] = None
        self.belief: Optional[Belief] = None
        self.worst: Optional[Worst] = None
        self.journey: Optional[Journey] = None
        self.place: Optional[Place] = None
        self.ring: Optional[Ring] = None
        self.drive: Optional[Drive] = None
        self.faults: dict[FaultKind, int] = {kind: 0 for kind in FaultKind}
        self._labels: dict[int, tuple[int, int]] = {}
        """Radius and visits of the vertices whose label was heard."""
        self._neighbours = [0] * _VERTICES_MAX
        self._digest: Optional[int] = None
        """The digest of the robot's map, unless a message was missed since it was heard."""

    def apply(self, event: Event) -> None:
        """Takes in one event of a decoder."""
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
        elif isinstance(message, Renamed):
            self._rename(message)
        elif not isinstance(message, (Reply, Request)):
            setattr(self, type(message).__name__.lower(), message)

    def is_converged(self) -> bool:
        """Whether the map heard so far is the robot's: its digest is the one that the robot sent last, and no frame was
        missed since."""
        rows = filter(None, map(self.row, range(self.vertices)))
        canonical = b"".join(struct.pack("<HIQ", row.radius_mm, row.visits, row.neighbours) for row in rows)
        return self._digest == zlib.crc32(bytes([self.vertices]) + canonical)

    def is_complete(self) -> bool:
        """Whether the label of every vertex known to exist was heard. Edges may still be missing."""
        return self._labels.keys() == set(range(self.vertices))

    def row(self, vertex: int) -> Optional[Row]:
        """All that was heard of a vertex; None while its label was not."""
        label = self._labels.get(vertex)
        return None if label is None else Row(vertex, *label, self._neighbours[vertex])

    def edges(self) -> list[tuple[int, int]]:
        """Every edge once, the smaller vertex first, in ascending order; equal ends are a corridor back to its place."""
        return [(a, b) for a in range(self.vertices) for b in _bits(self._neighbours[a]) if a <= b]

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
        """Vertices that do not exist any more go with their edges."""
        self.vertices = min(vertices, _VERTICES_MAX)
        kept = (1 << self.vertices) - 1
        for vertex in range(_VERTICES_MAX):
            self._neighbours[vertex] &= kept if vertex < self.vertices else 0
        self._labels = {vertex: label for vertex, label in self._labels.items() if vertex < self.vertices}

    def _rename(self, renamed: Renamed) -> None:
        """Gives the vertices their new numbers. The map is that of the update once its size follows; until then the digest
        of the map before means nothing."""
        self._digest = None
        names = [renamed.now(vertex) for vertex in range(_VERTICES_MAX)]
        self.vertices = min(max((now + 1 for now in names[: self.vertices] if now is not None), default=0), _VERTICES_MAX)
        labels, self._labels = self._labels, {}
        neighbours, self._neighbours = self._neighbours, [0] * _VERTICES_MAX
        for before, now in enumerate(names):
            if now is None or now >= _VERTICES_MAX:
                continue
            for other in (names[other] for other in _bits(neighbours[before])):
                if other is not None and other < _VERTICES_MAX:
                    self._neighbours[now] |= 1 << other
            # Of vertices that are one now, the first one's label stays.
            if before in labels:
                self._labels.setdefault(now, labels[before])
        if self.location:
            self.location = _with_vertex(self.location, renamed.now(self.location.vertex))
        if self.journey:
            self.journey = _with_vertex(self.journey, renamed.now(self.journey.vertex))
        if self.belief:
            self.belief = self.belief._renamed(renamed)
        if self.worst:
            walk = self.worst.vertices
            kept = tuple(vertex for vertex in map(renamed.now, walk) if vertex is not None)
            self.worst = dataclasses.replace(self.worst, vertices=kept) if len(kept) == len(walk) else None


def _with_vertex(message: Any, vertex: Optional[int]) -> Any:
    return None if vertex is None else dataclasses.replace(message, vertex=vertex)


def _bits(row: int) -> Iterator[int]:
    while row:
        yield (row & -row).bit_length() - 1
        row &= row - 1


# JSON.


def to_json(event: Event) -> dict[str, Any]:
    """An event as plain data, in the shape that `toposlam` prints too: `event` is the name of the message, or `Damaged`;
    the message's fields stand beside it. `lost` is there when frames are missing before it."""
    if isinstance(event, Damaged):
        return {"event": "Damaged", "error": str(event)}
    plain: dict[str, Any] = {**_plain(event.message), "event": type(event.message).__name__, "sequence": event.sequence}
    if event.arrival is Arrival.AFTER_GAP:
        plain["lost"] = event.lost
    return plain


def json_line(plain: Any) -> str:
    """Plain data as one line of JSON: keys in order, no spaces."""
    return json.dumps(plain, sort_keys=True, separators=(",", ":"))


def _plain(value: Any) -> Any:
    if isinstance(value, Outcome.Refused):
        return {"Refused": value.refusal.value}
    if isinstance(value, Command.SetConfig):
        return {"SetConfig": {value.setting.name.title().replace("_", ""): value.value}}
    if dataclasses.is_dataclass(value):
        plain = {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
        if type(value).__qualname__ == type(value).__name__:
            return plain
        # One of the outcomes or commands: its name tells which.
        return {type(value).__name__: plain} if plain else type(value).__name__
    if isinstance(value, (tuple, bytes)):
        return [_plain(element) for element in value]
    return value.value if isinstance(value, enum.IntEnum) else value


# Lines.

READ_TIMEOUT_S = 0.02
"""A read of a line gives up after this long when nothing comes."""


class Line:
    """A line to a robot."""

    def __init__(self, read: Callable[[], bytes], write: Callable[[bytes], object], close: Callable[[], None]) -> None:
        self.read = read
        """What has come; nothing when nothing comes for a while. EOFError when the line has ended."""
        self.write = write
        """Sends bytes."""
        self.close = close

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_line(name: str, baud: int = 115_200) -> Line:
    """Opens a line by its name: `tcp:HOST:PORT`, a serial port, or a file of raw bytes to be read again.

    OSError when it cannot be opened, ImportError for a serial port without pyserial, ValueError for a name that is none.
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
    raise OSError("a recording cannot be told anything")


class NoReply(Exception):
    """The robot did not answer: it is not there, or does not know the command."""


class Client:
    """Tells a robot on a line what to do, and listens meanwhile.

        with open_line("tcp:127.0.0.1:7070") as line:
            client = Client(line)
            print(client.request(Command.Info()))
            outcome = client.request(Command.GoTo(vertex=3))
            if isinstance(outcome, Outcome.Refused):
                print(outcome.refusal.name)

    A request whose reply does not come in time is sent again, which the robot executes once.
    """

    def __init__(self, line: Line, heard: Callable[[Event], object] = lambda event: None) -> None:
        self.line = line
        self.decoder = Decoder()
        self.picture = Picture()
        self.heard = heard
        """Called with every event, when the picture has taken it in."""
        self.timeout_s = 1.0
        self.attempts = 5
        self._encoder = Encoder()
        # It should not be the number of the last request of the client before.
        self._next_id = random.randrange(1 << 16)

    def listen(self) -> list[Event]:
        """Reads the line once and takes in what came. EOFError or OSError when the line ends or fails."""
        events = self.decoder.feed(self.line.read())
        for event in events:
            self.picture.apply(event)
            self.heard(event)
        return events

    def request(self, command: AnyCommand) -> AnyOutcome:
        """Sends a command and waits for what comes of it; a refusal is an outcome. NoReply after the last attempt."""
        request = Request(self._next_id, command)
        self._next_id = (self._next_id + 1) & 0xFFFF
        for _ in range(self.attempts):
            self.line.write(b"\0" + self._encoder.encode(request))
            deadline = time.monotonic() + self.timeout_s
            while time.monotonic() < deadline:
                for event in self.listen():
                    if isinstance(event, Heard) and isinstance(event.message, Reply) and event.message.request == request.id:
                        return event.message.outcome
        raise NoReply(f"no reply to {self.attempts} requests: {command}")


def main() -> int:
    """`python -m toposlam_stream LINE`: every event as a line of JSON, and at the end what was counted."""
    parser = argparse.ArgumentParser(prog="toposlam_stream", description="Prints what a robot says, one JSON object a line.")
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
                    if isinstance(event, Heard) and isinstance(event.message, Hello) and event.message.complaint() != complaint:
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
