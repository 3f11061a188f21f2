"""Structures: tuples of the declared parts with their numbers, priors of these, and the model of one."""

import math
from typing import Annotated, NamedTuple, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from steerway.core.arrays import Floats
from steerway.core.settings import Table, positive_number
from steerway.estimation.filter.bank import LEAST_SHARE
from steerway.estimation.filter.model import AID, DRIVING, MODE, PROCESS, RECEIVER, Model, has_two_states
from steerway.estimation.vessel.aids import TABLE
from steerway.estimation.vessel.parts import PARTS, Parts, Prior, Values

CALM, TURN, YAW, SURGE, EMERGENCY = range(5)
"""Modes: course held; steady turn; yaw manoeuvre; speed manoeuvre; emergency, any motion the vessel is capable of."""
MODES = 5
START_PROBABILITY, START_RATE_STD = (0.55, 0.2, 0.15, 0.09, 0.01), 0.2
"""Probabilities of the modes at the start, and 1σ of the course rate, rad/s (two σ are 23 °/s). A fit leaves out the
first rows (`fit.posterior`)."""
EMERGENCY_ACCELERATION, EMERGENCY_YAW, EMERGENCY_TIME = 3.0, 1.5, 1.5
"""In an emergency: acceleration, m/s² (a planing craft that stops); yaw acceleration, rad/s² (a small craft that
spins); and mean duration, s."""
TURN_SHARE = 0.5
"""Probability that a yaw manoeuvre ends in a steady turn rather than on a held course: no preference."""
STRAIGHT = 2.0
"""Probability of a held course after a steady turn or an emergency, relative to that of each other mode. With 1, the
end of a steady turn is noticed later in scenes; with 4, a figure of eight is followed later."""
_POOR = 5.0
"""Ratio of a single poor fix's noise to the usual, minus 1. The share of poor fixes is fitted."""
_MOST_BAD = 0.3
"""Largest share of outliers, and of poor fixes, in a model. With more they would be the rule."""
WIDEST_INTERVAL = 10.0
"""Ratio of the ends of a 95 % interval above which a number is not determined, not even its order of magnitude."""


def priors_of(parts: Parts) -> dict[str, Prior]:
    """The priors of a structure's numbers by their names."""
    return {name: prior for part in parts for name, prior in PARTS[part].priors.items()}


def parameters_of(parts: Parts) -> tuple[tuple[str, ...], Floats, Floats]:
    """Names, logarithms of the prior medians, and prior σ of the logarithms, of a structure's numbers."""
    table = priors_of(parts)
    return (
        tuple(table),
        np.log([each.median for each in table.values()]),
        np.array([each.deviation for each in table.values()]),
    )


def medians_of(parts: Parts) -> Values:
    """The prior medians of a structure's numbers."""
    names, logarithms, _ = parameters_of(parts)
    return dict(zip(names, np.exp(logarithms).tolist(), strict=True))


def log_share(parts: Parts) -> float:
    """Log prior odds that a vessel has these parts against none of them."""
    return sum(math.log(PARTS[part].share / (1.0 - PARTS[part].share)) for part in parts)


