"""The page of a study: a long one says first what came out."""

import json
import math

import pytest

from steerway_studies.testing import Quantity, Results, judged, means, reached


def long_study():
    results = Results("T", lead="What it is about.")
    results.section = "First"
    results.compare("a", 1.0, "how near", "m", target="≤ 2", met=True)
    results.section = "Second"
    for k in range(5):
        results.compare(f"b{k}", 3.0 + k, f"how far {k}", "m", target="≤ 3", met=k == 0, interval=(2.0, 9.0))
    results.section = "Third"
    results.compare("c", 7.0, "how odd")
    results.remarks.append("Why.")
    return results


def test_a_study_of_many_sections_begins_with_a_verdict(tmp_path):
    page = long_study().write(tmp_path).read_text()
    verdict, details = page.split("<h2>Remarks</h2>")
    assert "What it is about." in verdict
    assert "1 of 1" in verdict and "1 of 5" in verdict and "Third" not in verdict
    assert "how far 1: 4 (2 to 9) m, target ≤ 3" in verdict and "and 1 more" in verdict and "how far 4" not in verdict
    assert [details.index(f"<h2>{name}</h2>") for name in ("First", "Second", "Third")] == sorted(
        details.index(f"<h2>{name}</h2>") for name in ("First", "Second", "Third")
    )
    assert json.loads((tmp_path / "results.json").read_text())["b4_high"] == 9.0


def test_a_study_of_one_shows_its_comparisons_at_once(tmp_path):
    results = Results("T")
    results.compare("a", 1.0, "how near", "m", target="≤ 2", met=True)
    page = results.write(tmp_path).read_text()
    assert "Published, target and measured" in page and "Verdict" not in page


@pytest.mark.parametrize(
    ("target", "within", "beyond"),
    [
        ("≤ 0.06", 0.06, 0.061),
        ("≥ 95", 95.0, 94.9),
        ("< 0.001", 9e-4, 1e-3),
        ("> 20: fails", 20.1, 20.0),
        ("1.9 to 2.1", 2.1, 2.2),
        ("9.7 ± 0.5", 9.2, 10.21),
        ("1.02386 ± 1e-5", 1.023865, 1.02388),
        ("0.139 ± 2 %", 0.1415, 0.142),
        ("−1.5 ± 0.1", -1.45, 1.5),
        ("100", 100.0, 99.9),
    ],
)
def test_a_target_is_what_its_text_says(target, within, beyond):
    assert reached(target, within) and not reached(target, beyond) and not reached(target, math.nan)


def test_a_target_that_says_nothing_is_refused():
    with pytest.raises(ValueError, match=r"target is 'about 3', expected one of "):
        reached("about 3", 3.0)


def test_numbers_that_are_listed_are_compared_and_all_are_kept():
    results = Results("T")
    results.add({"a": 1.0, "b": 2.0}, [Quantity("a", "how near", "m", "0.9", "≤ 0.5")])
    (only,) = results.comparisons
    assert (only.key, only.published, only.target, only.met) == ("a", "0.9", "≤ 0.5", False)
    assert results.numbers == {"a": 1.0, "b": 2.0}


@pytest.mark.parametrize(
    ("target", "value", "interval", "verdict"),
    [
        ("≤ 3", 2.0, (1.0, 2.9), "met"),
        ("≤ 3", 2.0, (0.9, 3.1), "undecided"),
        ("≤ 3", 4.0, (2.9, 5.1), "undecided"),
        ("≤ 3", 4.0, (3.1, 4.9), "missed"),
        ("2 ± 0.5", 3.0, (0.0, 6.0), "undecided"),
        ("≤ 3", 4.0, (math.nan, math.nan), "missed"),
    ],
)
def test_a_target_within_the_interval_of_a_number_is_undecided(target, value, interval, verdict):
    results = Results("T")
    half = 0.5 * (interval[1] - interval[0])
    results.add(
        {"a": 0.5 * sum(interval) if math.isfinite(half) else value, "a_ci": half}, [Quantity("a", "", "", "", target)]
    )
    assert results.comparisons[0].verdict == verdict
    assert judged(target, value, interval) == {"met": True, "missed": False, "undecided": None}[verdict]


def test_the_page_says_what_is_undecided(tmp_path):
    results = Results("T")
    for section in ("First", "Second"):
        results.section = section
        results.add({section: 1.0, f"{section}_ci": 0.4}, [Quantity(section, "how near", "m", "", "≤ 1.2")])
    page = results.write(tmp_path).read_text()
    assert "undecided" in page and "0 of 1" in page and "how near: 1 (0.6 to 1.4) m, target ≤ 1.2" in page


def test_means_have_their_intervals():
    found = means([{"a": 1.0}, {"a": 3.0}, {"a": 2.0}])
    assert found["a"] == 2.0 and found["a_ci"] == pytest.approx(1.95996 / math.sqrt(3.0), rel=1e-4)
    assert means([{"a": 1.0}]) == {"a": 1.0}
