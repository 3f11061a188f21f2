"""Aids: scalar measurements beside positions, each declared once in `TABLE`.

An aid measures a state of the filter, plus a slowly varying companion state (first-order Gauss–Markov) if the profile
gives a standard deviation for it: heading = χ − crab angle, speed through water = U − the current along the course,
yaw rate = ω_χ + the bias of the gyro.
"""

import math
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel

from steerway.core.errors import InputError
from steerway.core.records import AID_COLUMNS
from steerway.core.settings import positive_number
from steerway.estimation.filter.model import COURSE, RATE, SPEED

_DEG = math.pi / 180.0


class Aid(NamedTuple):
    """Declaration of an aid.

    priors: those of the numbers that are inferred from a log: the noise, then standard deviation and time constant of
    the companion. Each is a median, which is also a profile's default, and the σ of the logarithm (0.7: a factor of 2;
    1.2: one of 3.3). They are chosen for instruments on the market.
    """

    name: str  # column of `Fixes`
    state: int  # of the filter, that the aid measures
    noise: str  # profile key of its 1σ; with `across_course` that of a velocity across the course (m/s)
    words: str  # description with inferred numbers, which are shown in degrees if it contains °
    priors: dict[str, tuple[float, float]]
    companion: tuple[str, str] | None = None  # profile keys of its 1σ and time constant
    sign: float = 0.0  # of the companion in the measurement
    is_angle: bool = False
    across_course: bool = False


TABLE = (  # in the order of `AIDS`
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
    """Noise of the aids in a profile; defaults are the medians of the priors."""

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
    crab_time: float = positive_number(_USUAL["crab_time"], unit="s", what="correlation time of the crab angle")
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
    stream_time: float = positive_number(_USUAL["stream_time"], unit="s", what="correlation time of the current")
    yaw_rate_std: float = positive_number(_USUAL["yaw_rate_std"], unit="rad/s", what="1σ of the gyro", most=1.0)
    gyro_bias_std: float = positive_number(
        _USUAL["gyro_bias_std"], or_zero=True, unit="rad/s", what="1σ of the gyro's bias", most=0.5
    )
    gyro_bias_time: float = positive_number(_USUAL["gyro_bias_time"], unit="s", what="correlation time of the bias")


AIDS = AID_COLUMNS
"""Names of the aids, in the order of the kernels' aiding table."""
NO_AIDS = np.empty((0, len(AIDS)))
SOG, COG = AIDS.index("sog"), AIDS.index("cog")
STATE_OF = np.array([aid.state for aid in TABLE])
SIGN_OF = np.array([aid.sign for aid in TABLE])
IS_ANGLE = np.array([aid.is_angle for aid in TABLE])


def expect_aids(names: tuple[str, ...]) -> None:
    """Raises InputError for a name that is not in `AIDS`."""
    unknown = [name for name in names if name not in AIDS]
    if unknown:
        raise InputError(f"aid {unknown[0]!r} is unknown, expected some of {', '.join(AIDS)}")
