"""Numbers of P4's matrices, autopilot and interval filters."""

import math

import numpy as np

from steerway.estimation.heading import IntervalFilter, ModelBank, corners
from steerway.sensors import TCM2, TRUE_TCM2, random_compass, stability_limit
from steerway.vessels import CALM, RPM, Springer
from steerway_studies.papers.interval_filter import PrintedIntervalFilter
from steerway_studies.springer_mission.missions import WeightedBounds, interval_box
from steerway_studies.springer_mission.world import World, paper_mpc, sail
from steerway_studies.study import Quantity

SECONDS = 860
WIDTHS = {"1pct": (0.01, 1), "05pct": (0.005, 1), "01pct": (0.001, 1), "1pct_4x4": (0.01, 4)}
"""Key → tolerance of the box, and the number of parts into which either side of the box is divided."""


def decoding() -> dict[str, float]:
    """Gains and stability limits of the decoded matrices, and turn rates at 300 rpm."""
    vessel, headings = Springer("paper"), []
    state = vessel.start()
    state[4] = 300.0 * RPM
    for _ in range(122):
        headings.append(math.degrees(vessel.heading(state)))
        state = vessel.step(state, (300.0 * RPM,), CALM, 1.0)
    return {
        "dc_gain_nominal": TCM2.gain,
        "dc_gain_true_shift_exact": TCM2.scaled(1.005).gain,
        "dc_gain_true": TRUE_TCM2.gain,
        "stability_limit_shift_exact": stability_limit(False),
        "stability_limit_shift_scaled": stability_limit(True),
        **{f"turn_rate_{second}s_dps": headings[second + 1] - headings[second] for second in (0, 30, 120)},
    }


class OutputCorrectedMpc:
    """A HeadingMpc without an observer: the last output error is added to the open-loop prediction (step-response MPC).

    If the plant is not asymptotically stable, the open-loop states drift off, and the prediction with them.
    """

    def __init__(self, mpc):
        self._mpc = mpc
        mpc.reset(0.0)

    def step(self, wanted: float, estimated: float) -> float:
        """The speed difference of the propellers (rad/s) for a heading wanted and one estimated, rad."""
        error = estimated - self._mpc.observer.output
        return self._mpc.step(wanted - error, math.nan)


def offsets() -> dict[str, float]:
    """Remaining heading error (°) with a propeller bias of 10 rpm, for an ordered heading of 1 rad."""
    found = {}
    for key, autopilot in (("mpc", paper_mpc()), ("mpc_output_correction", OutputCorrectedMpc(paper_mpc()))):
        vessel = Springer("paper", bias=10.0 * RPM)
        state, off = vessel.start(), []
        for _ in range(3601):
            heading = vessel.heading(state)
            off.append(math.degrees(heading - 1.0))
            state = vessel.step(state, (autopilot.step(1.0, heading),), CALM, 1.0)
        found |= {f"{key}_offset_{second}s_deg": abs(off[second]) for second in (600, 3600)}
    return found


def inclusion(voyage, models: int, seed: int) -> dict[str, float]:
    """Share (%) of the estimates of filters from the box that lie inside the bounds, for three boxes; and the least."""
    found = {}
    for key, tolerance in (("01", 0.001), ("05", 0.005), ("10", 0.01)):
        rng = np.random.default_rng(seed)
        bank = ModelBank([random_compass(rng, tolerance) for _ in range(models)])
        bounds, inside = IntervalFilter(interval_box(tolerance)), 0
        for difference, readings in zip(voyage.difference[:SECONDS], voyage.readings[:SECONDS], strict=True):
            bounds.step(difference, readings)
            bank.step(difference, readings)
            headings = bank.headings
            inside += int(np.sum((bounds.low <= headings) & (headings <= bounds.high)))
        found[f"interval_inclusion_{key}_pct"] = 100.0 * inside / (models * min(SECONDS, len(voyage.difference)))
    return found | {"interval_inclusion_pct": min(found.values())}


def widths(voyage) -> dict[str, np.ndarray]:
    """Widths (n, 2) over time, degrees, of the bounds and of the hull of 17 filters, by key of WIDTHS."""
    traces = {}
    for key, (tolerance, parts) in WIDTHS.items():
        bounds, bank = IntervalFilter(interval_box(tolerance), parts=parts), ModelBank(corners(tolerance))
        trace = []
        for difference, readings in zip(voyage.difference[:SECONDS], voyage.readings[:SECONDS], strict=True):
            bounds.step(difference, readings)
            bank.step(difference, readings)
            trace.append((bounds.width, bank.high - bank.low))
        traces[key] = np.degrees(trace)
    return traces


