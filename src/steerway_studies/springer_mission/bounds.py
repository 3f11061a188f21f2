"""Numbers of P4's matrices, autopilot and interval filters."""

import math
import time

import numpy as np

from steerway.estimation.heading import IntervalFilter, ModelBank, corners
from steerway.sensors import TCM2, TRUE_TCM2, random_compass, stability_limit
from steerway.vessels import CALM, RPM, Springer
from steerway.vessels import SPRINGER_PAPER_YAW as PAPER_YAW
from steerway_studies.papers.interval_filter import PrintedIntervalFilter
from steerway_studies.papers.output_corrected_mpc import OutputCorrectedMpc
from steerway_studies.springer_mission.navigators import WeightedBounds, ideal, interval_box
from steerway_studies.springer_mission.world import World, paper_mpc, sail

SECONDS = 860


def decoding(results):
    """Gains, limits and offsets of the decoded matrices."""
    for key, model, published, target in (
        ("dc_gain_nominal", TCM2, "1", 0.99997),
        ("dc_gain_true_shift_exact", TCM2.scaled(1.005), "", 1.2778),
        ("dc_gain_true", TRUE_TCM2, "", 1.5780),
    ):
        met = abs(model.gain - target) <= (1e-5 if target < 1.0 else 5e-5)
        results.compare(
            key, model.gain, f"gain of the compass, {key[8:].replace('_', ' ')}", "", published, target, met
        )
    for key, shift_too, target in (
        ("stability_limit_shift_exact", False, 1.02386),
        ("stability_limit_shift_scaled", True, 1.01384),
    ):
        limit = stability_limit(shift_too)
        name = f"factor on the compass at which it turns unstable, {key[16:].replace('_', ' ')}"
        results.compare(key, limit, name, "", "", f"{target} ± 1e-5", abs(limit - target) <= 1e-5)
    vessel, headings = Springer("paper"), []
    state = vessel.start()
    state[4] = 300.0 * RPM
    for _ in range(122):
        headings.append(math.degrees(vessel.heading(state)))
        state = vessel.step(state, (300.0 * RPM,), CALM, 1.0)
    for second, target in ((0, 2.507), (30, 2.924), (120, 4.108)):
        rate = headings[second + 1] - headings[second]
        results.compare(
            f"turn_rate_{second}s_dps",
            rate,
            f"turn rate at 300 rpm after {second} s",
            "°/s",
            "",
            f"{target} ± 0.002",
            abs(rate - target) <= 0.002,
        )


def offsets(results):
    """What 10 rpm of bias leaves of a heading of 57.3°."""
    for key, autopilot in (("mpc", paper_mpc()), ("mpc_output_correction", OutputCorrectedMpc(paper_mpc()))):
        vessel = Springer("paper", bias=10.0 * RPM)
        state, off = vessel.start(), []
        for _ in range(3601):
            heading = vessel.heading(state)
            off.append(math.degrees(heading - 1.0))
            state = vessel.step(state, (autopilot.step(1.0, heading),), CALM, 1.0)
        for second, label in ((600, "600 s"), (3600, "an hour")):
            met = abs(off[second]) < 0.01 if key == "mpc" else None
            name = "MPC with a bias state" if key == "mpc" else "the textbook's output correction"
            results.compare(
                f"{key}_offset_{second}s_deg",
                abs(off[second]),
                f"heading offset that 10 rpm leave after {label}, {name}",
                "°",
                "",
                "< 0.01" if key == "mpc" else "shown failing",
                met,
            )


def inclusion(results, voyage, models: int, seed: int):
    """Every filter of the box inside the bounds, at three boxes."""
    shares = []
    for tolerance in (0.001, 0.005, 0.01):
        rng = np.random.default_rng(seed)
        bank = ModelBank([random_compass(rng, tolerance) for _ in range(models)])
        bounds, inside = IntervalFilter(interval_box(tolerance)), 0
        for difference, readings in zip(voyage.difference[:SECONDS], voyage.readings[:SECONDS], strict=True):
            bounds.step(difference, readings)
            bank.step(difference, readings)
            headings = bank.headings
            inside += int(np.sum((bounds.low <= headings) & (headings <= bounds.high)))
        shares.append(100.0 * inside / (models * min(SECONDS, len(voyage.difference))))
        results.numbers[f"interval_inclusion_{_tenths(tolerance)}_pct"] = shares[-1]
    name = f"estimates of {models} models in the box inside the bounds, worst of three boxes"
    results.compare("interval_inclusion_pct", min(shares), name, "%", "", "100", min(shares) == 100.0)


def _tenths(tolerance):
    return f"{1000.0 * tolerance:g}".zfill(2)


