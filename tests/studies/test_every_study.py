"""Every study whole, with few seeds, in this process: its numbers, its targets, its page and its figures."""

import json
import math

import pytest

import steerway_studies


@pytest.mark.timeout(3000)
@pytest.mark.parametrize("name", sorted(set(steerway_studies.STUDIES) - {"unseen-logs"}))  # needs logs
def test_a_study_meets_its_targets_and_writes_its_page(name, tmp_path):
    """With one seed; targets of CyberShip's observers are for means over runs of a minute."""
    shares, seeds = [], 8 if name == "cybership-observers" else 1
    results = steerway_studies.named(name).run(seeds, 1, lambda share, what: shares.append(share))
    page = results.write(tmp_path)
    written = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert [each.key for each in results.comparisons if each.met is False] == []
    assert all(math.isfinite(results.numbers[each.key]) for each in results.comparisons)
    assert all(written[each.key] == pytest.approx(results.numbers[each.key]) for each in results.comparisons)
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert page.stat().st_size > 10_000
    assert {path.stem for path in tmp_path.glob("*.png")} == set(results.figures)
