"""The declared parts: what a vessel and its receiver may be made of, an entry of `PARTS` each.

A part has the weak priors of its numbers, the shaping filters by which it enters the model, values from which the
search for them begins, and words. Numbers are fitted as logarithms, with normal priors. One deviation of 1 is a factor
of 2.7 either way: about what vessels of one kind differ by; 1.5 and more span dinghies and ships. Chosen for craft from
2 m to ships and receivers as they are sold. Judged by `steerway study unseen-logs`.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from steerway.estimation.filter.model import ON_AID, ON_ANTENNA, ON_COURSE, ON_FIX, ON_RATE, ON_SPEED
from steerway.estimation.vessel.aids import TABLE, Aid

Parts = tuple[str, ...]
"""A structure: names of `PARTS`."""
Values = dict[str, float]
"""Numbers of a structure by their names; SI."""
Stage = dict[str, tuple[float, ...]]
"""Values of some numbers to be tried, all with all."""

_DEG = math.pi / 180.0
LONGEST_ROLL = 4.0
"""s; what takes longer of craft under 15 m is their way through waves: one more oscillation athwart, with the period of
the waves, would be taken for the antenna's. And a yaw that takes less, beside an antenna that rolls, for a course."""
_SHORTEST_WAVE = 2.0
"""s; waves of a shorter period are shorter than 6 m (g T²/2π) and move no vessel to and fro."""
_WAVE = 3.0
"""s: a line across of a shorter period is looked for in the antenna first, and yaw begins from longer ones, or where
there is none from unknown ones. Chosen: with all lines a roll of 2.5 s is fitted as a yaw of the vessel, 1,100 of log
evidence below it. Surge begins from all that waves and strokes of oars may have."""
_SHORTEST_STAY = 2.5
"""Shortest periods that fixes resolve (five intervals) from one step of a receiver's error to the next on average: what
changes oftener is noise. Chosen: in recorded logs of receivers that step it is 9 to 100 intervals."""
_SEEN = 0.3
"""Last digits of a written fix that a step has at least: a smaller one hardly shows. Chosen: with any, the
smoothed SOG of a boat in a record ten digits long is off by a sixth, with a σ far below; with 0.1 that of boats that
drift by twice as much as without steps."""
UNKNOWN_PERIODS = (2.5, 4.0, 7.0, 12.0, 20.0)
"""s, where a record does not tell them: about a factor of 1.7 apart."""


class Prior(NamedTuple):
    """Prior of a number: median, deviation of its logarithm, and between what it is sought."""

    median: float
    deviation: float
    least: float = 0.0
    most: float = math.inf
    periods: float = 0.0
    """Its least value in shortest periods that the fixes resolve."""
    digits: float = 0.0
    """Its least value in last digits of a written fix."""


class Filter(NamedTuple):
    """A shaping filter by the names of its numbers: standard deviation and time constant, or period and damping."""

    acts_on: int
    std: str
    time: str
    damping: str | None = None


class Scales(NamedTuple):
    """What a record tells before any fit."""

    noise: float
    """m, of a fix by third differences."""
    shortest: float
    """s, the shortest period that the fixes resolve."""
    along: tuple[float, ...]
    across: tuple[float, ...]
    """s, periods that stand out along and across the track, the strongest first."""

    def sizes(self, largest: float) -> tuple[float, ...]:
        """Sizes of a receiver's error to be tried (m), from its noise to that of a receiver alone."""
        return self.noise, math.sqrt(self.noise * largest), largest

    def rolls(self) -> tuple[float, ...]:
        """Periods of an antenna that rolls to be tried (s)."""
        return tuple(period for period in self.across if period < LONGEST_ROLL) or (2.0, 3.0)


class Part(NamedTuple):
    """What may be in a structure."""

    priors: dict[str, Prior]
    words: str
    filters: tuple[Filter, ...] = ()
    begin: Callable[[Scales, Values], list[Stage]] | None = None
    """Where to begin the search, by the scales of a record and the numbers without the part: values of each number, all
    with all; stage by stage, each from the likeliest before. No stage where a record shows no sign of the part."""
    share: float = 0.5
    """Share of records that have it, before they are seen."""
    only_with: str = ""
    """Part without which it is not tried."""

    def resolved(self, shortest: float) -> bool:
        """Whether fixes that resolve periods from `shortest` (s) on resolve this part's, as long as those may be: two
        prior deviations above their medians."""
        longest = {name: prior.median * math.exp(2.0 * prior.deviation) for name, prior in self.priors.items()}
        return all(prior.periods * shortest < longest[name] for name, prior in self.priors.items())


