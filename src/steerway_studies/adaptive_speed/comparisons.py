"""From judged voyages to named numbers: the worst of seeds and plants, compared with the paper's claims."""

import math

import numpy as np

from steerway_studies.adaptive_speed import judge, plants, printed, theory
from steerway_studies.adaptive_speed.plants import SPEEDS

PUBLISHED_SETTLING = {3: "46.6", 6: "48.4", 9: "74.2"}
"""s, read from the paper's figures, about the final value."""
STEADY = {3: 5.975, 6: 10.529, 9: 15.093}
REQUIREMENT = "< 40 s, no overshoot, 1 %"


def compare_all(results, judged, tracks) -> None:
    """Every number of the study into `results`, in the order in which it is read."""
    _plant(results)
    _published(results, tracks["published"])
    _printed(results, tracks["printed"])
    _ours(results, judged)
    _chance(results, judged)
    _fusion(results, judged)
    _printed_filter(results, judged)
    _faults(results, judged)
    _current_and_outage(results, judged)
    _identification(results, judged)
    _theory(results)
    results.remarks += _remarks(results.numbers)


def column(judged, key, kind, setpoint=None, plant=None) -> np.ndarray:
    """One judged number of every voyage of a kind."""
    return np.array(
        [
            found[key]
            for job, found in judged.items()
            if job.kind == kind and setpoint in (None, job.setpoint) and plant in (None, job.plant)
        ]
    )


def farthest(values, centre):
    """The value that is farthest off."""
    return float(values[np.argmax(np.abs(values - centre))])


def _plant(results):
    for speed in SPEEDS:
        value = printed.steady_shaft(speed)
        met = abs(value - STEADY[speed]) <= 0.01
        what = f"shaft that holds {speed} m/s on plant T"
        results.compare(f"steady_rps_{speed}", value, what, "rev/s", "", f"{STEADY[speed]} ± 0.01", met)
    top = printed.top_speed()
    results.compare("top_speed_mps", top, "top speed of plant T", "m/s", "", "10.59 ± 0.02", abs(top - 10.59) <= 0.02)


def _published(results, tracks):
    targets = {3: 46.7, 6: 47.9, 9: 73.4}
    for speed, track in tracks.items():
        value = printed.settling_about_final(track)
        results.compare(
            f"published_settling_final_s_{speed}",
            value,
            f"published curve {speed} m/s (plant P, no adaptation): settling about its final value",
            "s",
            PUBLISHED_SETTLING[speed] + "; asked < 40",
            f"{targets[speed]} ± 1.5",
            abs(value - targets[speed]) <= 1.5,
        )
        results.numbers[f"published_settling_s_{speed}"] = judge.settling(track.time, track.speed, speed)
        results.numbers[f"published_overshoot_pct_{speed}"] = judge.overshoot_pct(track.speed, speed)
    value = results.numbers["published_overshoot_pct_3"]
    what = "published curve 3 m/s: overshoot"
    results.compare("published_overshoot_pct_3", value, what, "%", "5–6; asked 0", "5.1 ± 0.6", abs(value - 5.1) <= 0.6)


def _printed(results, tracks):
    targets = {3: 40.8, 6: 42.6, 9: 42.9}
    for speed, track in tracks.items():
        found = judge.response(track.time, track.speed, track.shaft, speed)
        settled, over = found["settling_s"], found["overshoot_pct"]
        key = f"printed_mrac_settling_s_{speed}"
        what = f"printed MRAC on plant T, {speed} m/s: settling"
        results.compare(
            key, settled, what, "s", REQUIREMENT, f"{targets[speed]} ± 0.7", abs(settled - targets[speed]) <= 0.7
        )
        what = f"printed MRAC on plant T, {speed} m/s: overshoot"
        results.compare(f"printed_mrac_overshoot_pct_{speed}", over, what, "%", "", "< 0.5", over < 0.5)
        results.numbers[f"printed_mrac_tail_pct_{speed}"] = found["tail_pct"]
    for speed in (6, 9):
        for adapt_first, name, bound in ((False, "output_first", "> 20"), (True, "adapt_first", "< 1")):
            over = judge.overshoot_pct(printed.at_ten_hertz(speed, adapt_first).speed, speed)
            what = f"printed MRAC at 10 Hz, {name.replace('_', ' ')}, {speed} m/s: overshoot"
            met = over < 1.0 if adapt_first else over > 20.0
            results.compare(f"printed_mrac_10hz_{name}_overshoot_pct_{speed}", over, what, "%", "", bound, met)
    over = judge.overshoot_pct(printed.with_lag(3).speed, 3)
    what = "printed MRAC with 1 s of shaft lag, 3 m/s: overshoot"
    results.compare("printed_mrac_lag_overshoot_pct_3", over, what, "%", "", "> 15", over > 15.0)
    track = printed.with_wrong_sign(3)
    error = judge.tail_pct(track.time, track.speed, 3)
    what = "printed MRAC with the wrong sgn(g), 3 m/s: error in the last 20 s"
    settled = judge.settling(track.time, track.speed, 3)
    results.compare("printed_mrac_wrong_sign_tail_pct_3", error, what, "%", "", "does not settle", math.isinf(settled))


