"""`steerway study`: studies are found by entry points, and what is missing is said in one sentence."""

import math
import subprocess
import sys
import tomllib
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import steerway
import steerway_studies
from steerway.commands.testing import GROUP, study, terminal
from steerway.simulation import Unfinished
from steerway_studies.testing import Results, Study, keeping, over_cases

ROOT = Path(steerway.__file__).parents[2]


def entry_points_of(folder: Path, table: str) -> None:
    """Makes `folder` look like an installed package that offers studies."""
    folder = folder / "elsewhere-1.dist-info"
    folder.mkdir(parents=True)
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: elsewhere\nVersion: 1\n")
    (folder / "entry_points.txt").write_text(f"[{GROUP}]\nelsewhere = {table}\n")


def test_the_package_names_its_table_and_every_study_loads():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (value,) = project["entry-points"][GROUP].values()
    assert EntryPoint("papers", value, GROUP).load() is steerway_studies.STUDIES
    for name, module in steerway_studies.STUDIES.items():
        assert import_module(module).STUDY.name == name and steerway_studies.named(name).summary


def test_another_package_adds_a_study(tmp_path, monkeypatch, capsys):
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
    study()
    assert "theirs" in (listed := capsys.readouterr().out) and "a study of somebody else" in listed
    study("theirs", tmp_path / "out", 7)
    assert capsys.readouterr().out.splitlines()[0].split() == ["seeds", "7"]
    assert (tmp_path / "out" / "index.html").exists()
    with pytest.raises(steerway.InputError, match=r"study .ours. is unknown, expected one of .*theirs"):
        study("ours")


def test_what_is_not_installed_is_said_in_one_sentence(tmp_path):
    """In processes of their own: without studies, and with a study that needs a package which is not there."""
    (tmp_path / "needy.py").write_text(
        "from steerway_studies.study import Study\n"
        "STUDIES = {'needy': 'needy'}\n"
        "STUDY = Study('needy', 'needs a package', None, needs=('no_such_package',))\n"
    )
    entry_points_of(tmp_path, "needy:STUDIES")
    for path, expected in (
        ([], "no studies are installed, expected pip install '.[studies]' in a clone of steerway"),
        (
            [tmp_path],
            "study needy needs the package no_such_package, expected pip install '.[studies]' in a clone of steerway",
        ),
    ):
        code = (
            "import importlib.metadata, sys; from steerway.commands import cli, study as command\n"
            f"entry_points = lambda **group: importlib.metadata.entry_points(**group) if {bool(path)} else ()\n"
            "command.entry_points = entry_points; sys.argv = ['steerway', 'study', 'needy']; cli.main()"
        )
        command = [sys.executable, "-c", f"import sys; sys.path[:0] = {[str(each) for each in path]}\n{code}"]
        ended = subprocess.run(command, capture_output=True, text=True)
        assert (ended.returncode, ended.stdout, ended.stderr) == (2, "", f"steerway: {expected}\n")


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
    with pytest.raises(steerway.InputError, match="study ours draws its figures of all its runs"):
        Study("ours", "another", run=None).figures_only(0)
    have = {name for name, module in steerway_studies.STUDIES.items() if import_module(module).STUDY.drawn}
    assert have == {"otter-course", "mariner-los", "adaptive-speed", "springer-mission"}


def test_a_study_that_has_what_it_needs_is_run():
    assert Study("s", "", lambda *_: Results("T"), needs=("numpy",)).check_installed() is None


def test_the_time_left_counts_from_what_an_interrupted_run_had_done(tmp_path, monkeypatch, capsys):
    """Half is done before; then a tenth takes ten minutes."""
    clock = [100.0]
    monkeypatch.setattr(terminal.time, "monotonic", lambda: clock[0])
    with terminal.progress_line("study") as step:
        step(0.5)
        clock[0] += 600.0
        step(0.6, "voyages")
    assert capsys.readouterr().err == "study, voyages: 60 %, some 40 min left\n"
    parts = Unfinished(tmp_path / "parts", {})
    with keeping(parts):
        over_cases(math.sqrt, [1.0, 4.0])
        shares = []
        assert over_cases(math.sqrt, [1.0, 4.0, 9.0, 16.0], progress=shares.append) == [1.0, 2.0, 3.0, 4.0]
    assert shares == [0.5, 0.75, 1.0]
