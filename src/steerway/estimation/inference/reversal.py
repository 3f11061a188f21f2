"""A structure backwards in time: the same vessel on the opposite course, met from behind.

Stationary processes look the same from either side, but for the signs of rates and of what is athwart; so does a random
walk of which nothing is known. The chain of modes is reversed by its stationary probabilities (J. R. Norris, Markov
Chains, 1997, §1.9). The held rate, which dies away on a held course, would grow backwards without bound; it is replaced
by the stationary process of the same decay and second moment.
"""

from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap_array
from steerway.estimation.course.update.aids import IS_ANGLE, STATE_OF
from steerway.estimation.inference.model import (
    ACTS_ON,
    COMPANION,
    FREQUENCY,
    ON_ANTENNA,
    ON_RATE,
    ON_TIME,
    RATE,
    RATE_DECAY,
    RATE_NOISE,
    STATE,
    VARIANCE,
    Model,
    has_two_states,
)


class Reversal(NamedTuple):
    """A structure backwards in time, and what is known of its states without any fix. Arrays of float64."""

    model: Model
    sign: np.ndarray  # (n,) of every state against that forwards; the course is the opposite one
    share: np.ndarray  # (MODES,) stationary probabilities of the modes
    variance: np.ndarray  # (MODES, n) stationary variance of every state from RATE on


def reversal_of(model: Model, states: int) -> Reversal:
    """The structure backwards in time."""
    generator, rates = model.generator, model.modes
    equations = np.vstack([generator.T, np.ones(len(generator))])
    share = np.linalg.lstsq(equations, np.append(np.zeros(len(generator)), 1.0), rcond=None)[0]
    # second moment of the held rate in every mode, times the mode's probability: noise, decay and changes of mode
    moment = np.linalg.solve(np.diag(2.0 * rates[:, RATE_DECAY]) - generator.T, rates[:, RATE_NOISE] * share)
    rate = moment / share
    modes = rates.copy()
    modes[:, RATE_NOISE] = np.where(rates[:, RATE_DECAY] > 0.0, 2.0 * rates[:, RATE_DECAY] * rate, rates[:, RATE_NOISE])
    sign, variance = np.ones(states), np.full((len(share), states), np.nan)
    sign[RATE], variance[:, RATE] = -1.0, rate
    for row in model.filters:
        first, last = int(row[STATE]), int(row[STATE]) + has_two_states(row)
        variance[:, first : last + 1] = row[VARIANCE]
        if row[ACTS_ON] in (ON_RATE, ON_ANTENNA, ON_TIME):
            sign[first] = -1.0
        if row[FREQUENCY] > 0.0:
            sign[last] = -sign[first]
    for aid, measured in zip(model.aids, STATE_OF, strict=True):
        if measured == RATE and aid[COMPANION] > 0.0:
            sign[int(aid[COMPANION])] = -1.0
    backward = model._replace(modes=modes, generator=generator.T * share / share[:, None])
    return Reversal(backward, sign, share, variance)


def reversed_aids(aids):
    """Aids (n or 0, 5) of the same vessel on the opposite course."""
    turned = np.where(STATE_OF == RATE, -aids, aids)
    return np.where(IS_ANGLE, wrap_array(turned + np.pi), turned)
