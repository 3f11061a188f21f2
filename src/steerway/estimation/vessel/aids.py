"""Aids: scalar measurements beside positions, each declared once in `TABLE`.

An aid measures a state of the filter plus, where the profile gives it a standard deviation, one slowly varying
companion state (first-order Gauss–Markov): heading = χ − crab angle, speed through water = U − the water's own speed
along the course, yaw rate = ω_χ + the bias of the gyro.
"""

import math
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel

from steerway.core.errors import InputError
from steerway.core.settings import positive_number
from steerway.estimation.filter.model import COURSE, RATE, SPEED

_DEG = math.pi / 180.0


class Aid(NamedTuple):
    """Declaration of an aid.

    `priors` of its numbers, where they are inferred from a log: the noise first, then standard deviation and time
    constant of the companion. Each has a median, which is a profile's default, and a deviation of the logarithm (0.7: a
    factor of 2; 1.2: one of 3.3). Chosen for instruments as they are sold.
    """

    name: str  # of the column in a record and of the argument
    state: int  # that it measures
    noise: str  # key of a profile: standard deviation; of `across_course`, of a velocity across the course (m/s)
    words: str  # for what is inferred of it: in degrees where it has the sign of degrees
    priors: dict[str, tuple[float, float]]
    companion: tuple[str, str] | None = None  # keys of a profile: standard deviation and time constant
    sign: float = 0.0  # of the companion
    is_angle: bool = False
    across_course: bool = False


TABLE = (
    Aid(
        "sog",
        SPEED,
        "sog_std",
        "SOG within {sog_std:.2g} m/s",
        {"sog_std": (0.1, 1.0), "sog_error_std": (0.02, 1.2), "sog_error_time": (2.0, 1.0)},  # m/s, m/s, s
    ),
    Aid(
        "cog",
        COURSE,
        "velocity_std",
        "COG within {velocity_std:.2g} m/s across",
        {"velocity_std": (0.1, 1.0), "cog_error_std": (0.02, 1.2), "cog_error_time": (2.0, 1.0)},  # m/s, m/s, s
        is_angle=True,
        across_course=True,
    ),
    Aid(
        "heading",
        COURSE,
        "heading_std",
        "heading within {heading_std:.2g}°",
        {"heading_std": (1.0 * _DEG, 1.0), "crab_std": (10.0 * _DEG, 0.7), "crab_time": (60.0, 1.0)},  # rad, rad, s
        companion=("crab_std", "crab_time"),
        sign=-1.0,
        is_angle=True,
    ),
    Aid(
        "water_speed",
        SPEED,
        "water_speed_std",
        "speed through water within {water_speed_std:.2g} m/s",
        {"water_speed_std": (0.1, 1.0), "stream_std": (0.5, 0.7), "stream_time": (300.0, 1.0)},  # m/s, m/s, s
        companion=("stream_std", "stream_time"),
        sign=-1.0,
    ),
    Aid(
        "yaw_rate",
        RATE,
        "yaw_rate_std",
        "yaw rate within {yaw_rate_std:.2g}°/s",
        # rad/s, rad/s, s
        {"yaw_rate_std": (0.2 * _DEG, 1.0), "gyro_bias_std": (0.5 * _DEG, 0.7), "gyro_bias_time": (1000.0, 1.0)},
        companion=("gyro_bias_std", "gyro_bias_time"),
        sign=1.0,
    ),
)

_USUAL = {name: median for aid in TABLE for name, (median, _) in aid.priors.items()}


class AidNoise(BaseModel):
    """What a profile says of the aids; defaults are the medians of the priors."""

    # Receivers that filter less than 0.05 m/s are late, so that a fit does not go below it.
    sog_std: float = positive_number(_USUAL["sog_std"], unit="m/s", what="1σ of the receiver's SOG", most=20.0)
    velocity_std: float = positive_number(
        _USUAL["velocity_std"],
        unit="m/s",
        what="1σ of the receiver's velocity across the course; divided by SOG, it is that of COG",
        most=20.0,
    )
    heading_std: float = positive_number(_USUAL["heading_std"], unit="rad", what="1σ of the compass", most=0.5)
    crab_std: float = positive_number(
        _USUAL["crab_std"], or_zero=True, unit="rad", what="1σ of crab angle plus compass bias", most=math.pi / 2.0
    )
    crab_time: float = positive_number(_USUAL["crab_time"], unit="s", what="correlation time of crab_std")
    water_speed_std: float = positive_number(
        _USUAL["water_speed_std"], unit="m/s", what="1σ of the speed log", most=20.0
    )
    stream_std: float = positive_number(
        _USUAL["stream_std"],
        or_zero=True,
        unit="m/s",
        what="1σ of current along the course plus bias of the speed log",
        most=20.0,
    )
    stream_time: float = positive_number(_USUAL["stream_time"], unit="s", what="correlation time of stream_std")
    yaw_rate_std: float = positive_number(_USUAL["yaw_rate_std"], unit="rad/s", what="1σ of the gyro", most=1.0)
    gyro_bias_std: float = positive_number(
        _USUAL["gyro_bias_std"], or_zero=True, unit="rad/s", what="1σ of the gyro's bias", most=0.5
    )
    gyro_bias_time: float = positive_number(_USUAL["gyro_bias_time"], unit="s", what="correlation time of the bias")


AIDS = tuple(aid.name for aid in TABLE)
"""Names of the aids, in the order of the kernels' aiding table."""
NO_AIDS = np.empty((0, len(AIDS)))
SOG, COG = AIDS.index("sog"), AIDS.index("cog")
STATE_OF = np.array([aid.state for aid in TABLE])
SIGN_OF = np.array([aid.sign for aid in TABLE])
IS_ANGLE = np.array([aid.is_angle for aid in TABLE])


def expect_aids(names: tuple[str, ...]) -> None:
    """Raises InputError for a name that is none of `AIDS`."""
    unknown = [name for name in names if name not in AIDS]
    if unknown:
        raise InputError(f"aid {unknown[0]!r} is unknown, expected some of {', '.join(AIDS)}")
