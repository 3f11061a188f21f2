"""Course estimation fix by fix, alone and aboard."""

import math
from functools import partial

import numpy as np

from steerway import FiveStateFilter, Profile
from steerway.core import wrap
from steerway.estimation.testing import NO_MEASUREMENTS, AtFaceValue, FilterEstimator, HeadingTracker
from tests.reference_outputs.sorties import AIDS, KINDS, MODES, TWO, alternating, instruments, table_of
from tests.reference_outputs.tables import case
from tests.scenes import EPOCH


def state_columns(filter):
    """All that a streaming filter says: n numbers by name."""
    covariance = filter.covariance
    return {
        "underway": float(filter.underway),
        "started": float(filter.started),
        "sog": filter.sog,
        "cog": filter.cog,
        "course_rate": filter.course_rate,
        **{f"state_{j}": value for j, value in enumerate(filter.state)},
        **{f"covariance_{i}_{j}": covariance[i, j] for i in range(5) for j in range(i, 5)},
    }


def streamed(profile, aid=(), geodetic=False, steps=3):
    """A step of prediction at a time and a fix every so many steps; aids in between; accuracy said of some fixes."""
    fixes, scene = instruments(), alternating()
    filter, rows, k = FiveStateFilter(profile, aid), [], 0
    for j in np.flatnonzero(fixes.has_position)[:60]:
        nis = math.nan
        for _ in range(steps if rows else 0):
            filter.predict(1.0 / steps)
        if geodetic:
            nis = filter.update(fixes.latitude[j], fixes.longitude[j], 1.0 if k % 9 else 8.0)
        else:
            noise = 0.3 * np.random.default_rng(k).standard_normal(2)
            nis = filter.update_north_east(scene.north[k] + noise[0], scene.east[k] + noise[1])
        if aid:
            filter.predict(0.0)
            filter.aid_by(**{name: getattr(fixes, name)[j] for name in AIDS})
        rows.append({"nis": nis} | state_columns(filter))
        k += 1
    return table_of(rows)


for modes, profile in MODES.items():
    case(f"course-streaming-north-east-{modes}")(partial(streamed, profile))
    case(f"course-streaming-latitude-longitude-{modes}")(partial(streamed, profile, geodetic=True, steps=5))
    case(f"course-streaming-aided-{modes}")(partial(streamed, profile, aid=AIDS))
case("course-streaming-errors-oscillating")(partial(streamed, Profile(**KINDS["oscillating-error-acceleration"])))


def aboard(estimator):
    """Instruments at different rates, a compass that falls silent, and what is then known at every eighth step."""
    scene = alternating()
    noise, rows = np.random.default_rng(21).standard_normal((6, 500)), []
    for k in range(500):
        t = 0.1 * k
        course = np.interp(t, scene.time - EPOCH, np.unwrap(scene.cog))
        measurements = NO_MEASUREMENTS
        if k % 5 == 0:
            measurements = measurements._replace(
                north=np.interp(t, scene.time - EPOCH, scene.north) + 0.3 * noise[0, k],
                east=np.interp(t, scene.time - EPOCH, scene.east) + 0.3 * noise[1, k],
                sog=1.5 + 0.05 * noise[2, k],
                cog=wrap(course + 0.04 * noise[3, k]),
            )
        if k % 2 == 0 and not 200 <= k < 260:
            measurements = measurements._replace(heading=wrap(course + 0.1 + 0.02 * noise[4, k]))
        if 100 <= k < 400:
            measurements = measurements._replace(yaw_rate=0.01 * noise[5, k], water_speed=1.2)
        rows.append(estimator.step(measurements, 0.1)._asdict())
    return {name: values[::8] for name, values in table_of(rows).items()}


for modes, profile in MODES.items():
    case(f"course-aboard-{modes}")(lambda profile=profile: aboard(FilterEstimator(FiveStateFilter(profile))))
case("course-aboard-aided")(lambda: aboard(FilterEstimator(FiveStateFilter(TWO, AIDS), HeadingTracker(1.0, 3.0))))
case("course-aboard-at-face-value")(lambda: aboard(AtFaceValue()))