def _half(values: Values, name: str, *others: float) -> tuple[float, ...]:
    """A number as it is, half of it where the part takes over what it explained, and others."""
    return values[name], 0.5 * values[name], *others


def _longer(periods: tuple[float, ...], least: float) -> tuple[float, ...]:
    """Those of the periods that are longer than `least`, else those that are tried where a record shows none."""
    unknown = tuple(period for period in UNKNOWN_PERIODS if period > _WAVE)
    return tuple(period for period in periods if period > least) or unknown


def _waves(scales: Scales, values: Values) -> list[Stage]:
    along, across = _longer(scales.along, _SHORTEST_WAVE), _longer(scales.across, _WAVE)
    surge = {"surge_period": along, "wave_surge": (0.005, 0.05, 0.2), "wave_yaw": (0.01,)}
    yaw = {"yaw_period": across, "wave_yaw": (0.005, 0.03, 0.1)}
    return [
        {"speed_std": (values["speed_std"], 0.01)} | surge,
        {"wander_std": (values["wander_std"], 0.003)} | yaw,
    ]


def _of_aid(aid: Aid) -> Part:
    priors = {name: Prior(*prior) for name, prior in aid.priors.items()}
    _, *companion = aid.priors
    return Part(priors, aid.words, (Filter(ON_AID, *companion),) if companion else ())


