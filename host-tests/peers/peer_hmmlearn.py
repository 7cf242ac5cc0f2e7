"""Peer: a hidden Markov model with Gaussian emissions (hmmlearn), its states taken for the places of the map.

Choices, all in favour of the peer:

- The states never follow themselves: a robot that arrives at a place has left another one, and toposlam knows that too.
- For every number of states several random starts: half of them with means on random radii, half on k-means centres.
- The number of states is chosen by the Bayesian information criterion, but only transitions that the model uses count
  as parameters. With all K (K - 1) of them counted, as `GaussianHMM.bic` does, far too few states are chosen.
- A weak prior on the variance, with the first guess that toposlam starts from, keeps states from shrinking onto single
  radii. Of three pairs of deviation and weight tried on eight paths, this gave the most exact maps.
"""

from __future__ import annotations

import logging
import math
import warnings

import numpy
from hmmlearn.hmm import GaussianHMM
from sklearn.cluster import KMeans

MIN_STATES = 2
MAX_STATES = 32
PATIENCE = 4
"""The search ends when this many larger numbers of states in a row were no better."""
RESTARTS = 8
ITERATIONS = 100
PRIOR_DEVIATION_MM = 30.0
PRIOR_WEIGHT = 4.0
"""The prior deviation counts as much as this many radii."""
USED_TRANSITION = 1e-3
"""A transition less likely than this is no parameter of the model."""


def find_path(radii_mm: list[float], seed: int) -> list[int]:
    """The state of the model at every step, on the most likely path."""
    random_numbers = numpy.random.default_rng(seed)
    column = numpy.asarray(radii_mm, dtype=float)[:, None]
    best_criterion, best_path, since_better = -math.inf, [0] * len(column), 0
    for states in range(MIN_STATES, min(MAX_STATES, len(column)) + 1):
        since_better += 1
        for restart in range(RESTARTS):
            model = _fit(column, states, restart % 2 == 1, random_numbers)
            criterion = _criterion(model, column)
            if criterion > best_criterion:
                best_criterion, best_path, since_better = criterion, model.predict(column).tolist(), 0
        if since_better >= PATIENCE:
            break
    return best_path


def _fit(
    column: numpy.ndarray, states: int, cluster_means: bool, random_numbers: numpy.random.Generator
) -> GaussianHMM:
    model = GaussianHMM(
        states,
        covars_prior=PRIOR_WEIGHT * PRIOR_DEVIATION_MM**2,
        # hmmlearn divides by the number of radii plus this less one.
        covars_weight=PRIOR_WEIGHT + 1,
        # No state is left without a way out, as one would be that is visited last only.
        transmat_prior=1 + 1e-6,
        n_iter=ITERATIONS,
        init_params="",
    )
    transitions = random_numbers.dirichlet(numpy.ones(states), size=states)
    # Expectation maximisation keeps a zero a zero.
    numpy.fill_diagonal(transitions, 0.0)
    model.transmat_ = transitions / transitions.sum(axis=1, keepdims=True)
    model.startprob_ = numpy.full(states, 1 / states)
    model.covars_ = numpy.full((states, 1), PRIOR_DEVIATION_MM**2)
    # It reports fits that did not converge and states that no radius belongs to; both simply lose to other fits.
    logging.getLogger("hmmlearn").setLevel(logging.CRITICAL)
    with warnings.catch_warnings():
        # There may be more states than different radii.
        warnings.simplefilter("ignore")
        if cluster_means:
            clusters = KMeans(states, n_init=1, random_state=int(random_numbers.integers(2**31)))
            model.means_ = clusters.fit(column).cluster_centers_
        else:
            model.means_ = random_numbers.choice(column[:, 0], states, replace=False)[:, None]
        model.fit(column)
    return model


def _criterion(model: GaussianHMM, column: numpy.ndarray) -> float:
    """The negative Bayesian information criterion; of two models the larger is the better."""
    used_transitions = int((model.transmat_ > USED_TRANSITION).sum())
    # A mean and a variance for each state; the transitions of each state add up to one.
    parameters = used_transitions - model.n_components + 2 * model.n_components
    log_likelihood = model.score(column)
    if not math.isfinite(log_likelihood):
        return -math.inf
    return 2 * log_likelihood - parameters * math.log(len(column))
