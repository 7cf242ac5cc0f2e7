"""Compares toposlam with three programs that one would use instead, on the paths of `toposlam evaluate --export DIR`.

Prints one table of accuracy, time and memory. The README says how to install what it needs.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import fmean

from measure import PEERS, TOLD_WAYS, measure
from observations import Row, read_radii_mm, read_rows, read_truth, read_ways
from path_map import map_of_path
from score import score_map
from table import Result, markdown, read_ours


def evaluate(peer: str, row: Row, length: int, paths: int | None) -> Result:
    """Runs a peer on the first `length` places of the first `paths` paths of a row, or of all, and scores it."""
    files = row.path_files[:paths]
    radii_mm = [read_radii_mm(file, length) for file in files]
    # Every path has a seed of its own that does not depend on which paths are run.
    seeds = [row.seed * 1_000_003 % 2**31 + int(file.stem) for file in files]
    ways = [read_ways(file, length) for file in files] if peer in TOLD_WAYS else None
    measured = measure(peer, radii_mm, seeds, ways)
    scores = []
    for file, states in zip(files, measured.paths, strict=True):
        truth = read_truth(file, length)
        scores.append(score_map(map_of_path(states), truth.class_count, truth.edges, truth.classes))
    return Result(
        row.name,
        length,
        peer,
        len(files),
        fmean(score.exact for score in scores),
        fmean(score.isomorphic for score in scores),
        fmean(score.edge_f1 for score in scores),
        fmean(score.location_smoothed for score in scores),
        fmean(measured.seconds),
        measured.peak_mebibytes,
        measured.working_mebibytes,
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line."""
    options = _parser().parse_args(arguments)
    jobs = [
        (peer, row, length, options.paths)
        for row in read_rows(options.export)
        for length in row.lengths
        if not options.lengths or length in options.lengths
        for peer in options.peers
    ]
    if not jobs:
        print("nothing to run: the export has none of these lengths", file=sys.stderr)
        return 1
    # The threads only wait for processes.
    with ThreadPoolExecutor(options.jobs) as pool:
        results = []
        for result in pool.map(lambda job: evaluate(*job), jobs):
            results.append(result)
            print(f"{len(results)}/{len(jobs)}: {result.name}, {result.length}, {result.program}", file=sys.stderr)
    for report in options.ours:
        results += read_ours(report)
    if options.json:
        entries = [dataclasses.asdict(result) for result in results]
        options.json.write_text(json.dumps({"results": entries}, indent=1) + "\n")
    print(markdown(results))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("export", type=Path, metavar="DIR", help="what `toposlam evaluate --export DIR` wrote")
    parser.add_argument("--peers", type=_peer_names, default=list(PEERS), help=f"some of {','.join(PEERS | TOLD_WAYS)}")
    parser.add_argument("--paths", type=_positive, help="only the first so many paths of every set")
    parser.add_argument("--lengths", type=_positive, nargs="+", help="only these lengths")
    parser.add_argument("--ours", type=Path, nargs="+", default=[], metavar="FILE", help="JSON of `toposlam evaluate`")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results to this file as well")
    parser.add_argument("--jobs", type=_positive, default=1, help="how many processes run at once")
    return parser


def _peer_names(text: str) -> list[str]:
    names = text.split(",")
    for name in names:
        if name not in PEERS | TOLD_WAYS:
            raise argparse.ArgumentTypeError(f"no peer {name}; there are {', '.join(PEERS | TOLD_WAYS)}")
    return names


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number} is not positive")
    return number


if __name__ == "__main__":
    sys.exit(main())
