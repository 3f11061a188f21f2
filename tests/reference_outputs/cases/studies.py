"""Studies: what each finds with one seed, or its parts where that takes long.

Whole, with one seed: cybership-observers, springer-mission (but for its own timings), low-speed at two of its fifteen
speeds with one of its three receivers, otter-course without logs; on recorded logs: ais-prediction. In parts:
mariner-los (68 voyages a seed), otter-path (at one of its two speeds), adaptive-speed (every kind of voyage at one
set-point) and estimator-limits (its sections on one voyage of one cell; of troubles what they do to a record, of
wandering receivers the profiles). at-sea is one square; of real-logs and unseen-logs, which take minutes, what they
judge by on one log and a fixed profile.
"""

import os
from dataclasses import asdict
from unittest.mock import patch

import numpy as np

import steerway
from steerway_studies.testing import (
    CELLS,
    DEFAULT,
    EKF,
    KNOWN,
    OTTER_PRINTED_GAINS,
    STATED_NOISE,
    TROUBLES,
    Results,
    ablations,
    accuracy,
    aided,
    approaches,
    as_published,
    correlated,
    difference,
    held,
    identified,
    judged_rows,
    known_modes,
    low_speed,
    measured,
    of_motion,
    plants,
    printed,
    real_logs,
    recordings,
    steered_by_product,
    theory,
    trials,
    tuning,
    turned,
    unknown_modes,
    verdict,
)
from steerway_studies.testing import ShipCase as Voyage
from steerway_studies.testing import adaptive_speed_perturbed as perturbed
from steerway_studies.testing import boat as otter_path_boat
from steerway_studies.testing import cases as speed_cases
from steerway_studies.testing import named as study_named
from steerway_studies.testing import sailing_judged as at_sea_judged
from tests.reference_outputs.generated import numbers
from tests.reference_outputs.tables import case

FITTED = 1e-3
SEED = 1
CHAOTIC = ("verbatim_1cm_cog_rms_deg",)  # diverges: the last digit of a sine, which differs between processors, decides
TIMINGS = ("interval_step_us", "mpc_step_us", "interval_mission_s")


def whole(name, without=()):
    """All numbers of a study with one seed, on one core."""
    with patch("os.cpu_count", return_value=1):
        found = study_named(name).run(1, SEED, None).numbers
    return numbers({key: value for key, value in found.items() if key not in without})


def flat(found):
    """A dictionary of arrays as one of numbers."""
    return numbers({f"{key}_{k}": value for key, values in found.items() for k, value in enumerate(np.ravel(values))})


@case("study_cybership_observers", rtol=FITTED)
def cybership_observers():
    return whole("cybership-observers")


@case("study_cybership_observers_trial")
def cybership_trial():
    return numbers(trials.trial({each: np.array([-2.5, -3.0]) for each in tuning.CASES}, SEED))


@case("study_springer_mission")
def springer_mission():
    return whole("springer-mission", TIMINGS)


@case("study_low_speed", rtol=FITTED, atol=1e-4)  # m/s: a fit to a boat at rest moves with the machine code
def at_low_speed():
    receivers = {"low_cost": low_speed.RECEIVERS["low_cost"]}
    with patch.object(low_speed, "SPEEDS", (0.0, 0.7)), patch.object(low_speed, "RECEIVERS", receivers):
        return whole("low-speed")


@case("study_otter_course", rtol=FITTED)
def otter_course_without_logs():
    with patch.dict(os.environ):
        os.environ.pop("STEERWAY_DATA", None)
        return whole("otter-course", CHAOTIC)


@case("study_otter_course_published")
def otter_course_published():
    """With noise only the first quarter: then rounding has grown by nine digits."""
    found = {}
    for name, record, each in (("quiet", as_published(), 40), ("noisy", as_published(0.01, SEED), 10)):
        columns = np.column_stack([record.sog, record.cog, record.estimated_sog, record.estimated_cog, record.turning])
        found[name] = columns[::each][:51]
    return found