def _ours(results, judged):
    for speed in SPEEDS:
        for key, bound, unit in (("settling_s", 36.0, "s"), ("overshoot_pct", 0.3, "%"), ("tail_pct", 0.3, "%")):
            value = column(judged, key, "ours", speed).max()
            what = f"MRAC+, {speed} m/s, worst of plants a–c and seeds: {key.split('_')[0]}"
            asked = {"settling_s": "asked < 40", "overshoot_pct": "asked 0", "tail_pct": "asked ≤ 1"}[key]
            results.compare(f"mracplus_{key}_{speed}", value, what, unit, asked, f"≤ {bound:g}", value <= bound)
        for plant in plants.PLANTS:
            for key in ("settling_s", "overshoot_pct"):
                worst = column(judged, key, "baseline", speed, plant).max()
                results.numbers[f"pi_{key}_{speed}_{plant}"] = worst
    most = column(judged, "shaft_max", "ours").max()
    results.compare("mracplus_shaft_max_rps", most, "MRAC+: fastest shaft", "rev/s", "", "≤ 17.5", most <= 17.5)
    slowest = max(column(judged, f"step_{i}_s", "staircase").max() for i in range(1, 6))
    what = "staircase 3-6-9-6-3 m/s, plants a–c: slowest step"
    results.compare("staircase_settling_s", slowest, what, "s", "", "≤ 36", slowest <= 36.0)


def _chance(results, judged):
    passed = {}
    for speed in SPEEDS:
        good = (
            (column(judged, "settling_s", "chance", speed) < 40.0)
            & (column(judged, "overshoot_pct", "chance", speed) <= 0.5)
            & (column(judged, "tail_pct", "chance", speed) <= 1.0)
        )
        passed[speed] = 100.0 * float(good.mean())
        results.numbers[f"random_plants_pass_pct_{speed}"] = passed[speed]
        results.numbers[f"random_plants_settling_s_{speed}"] = column(judged, "settling_s", "chance", speed).max()
    worst = min(passed.values())
    what = "random plants that meet settling, overshoot and tail, worst set-point"
    results.compare("random_plants_pass_pct", worst, what, "%", "", "≥ 99", worst >= 99.0)
    peak = column(judged, "peak_pct", "chance").max()
    what = "random plants: peak after current and wind arrive"
    results.compare("random_plants_peak_pct", peak, what, "%", "", "≤ 4", peak <= 4.0)


def _fusion(results, judged):
    for speed, rms, most in zip(SPEEDS, (0.045, 0.025, 0.016), (0.25, 0.13, 0.09), strict=True):
        value = column(judged, "rms_pct", "ours", speed).max()
        what = f"fused speed, {speed} m/s: RMS error"
        results.compare(f"fusion_rms_pct_{speed}", value, what, "%", "asked ≤ 1", f"≤ {rms}", value <= rms)
        value = column(judged, "max_pct", "ours", speed).max()
        what = f"fused speed, {speed} m/s: largest error after 10 s"
        results.compare(f"fusion_max_pct_{speed}", value, what, "%", "asked ≤ 1", f"≤ {most}", value <= most)
    ratio = max(column(judged, "rms_pct", "ours", speed).max() * speed / 100.0 / 0.002 for speed in SPEEDS)
    results.compare("fusion_over_dvl", ratio, "fused RMS over the log's own", "", "", "≤ 0.7", ratio <= 0.7)
    nis = farthest(column(judged, "nis", "ours"), 1.0)
    results.compare("fusion_nis", nis, "mean NIS, the run farthest from 1", "", "", "0.9–1.1", 0.9 <= nis <= 1.1)
    share = farthest(column(judged, "coverage", "ours"), 0.95)
    what = "coverage of the 95 % band, the run farthest off"
    results.compare("fusion_coverage", share, what, "", "", "0.92–0.98", 0.92 <= share <= 0.98)
    for speed, bound in zip(SPEEDS, (0.3, 0.15, 0.1), strict=True):
        value = column(judged, "rms_pct", "gps_only", speed).max()
        what = f"GPS and accelerometer only, {speed} m/s: RMS error"
        results.compare(f"gps_imu_rms_pct_{speed}", value, what, "%", "", f"≤ {bound}", value <= bound)


