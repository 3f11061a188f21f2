"""Recorded logs: what was read of each, and what fixed profiles make of it, as summary numbers."""

from pathlib import Path

import numpy as np

import steerway
from steerway import Profile
from tests.reference_outputs.sorties import EARTH_RADIUS, FAR, table_of, wrapped
from tests.reference_outputs.tables import case

MOST_FIXES = 5000
TWO_MODES = Profile(
    speed_noise=2e-3,
    course_rate_noise=1e-5,
    course_rate_decay=0.5,
    position_std=0.3,
    turn_time=15.0,
    straight_time=60.0,
    turn_speed_noise=1e-2,
    turn_course_rate_noise=5e-3,
    turn_course_rate_decay=0.3,
    error_std=0.5,
    error_time=30.0,
)
RECEIVER, COMPASS = ("sog", "cog"), ("heading", "yaw_rate", "water_speed")
RUNS = (
    ("small-usv", (), False, None),
    ("small-usv", (), True, None),
    ("sailing-yacht", RECEIVER, False, 2.0),
    (TWO_MODES, (), False, None),
    (TWO_MODES, (), True, None),
    (TWO_MODES, COMPASS, False, None),
)
"""A row of a table each: profile, aids, smoothed, rows a second."""
TRAFFIC_RUNS = (("ais", (), False, None), ("ais", (), True, None), ("ais", RECEIVER, True, None))

LOGS = """
    ais_misc/kystverket_1000lines.nm4
    ais_misc/pyais_nmea_data_sample.txt
    anemomind_corrupt/irene_20150429_fragments.nmea
    anemomind_corrupt/irene_flensburg_20130802_corrupt.nmea
    anemomind_corrupt/psaros33_20140627_gaps_dups.nmea
    furuno_scx20_n2k/ac42-commissioning.raw
    furuno_scx20_n2k/furuno-130842-figure8-fast.raw
    furuno_scx20_n2k/furuno-130842-wide-turn.raw
    gpsd_logs/blumax-gps009.log
    gpsd_logs/bundg_zeus_9.log
    gpsd_logs/haicom-305N.log
    gpsd_logs/humminbird-M37.log
    gpsd_logs/navisys-gr8013.log
    gpsd_logs/nl2008u.log
    gpsd_logs/pygnssutils_ubx_static_rtcm3.log
    gpsd_logs/quectel-eg25-g.log
    gpsd_logs/sl869.log
    gpsd_logs/ublox-glo.log
    gpsd_logs/ublox-lea-4h.log
    gpsd_logs/ublox-neo-m8l.log
    gpsd_logs/ublox-neo-m8n.log
    gpsd_logs/ublox-neo-m8p.log
    gpsd_logs/ublox-zed-f9p-hp.log
    palmer_seapath_truth/NBP1406_PCOD-2014-08-01
    palmer_seapath_truth/NBP1406_gp02-2014-08-01
    palmer_seapath_truth/NBP1406_s330-2014-08-01
    palmer_seapath_truth/NBP1406_seap-2014-08-01
    rob_atlantic_1hz/gx_to_gavres.nmea
    rob_atlantic_1hz/kernevel_latrinite.nmea
    rob_atlantic_1hz/nukuhiva_multitalker.nmea
    rob_atlantic_1hz/tomales_kayak.nmea
    signalk_samples/aava-n2k.data
    signalk_samples/gofree-merrimac.log
    signalk_samples/gps.log
    signalk_samples/plaka.log
    solent_ais/SolentAIS_20160112_130211.csv
""".split()

ANGLES = ("cog", "heading", "longitude")
REPORTED = ("position_std", "sog", "cog", "heading", "water_speed", "yaw_rate")


def summary(columns, names) -> dict[str, float]:
    """Count, mean, RMS and last of the known values of each column; of angles those of cosine and sine."""
    parts = {}
    for name in names:
        if name in ANGLES:
            parts |= {f"{name}_cos": np.cos(columns[name]), f"{name}_sin": np.sin(columns[name])}
        else:
            parts[name] = columns[name]
    numbers = {}
    for name, values in parts.items():
        known = values[np.isfinite(values)]
        if not len(known):
            known = np.array([np.nan])
        numbers[f"{name}_count"] = float(np.isfinite(values).sum())
        numbers[f"{name}_mean"] = float(known.mean())
        numbers[f"{name}_rms"] = float(np.sqrt(np.mean(known**2)))
        numbers[f"{name}_last"] = float(known[-1])
    return numbers


def read_numbers(fixes) -> dict[str, float]:
    """What was read of a log, the whole of it."""
    columns = fixes.columns() | {"since_first": fixes.time - fixes.time[0]}
    numbers = {"fixes": len(fixes), "notes": len(fixes.notes), "first_time": fixes.time[0]}
    return numbers | summary(columns, ("since_first", "latitude", "longitude", *REPORTED))


def motion_numbers(motion) -> dict[str, float]:
    """How many rows of each status, and every column; places in m from south and west of the first."""
    columns = motion.columns() | {
        "north": FAR + EARTH_RADIUS * (motion.latitude - motion.latitude[0]),
        "east": FAR + EARTH_RADIUS * wrapped(motion.longitude - motion.longitude[0]),
    }
    numbers = {f"status_{code}": float((motion.status == code).sum()) for code in range(6)}
    names = ("north", "east", "sog", "cog", "course_rate", "sog_std", "cog_std", "course_rate_std", "nis")
    return numbers | summary(columns, (*names, "position_std"))


def short_name(log) -> str:
    return Path(log).name.split(".")[0].lower().replace("_", "-")


def read_and_estimated(data, log):
    """A row a run; what was read stands in every one."""
    whole = steerway.read(data / "data" / log)
    read = {f"read_{name}": value for name, value in read_numbers(whole).items()}
    fixes = whole.rows(slice(MOST_FIXES))
    runs = RUNS if fixes.mmsi is None else TRAFFIC_RUNS
    return table_of(
        [
            read | motion_numbers(steerway.estimate(fixes, profile, aid=aid, rate=rate, smooth=smooth))
            for profile, aid, smooth, rate in runs
        ]
    )


for log in LOGS:
    case(f"log-{short_name(log)}", recorded=True)(lambda data, log=log: read_and_estimated(data, log))