@case("study_otter_course_steered")
def otter_course_steered():
    run = steered_by_product(0.1, 1.0, None, SEED)
    found = np.column_stack([run.true_cog, run["estimated_cog"], run["reference_angle"], run.command])[::100]
    angles = [turned(OTTER_PRINTED_GAINS, 6.1, 0.2, each) for each in (True, False)]
    return {"run": found, "turned": np.tile(angles, (len(found), 1))}


@case("study_otter_course_identified", rtol=FITTED)
def otter_course_identified():
    model = identified(0.1, SEED)
    return {"gain": model.gain, "time_constant": model.time_constant, "bias": model.rudder_bias}


@case("study_otter_path")
def otter_path():
    cases = [each for each in otter_path_boat.CASES if each.speed == 1.2]
    legs = {"_".join(map(str, each)): otter_path_boat.leg(each, SEED) for each in cases}
    return flat({name: list(leg) for name, leg in legs.items()})


@case("study_mariner_los")
def mariner():
    found = {}
    for feedback in ("truth", "printed", "product"):
        voyage = Voyage(feedback, STATED_NOISE, turned=0.5, seed=SEED)
        found |= {f"{feedback}_{key}": value for key, value in measured(voyage).items()}
    return numbers(found)


@case("study_mariner_los_lyapunov")
def mariner_lyapunov():
    found = {}
    for name, each in zip(("ideal", "ship"), approaches(), strict=True):
        rows = np.linspace(0, len(each.time) - 1, 40).astype(int)
        found[name] = np.column_stack([each.time, each.cross_track, each.promised, each.lyapunov])[rows]
        totals = each.falling_pct, each.largest_error, each.relative_error
        found[f"{name}_totals"] = np.tile(totals, (len(rows), 1))
    return found


@case("study_adaptive_speed_voyages", rtol=1e-6)  # what adapts amplifies rounding
def adaptive_speed():
    """Every kind of voyage at 3 m/s."""
    found = {}
    shown = [kind for kind in speed_cases.KINDS if kind not in perturbed.KINDS or kind in ("log_scale", "drift")]
    for kind in shown:
        boats = speed_cases.FAULTS if kind == "fault" else ("a",)
        for boat in boats:
            judged = speed_cases.run(speed_cases.Job(kind, SEED, 3, boat))
            found |= {f"{kind}_{boat}_{key}": value for key, value in judged.items()}
    return numbers(found)


@case("study_adaptive_speed_plants")
def adaptive_speed_plants():
    found = {}
    for name in plants.PLANTS:
        judged = speed_cases.run(speed_cases.Job("ours", SEED, 6, name))
        found |= {f"ours_{name}_{key}": value for key, value in judged.items()}
    return numbers(found)


@case("study_adaptive_speed_printed")
def adaptive_speed_printed():
    found = {}
    for name, track in (
        ("published", printed.as_published(3)),
        ("ten_hertz", printed.at_ten_hertz(3, True)),
        ("ten_hertz_late", printed.at_ten_hertz(3, False)),
    ):
        rows = np.linspace(0, len(track.time) - 1, 50).astype(int)
        found[name] = np.column_stack([track.speed, track.shaft, track.model, track.parameters])[rows]
        found[f"{name}_settling"] = np.full(50, min(printed.settling_about_final(track), 1e9))
    return found | {"steady": np.full(50, printed.steady_shaft(3)), "top": np.full(50, printed.top_speed())}


