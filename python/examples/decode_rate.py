"""How fast a stream is decoded here: `python python/examples/decode_rate.py FILE`, with a file of raw bytes.

`cargo run --release -p toposlam-link --example decode_rate -- FILE` writes one, and measures the same in Rust.
"""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path

from toposlam_stream import Decoder, MapReplica

RUNS = 5
PIECE_BYTES = 4096


def main() -> None:
    """The command."""
    stream = Path(sys.argv[1]).read_bytes()
    seconds = []
    for _ in range(RUNS):
        decoder, replica = Decoder(), MapReplica()
        begun = time.perf_counter()
        for at in range(0, len(stream), PIECE_BYTES):
            for event in decoder.feed(stream[at : at + PIECE_BYTES]):
                replica.apply(event)
        seconds.append(time.perf_counter() - begun)
    median = statistics.median(seconds)
    frames = decoder.counters.messages
    print(f"{len(stream)} bytes, {frames} frames, {replica.vertices} vertices, median of {RUNS} runs on one core")
    print(f"{len(stream) / median / 1e6:.2f} MB/s, {frames / median:.0f} frames/s")


if __name__ == "__main__":
    main()