def _modes_of(v: Values) -> tuple[np.ndarray, Floats]:
    """(MODES,) MODE, and the rates of change between them (MODES, MODES)."""
    decay = 1.0 / v["rate_time"]
    speed = v["speed_walk"] ** 2
    yaw, surge = v["yaw_size"] ** 2 / v["yaw_time"], v["surge_size"] ** 2 / v["surge_time"]
    modes = np.zeros(MODES, MODE)
    modes["start"], modes["start_rate"], modes["drift_speed"] = START_PROBABILITY, START_RATE_STD**2, v["drift_speed"]
    modes["speed_noise"] = speed, speed, v["yaw_slip"] ** 2, surge, EMERGENCY_ACCELERATION**2 * EMERGENCY_TIME
    modes["rate_noise"] = 0.0, v["turn_walk"] ** 2, yaw, 0.0, EMERGENCY_YAW**2 * EMERGENCY_TIME
    modes["rate_decay"][[CALM, SURGE]] = decay
    modes["sideways"][EMERGENCY] = 1.0
    modes["least_share"] = LEAST_SHARE
    modes["manoeuvres"][[YAW, SURGE, EMERGENCY]] = 1
    g = np.zeros((MODES, MODES))
    yaw_begins, surge_begins = 1.0 / v["yaw_every"], 1.0 / v["surge_every"]
    g[CALM, YAW], g[CALM, SURGE] = yaw_begins, surge_begins
    turn_ends = 1.0 / v["turn_time"]
    straight = STRAIGHT / (STRAIGHT + 1.0)
    g[TURN, CALM], g[TURN, YAW] = straight * turn_ends, (1.0 - straight) * turn_ends
    g[TURN, SURGE] = surge_begins
    g[YAW, TURN], g[YAW, CALM] = TURN_SHARE / v["yaw_time"], (1.0 - TURN_SHARE) / v["yaw_time"]
    g[SURGE, CALM], g[SURGE, YAW] = 1.0 / v["surge_time"], yaw_begins
    g[:, EMERGENCY] = 1.0 / v["emergency_every"]
    g[EMERGENCY, [CALM, TURN, YAW, SURGE]] = np.array([STRAIGHT, 1.0, 1.0, 1.0]) / (STRAIGHT + 3.0) / EMERGENCY_TIME
    np.fill_diagonal(g, 0.0)
    np.fill_diagonal(g, -g.sum(axis=1))
    return modes, g


class Shaping(NamedTuple):
    """A shaping filter with its numbers (see PROCESS); aid: whose companion it is."""

    acts_on: int
    decay: float
    frequency: float
    variance: float
    aid: str = ""


def model_of(parts: Parts, values: Values, quantum: tuple[float, float] = (0.0, 0.0), beside: Parts = ()) -> Model:
    """Model of a structure with these numbers.

    quantum: last digit of fixes north and east, m or 0.
    beside: parts of other structures, of which this one gets states without noise, so that all models have one size.
    """
    v, shapings = dict.fromkeys(priors_of(beside), 1.0) | values, []
    for name, each in [(n, each) for n, part in PARTS.items() if n in parts or n in beside for each in part.filters]:
        decay, frequency = 1.0 / v[each.time], 0.0
        if each.damping:
            frequency = 2.0 * math.pi / v[each.time]
            decay = v[each.damping] * frequency
        shapings.append(Shaping(each.acts_on, decay, frequency, v[each.std] ** 2 if name in parts else 0.0, name))
    variances = {aid.name: values[next(iter(aid.priors))] ** 2 for aid in TABLE if aid.name in parts}
    return assembled(*_modes_of(values), shapings, _receiver_of(values, quantum), variances)


def assembled(
    modes: np.ndarray, generator: Floats, shapings: list[Shaping], receiver: np.ndarray, variances: Values
) -> Model:
    """Model of these modes (m,), rates of change (m, m), shaping filters, receiver (1,) and variances of aids by name.

    Shaping filters that drive the motion come first.
    """
    processes, states, driving, companions = [], 5, 5, {}
    for each in shapings:
        process = np.array((each.decay, each.frequency, each.variance, each.acts_on, states), PROCESS)
        processes.append(process)
        companions[each.aid] = states
        states += 2 if has_two_states(each.acts_on, each.frequency) else 1
        if each.acts_on in DRIVING:
            driving = states
    aids = np.array([(math.nan, 0)] * len(TABLE), AID)
    for which, aid in enumerate(TABLE):
        if aid.name in variances:
            aids[which] = variances[aid.name], companions.get(aid.name, 0)
    return Model(modes, generator, np.array(processes, PROCESS), receiver, aids, states, driving)


