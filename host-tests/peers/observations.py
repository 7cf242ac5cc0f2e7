"""Reads what `toposlam evaluate --export DIR` writes: rows of paths, each with its observations and its truth.

A peer is handed `radii_mm` and nothing else, except one whose input includes the ways. The other hints of the CSV (`turn`,
`degree`) and the true place are not read.
"""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path

from path_map import Edge, undirected


@dataclass(frozen=True)
class Row:
    """One set of paths, a row of the table for every length."""

    name: str
    directory: Path
    seed: int
    lengths: tuple[int, ...]
    path_files: tuple[Path, ...]
    """The CSV files, in the order of their path numbers."""


@dataclass(frozen=True)
class Truth:
    """The smallest equivalent of the places that the first `length` steps traversed."""

    classes: tuple[int, ...]
    """The class of every step."""
    class_count: int
    edges: frozenset[Edge]


def read_rows(export: Path) -> list[Row]:
    """The rows that the manifest of an export names."""
    rows = []
    for entry in json.loads((export / "manifest.json").read_text()):
        directory = export / entry["directory"]
        files = sorted(directory.glob("*.csv"), key=lambda file: int(file.stem))
        if not files:
            raise FileNotFoundError(f"no paths in {directory}")
        rows.append(Row(entry["name"], directory, entry["seed"], tuple(entry["lengths"]), tuple(files)))
    return rows


def read_radii_mm(path_file: Path, length: int) -> list[float]:
    """The radius observed at each of the first `length` places."""
    with path_file.open(newline="") as lines:
        radii_mm = [float(row["radius_mm"]) for row in csv.DictReader(lines)]
    if len(radii_mm) < length:
        raise ValueError(f"{path_file} has {len(radii_mm)} places, not {length}")
    return radii_mm[:length]


@dataclass(frozen=True)
class Ways:
    """What a robot with a ring perceives of the ways of a place."""

    others_mrad: tuple[float, ...]
    """The bearings of the ways seen, relative to the one by which the robot came, which is not among them."""
    exit_mrad: float | None
    """The exit that it took at the place before, 0 for back; `None` if it was not reported."""


def read_ways(path_file: Path, length: int) -> list[Ways]:
    """The ways of the first `length` places."""
    with path_file.open(newline="") as lines:
        rows = list(csv.DictReader(lines))[:length]
    return [
        Ways(
            tuple(float(bearing) for bearing in (row["ways_mrad"] or "").split()),
            float(row["exit_mrad"]) if row["exit_mrad"] else None,
        )
        for row in rows
    ]


def read_truth(path_file: Path, length: int) -> Truth:
    """The truth about the first `length` places."""
    entry = json.loads(path_file.with_suffix(".truth.json").read_text())["truth"][str(length)]
    return Truth(tuple(entry["classes"]), entry["vertices"], undirected(entry["edges"]))