@case("study_adaptive_speed_theory")
def adaptive_speed_theory():
    found = {}
    for constant in (True, False):
        fall = theory.descent(3.0, constant, 20.0)
        rows = np.linspace(0, len(fall.time) - 1, 30).astype(int)
        values = [getattr(fall, name) for name in fall.__dataclass_fields__]
        found[f"descent_{constant}"] = np.column_stack(values)[rows]
    for loop in (True, False):
        course = theory.sail_straight(3.0, loop, 60.0)
        rows = np.linspace(0, len(course.time) - 1, 30).astype(int)
        found[f"straight_{loop}"] = np.column_stack([course.speed, course.heading, course.yaw_rate])[rows]
    grows = [theory.growth(speed) for speed in np.linspace(1.0, 9.0, 30)]
    return found | {"growth": grows, "stiffness": np.full(30, theory.least_stiffness(3.0))}


@case("study_limits_accuracy", rtol=1e-6)
def limits_accuracy():
    return flat(accuracy.measure("o05", SEED, tuned_below=0))


@case("study_limits_known_modes")
def limits_known_modes():
    return flat(known_modes.one("o05", SEED))


@case("study_limits_unknown_modes")
def limits_unknown_modes():
    return flat(unknown_modes.one("m25", SEED))


@case("study_limits_aided")
def limits_aided():
    """Without the estimates that infer their parameters: those go through a fit."""
    found = aided.one(SEED, {"": aided.PROFILE})
    return flat(found | {"bias": found["bias"][::50]})


@case("study_limits_held")
def limits_held():
    return flat(held.one(SEED, ("m05",)))


@case("study_limits_troubles")
def limits_troubles():
    """What every trouble does to a record: rows, and where they are on the mean."""
    voyage, fixes = CELLS["o05"].sailed(SEED)
    found = {}
    for number, (name, (trouble, _, over)) in enumerate(TROUBLES.items()):
        truth, output = trouble(voyage, fixes, np.random.default_rng([SEED, number]))
        place = np.nansum(np.abs(np.diff(output.latitude))), np.nansum(np.abs(np.diff(output.longitude)))
        found[name] = [len(truth.time), len(output), over, output.time[-1], np.nanmean(output.time), *place]
    return flat(found)


@case("study_limits_receivers", rtol=1e-3)
def limits_receivers():
    profiles = {"ship": correlated.ship_profile(STATED_NOISE), "boat": correlated.boat_profile()}
    return flat({name: np.ravel(each.parameters()) for name, each in profiles.items()})


@case("study_at_sea")
def at_sea_square():
    sailed = at_sea_judged(ablations(SEED)[0], SEED)
    return numbers({"legs": sailed.legs, "corners": sailed.corners, "time": sailed.time})


def known_log(data, stem):
    """A recorded log of the study, with a fixed profile in place of the inferred one."""
    name = next(each for each in real_logs.logs(data / "data") if stem in each)
    log = real_logs.EstimatedLog(steerway.read(data / "data" / name))
    log.__dict__["profile"] = steerway.Profile.named("ship")
    return name, log


@case("study_real_logs_judged", recorded=True)
def real_logs_judged(data):
    results = Results("one log")
    real_logs.add_log(results, *known_log(data, "s330"))
    return numbers(results.numbers)


@case("study_unseen_logs_judged", recorded=True)
def unseen_logs_judged(data):
    """The verdicts on two fixed profiles and on differences of positions."""
    with patch.dict(os.environ, STEERWAY_DATA=str(data)):
        recording = recordings.opened(next(each for each in KNOWN if "s330" in each.name))
    fixes = recording.fixes
    profiles = {DEFAULT: "ship", EKF: "small-usv"}
    output = {name: of_motion(fixes.time, steerway.estimate(fixes, profile)) for name, profile in profiles.items()}
    output["difference"] = difference(fixes.time, recording.places, 1.0)
    rows = judged_rows(recording, output)
    found = {name: asdict(verdict(recording, each, rows)) for name, each in output.items()}
    return numbers({f"{name}_{key}": value for name, each in found.items() for key, value in each.items()})


@case("study_ais_prediction", recorded=True)
def ais_prediction(data):
    with patch.dict(os.environ, STEERWAY_DATA=str(data)):
        return whole("ais-prediction")