def _receiver_of(v: Values, quantum: tuple[float, float]) -> np.ndarray:
    """(1,) RECEIVER of these numbers."""
    receiver = np.zeros(1, RECEIVER)
    for name, number in {
        "fix_variance": v["fix_std"] ** 2,
        "outlier_rate": min(v["outlier_rate"], _MOST_BAD),
        "poor_rate": min(v["poor_rate"], _MOST_BAD),
        "poor_noise": 1.0 + v.get("obstructed_noise", _POOR),
        "poor_time": v.get("obstructed_time", 0.0),
        "time_variance": v.get("time_std", 0.0) ** 2,
        "late_variance": v["late_std"] ** 2,
        "step_rate": 1.0 / v.get("step_every", math.inf),
        "step_variance": v.get("step_std", 0.0) ** 2,
        "quantum_north": quantum[0],
        "quantum_east": quantum[1],
    }.items():
        receiver[name] = number
    return receiver


class Structure(Table):
    """One structure: weight, parts, numbers by name, and 95 % intervals of numbers that were fitted to a log."""

    weight: float = positive_number(unit="1", what="weight of the structure; all add up to 1")
    parts: Parts
    """Names of the parts of the model of vessel and receiver."""
    values: Annotated[Values, "SI"]
    """Numbers of the parts by name."""
    intervals: Annotated[dict[str, tuple[float, float]], "SI"] = Field(default_factory=dict)
    """95 % intervals of the numbers by name."""
    quantum: Annotated[tuple[float, float], "m"] = (0.0, 0.0)
    """Last digit of a fix north and east, m; 0 where fixes are not rounded."""

    @field_validator("parts")
    @classmethod
    def _declared(cls, parts: Parts) -> Parts:
        for part in parts:
            if part not in PARTS:
                raise ValueError(f"part {part!r} is unknown, expected some of {', '.join(PARTS)}")
        if "base" not in parts:
            raise ValueError("part 'base' is missing, expected in every structure")
        return parts

    @model_validator(mode="after")
    def _whole(self) -> Self:
        names, _, _ = parameters_of(self.parts)
        for name in names:
            if name not in self.values:
                raise ValueError(f"values has no {name}, which the parts {', '.join(self.parts)} need")
        if not all(0.0 <= digit < math.inf for digit in self.quantum):
            raise ValueError(f"quantum is {list(self.quantum)}, expected two numbers of 0 or more (m)")
        for name, value in self.values.items():
            if name not in names:
                raise ValueError(f"values has {name}, which none of the parts {', '.join(self.parts)} takes")
            if not 0.0 < value < float("inf"):
                raise ValueError(f"{name} is {value}, expected a positive number")
        return self

    @property
    def model(self) -> Model:
        """The model by which filters run this structure."""
        return model_of(self.parts, self.values, self.quantum)

    def is_determined(self, name: str) -> bool:
        """Whether the log of the tuning determines this number; True for a number without an interval."""
        low, high = self.intervals.get(name, (1.0, 1.0))
        return high <= WIDEST_INTERVAL * low


SHIP = {
    "yaw_size": 0.005,
    "yaw_time": 30.0,
    "yaw_every": 500.0,
    "turn_time": 120.0,
    "turn_walk": 2e-4,
    "rate_time": 20.0,
    "surge_time": 60.0,
    "surge_every": 900.0,
    "wander_std": 5e-4,
    "speed_walk": 0.003,
    "emergency_every": 2e4,
}
VESSELS: tuple[Values, ...] = (
    # Kinds of vessel in the prior of a filter that learns: a usual vessel, a ship, a small craft that spins, one whose
    # speed changes fast. Numbers that are not named are at their prior medians.
    {},
    SHIP,
    {"yaw_size": 0.5, "yaw_time": 1.5, "rate_time": 0.4, "surge_size": 2.0, "turn_time": 6.0},
    {"yaw_size": 0.1, "speed_walk": 0.1, "wander_std": 0.05, "speed_std": 0.15, "surge_size": 5.0},
)
