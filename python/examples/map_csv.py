"""Maps ring frames from a CSV file, as `examples/replay_csv.rs` does, and prints its speed.

    python python/examples/map_csv.py examples/frames.csv

The file has a column for each sensor, counter-clockwise from straight ahead: millimetres, `silence` or `dead`.
"""

from __future__ import annotations

import csv
import sys
import time

from toposlam import Mapper


def main(path: str) -> None:
    """Maps a file."""
    start = time.perf_counter()
    with open(path, newline="") as file:
        rows = csv.reader(file)
        mapper, frames = Mapper(len(next(rows))), 0
        for row in rows:
            frames += 1
            observed = mapper.observe(float(value) if value.isdigit() else value for value in row)
            if observed is not None:
                place, update = observed
                print(f"frame {place.frame_index}: radius {place.radius_mm} mm, vertex {update.vertex}")
    seconds = time.perf_counter() - start
    print(f"{len(mapper.map.vertices)} vertices, {len(mapper.map.edges)} edges, digest {mapper.map.digest}")
    print(f"{frames} frames, {mapper.observed} places in {seconds:.3f} s: {frames / seconds:,.0f} frames/s", file=sys.stderr)


if __name__ == "__main__":
    main(sys.argv[1])
