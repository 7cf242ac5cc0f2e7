"""Frames as a robot sends them, from docs/wire.md alone: nothing of this is shared with what is tested."""

import zlib


def cobs(data: bytes) -> bytes:
    """Consistent overhead byte stuffing of less than 254 bytes, with the closing zero."""
    return b"".join(bytes([len(part) + 1]) + part for part in data.split(b"\0")) + b"\0"


def frame(sequence: int, payload: bytes) -> bytes:
    body = bytes([2]) + sequence.to_bytes(2, "little") + payload
    return cobs(body + zlib.crc32(body).to_bytes(4, "little"))


def varint(value: int) -> bytes:
    return bytes([value]) if value < 128 else bytes([value & 0x7F | 0x80]) + varint(value >> 7)
