"""Turns radii into symbols for the peers that need a finite alphabet, from the path's own radii alone.

A Gaussian mixture in one dimension with as many components as the Bayesian information criterion asks for.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy
from sklearn.mixture import GaussianMixture

MAX_CATEGORIES = 24
RESOLUTION_MM = 2.0
"""Radii are rounded to this step; no component is narrower."""


def categorise(radii_mm: Sequence[float], seed: int) -> list[int]:
    """The category of every radius, numbered from the smallest mean radius to the largest."""
    column = numpy.asarray(radii_mm, dtype=float)[:, None]
    distinct = len(numpy.unique(column))
    if distinct == 1:
        return [0] * len(column)
    fits = []
    for components in range(1, min(MAX_CATEGORIES, distinct) + 1):
        mixture = GaussianMixture(components, n_init=3, reg_covar=RESOLUTION_MM**2, random_state=seed)
        mixture.fit(column)
        fits.append((mixture.bic(column), components, mixture))
    best = min(fits, key=lambda fit: fit[:2])[2]
    found = best.predict(column)
    # Only the components that hold a radius are symbols.
    used = sorted(set(found.tolist()), key=lambda component: best.means_[component, 0])
    numbers = {component: number for number, component in enumerate(used)}
    return [numbers[component] for component in found.tolist()]
