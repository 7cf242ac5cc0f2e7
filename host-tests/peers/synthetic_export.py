"""Writes small exports in the format of `toposlam evaluate --export`, for the tests of this folder only.

`python3 synthetic_export.py DIR` writes the sample that the README speaks of.
"""

from __future__ import annotations

import json
import random
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Environment:
    """Labelled places and the corridors between them."""

    name: str
    labels: tuple[tuple[float, float], ...]
    """Mean and standard deviation of every place in mm."""
    edges: tuple[tuple[int, int], ...]


WEAN_SURROGATE_SD = Environment(
    "wean-surrogate-sd",
    (
        (1171.3, 12.1), (1360.0, 6.9), (2164.1, 17.9), (2162.4, 7.7), (1335.0, 10.7), (1269.5, 25.5),
        (1310.4, 0.8), (1498.3, 2.4), (1676.8, 13.4), (1353.7, 0.9), (1160.6, 11.0),
    ),
    ((0, 4), (0, 6), (1, 7), (2, 4), (3, 5), (4, 5), (5, 8), (6, 7), (6, 9), (7, 10), (8, 9), (8, 10), (9, 10)),
)  # fmt: skip

ALL_DIFFERENT = Environment(
    "all-different",
    ((600.0, 5.0), (1000.0, 5.0), (1400.0, 5.0), (1800.0, 5.0), (2200.0, 5.0)),
    ((0, 1), (1, 2), (2, 0), (2, 3), (3, 4)),
)

# D-A-B-A-E: the two A differ only in what is behind them. Without noise.
LOOK_ALIKE_NEIGHBOURS = Environment(
    "look-alike-neighbours",
    ((1000.0, 0.0), (600.0, 0.0), (600.0, 0.0), (1400.0, 0.0), (1800.0, 0.0)),
    ((0, 1), (0, 2), (1, 3), (2, 4)),
)

# The ring A-B-C-A-D-E: the label before an A tells which of the two it is. Without noise.
LOOK_ALIKES_IN_A_RING = Environment(
    "look-alikes-in-a-ring",
    ((600.0, 0.0), (1000.0, 0.0), (1400.0, 0.0), (600.0, 0.0), (1800.0, 0.0), (2200.0, 0.0)),
    ((0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0)),
)


def walk(environment: Environment, length: int, source: random.Random) -> list[int]:
    """A uniform random walk, U-turns included."""
    neighbours: list[list[int]] = [[] for _ in environment.labels]
    for a, b in environment.edges:
        neighbours[a].append(b)
        neighbours[b].append(a)
    places = [source.randrange(len(neighbours))]
    while len(places) < length:
        places.append(source.choice(neighbours[places[-1]]))
    return places


def smallest_equivalent(environment: Environment, places: Sequence[int]) -> dict[str, object]:
    """The truth about a walk: places that no walk tells apart are one class (see `equivalence.rs`)."""
    traversed = {frozenset(step) for step in zip(places, places[1:])}
    visited = sorted(set(places))
    around = {place: {p for step in traversed if place in step for p in step - {place}} for place in visited}
    classes = _number({place: environment.labels[place] for place in visited})
    while True:
        refined = _number({p: (classes[p], tuple(sorted({classes[q] for q in around[p]}))) for p in visited})
        if len(set(refined.values())) == len(set(classes.values())):
            break
        classes = refined
    edges = sorted({tuple(sorted(classes[place] for place in step)) for step in traversed})
    return {
        "classes": [classes[place] for place in places],
        "vertices": len(set(classes.values())),
        "edges": [list(edge) for edge in edges],
    }


def _number(keys: dict[int, tuple]) -> dict[int, int]:
    numbers: dict[tuple, int] = {}
    return {place: numbers.setdefault(key, len(numbers)) for place, key in keys.items()}


def write_export(
    export: Path, environments: Sequence[Environment], paths: int, lengths: Sequence[int], seed: int
) -> None:
    """Writes an export of `paths` paths for each environment; the hints are left unknown (0)."""
    manifest = []
    for environment in environments:
        directory = export / environment.name
        directory.mkdir(parents=True)
        for path in range(paths):
            source = random.Random(f"{seed} {environment.name} {path}")
            places = walk(environment, max(lengths), source)
            lines = ["place,radius_mm,turn,degree"]
            for place in places:
                radius_mm = 2 * round(source.gauss(*environment.labels[place]) / 2)
                lines.append(f"{place},{radius_mm},0,0")
            (directory / f"{path}.csv").write_text("\n".join(lines) + "\n")
            truth = {
                "places": places,
                "labels": environment.labels,
                "edges": environment.edges,
                "lengths": list(lengths),
                "truth": {str(length): smallest_equivalent(environment, places[:length]) for length in lengths},
            }
            (directory / f"{path}.truth.json").write_text(json.dumps(truth))
        manifest.append(
            {
                "directory": environment.name,
                "name": environment.name,
                "paths": paths,
                "lengths": list(lengths),
                "seed": seed,
            }
        )
    (export / "manifest.json").write_text(json.dumps(manifest))


if __name__ == "__main__":
    write_export(Path(sys.argv[1]), [ALL_DIFFERENT, WEAN_SURROGATE_SD], paths=6, lengths=(50, 100, 200, 400), seed=1)