PARTS = {
    "base": Part(
        {
            "fix_std": Prior(0.3, 2.0),  # m, white part of a fix
            "poor_rate": Prior(0.003, 1.5),  # share of fixes with much larger noise
            "late_std": Prior(0.03, 1.2),  # s, of the moment of such a fix
            "outlier_rate": Prior(0.001, 1.2),  # share of fixes that are off by any distance
            "speed_walk": Prior(0.004, 1.5),  # m/s per √s, held speed
            "yaw_size": Prior(6.0 * _DEG, 1.5),  # rad/s, change of course rate in a yaw manoeuvre
            "yaw_time": Prior(2.0, 1.2),  # s, how long it lasts
            "yaw_every": Prior(100.0, 2.0),  # s between them
            "yaw_slip": Prior(0.02, 1.5),  # m/s per √s, held speed in a yaw manoeuvre
            "turn_walk": Prior(0.3 * _DEG, 1.5),  # rad/s per √s, course rate in a steady turn
            "turn_time": Prior(30.0, 2.0),  # s, how long a steady turn lasts
            "rate_time": Prior(0.8, 1.0),  # s, in which the course rate dies away on a held course
            "surge_size": Prior(1.0, 1.5),  # m/s, change of speed in a speed manoeuvre
            "surge_time": Prior(4.0, 1.2),  # s
            "surge_every": Prior(200.0, 1.5),  # s
            "emergency_every": Prior(1e4, 2.0),  # s
            "drift_speed": Prior(0.2, 1.0),  # m/s, below which a vessel is pushed about in any direction
        },
        "fixes with {fix_std:.2g} m of noise",
    ),
    "wander": Part(
        {
            "speed_std": Prior(0.03, 1.5),  # m/s about the held speed
            "speed_time": Prior(6.0, 1.0),  # s
            "wander_std": Prior(0.5 * _DEG, 1.5),  # rad/s about the held course rate
            "wander_time": Prior(3.0, 1.0),  # s
        },
        "speed varying by {speed_std:.2g} m/s and course rate by {wander_std:.2g}°/s",
        (Filter(ON_SPEED, "speed_std", "speed_time"), Filter(ON_RATE, "wander_std", "wander_time")),
    ),
    "waves": Part(
        {
            "wave_surge": Prior(0.15, 1.2),  # m/s
            "surge_period": Prior(9.0, 0.8, _SHORTEST_WAVE, periods=1.0),  # s
            "wave_yaw": Prior(3.0 * _DEG, 1.2),  # rad
            "yaw_period": Prior(12.0, 0.8, _SHORTEST_WAVE, periods=1.0),  # s
            "surge_damping": Prior(0.06, 1.2),  # as a share of critical damping
            "yaw_damping": Prior(0.06, 1.2),
        },
        "waves: {wave_surge:.2g} m/s every {surge_period:.2g} s, {wave_yaw:.2g}°/s every {yaw_period:.2g} s",
        (
            Filter(ON_SPEED, "wave_surge", "surge_period", "surge_damping"),
            Filter(ON_COURSE, "wave_yaw", "yaw_period", "yaw_damping"),
        ),
        _waves,
    ),
    "antenna": Part(
        {
            "antenna_std": Prior(0.1, 1.2),  # m athwart
            "antenna_period": Prior(2.5, 0.25, most=LONGEST_ROLL, periods=1.0),  # s; craft under 15 m roll in 2 to 4 s
            "antenna_damping": Prior(0.03, 1.2),
        },
        "antenna rolling {antenna_std:.2g} m every {antenna_period:.2g} s",
        (Filter(ON_ANTENNA, "antenna_std", "antenna_period", "antenna_damping"),),
        lambda scales, values: [
            {
                "fix_std": _half(values, "fix_std", scales.noise),
                "antenna_period": scales.rolls(),
                "antenna_std": (0.005, 0.02, 0.15),
            }
        ],
    ),
    "second_roll": Part(
        {
            "roll_std": Prior(0.05, 1.2),  # m athwart
            "roll_period": Prior(2.5, 0.25, most=LONGEST_ROLL, periods=1.0),  # s
            "roll_damping": Prior(0.03, 1.2),
        },
        "antenna rolling {roll_std:.2g} m every {roll_period:.2g} s too",
        (Filter(ON_ANTENNA, "roll_std", "roll_period", "roll_damping"),),
        lambda scales, values: [{"roll_period": scales.rolls(), "roll_std": (0.02, 0.1)}],
        only_with="antenna",
    ),
    "clock": Part(
        {"time_std": Prior(0.03, 1.2)},  # s, of the moment of a fix
        "time of a fix within {time_std:.2g} s",
        begin=lambda scales, values: [{"fix_std": _half(values, "fix_std"), "time_std": (0.001, 0.01, 0.1)}],
    ),
    "error": Part(
        {"error_std": Prior(0.7, 1.2), "error_time": Prior(100.0, 1.5)},  # m, s
        "error of {error_std:.2g} m over {error_time:.2g} s",
        (Filter(ON_FIX, "error_std", "error_time"),),
        lambda scales, values: [
            {
                "fix_std": _half(values, "fix_std", scales.noise),
                "error_std": scales.sizes(1.0),
                "error_time": (20.0, 200.0),
            }
        ],
    ),
    "steps": Part(  # s and m, as of the study's developing half
        {"step_every": Prior(15.0, 1.0, periods=_SHORTEST_STAY), "step_std": Prior(0.15, 1.3, digits=_SEEN)},
        "steps of {step_std:.2g} m every {step_every:.2g} s",
        begin=lambda scales, values: [
            {
                "fix_std": _half(values, "fix_std"),
                "step_every": (10.0, 60.0),
                "step_std": (3.0 * scales.noise, 10.0 * scales.noise),
            }
        ],
    ),
    "obstructions": Part(  # of the sky, by trees, bridges, quays: poor fixes in a row
        {
            "obstructed_noise": Prior(10.0, 0.7),  # of a poor fix, in the usual one, above 1
            "obstructed_time": Prior(20.0, 1.2),  # s
        },
        "noise larger by {obstructed_noise:.2g} times the usual for {obstructed_time:.2g} s at a time",
        begin=lambda scales, values: [
            {"poor_rate": (0.01,), "obstructed_noise": (5.0, 20.0), "obstructed_time": (20.0,)}
        ],
        share=0.02,  # Chosen: few records are made under trees, which those say by hundreds of log evidence
    ),
    **{aid.name: _of_aid(aid) for aid in TABLE},
}
"""In the order in which they enter a structure, those that move the vessel first."""
PLAIN = "base", "wander"
"""Parts of every structure that is inferred."""
OPTIONAL = tuple(name for name, part in PARTS.items() if part.begin)
"""Parts that a structure may have beside the plain ones and aids."""