WIDTHS = (
    ("interval_width_1pct_deg", 0.01, 1, 6500.0, "sharpened, ± 1 %"),
    ("interval_width_05pct_deg", 0.005, 1, 400.0, "sharpened, ± 0.5 %"),
    ("interval_width_01pct_deg", 0.001, 1, None, "sharpened, ± 0.1 %"),
    ("interval_width_1pct_4x4_deg", 0.01, 4, 520.0, "sharpened, ± 1 %, 4 × 4 sub-boxes"),
)


def widths(results, voyage) -> dict[str, np.ndarray]:
    """Widths over time by key, degrees, and their values at the end; the hull of 17 filters beside each."""
    traces = {}
    for key, tolerance, parts, target, label in WIDTHS:
        bounds, bank = IntervalFilter(interval_box(tolerance), parts=parts), ModelBank(corners(tolerance))
        trace = []
        for difference, readings in zip(voyage.difference[:SECONDS], voyage.readings[:SECONDS], strict=True):
            bounds.step(difference, readings)
            bank.step(difference, readings)
            trace.append((bounds.width, bank.high - bank.low))
        traces[key] = np.degrees(trace)
        width, hull = traces[key][-1]
        met = None if target is None else width <= target
        aim = "" if target is None else f"≤ {target:g}"
        results.compare(key, width, f"width of the bounds at {SECONDS} s, {label}", "°", "", aim, met)
        results.compare(key.replace("width", "hull"), hull, f"hull of 17 filters at {SECONDS} s, {label}", "°")
    for key, tolerance, shift_too, latest in (
        ("literal_1pct_diverged_s", 0.01, False, 15),
        ("literal_10pct_diverged_s", 0.1, True, 10),
    ):
        bounds, second = PrintedIntervalFilter(interval_box(tolerance, shift_too)), 0
        while not bounds.diverged and second < SECONDS:
            bounds.step(voyage.difference[second], voyage.readings[second])
            second += 1
        name = f"literal interval filter reports divergence, ± {100 * tolerance:g} %"
        printed = "bounds shown to the end" if shift_too else ""
        results.compare(key, second, name, "s", printed, f"≤ {latest}", second <= latest)
    return traces


def tautology(results, seed):
    """The weighted estimate with the ideal weight, in the loop; returns its voyage and the bounds (rad)."""
    navigator = WeightedBounds(IntervalFilter(interval_box(0.01, shift_too=False)), TRUE_TCM2)
    voyage = sail(World(), navigator, seed)
    low, high, weight, truth = np.array(navigator.record).T
    gap = np.degrees(np.abs(weighted_of(low, high, weight) - truth))
    allowed = np.maximum(1e-6, 1e-12 * np.degrees(high - low))
    results.compare(
        "weighted_ideal_difference_deg",
        gap.max(),
        "weighted estimate less the ideal filter's, largest",
        "°",
        "0",
        "≤ max(1e-6, 1e-12 width)",
        bool(np.all(gap <= allowed)),
    )
    for key, value, name in (
        ("weight_least", weight.min(), "least ideal weight"),
        ("weight_largest", weight.max(), "largest ideal weight"),
    ):
        results.compare(key, value, name, "", "", "in [0, 1]", 0.0 <= value <= 1.0)
    return voyage, navigator


def weighted_of(low, high, weight):
    return low + weight * (high - low)


def speeds(results, voyage):
    """Microseconds a step on this machine, best of several runs."""
    bounds = IntervalFilter(interval_box(0.01))
    bounds.step(0.0, voyage.readings[0])
    step = min(_timed(lambda: bounds.step(0.0, voyage.readings[0])) for _ in range(100)) / 40.0
    results.compare("interval_step_us", 1e6 * step, "sharpened interval step", "µs", "", "≤ 15", step <= 15e-6)
    mpc, times = paper_mpc(), []
    for k in range(300):
        start = time.perf_counter()
        mpc.step(voyage.wanted[k], voyage.heading[k])
        times.append(time.perf_counter() - start)
    step = float(np.median(times))
    results.compare("mpc_step_us", 1e6 * step, "MPC step", "µs", "", "≤ 15", step <= 15e-6)
    navigator = WeightedBounds(IntervalFilter(interval_box(0.01)), TRUE_TCM2)
    taken = _timed(lambda: sail(World(), navigator, 1)) * 900.0 / len(voyage.heading)
    name = "a mission of 900 s with the interval filter at 40 Hz"
    results.compare("interval_mission_s", taken, name, "s", "", "≤ 1", taken <= 1.0)


def _timed(work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def reference_voyage(seed) -> object:
    """The ideal mission that bounds are shown on."""
    return sail(World(), ideal(TRUE_TCM2, PAPER_YAW), seed)
