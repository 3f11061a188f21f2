"""What the core installs suffices for the demo and for estimates: scipy, websockets and others are extras."""

import subprocess
import sys

import steerway
from tests.scenes import turning

EXTRAS = ("scipy", "sklearn", "distributed", "websockets", "nicegui", "pymavlink", "daqp", "matplotlib", "bokeh")
WITHOUT = f"import sys; sys.modules.update(dict.fromkeys({EXTRAS}))\nfrom steerway.commands.cli import main; main()"


def run(*arguments):
    done = subprocess.run([sys.executable, "-c", WITHOUT, *map(str, arguments)], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def test_a_log_is_estimated_without_the_extras(tmp_path):
    log = tmp_path / "log.csv"
    steerway.write(turning(2.0, 0.5, 60.0).fixes(0.3, 1), log)
    assert run("estimate", log, "--smooth", "--profile", "small-usv")[0] == 0


def test_a_scenario_is_simulated_without_the_extras(tmp_path):
    scenario = tmp_path / "short.toml"
    scenario.write_text(
        "duration = 10.0\n[route]\nwaypoints = [{ north = 0.0, east = 0.0 }, { north = 50.0, east = 0.0 }]\n"
    )
    code, out = run("simulate", scenario, "-o", tmp_path / "sailed", "--nmea")
    assert code == 0, out
    assert "This page has figures after pip install" in (tmp_path / "sailed" / "index.html").read_text()


def test_what_is_missing_is_named(tmp_path):
    log = tmp_path / "staircase.csv"
    rows = "".join(f"{k},{1.0 + 0.01 * k},{2.0 + 0.02 * k}\n" for k in range(200))
    log.write_text("time_s,speed_mps,shaft_rps\n" + rows)
    code, out = run("identify", "surge", log)
    expected = "pip install '.[{}]' in a clone of steerway\n"
    assert (code, out) == (2, f"steerway: this needs the package scipy, expected {expected.format('identify')}")
    track = tmp_path / "track.csv"
    steerway.write(turning(2.0, 0.5, 60.0).fixes(0.3, 1), track)
    for name in ("report.html", "report.png"):
        code, out = run("estimate", track, "--profile", "small-usv", "--report", tmp_path / name)
        assert code == 2 and out.endswith(expected.format("report")), out
