"""The declared parts of structures: what a vessel or its receiver may do. Each is an entry of `PARTS`.

A part has weak priors for its numbers, the shaping filters that add it to the model, starting values of the search, and
a description. Numbers are fitted as logarithms, with normal priors. A σ of 1 is a factor of 2.7 either way, about the
range within one kind of vessel; 1.5 and more span dinghies and ships. The priors are chosen for craft from 2 m to ships
and for receivers on the market, and judged by `steerway study unseen-logs`.
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
"""Values to try for some numbers, in all combinations."""

_DEG = math.pi / 180.0
LONGEST_ROLL = 4.0
"""Longest period (s) of an antenna's roll. Slower oscillations of craft under 15 m are motion in waves, which would be
fitted as roll. In a structure with both antenna roll and waves it is also the shortest period of wave yaw: without this
bound, yaw with the period of the roll was fitted as course."""
_SHORTEST_WAVE = 2.0
"""Shortest period (s) of waves in a fit: shorter ones, under 6 m long (g T²/2π), move no vessel to and fro."""
_WAVE = 3.0
"""Shortest period (s) of a line across the track from which the fit of yaw starts; without such a line it starts from
`UNKNOWN_PERIODS`. Faster lines are tried as roll of the antenna. If yaw starts from all lines, a roll of 2.5 s is
fitted as yaw, and the log evidence is 1,100 lower. Surge starts from all lines above `_SHORTEST_WAVE`, even strokes of
oars."""
_SHORTEST_STAY = 2.5
"""Least mean time between steps of a receiver's error, as a multiple of the shortest period that fixes resolve: five
intervals. Steps that are more frequent are noise. In recorded logs with steps this time is 9 to 100 intervals."""
_SEEN = 0.3
"""Least step of a receiver's error, in last digits of a written fix; a smaller step hardly shows. With no limit,
smoothed SOG of a track ten digits long errs by a sixth, well beyond its σ. With 0.1, SOG of drifting boats errs twice
as much as without steps."""
UNKNOWN_PERIODS = (2.5, 4.0, 7.0, 12.0, 20.0)
"""Periods (s) to try where a record shows none, about a factor of 1.7 apart."""


class Prior(NamedTuple):
    """Prior of a number: median, σ of its logarithm, and bounds of the search."""

    median: float
    deviation: float
    least: float = 0.0
    most: float = math.inf
    periods: float = 0.0
    """Least value of the number, in shortest periods that the fixes resolve."""
    digits: float = 0.0
    """Least value of the number, in last digits of a written fix."""


class Filter(NamedTuple):
    """A shaping filter by the names of its numbers: standard deviation and time constant, or period and damping."""

    acts_on: int
    std: str
    time: str
    damping: str | None = None


class Scales(NamedTuple):
    """Scales of a record before any fit."""

    noise: float
    """White noise (m) of a fix, by third differences."""
    shortest: float
    """s, the shortest period that the fixes resolve."""
    along: tuple[float, ...]
    across: tuple[float, ...]
    """s, periods that stand out along and across the track, the strongest first."""

    def sizes(self, largest: float) -> tuple[float, ...]:
        """Sizes (m) to try for a receiver's slow error, from its white noise to `largest`."""
        return self.noise, math.sqrt(self.noise * largest), largest

    def rolls(self) -> tuple[float, ...]:
        """Periods (s) to try for an antenna's roll."""
        return tuple(period for period in self.across if period < LONGEST_ROLL) or (2.0, 3.0)


class Part(NamedTuple):
    """A part that a structure may have."""

    priors: dict[str, Prior]
    words: str
    filters: tuple[Filter, ...] = ()
    begin: Callable[[Scales, Values], list[Stage]] | None = None
    """Values from which the search starts, by a record's scales and the numbers fitted without the part. Each stage
    starts from the likeliest values of the stage before."""
    share: float = 0.5
    """Prior probability that a record has the part."""
    only_with: str = ""
    """Part without which this one is not tried."""

    def resolved(self, shortest: float) -> bool:
        """Whether fixes resolve this part's periods at two prior σ above the medians. shortest: as in `Scales`."""
        longest = {name: prior.median * math.exp(2.0 * prior.deviation) for name, prior in self.priors.items()}
        return all(prior.periods * shortest < longest[name] for name, prior in self.priors.items())


def _half(values: Values, name: str, *others: float) -> tuple[float, ...]:
    """Values to try for a number: as it is, half (a new part may explain the rest), and others."""
    return values[name], 0.5 * values[name], *others


def _longer(periods: tuple[float, ...], least: float) -> tuple[float, ...]:
    """The periods longer than `least` (s); without any, the unknown periods longer than `_WAVE`."""
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
            "fix_std": Prior(0.3, 2.0),  # m, white noise of a fix
            "poor_rate": Prior(0.003, 1.5),  # share of fixes with much larger noise
            "late_std": Prior(0.03, 1.2),  # s, error of the time of such a fix
            "outlier_rate": Prior(0.001, 1.2),  # share of fixes that err by any distance
            "speed_walk": Prior(0.004, 1.5),  # m/s per √s, random walk of the held speed
            "yaw_size": Prior(6.0 * _DEG, 1.5),  # rad/s, change of course rate in a yaw manoeuvre
            "yaw_time": Prior(2.0, 1.2),  # s, duration of such a manoeuvre
            "yaw_every": Prior(100.0, 2.0),  # s between yaw manoeuvres
            "yaw_slip": Prior(0.02, 1.5),  # m/s per √s, random walk of the held speed in a yaw manoeuvre
            "turn_walk": Prior(0.3 * _DEG, 1.5),  # rad/s per √s, random walk of the course rate in a steady turn
            "turn_time": Prior(30.0, 2.0),  # s, duration of a steady turn
            "rate_time": Prior(0.8, 1.0),  # s, in which the course rate dies away on a held course
            "surge_size": Prior(1.0, 1.5),  # m/s, change of speed in a speed manoeuvre
            "surge_time": Prior(4.0, 1.2),  # s, duration of such a manoeuvre
            "surge_every": Prior(200.0, 1.5),  # s between speed manoeuvres
            "emergency_every": Prior(1e4, 2.0),  # s between emergencies
            "drift_speed": Prior(0.2, 1.0),  # m/s, below which noise moves a vessel in any direction
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
        {"time_std": Prior(0.03, 1.2)},  # s, error of the time of a fix
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
    "steps": Part(  # s and m; medians of the developing half of `unseen-logs`
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
            "obstructed_noise": Prior(10.0, 0.7),  # ratio of a poor fix's noise to the usual, minus 1
            "obstructed_time": Prior(20.0, 1.2),  # s, duration of an obstruction
        },
        "noise larger by {obstructed_noise:.2g} times the usual for {obstructed_time:.2g} s at a time",
        begin=lambda scales, values: [
            {"poor_rate": (0.01,), "obstructed_noise": (5.0, 20.0), "obstructed_time": (20.0,)}
        ],
        share=0.02,  # few records are made under trees, and these gain hundreds of log evidence
    ),
    **{aid.name: _of_aid(aid) for aid in TABLE},
}
"""The parts in the order in which they enter a structure: parts that move the vessel come first."""
PLAIN = "base", "wander"
"""Parts of every structure that is inferred."""
OPTIONAL = tuple(name for name, part in PARTS.items() if part.begin)
"""Parts that a structure may have beside the plain ones and aids."""
