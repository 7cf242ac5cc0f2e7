"""Runs one peer in a process of its own and measures its time and its memory.

`python3 measure.py` is that process: it reads a request (JSON) from its standard input and answers on its standard
output. Time is processor time on one thread, which other work on the machine disturbs less than wall-clock time does.
Memory is the largest resident size of the process, and how much of that came after the imports.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from observations import Ways

PEERS = {"hmmlearn": "peer_hmmlearn", "alergia": "peer_alergia", "chmm": "peer_cloned_hmm"}
"""The module of every peer. Each has `find_path(radii_mm, seed)`, which returns a state for every radius."""

TOLD_WAYS = {"chmm-actions": "peer_action_chmm"}
"""The module of every peer whose input includes the ways: `find_path(radii_mm, seed, ways)`."""

ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


@dataclass(frozen=True)
class Measurement:
    """What one process found for several paths, in their order."""

    paths: tuple[tuple[int | str, ...], ...]
    """The states of every path."""
    seconds: tuple[float, ...]
    """The processor time of every path."""
    peak_mebibytes: float
    """The largest resident size of the process, the Python libraries included."""
    working_mebibytes: float
    """How much larger that is than before the first path."""


def measure(
    peer: str,
    radii_mm: Sequence[Sequence[float]],
    seeds: Sequence[int],
    ways: Sequence[Sequence[Ways]] | None = None,
) -> Measurement:
    """Runs a peer on several paths, one after the other, each with its own seed. `ways` are for a peer whose input includes them."""
    request = {"peer": peer, "radii_mm": [list(path) for path in radii_mm], "seeds": list(seeds)}
    if ways is not None:
        request["ways"] = [[(place.others_mrad, place.exit_mrad) for place in path] for path in ways]
    done = subprocess.run(
        [sys.executable, __file__],
        input=json.dumps(request),
        capture_output=True,
        text=True,
        env=os.environ | ONE_THREAD,
    )
    if done.returncode != 0:
        raise RuntimeError(f"{peer} failed:\n{done.stderr}")
    answer = json.loads(done.stdout)
    return Measurement(
        tuple(tuple(path) for path in answer["paths"]),
        tuple(answer["seconds"]),
        answer["peak_mebibytes"],
        answer["working_mebibytes"],
    )


def _peak_mebibytes() -> float:
    # Linux counts the parent's size in `ru_maxrss` too, so its own record of this process alone comes first.
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return largest / (1024 * 1024) if sys.platform == "darwin" else largest / 1024


def _answer(request: dict) -> dict:
    peer = importlib.import_module((PEERS | TOLD_WAYS)[request["peer"]])
    before = _peak_mebibytes()
    paths, seconds = [], []
    told = [
        [[Ways(tuple(others_mrad), exit_mrad) for others_mrad, exit_mrad in path]] for path in request.get("ways", [])
    ] or [[] for _ in request["seeds"]]
    for radii_mm, seed, ways in zip(request["radii_mm"], request["seeds"], told, strict=True):
        start = time.process_time()
        paths.append(peer.find_path(radii_mm, seed, *ways))
        seconds.append(time.process_time() - start)
    peak = _peak_mebibytes()
    return {"paths": paths, "seconds": seconds, "peak_mebibytes": peak, "working_mebibytes": peak - before}


if __name__ == "__main__":
    # What a library prints must not get into the answer.
    with contextlib.redirect_stdout(sys.stderr):
        answer = _answer(json.load(sys.stdin))
    json.dump(answer, sys.stdout)
