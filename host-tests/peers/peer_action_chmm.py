"""Peer: a cloned hidden Markov model with actions, with the input of the ordered filter except travel times.

As `peer_cloned_hmm.py`, with two additions. A symbol is the category of the radius and the number of ways seen. The
action of a step is the exit: the number of the way by which the robot left, counter-clockwise from the way by which it
came, or unknown. Transitions are learned for each action (George et al., 2021).

An exit counts from the way by which the robot came, so a state is a place together with that way. Two states are one
place if the robot came back to the second one from where it had driven from the first one: they are united along the
path, before the map is judged.
"""

from __future__ import annotations

from collections import Counter

from categories import categorise
from observations import Ways
from peer_cloned_hmm import find_clones

BACK = 0
UNKNOWN = -1
LEAST_TURNS = 2
"""Clones are united if the robot turned back between them this often: a single turn may be a wrong report."""


def find_path(radii_mm: list[float], seed: int, ways: list[Ways]) -> list[int]:
    """The place at every step: the clones on the most likely path, united."""
    seen = list(zip(categorise(radii_mm, seed), (len(place.others_mrad) for place in ways)))
    numbers = {symbol: number for number, symbol in enumerate(sorted(set(seen)))}
    actions = [_exit(before, after.exit_mrad) for before, after in zip(ways, ways[1:])]
    clones = find_clones([numbers[symbol] for symbol in seen], actions, seed)
    return _places(clones, actions)


def _exit(place: Ways, exit_mrad: float | None) -> int:
    """The number of the way that is nearest to the exit; 0 for back."""
    if exit_mrad is None:
        return UNKNOWN
    turn = 6283.185
    bearings = [0.0, *sorted(bearing % turn for bearing in place.others_mrad)]
    off = [abs((bearing - exit_mrad + turn / 2) % turn - turn / 2) for bearing in bearings]
    return off.index(min(off))


def _places(clones: list[int], actions: list[int]) -> list[int]:
    """Unites the clones that are one place because the robot turned back between them."""
    parent = {clone: clone for clone in clones}

    def find(clone: int) -> int:
        while parent[clone] != clone:
            clone = parent[clone]
        return clone

    turns = Counter(
        (first, last) for first, last, action in zip(clones, clones[2:], actions[1:]) if action == BACK
    )
    for (first, last), count in turns.items():
        if count >= LEAST_TURNS:
            parent[find(last)] = find(first)
    return [find(clone) for clone in clones]
