"""Every study whole, with one seed, in this process: its numbers, its targets, its page and its figures."""

import json
import math

import pytest

import steerway_studies

NEEDS_LOGS = ("unseen-logs",)
KEYS = {
    "adaptive-speed": """mracplus_settling_s_3 mracplus_overshoot_pct_9 printed_mrac_settling_s_6 fusion_rms_pct_9
        fusion_nis random_plants_pass_pct fault_dvl_ramp_named_s""",
    "cybership-observers": """tekf_mae_all tekf_mae_fix tekf_recipe_b_mae observer_stock_mae observer_tuned_mae ekf9_mae
        ekf9_bound_ratio ekf9_nis rts_mae hold_mae pid_overshoot_north_pct pid_overshoot_east_pct""",
    "mariner-los": """truth_switch_s_1 truth_switch_s_4 truth_rudder_max_deg truth_rudder_rate_max_dps
        truth_cross_track_max_m rotations_finished_pct rudder_rate_ratio heading_los_offset_ratio""",
    "otter-course": """verbatim_sog_rms_mps verbatim_cog_rms_deg verbatim_rate_rms_dps verbatim_overshoot_pct
        verbatim_settling_s noisy_0p1_course_rms_deg noisy_0p5_course_rms_deg""",
    "springer-mission": """ideal_reached ideal_time_s nominal_reached nominal_heading_rms_deg
        weight_net_heading_rms_deg scale_state_heading_rms_deg
        product_s2_reached_all_pct product_s2_heading_median_deg interval_inclusion_pct deviation_printed_ideal_m
        deviation_printed_nominal_m interval_width_1pct_deg literal_1pct_diverged_s""",
}
"""Study → numbers that documents name."""


@pytest.mark.timeout(3000)
@pytest.mark.parametrize("name", sorted(set(steerway_studies.STUDIES) - set(NEEDS_LOGS)))
def test_a_study_meets_its_targets_with_one_seed_and_writes_its_page(name, tmp_path):
    shares = []
    results = steerway_studies.named(name).run(1, 1, lambda share, what: shares.append(share))
    page = results.write(tmp_path)
    numbers = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert [each.key for each in results.comparisons if each.met is False] == []
    assert all(math.isfinite(results.numbers[each.key]) for each in results.comparisons)
    assert [key for key in KEYS.get(name, "").split() if not isinstance(numbers[key], float)] == []
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert page.stat().st_size > 10_000
    assert {path.stem for path in tmp_path.glob("*.png")} == set(results.figures)
