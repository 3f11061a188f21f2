"""`steerway study`: studies are found by entry points, what is missing is said, and a page says what came out."""

import json
import math
import re
import tomllib
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import steerway
import steerway_studies
from steerway.commands.testing import GROUP, study
from steerway.simulation import Unfinished
from steerway_studies.testing import Quantity, Results, keeping, means, over_cases, reached
from tests.command_line import run

THEIRS = """
from matplotlib.figure import Figure
from steerway_studies.study import Results, Study
STUDIES = {"theirs": "elsewhere", "needy": "needy"}
def run(seeds, first_seed, progress):
    results = Results("Theirs")
    results.compare("n", seeds, "seeds")
    return results
STUDY = Study("theirs", "a study of somebody else", run, drawn=lambda seed: {"line": (Figure(), f"seed {seed}")})
"""
NEEDY = """
from steerway_studies.study import Study
STUDY = Study("needy", "needs a package", None, needs=("numpy", "no_such_package"))
"""


def test_another_package_adds_studies(tmp_path, monkeypatch):
    """One is run, its figures are drawn without a run; what is not installed is said in one sentence."""
    files = {"elsewhere.py": THEIRS, "needy.py": NEEDY, "a-1.dist-info/METADATA": "Name: a\nVersion: 1\n"}
    files["a-1.dist-info/entry_points.txt"] = f"[{GROUP}]\nelsewhere = elsewhere:STUDIES\n"
    (tmp_path / "a-1.dist-info").mkdir()
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    assert "a study of somebody else" in run("study")[1]
    out = tmp_path / "out"
    assert run("study", "theirs", "-o", out, "--seeds", 7)[1].splitlines()[0].split() == ["seeds", "7"]
    kept = (out / "results.json").read_text()
    assert run("study", "theirs", "-o", out, "--figures-only", "--first-seed", 3)[0] in (0, None)
    assert (out / "line.png").read_bytes().startswith(b"\x89PNG") and "seed 3" in (out / "index.html").read_text(
        "utf-8"
    )
    assert (out / "results.json").read_text() == kept
    code, _, error = run("study", "ours")
    assert code == 2 and re.search(r"study .ours. is unknown, expected one of .*theirs", error)
    expected = "expected pip install '.[studies]' in a clone of steerway\n"
    needs = f"steerway: study needy needs the package no_such_package, {expected}"
    assert run("study", "needy") == (2, "", needs)
    monkeypatch.setattr(study, "entry_points", lambda **group: ())
    assert run("study", "needy") == (2, "", f"steerway: no studies are installed, {expected}")


def test_the_package_names_its_table_and_every_study_loads():
    root = Path(steerway.__file__).parents[2]
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (value,) = project["entry-points"][GROUP].values()
    assert EntryPoint("papers", value, GROUP).load() is steerway_studies.STUDIES
    found = {name: import_module(module).STUDY for name, module in steerway_studies.STUDIES.items()}
    assert all(each.name == name and each.summary for name, each in found.items())
    drawn = sorted(name for name, each in found.items() if each.drawn)
    assert drawn == ["adaptive-speed", "mariner-los", "otter-course", "springer-mission"]
    with pytest.raises(steerway.InputError, match="study at-sea draws its figures from all its runs"):
        found["at-sea"].figures_only(0)


def test_a_study_that_goes_on_runs_what_is_missing_and_counts_what_is_done(tmp_path, monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 1)  # in this process: a worker needs seconds to start
    shares = []
    with keeping(Unfinished(tmp_path / "parts", {})):
        over_cases(math.sqrt, [1.0, 4.0])
        assert over_cases(math.sqrt, [1.0, 4.0, 9.0, 16.0], progress=shares.append) == [1.0, 2.0, 3.0, 4.0]
    assert shares == [0.5, 0.75, 1.0]


def test_a_study_of_many_sections_begins_with_a_verdict(tmp_path):
    results = Results("T", lead="What it is about.", section="First")
    results.compare("a", 1.0, "how near", "m", target="≤ 2", met=True)
    assert "Verdict" not in results.write(tmp_path).read_text(encoding="utf-8")
    results.section = "Second"
    for k in range(5):
        results.compare(f"b{k}", 3.0 + k, f"how far {k}", "m", target="≤ 3", met=k == 0, interval=(2.0, 9.0))
    results.section = "Third"
    results.add({"d": 1.0, "d_ci": 0.4}, [Quantity("d", "how open", "m", "", "≤ 1.2")])
    results.remarks.append("Why.")
    page = results.write(tmp_path).read_text(encoding="utf-8")
    verdict, details = page.split("<h2>Remarks</h2>")
    shown = ("1 of 1", "1 of 5", "how far 1: 4 (2 to 9) m, target ≤ 3", "and 1 more", "undecided")
    assert [
        words
        for words in ("What it is about.", *shown, "how open: 1 (0.6 to 1.4) m, target ≤ 1.2")
        if words not in verdict
    ] == []
    assert re.findall("<h2>(First|Second|Third)</h2>", details) == ["First", "Second", "Third"]
    assert json.loads((tmp_path / "results.json").read_text())["b4_high"] == 9.0


TARGETS = (
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
)


def test_a_target_is_what_its_text_says():
    for target, within, beyond in TARGETS:
        assert (reached(target, within), reached(target, beyond), reached(target, math.nan)) == (True, False, False)
    with pytest.raises(ValueError, match=r"target is 'about 3', expected one of "):
        reached("about 3", 3.0)


VERDICTS = (
    ("≤ 3", 1.95, 0.95, "met"),
    ("≤ 3", 2.0, 1.1, "undecided"),
    ("≤ 3", 4.0, 1.1, "undecided"),
    ("≤ 3", 4.0, 0.9, "missed"),
    ("2 ± 0.5", 3.0, 3.0, "undecided"),
    ("≤ 3", 4.0, math.nan, "missed"),
)


def test_a_target_within_the_interval_of_a_mean_is_undecided():
    for target, value, half, verdict in VERDICTS:
        results = Results("T")
        results.add({"a": value, "a_ci": half}, [Quantity("a", "how near", "m", "0.9", target)])
        (only,) = results.comparisons
        assert (only.key, only.published, only.target, only.verdict) == ("a", "0.9", target, verdict)
        assert {"a", "a_ci"} <= set(results.numbers)
    found = means([{"a": 1.0}, {"a": 3.0}, {"a": 2.0}])
    assert found["a"] == 2.0 and found["a_ci"] == pytest.approx(1.95996 / math.sqrt(3.0), rel=1e-4)
    assert means([{"a": 1.0}]) == {"a": 1.0}
