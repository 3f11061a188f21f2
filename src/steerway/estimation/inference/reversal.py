"""A structure backwards in time: the same vessel on the opposite course, met from behind.

Stationary processes look the same from either side, but for the signs of rates and of what is athwart; so does a random
walk of which nothing is known. The chain of modes is reversed by its stationary probabilities (J. R. Norris, Markov
Chains, 1997, §1.9). The held rate, which dies away on a held course, would grow backwards without bound; it is replaced
by a stationary process of the same decay, see _LEFT_BY_TURNS.
"""

from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap_array
from steerway.estimation.course.update.aids import IS_ANGLE, STATE_OF
from steerway.estimation.inference.model import (
    ACTS_ON,
    CALM,
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

_LEFT_BY_TURNS = 0.1
"""Part of the second moment of the rate on a held course that it has backwards. Nearly all of that moment is left by
turns, in the few moments after them; at all others it would let the course wander. Chosen: with 1 smoothed courses of
scenes are off by 6 % more and rates by 2 %, with 0.003 rates by 3 %. With less in a speed manoeuvre too, an emergency
stop is smoothed worse."""


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
    modes, rate, decay = rates.copy(), moment / share, rates[:, RATE_DECAY]
    held = decay > 0.0
    rate[CALM] = max(_LEFT_BY_TURNS * rate[CALM], 0.5 * rates[CALM, RATE_NOISE] / decay[CALM])
    modes[held, RATE_NOISE] = 2.0 * decay[held] * rate[held]
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
    reversed_ = np.ascontiguousarray(generator.T * share / share[:, None])  # else all is compiled for its layout too
    backward = model._replace(modes=modes, generator=reversed_)
    return Reversal(backward, sign, share, variance)


def reversed_aids(aids):
    """Aids (n or 0, 5) of the same vessel on the opposite course."""
    turned = np.where(STATE_OF == RATE, -aids, aids)
    return np.where(IS_ANGLE, wrap_array(turned + np.pi), turned)
