"""A model backwards in time: a vessel that sails the track from its end, on the opposite course.

Stationary processes, and random walks with an unknown start, are the same backwards, except that rates and
displacements athwart change their sign. The chain of modes is reversed by its stationary probabilities (J. R. Norris,
Markov Chains, 1997, §1.9). The held rate, which decays on a held course, would grow backwards without bound. It is
replaced by a stationary process of the same decay, see _LEFT_BY_TURNS.
"""

from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats, Ints, Records
from steerway.estimation.filter.model import ON_ACCELERATION, ON_ANTENNA, ON_RATE, RATE, SPEED, Model, has_two_states
from steerway.estimation.vessel.aids import IS_ANGLE, STATE_OF

_LEFT_BY_TURNS = 0.1
"""Factor on the second moment of the rate on a held course, for the backward filter. Nearly all of that moment stems
from the short time after turns; at other times it would let the course wander. With 1, errors in scenes are 6 % larger
for smoothed courses and 2 % for rates; with 0.003, they are 3 % larger for rates. If the factor is applied to speed
manoeuvres too, emergency stops are estimated worse."""
_ANY_RATE = 1.0
"""Second moment, rad²/s², of a rate that is a random walk in all modes: (57 °/s)²."""


class Reversal(NamedTuple):
    """A model backwards in time, and the prior of its states without any fix."""

    model: Model
    sign: Floats  # (n,) factor from a state forwards to the same state backwards; the course turns by π besides
    share: Floats  # (m,) stationary probabilities of the modes
    variance: Floats  # (m, n) stationary variance of every state, infinite for a random walk
    is_normal: bool  # whether the held rate of a mode is a stationary process of its own, see `smoother.inform`
    kind: Ints  # (m,) first mode of the same motion; modes of one kind differ by their age alone


def reversal_of(model: Model) -> Reversal:
    """The model backwards in time."""
    generator, modes, states = model.generator, model.modes.copy(), model.states
    equations = np.vstack([generator.T, np.ones(len(generator))])
    share = np.linalg.lstsq(equations, np.append(np.zeros(len(generator)), 1.0), rcond=None)[0]
    kind = _kinds(modes)
    is_normal = len(kind) == 1 or len(set(kind)) < len(kind)
    noise, decay = modes["rate_noise"], modes["rate_decay"]
    held = decay > 0.0
    # stationary balance of noise, decay and changes of mode, for the second moment of the held rate times `share`
    lasting = np.diag(2.0 * decay) - generator.T
    rate = np.linalg.solve(lasting, noise * share) / share if lasting.any() else np.full(1, _ANY_RATE)
    if len(set(kind)) == len(kind):
        calm = held & (modes["manoeuvres"] == 0)
        rate[calm] = np.maximum(_LEFT_BY_TURNS * rate[calm], 0.5 * noise[calm] / decay[calm])
        noise[held] = 2.0 * decay[held] * rate[held]
        reversed_ = generator.T * share / share[:, None]
    else:  # ages count from the end of the record, and two kinds of mode that alternate do so backwards too
        reversed_ = generator
    modes["start"] = share
    sign, variance = np.ones(states), np.full((len(share), states), np.inf)
    decays = modes["speed_decay"] > 0.0
    variance[decays, SPEED] = 0.5 * modes["speed_noise"][decays] / modes["speed_decay"][decays]
    sign[RATE], variance[:, RATE] = -1.0, rate
    for process in model.processes:
        begin, acts_on, frequency = process.state, process.acts_on, process.frequency
        last = begin + has_two_states(acts_on, frequency)
        variance[:, begin : last + 1] = process.variance
        if acts_on in (ON_RATE, ON_ANTENNA, ON_ACCELERATION):
            sign[begin] = -1.0
        if frequency > 0.0:
            sign[last] = -sign[begin]
    for aid, measured in zip(model.aids, STATE_OF, strict=True):
        if measured == RATE and aid.companion > 0:
            sign[aid.companion] = -1.0
    reversed_ = np.ascontiguousarray(reversed_)  # otherwise every kernel is compiled for its layout too
    return Reversal(model._replace(modes=modes, generator=reversed_), sign, share, variance, is_normal, kind)


def _kinds(modes: Records) -> Ints:
    """For every mode, the first one of the same motion (m,)."""
    motions = modes.copy()
    motions["start"] = 0.0
    alike = [each.tobytes() for each in motions]
    return np.array([alike.index(each) for each in alike])


def reversed_aids(aids: Floats) -> Floats:
    """Aids of the vessel going backwards, on the opposite course; a table of n rows or none."""
    turned = np.where(STATE_OF == RATE, -aids, aids)
    return np.where(IS_ANGLE, wrap_array(turned + np.pi), turned)
