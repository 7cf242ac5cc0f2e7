"""Peer: a cloned hidden Markov model, the model of clone-structured cognitive graphs, without actions.

Written from the description in Dedieu et al., "Learning higher-order sequential structure with cloned HMMs" (2019),
and George et al., "Clone-structured graph representations enable flexible learning and vicarious evaluation of
cognitive maps" (2021): every symbol has a fixed number of hidden states, its clones, each of which emits that symbol
only; transitions are learned by expectation maximisation with a pseudocount and then by Viterbi training; the map is
the clones on the most likely path.

Choices: the symbols are the categories of `categories.py`; several numbers of clones are tried from several random
starts each; of all results the one with the best Bayesian information criterion is kept. A clone never follows itself,
except where each symbol has one clone only.
"""

from __future__ import annotations

import numpy

from categories import categorise
from path_map import chain_criterion

CLONES = (1, 2, 3, 4, 6)
RESTARTS = 16
EXPECTATION_MAXIMISATION_ITERATIONS = 100
VITERBI_ITERATIONS = 10
PSEUDOCOUNT = 0.01


def find_path(radii_mm: list[float], seed: int) -> list[int]:
    """The clone at every step, on the most likely path."""
    symbols = categorise(radii_mm, seed)
    return find_clones(symbols, [0] * (len(symbols) - 1), seed)


def find_clones(symbols: list[int], actions: list[int], seed: int) -> list[int]:
    """The clone at every step, on the most likely path. The action of a step leads from its symbol to the next."""
    random_numbers = numpy.random.default_rng(seed)
    candidates = [path for clones in CLONES for path in _ClonedModel(symbols, actions, clones, random_numbers).train()]
    # The first of several that are equally good.
    return max(candidates, key=chain_criterion)


class _ClonedModel:
    """All restarts of one number of clones, trained side by side.

    The transition matrix of restart r from the clones of one symbol by one action to those of another is
    `blocks[pair, r]`, with a block only for what occurs. The first axis of `forward` and `backward` is the step.
    """

    def __init__(
        self, symbols: list[int], actions: list[int], clones: int, random_numbers: numpy.random.Generator
    ) -> None:
        self.symbols = symbols
        self.clones = clones
        steps = list(zip(symbols, actions, symbols[1:]))
        pairs = sorted(set(steps))
        number_of_pair = {pair: number for number, pair in enumerate(pairs)}
        self.step_pairs = numpy.array([number_of_pair[step] for step in steps], dtype=int)
        leaves = sorted({(start, action) for start, action, _ in pairs})
        self.leaves = len(leaves)
        self.pair_starts = numpy.array([leaves.index((start, action)) for start, action, _ in pairs], dtype=int)
        self.allowed = numpy.ones((len(pairs), 1, clones, clones))
        for number, (start, _, end) in enumerate(pairs):
            if start == end and clones > 1:
                self.allowed[number, 0] -= numpy.eye(clones)
        counts = random_numbers.random((len(pairs), RESTARTS, clones, clones))
        self.blocks = self._normalised(counts * self.allowed)

    def train(self) -> list[list[int]]:
        """The path of every restart."""
        if len(self.symbols) < 2:
            return [[0] * len(self.symbols)]
        for _ in range(EXPECTATION_MAXIMISATION_ITERATIONS):
            self.blocks = self._normalised((self._expected_counts() + PSEUDOCOUNT) * self.allowed)
        path = self._most_likely_clones()
        for _ in range(VITERBI_ITERATIONS):
            self.blocks = self._normalised((self._path_counts(path) + PSEUDOCOUNT) * self.allowed)
            last_path, path = path, self._most_likely_clones()
            if numpy.array_equal(last_path, path):
                break
        states = numpy.array(self.symbols)[:, None] * self.clones + path
        return [states[:, restart].tolist() for restart in range(RESTARTS)]

    def _normalised(self, counts: numpy.ndarray) -> numpy.ndarray:
        """Divides the counts by the sum over all that may follow a clone by an action, whatever its symbol."""
        totals = numpy.zeros((self.leaves, RESTARTS, self.clones))
        numpy.add.at(totals, self.pair_starts, counts.sum(axis=3))
        return counts / numpy.maximum(totals[self.pair_starts][..., None], numpy.finfo(float).tiny)

    def _expected_counts(self) -> numpy.ndarray:
        """How often each transition is taken, expected over all paths."""
        steps = len(self.step_pairs)
        forward = numpy.empty((steps + 1, RESTARTS, self.clones))
        backward = numpy.empty_like(forward)
        forward[0] = 1 / self.clones
        for step, pair in enumerate(self.step_pairs):
            message = numpy.matmul(forward[step][:, None, :], self.blocks[pair])[:, 0, :]
            forward[step + 1] = message / message.sum(axis=1, keepdims=True)
        backward[steps] = 1 / self.clones
        for step in range(steps - 1, -1, -1):
            message = numpy.matmul(self.blocks[self.step_pairs[step]], backward[step + 1][:, :, None])[:, :, 0]
            backward[step] = message / message.sum(axis=1, keepdims=True)
        taken = forward[:-1, :, :, None] * self.blocks[self.step_pairs] * backward[1:, :, None, :]
        taken /= taken.sum(axis=(2, 3), keepdims=True)
        counts = numpy.zeros_like(self.blocks)
        numpy.add.at(counts, self.step_pairs, taken)
        return counts

    def _most_likely_clones(self) -> numpy.ndarray:
        """The clone, numbered within its symbol, of every step and restart."""
        with numpy.errstate(divide="ignore"):
            log_blocks = numpy.log(self.blocks)
        steps = len(self.step_pairs)
        came_from = numpy.empty((steps, RESTARTS, self.clones), dtype=int)
        best = numpy.zeros((RESTARTS, self.clones))
        for step, pair in enumerate(self.step_pairs):
            ways = best[:, :, None] + log_blocks[pair]
            came_from[step] = ways.argmax(axis=1)
            best = ways.max(axis=1)
        path = numpy.empty((steps + 1, RESTARTS), dtype=int)
        path[steps] = best.argmax(axis=1)
        restarts = numpy.arange(RESTARTS)
        for step in range(steps - 1, -1, -1):
            path[step] = came_from[step, restarts, path[step + 1]]
        return path

    def _path_counts(self, path: numpy.ndarray) -> numpy.ndarray:
        counts = numpy.zeros_like(self.blocks)
        where = self.step_pairs[:, None], numpy.arange(RESTARTS)[None, :], path[:-1], path[1:]
        numpy.add.at(counts, where, 1.0)
        return counts
