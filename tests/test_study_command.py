"""`steerway study`: studies are found by entry points, what is missing is said, and a page says what came out."""

import json
import math
import re
import tomllib
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import steerway
import steerway_studies
from steerway.commands.testing import GROUP, study
from steerway.simulation import Unfinished
from steerway_studies.testing import Quantity, Results, Study, keeping, means, over_cases, reached
from tests.command_line import run


def entry_points_of(folder: Path, table: str) -> None:
    """Makes `folder` look like an installed package that offers studies."""
    folder = folder / "elsewhere-1.dist-info"
    folder.mkdir(parents=True)
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: elsewhere\nVersion: 1\n")
    (folder / "entry_points.txt").write_text(f"[{GROUP}]\nelsewhere = {table}\n")


def test_the_package_names_its_table_and_every_study_loads():
    root = Path(steerway.__file__).parents[2]
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (value,) = project["entry-points"][GROUP].values()
    assert EntryPoint("papers", value, GROUP).load() is steerway_studies.STUDIES
    for name, module in steerway_studies.STUDIES.items():
        assert import_module(module).STUDY.name == name and steerway_studies.named(name).summary


def test_another_package_adds_a_study(tmp_path, monkeypatch):
    module = tmp_path / "elsewhere.py"
    module.write_text(
        "from steerway_studies.study import Results, Study\n"
        "STUDIES = {'theirs': 'elsewhere'}\n"
        "def run(seeds, first_seed, progress):\n"
        "    results = Results('Theirs')\n"
        "    results.compare('n', seeds, 'seeds')\n"
        "    return results\n"
        "STUDY = Study('theirs', 'a study of somebody else', run)\n"
    )
    entry_points_of(tmp_path, "elsewhere:STUDIES")
    monkeypatch.syspath_prepend(tmp_path)
    _, listed, _ = run("study")
    assert "theirs" in listed and "a study of somebody else" in listed
    _, out, _ = run("study", "theirs", "-o", tmp_path / "out", "--seeds", 7)
    assert out.splitlines()[0].split() == ["seeds", "7"]
    assert (tmp_path / "out" / "index.html").exists()
    code, _, error = run("study", "ours")
    assert code == 2 and re.search(r"study .ours. is unknown, expected one of .*theirs", error)


def test_what_is_not_installed_is_said_in_one_sentence(tmp_path, monkeypatch):
    """A package that a study needs, and all studies."""
    (tmp_path / "needy.py").write_text(
        "from steerway_studies.study import Study\n"
        "STUDIES = {'needy': 'needy'}\n"
        "STUDY = Study('needy', 'needs a package', None, needs=('numpy', 'no_such_package'))\n"
    )
    entry_points_of(tmp_path, "needy:STUDIES")
    monkeypatch.syspath_prepend(tmp_path)
    expected = "expected pip install '.[studies]' in a clone of steerway\n"
    needs = f"steerway: study needy needs the package no_such_package, {expected}"
    assert run("study", "needy") == (2, "", needs)
    monkeypatch.setattr(study, "entry_points", lambda **group: ())
    assert run("study", "needy") == (2, "", f"steerway: no studies are installed, {expected}")


def test_figures_alone_are_drawn_without_a_run(tmp_path, monkeypatch):
    def drawn(seed):
        figure = Figure()
        figure.subplots().plot([0.0, seed])
        return {"line": (figure, f"seed {seed}")}

    theirs = Study("theirs", "a study", run=None, drawn=drawn)
    (tmp_path / "results.json").write_text("kept")
    theirs.figures_only(3).write(tmp_path)
    assert (tmp_path / "line.png").read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "index.html").read_text("utf-8")
    assert "seed 3" in page and (tmp_path / "results.json").read_text() == "kept"
    with pytest.raises(steerway.InputError, match="study ours draws its figures from all its runs"):
        Study("ours", "another", run=None).figures_only(0)
    have = {name for name, module in steerway_studies.STUDIES.items() if import_module(module).STUDY.drawn}
    assert have == {"otter-course", "mariner-los", "adaptive-speed", "springer-mission"}


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