def _printed_filter(results, judged):
    readings = {
        "literal": "printed filter, accelerometer read as a speed sensor of 5 µg",
        "gps_dvl": "printed filter, GPS and log only",
        "integrated": "printed filter, speed integrated from a real accelerometer",
        "printed_sign": "printed filter with the printed sign in (28)",
    }
    for reading, what in readings.items():
        for speed in SPEEDS:
            value = column(judged, reading, "printed_filter", speed).max()
            diverges = reading in ("integrated", "printed_sign")
            what_at = f"{what}, {speed} m/s: largest error"
            key = f"printed_ekf_{reading}_max_pct_{speed}"
            target = "diverges" if diverges else "≤ 1 (asked)"
            results.compare(key, value, what_at, "%", "≤ 1", target, value > 10.0 if diverges else value <= 1.0)


def _faults(results, judged):
    bounds = {"dvl": 1.0, "dvl_ramp": 2.0, "gps": 0.3}
    names = {"dvl": "log +0.1 m/s", "dvl_ramp": "log ramp 0.005 m/s²", "gps": "GPS +0.3 m/s"}
    for name, bound in bounds.items():
        value = column(judged, "max_pct", "fault", plant=name).max()
        results.compare(
            f"fault_{name}_max_pct", value, f"{names[name]}: largest error", "%", "", f"≤ {bound:g}", value <= bound
        )
    for name in (*bounds, "imu"):
        results.numbers[f"fault_{name}_named_s"] = column(judged, "named_s", "fault", plant=name).max()
    results.numbers["fault_imu_max_pct"] = column(judged, "max_pct", "fault", plant="imu").max()
    results.numbers["random_plants_false_exclusions"] = column(judged, "exclusions", "chance").sum()
    named = results.numbers["fault_dvl_ramp_named_s"]
    results.compare("fault_dvl_ramp_named_s", named, "log ramp: the log named after", "s", "", "≤ 12", named <= 12.0)
    back = column(judged, "recovered_s", "fault", plant="imu").max()
    what = "accelerometer +0.1 m/s²: back below 1 % after"
    results.compare("fault_imu_recovered_s", back, what, "s", "", "≤ 10", back <= 10.0)
    false = column(judged, "exclusions", "faultless").sum()
    runs = len(column(judged, "exclusions", "faultless"))
    what = f"false exclusions in {runs} sound runs with current and wind"
    results.compare("fault_false_exclusions", false, what, "", "", "0", false == 0)


def _current_and_outage(results, judged):
    for speed, bound in zip(SPEEDS, (0.7, 0.4, 0.25), strict=True):
        value = column(judged, "max_pct", "water_track", speed).max()
        what = f"log on water track in 0.5 m/s of current, {speed} m/s: largest ground-speed error"
        results.compare(f"water_track_max_pct_{speed}", value, what, "%", "", f"≤ {bound}", value <= bound)
    found = column(judged, "current_found_s", "water_track").max()
    results.compare("current_found_s", found, "current within 0.05 m/s for good after", "s", "", "≤ 10", found <= 10.0)
    worst = column(judged, "max_pct", "outage").max()
    what = "60 s without GPS and log, 3 → 6 m/s, identified model: largest error"
    results.compare("outage_max_pct", worst, what, "% of 6 m/s", "", "≤ 0.6", worst <= 0.6)


def _identification(results, judged):
    for key, what, bound in (
        ("drag_linear_pct", "linear drag", 10.0),
        ("drag_quadratic_pct", "quadratic drag", 10.0),
        ("thrust_pct", "thrust", 2.5),
    ):
        value = column(judged, key, "staircase", plant="a").max()
        results.compare(
            f"identified_{key}", value, f"identified {what}: error", "%", "", f"≤ {bound:g}", value <= bound
        )
    known = column(judged, "identified", "staircase", plant="a").min()
    refused = column(judged, "constant_identified", "staircase", plant="a").max()
    what = "staircases that count as identifying"
    results.compare("identified_staircases_pct", 100.0 * known, what, "%", "", "100", known == 1.0)
    what = "logs of one speed that count as identifying"
    results.compare("identified_constant_speed_pct", 100.0 * refused, what, "%", "", "0", refused == 0.0)
    slow = plants.shaft(rate=17.5 / 55.0)
    possible, sentence = plants.NOMINAL.feasible(9.0, slow)
    least = plants.NOMINAL.time_to(9.0, slow)
    what = "9 m/s with a shaft of 55 s to full speed: full throttle takes"
    results.compare("infeasible_least_s_9", least, what, "s", "", "infeasible in 40 s", not possible)
    results.remarks.append(sentence)


