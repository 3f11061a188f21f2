"""The page of a study: a long one says first what came out."""

import json
import math

import pytest

from steerway_studies.testing import Quantity, Results, reached


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
