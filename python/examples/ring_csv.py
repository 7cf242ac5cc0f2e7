"""Writes the ring frames of a line as CSV: a column for each sensor, millimetres, `silence` or `dead`.

    python python/examples/ring_csv.py office.bin > frames.csv      # or tcp:HOST:PORT, or a serial port
"""

from __future__ import annotations

import argparse
import csv
import sys

from toposlam_stream import Decoder, Received, Ring, open_line


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description="Writes the ring frames of a line as CSV.")
    parser.add_argument("line", help="tcp:HOST:PORT, a serial port, or a file of raw bytes")
    arguments = parser.parse_args()
    decoder, writer, has_header = Decoder(), csv.writer(sys.stdout), False
    with open_line(arguments.line) as line:
        while True:
            try:
                events = decoder.feed(line.read())
            except EOFError:
                return
            for event in events:
                if isinstance(event, Received) and isinstance(event.message, Ring):
                    if not has_header:
                        writer.writerow(f"s{sensor}_mm" for sensor in range(len(event.message.ranges_mm)))
                        has_header = True
                    writer.writerow(event.message.ranges_mm)


if __name__ == "__main__":
    main()