def _theory(results):
    inner = slice(2, -2)
    held, free = theory.descent(3.0, constant=True), theory.descent(3.0, constant=False)
    off = float(np.abs(held.derivative - held.claimed)[inner].max() / np.abs(held.claimed).max())
    what = "constant g: V̇ against −d_m z², largest difference over largest"
    results.compare("lyapunov_constant_g_error", off, what, "", "V̇ = −d_m z²", "< 1e-3", off < 1e-3)
    rise = float(np.maximum(np.diff(free.value), 0.0).sum() / free.value[0])
    what = "g(u, n): what V rises by on its way, over its first value"
    results.compare("lyapunov_varying_g_rise", rise, what, "", "V̇ ≤ 0", "> 0: violated", rise > 0.0)
    for speed in SPEEDS:
        value = theory.growth(speed) / speed
        what = f"three degrees of freedom, {speed} m/s: open-loop eigenvalue over u"
        results.compare(f"eigenvalue_{speed}", value, what, "1/m", "", "0.139 ± 2 %", abs(value / 0.139 - 1.0) <= 0.02)
        value = theory.least_stiffness(speed) / speed**2 / 1e3
        what = f"three degrees of freedom, {speed} m/s: least heading gain over u²"
        met = abs(value / 6.41 - 1.0) <= 0.05
        results.compare(f"heading_gain_{speed}", value, what, "kN·m·s²/m²", "", "6.41 ± 5 %", met)
    for speed in (3, 6):
        course = theory.sail_straight(speed, heading_loop=True)
        late = course.time > course.time[-1] - judge.TAIL
        off = math.degrees(np.abs(course.heading[late]).max())
        settled = judge.settling(course.time, course.speed, speed)
        met = off < 0.1 and settled < 40.0
        what = f"three degrees of freedom with a heading loop, {speed} m/s: heading error in the last 20 s"
        results.compare(f"heading_loop_error_deg_{speed}", off, what, "°", "", "straight and settled", met)
        results.numbers[f"heading_loop_settling_s_{speed}"] = settled
        loose = theory.sail_straight(speed, heading_loop=False)
        results.numbers[f"no_heading_loop_turned_deg_{speed}"] = math.degrees(np.abs(loose.heading).max())


def _remarks(numbers) -> list[str]:
    settled = ", ".join(f"{numbers[f'printed_mrac_settling_s_{speed}']:.1f}" for speed in SPEEDS)
    return [
        "The paper's own runs miss its requirements: read from its figures, settling is 46.6, 48.4 and 74.2 s "
        "where less than 40 s is asked, with 5–6 % overshoot at 3 m/s where none is allowed; its curves show no "
        "adaptation.",
        f"The printed design on the printed boat settles in {settled} s: it misses too, as it must, for its "
        "reference model alone takes ln 50/0.1 = 39.1 s. It needs an ideal shaft and a fast loop: with 1 s of "
        "lag, or at 10 Hz with the output before the adaptation, it overshoots by a fifth and more.",
        "The printed filter meets 1 % only where an accelerometer counts as a speed sensor, or is left out. With "
        "a speed integrated from a real accelerometer it trusts the drift; with the sign printed in (28) it runs "
        "away.",
        "The Lyapunov argument holds for constant g, which no propeller has: with g(u, n) of Table II V rises on "
        "its way.",
        "As printed the boat is directionally unstable: the slightest yaw grows as e^(0.139 u t), so that v = "
        "r = 0 of section II-B needs a heading loop.",
        "Plant T: Tables I and II with D = 0.8 m, η = 0.8, ρ = 1.025 t/m³, two propellers, n in rev/s up to 17.5, "
        "which the paper leaves out. Plant P: a surrogate fitted to the published curves. MRAC+ runs on plants a "
        "(T, 0.5 s of shaft lag), b (T, 1.75 rev/s²) and c (P, with an inner shaft loop) with one set of gains.",
        "PI with anti-windup on the same guess is in the numbers as pi_…: quick where the guess happens to be "
        f"right, it overshoots by {numbers['pi_overshoot_pct_3_b']:.0f} % on plant b and by "
        f"{numbers['pi_overshoot_pct_3_c']:.0f} % on plant c at 3 m/s, without an inner loop there.",
        f"A fault of the accelerometer is not avoided but recovered from: {numbers['fault_imu_max_pct']:.1f} % at "
        "worst in the two seconds before it is named.",
        "The vote's third voice is plant T's own propeller model, also in sound runs; random boats have the same, "
        "wrong for them. It isolates faults of GPS and log in steady sailing; in a transient that the model does "
        "not follow it waits or can name the wrong one.",
        "Estimates are judged after 10 s, as the paper's figures 13–15 are drawn. GPS 0.03 m/s and log 0.002 m/s "
        "at 10 Hz, white; accelerometer at 200 Hz with 5 mg at switching on, 5 µg in the run, 60 µg/√Hz and a "
        "gravity leak of 0.0034 m/s² over 5 s. The filter is given these sizes.",
    ]
