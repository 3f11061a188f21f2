"""The profile that suits a log: vessel class and receiver quality, found from the fixes themselves.

The built-in motions are tried on fixes at least a second apart (see `tuning` for why), the likeliest is fitted from
there, and then the receiver whose noise makes all fixes likeliest is added. What a log cannot tell stays as the class
has it. A log without way tells little more than the receiver, and nothing is fitted to it.
"""

import math
from functools import partial

import numpy as np

from steerway.estimation.fitting import FURTHER, MOTION, minimise, moving, thinned
from steerway.estimation.likelihood import cost
from steerway.estimation.profiles import BUILT_IN, Profile
from steerway.records import Fixes

_STRETCHES, _STRETCH = 5, 1000
_LEAST_SHARE = 0.1
_FEWEST_FIXES = 60
_WHITE = (0.005, 0.02, 0.05, 0.15, 0.5, 1.5, 5.0, 15.0)
_SLOW = ((0.15, 4.0), (0.5, 20.0), (1.5, 100.0))
_EVALUATIONS = 200
_SPACING = 1.0


def suited(fixes: Fixes) -> Profile:
    """The profile under which `fixes` are most likely, starting from the built-in ones.

    Reports of many vessels (AIS) have a profile of their own.
    """
    if fixes.mmsi is not None:
        return BUILT_IN["ais"]
    vessels = [each for each in BUILT_IN.values() if each.name != "ais"]
    sample = _sample(fixes.rows(fixes.has_position).in_order())
    under_way = moving(sample)
    if under_way.sum() < max(_FEWEST_FIXES, _LEAST_SHARE * len(sample)):
        return min((_with_receiver(each, sample, None) for each in vessels), key=lambda each: cost(each, sample))
    apart = thinned(sample.time, _SPACING)
    motion_cost = partial(cost, fixes=sample.rows(apart), counted=under_way[apart])
    candidates = [
        each.model_copy(update={"position_std": white, "error_std": 0.0}) for each in vessels for white in _WHITE
    ]
    start = min(candidates, key=motion_cost)
    further = [name for name in FURTHER if getattr(start, name)]
    fitted, _ = minimise(motion_cost, start, (*MOTION, *further), start.model_dump(), _EVALUATIONS)
    white = fitted.position_std * math.sqrt(len(sample) / len(apart))
    return _with_receiver(fitted.model_copy(update={"position_std": white}), sample, under_way)


def _with_receiver(motion: Profile, sample: Fixes, counted) -> Profile:
    """The motion with the likeliest noise of fixes: as fitted, of the table, or with a slow part."""
    whites = [motion.position_std * share for share in (0.5, 0.7, 1.0, 1.4)] if counted is not None else _WHITE
    receivers = [(white, 0.0, 60.0) for white in whites]
    smallest = [0.05] if counted is None else [0.05, 0.5 * motion.position_std]
    receivers += [(white, slow, time) for white in smallest for slow, time in _SLOW]
    candidates = [_named(motion, *receiver) for receiver in receivers]
    return min(candidates, key=lambda each: cost(each, sample, counted))


def _named(motion, white, slow, time):
    wander = f" and {slow:g} m over {time:g} s" if slow else ""
    name = f"{motion.name}, fixes with {white:.2g} m{wander} of noise"
    return motion.model_copy(update={"name": name, "position_std": white, "error_std": slow, "error_time": time})


def _sample(fixes: Fixes) -> Fixes:
    """Stretches from all over the record, those most under way, as tracks of their own."""
    count = len(fixes) // _STRETCH
    if count <= _STRETCHES:
        return fixes
    sailed = moving(fixes)[: count * _STRETCH].reshape(count, _STRETCH).sum(axis=1)
    busy = np.flatnonzero(sailed >= 0.5 * np.sort(sailed)[-_STRETCHES])
    chosen = busy[np.linspace(0, len(busy) - 1, _STRETCHES).round().astype(int)]
    rows = np.concatenate([np.arange(k * _STRETCH, (k + 1) * _STRETCH) for k in chosen])
    sample = fixes.rows(rows)
    return Fixes(sample.time, sample.latitude, sample.longitude, mmsi=np.repeat(np.arange(_STRETCHES), _STRETCH))
