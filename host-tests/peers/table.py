"""The results as lines of one Markdown table, peers and toposlam side by side."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


OURS = "toposlam"


@dataclass(frozen=True)
class Result:
    """The means over all paths of one set, one length and one program. Shares lie between 0 and 1."""

    name: str
    length: int
    program: str
    paths: int
    exact: float
    isomorphic: float
    edge_f1: float
    location_smoothed: float
    seconds_per_path: float
    peak_mebibytes: float | None
    working_mebibytes: float | None
    """Without what the interpreter and the libraries take; `None` where it was not measured."""


def read_ours(report: Path) -> list[Result]:
    """The results in what `toposlam evaluate` printed: its `rows`, or the `environments` of its first version.

    Its time is for one place and is counted here for the whole path, as a peer starts anew with every path. What it was
    told besides radii is said in the name, for the peers are not told it.
    """
    printed = json.loads(report.read_text())
    settings = printed.get("settings", {})
    results = []
    for entry in printed["rows"] if "rows" in printed else printed["environments"]:
        program = f"toposlam {entry['filter']}"
        for told in ("hints", "prior"):
            value = settings.get(told, entry.get(told, "none"))
            if value != "none":
                program += f", {told} {value}"
        results.append(
            Result(
                entry["name"],
                entry["length"],
                program,
                entry["paths"],
                entry["exact"],
                entry["isomorphic"],
                entry["edge_f1"],
                entry["location_smoothed"],
                entry.get("prior_seconds", 0.0) + entry["seconds_per_place"] * entry["length"],
                None,
                None,
            )
        )
    return results


def markdown(results: Sequence[Result]) -> str:
    """The table: the sets in the order they first appear in, then by length; within those, the order given.

    The ratio of the processor times is that of a peer to toposlam.
    """
    heads = "set | T | program | paths | exact | isomorphic | edge F1 | smoothed | s/path | ratio | peak MiB | working MiB"
    lines = [f"| {heads} |", "|" + "---|" * (heads.count("|") + 1)]
    names = list(dict.fromkeys(result.name for result in results))
    ours = {(result.name, result.length): result for result in results if result.program.startswith(OURS)}
    for result in sorted(results, key=lambda result: (names.index(result.name), result.length)):
        cells = [result.name, str(result.length), result.program, str(result.paths)]
        cells += [f"{result.exact:.3f}", f"{result.isomorphic:.3f}"]
        cells += [f"{result.edge_f1:.3f}", f"{result.location_smoothed:.3f}", f"{result.seconds_per_path:.2g}"]
        one = ours.get((result.name, result.length))
        is_peer = one is not None and not result.program.startswith(OURS) and one.seconds_per_path > 0
        cells.append(f"{result.seconds_per_path / one.seconds_per_path:.0f}" if is_peer else "-")
        for mebibytes in (result.peak_mebibytes, result.working_mebibytes):
            cells.append("-" if mebibytes is None else f"{mebibytes:.0f}")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)