def divergence(voyage) -> dict[str, float]:
    """Seconds after which the interval filter as printed has diverged."""
    found = {}
    for key, tolerance, shift_too in (("1pct", 0.01, False), ("10pct", 0.1, True)):
        bounds, second = PrintedIntervalFilter(interval_box(tolerance, shift_too)), 0
        while not bounds.diverged and second < SECONDS:
            bounds.step(voyage.difference[second], voyage.readings[second])
            second += 1
        found[f"literal_{key}_diverged_s"] = second
    return found


def tautology(seed) -> tuple[dict[str, float], object, WeightedBounds]:
    """The weighted estimate with the ideal weight in the loop: (its numbers, the voyage, the navigator)."""
    navigator = WeightedBounds(IntervalFilter(interval_box(0.01, shift_too=False)), TRUE_TCM2)
    voyage = sail(World(), navigator, seed)
    low, high, weight, truth = np.array(navigator.record).T
    found = {
        "weighted_ideal_difference_deg": np.degrees(np.abs(low + weight * (high - low) - truth)).max(),
        "weight_least": weight.min(),
        "weight_largest": weight.max(),
    }
    return found, voyage, navigator


_GAIN, _UNSTABLE = "gain of the compass", "factor on the compass at which it turns unstable"
_OFFSET, _TURN = "heading offset with a bias of 10 rpm", "turn rate at 300 rpm after"
_MPC, _TEXTBOOK = "MPC with a bias state", "the textbook's output correction"
_WIDTH, _HULL, _LITERAL = (
    "width of the bounds at 860 s",
    "hull of 17 filters at 860 s",
    "literal interval filter diverges",
)
QUANTITIES = [
    Quantity("dc_gain_nominal", f"{_GAIN}, nominal", "", "1", "0.99997 ± 1e-5"),
    Quantity("dc_gain_true_shift_exact", f"{_GAIN}, true, shift exact", "", "", "1.2778 ± 5e-5"),
    Quantity("dc_gain_true", f"{_GAIN}, true", "", "", "1.578 ± 5e-5"),
    Quantity("stability_limit_shift_exact", f"{_UNSTABLE}, shift exact", "", "", "1.02386 ± 1e-5"),
    Quantity("stability_limit_shift_scaled", f"{_UNSTABLE}, shift scaled", "", "", "1.01384 ± 1e-5"),
    Quantity("turn_rate_0s_dps", f"{_TURN} 0 s", "°/s", "", "2.507 ± 0.002"),
    Quantity("turn_rate_30s_dps", f"{_TURN} 30 s", "°/s", "", "2.924 ± 0.002"),
    Quantity("turn_rate_120s_dps", f"{_TURN} 120 s", "°/s", "", "4.108 ± 0.002"),
    Quantity("mpc_offset_600s_deg", f"{_OFFSET} after 600 s, {_MPC}", "°", "", "< 0.01"),
    Quantity("mpc_offset_3600s_deg", f"{_OFFSET} after an hour, {_MPC}", "°", "", "< 0.01"),
    Quantity("mpc_output_correction_offset_600s_deg", f"{_OFFSET} after 600 s, {_TEXTBOOK}", "°"),
    Quantity("mpc_output_correction_offset_3600s_deg", f"{_OFFSET} after an hour, {_TEXTBOOK}", "°"),
    Quantity("interval_inclusion_pct", "estimates of models in the box inside the bounds, worst of 3", "%", "", "100"),
    Quantity("interval_width_1pct_deg", f"{_WIDTH}, sharpened, ± 1 %", "°", "", "≤ 6500"),
    Quantity("interval_hull_1pct_deg", f"{_HULL}, ± 1 %", "°"),
    Quantity("interval_width_05pct_deg", f"{_WIDTH}, sharpened, ± 0.5 %", "°", "", "≤ 400"),
    Quantity("interval_hull_05pct_deg", f"{_HULL}, ± 0.5 %", "°"),
    Quantity("interval_width_01pct_deg", f"{_WIDTH}, sharpened, ± 0.1 %", "°"),
    Quantity("interval_hull_01pct_deg", f"{_HULL}, ± 0.1 %", "°"),
    Quantity("interval_width_1pct_4x4_deg", f"{_WIDTH}, sharpened, ± 1 %, 4 × 4 sub-boxes", "°", "", "≤ 520"),
    Quantity("interval_hull_1pct_4x4_deg", f"{_HULL}, ± 1 %", "°"),
    Quantity("literal_1pct_diverged_s", f"{_LITERAL}, ± 1 %, after", "s", "", "≤ 15"),
    Quantity("literal_10pct_diverged_s", f"{_LITERAL}, ± 10 %, after", "s", "bounds shown to the end", "≤ 10"),
    Quantity("weighted_ideal_difference_deg", "weighted estimate less the ideal filter's, largest", "°", "0", "≤ 1e-6"),
    Quantity("weight_least", "least ideal weight", "", "", "0 to 1"),
    Quantity("weight_largest", "largest ideal weight", "", "", "0 to 1"),
]
