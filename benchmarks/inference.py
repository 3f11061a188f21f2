"""A whole record at its fixes, on one core: models of one and two modes, and the default without a profile."""

import time

import steerway
from benchmarks.support import ours
from benchmarks.support.harness import Result, interleaved
from benchmarks.support.record import STEPS_A_FIX, Record, fixes_of, winding
from steerway.estimation import choose_profile

_FIXES, _ROUNDS = 20_000, 15
_SLOW = {"error_std": 0.25, "error_time": 5.0, "drift_std": 1.5, "drift_time": 300.0, "position_std": 0.05}
_TURNS = {
    "turn_time": 10.0,
    "straight_time": 40.0,
    "turn_speed_noise": 1e-2,
    "turn_course_rate_noise": 8e-3,
    "turn_course_rate_decay": 0.2,
}


def run():
    rows = winding(_FIXES * STEPS_A_FIX)
    record = Record(rows.time[::STEPS_A_FIX], rows.north[::STEPS_A_FIX], rows.east[::STEPS_A_FIX])
    models = {"five states": ours.MODEL, "two modes, two slow errors": ours.model_with(**_SLOW, **_TURNS)}
    targets = {"two modes, two slow errors": 3000.0}
    taken = interleaved(
        {name: lambda model=model: ours.whole_record(record, model) for name, model in models.items()}, _ROUNDS
    )
    for name, seconds in taken.items():
        yield Result(name, 1e9 * seconds / _FIXES, "ns a fix", at_most=targets.get(name))
    fixes = fixes_of(rows)
    choose_profile(fixes)  # compiles
    began = time.process_time()
    profile = choose_profile(fixes)
    fit = time.process_time() - began
    yield Result("the default's fit, processor time", fit, "s", note=f"{len(profile.structures)} structures")
    taken = interleaved({"": lambda: steerway.estimate(fixes, profile, causal=True)}, 3)[""]
    yield Result("the default's estimate with the fitted profile", 1e9 * taken / _FIXES, "ns a fix")
