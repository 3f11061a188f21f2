"""The commands as a user types them, with the profile files that they write and take."""

import gzip
import json
import os
import subprocess
from importlib.metadata import version
from pathlib import Path

import polars as pl
import pytest

import steerway
import steerway.archive
from steerway.estimation import load_profile
from steerway.estimation.testing import prior_profile
from tests.command_line import STEERWAY, run
from tests.messages import sentences, tagged
from tests.scenes import turning

EXAMPLE = Path(__file__).parents[1] / "examples" / "p2.toml"


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "sortie.csv"
    steerway.write(turning(2.0, 0.5, 200.0).fixes(0.3, 1), path)
    return path


def test_estimate_writes_what_is_asked_or_says_how_to_ask(log, tmp_path):
    pytest.importorskip("bokeh", reason="bokeh is not installed")
    code, out, err = run("estimate", log)
    assert (code, err) == (0, "")
    assert "1001" in out and "-o track.csv" in out and "--report page.html" in out
    table, page = tmp_path / "track.csv", tmp_path / "page.html"
    code, out, _ = run("estimate", log, "-o", table, "--report", page, "--smooth", "--profile", "small-usv")
    assert code == 0 and f"wrote {table}" in out
    assert len(pl.read_csv(table)) == 1001 and 'id="data"' in page.read_text()


def test_json_is_for_machines_also_of_standard_input_gzip_and_an_interval(log, tmp_path):
    packed = tmp_path / "sortie.csv.gz"
    packed.write_bytes(gzip.compress(log.read_bytes()))

    def summary(*arguments, **given):
        code, out, _ = run("estimate", *arguments, "--json", "--profile", "small-usv", **given)
        assert code == 0
        return json.loads(out)

    assert summary(packed, "--rate", "10")["rows"] == 2001
    assert summary("-", stdin=log.read_bytes())["fixes"] == 1001
    start = turning(2.0, 0.5, 200.0).time[0]
    cut = summary(log, "--from", start + 50, "--until", "2023-11-14T22:15:00Z")
    assert cut["start"] == "2023-11-14T22:14:10Z" and cut["fixes"] == 250
    assert isinstance(json.loads(run("info", log, "--json")[1]), list) and "5 Hz" in run("info", log)[1]


def test_files_are_smoothed_standard_input_and_causal_are_not(log):
    def asked(*arguments, **given):
        code, out, err = run("estimate", *arguments, "--profile", "small-usv", **given)
        assert code == 0, err
        return out

    data = log.read_bytes()
    causal, smoothed = "causal: every row uses the fixes up to its time", "smoothed: every row uses the whole log"
    assert smoothed in asked(log) and causal in asked(log, "--causal")
    assert causal in asked("-", stdin=data) and smoothed in asked("-", "--smooth", stdin=data)
    of_file, of_input = (json.loads(asked(*each, "--json")) for each in ((log,), (log, "--causal")))
    assert of_file["smoothed"] and not of_input["smoothed"]
    assert of_file["cog_std_median_deg"] < of_input["cog_std_median_deg"]


def test_tune_writes_a_profile_that_estimate_takes(log, tmp_path):
    short, profile = tmp_path / "short.csv", tmp_path / "mine.toml"
    steerway.write(steerway.read(log).rows(slice(350)), short)
    code, out, _ = run("tune", short, "-o", profile)
    assert code == 0 and "NIS" in out
    assert load_profile(profile).name == "mine"
    assert json.loads(run("estimate", log, "--json", "--profile", profile)[1])["profile"] == "mine"


def test_an_input_is_never_overwritten(log):
    before = log.read_bytes()
    link = log.with_name("link.csv")
    link.symlink_to(log)
    for option, path in (("-o", log), ("--report", log), ("-o", link)):
        code, _, err = run("estimate", log, option, path)
        assert code == 2 and "is also an input" in err
    assert log.read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["estimate", "LOG", "--report", "page.pdf"], "expected .html or .png"),
        (["estimate", "LOG", "-o", "out.xlsx"], "unknown ending, expected one of .csv, .parquet"),
        (["estimate", "LOG", "--profile", "otterr"], "expected one of otter"),
        (["estimate", "LOG", "--aid", "sextant"], "--aid names 'sextant', expected any of auto, sog"),
        (["estimate", "LOG", "-o", "missing/track.csv"], "cannot write 'missing/track.csv': no directory 'missing'"),
        (["estimate", "LOG", "--rate", "1e-320"], "expected Hz between 1e-6 and 1000"),
        (["advise", "otter", "--speed", "1e300"], "--speed is 1e+300, expected at most 1000 m/s"),
        (["estimate", "LOG", "--rate", "fast"], "steerway: --rate is 'fast', expected a number\n"),
        (["simulate", "LOG", "--seeds", "0"], "steerway: --seeds is '0', expected at least 1\n"),
        (["simulate", "LOG", "--dask", "here:1", "-o", "out"], "--dask distributes seeds"),
        (["simulate", "LOG", "--seeds", "2", "--nmea", "-o", "out"], "--nmea writes the log of one run"),
        (["simulate", EXAMPLE, "-o", "LOG"], "cannot write"),
        (["advise", "otter"], "--speed is missing"),
        (["advise", "otter", "--speed", "-1"], "speed is -1, expected a number of at least 0"),
        (["advise", "otter", "--speed", "1", "--rate", "0"], "--rate is 0 Hz"),
        (["estimate", "LOG", "--from", "yesterday"], "--from is 'yesterday', expected a time"),
        (["estimate", "LOG", "--causal", "--smooth"], "--causal and --smooth are both given"),
        (["compare", "LOG"], "no SOG or COG from a receiver"),
        (["study", "otter"], "study 'otter' is unknown"),
        (["sail"], "No such command"),
    ],
)
def test_mistakes_end_in_one_sentence_and_2(log, arguments, message):
    code, out, err = run(*(str(log) if each == "LOG" else each for each in arguments))
    assert code == 2
    assert message in err and err.startswith("steerway: ") and err.count("\n") == 1, err
    assert "Traceback" not in err and out == ""


def test_a_name_cannot_write_on_the_terminal(tmp_path):
    """Control characters are escaped, and brackets are not markup."""
    for name, shown in (("a\x1b[31m\n.csv", r"a\x1b[31m\n.csv"), ("[red].csv", "[red].csv")):
        path = tmp_path / name
        path.write_text("")
        code, _, said = run("info", path)
        assert (code, said) == (2, f"steerway: {tmp_path / shown}: is empty, expected a log\n")
        path.write_text("time_s,lat_deg,lon_deg,\x1b[2J\n1672531201,54,10,1\n")
        code, out, _ = run("info", path)
        assert code == 0 and shown in out and "\x1b" not in out and r"\x1b[2J" in out


def test_the_shell_completes_commands_and_options():
    for words, expected in (("steerway est", "estimate"), ("steerway compare --least", "--least-speed")):
        setting = {"_STEERWAY_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
        done = subprocess.run(STEERWAY, env=os.environ | setting, capture_output=True, text=True)
        assert done.stdout.split() == [expected]


def test_version_and_short_help():
    assert run("--version")[1].strip() == f"steerway {version('steerway')}"
    code, out, _ = run("-h")
    assert code == 0 and out.index("Logs") < out.index("On the boat") < out.index("Simulation") < out.index("Research")


SCENARIO = """
duration = 20.0
[vessel]
kind = "otter"
[route]
waypoints = [{{ north = 0.0, east = 0.0 }}, {{ north = 60.0, east = 0.0 }}]
[estimator]
profile = "{path}"
"""


@pytest.fixture(scope="module")
def inferred(tmp_path_factory):
    path = tmp_path_factory.mktemp("profile") / "mine.toml"
    prior_profile().save(path)
    return path


def test_every_command_takes_it(inferred, log, tmp_path):
    scenario, archive, short = tmp_path / "scenario.toml", tmp_path / "archive", tmp_path / "short.csv"
    scenario.write_text(SCENARIO.format(path=inferred))
    steerway.write(steerway.read(log).rows(slice(61)), short)
    filed = ("archive", "run", short, "-o", archive, "--workers", "1", "--profile", inferred)
    for command in (
        ("estimate", short, "-o", tmp_path / "out.csv", "--profile", inferred),
        ("advise", inferred, "--speed", "2"),
        ("profile", "show", inferred),
        ("simulate", scenario, "-o", tmp_path / "sailed"),
        filed,
    ):
        code, _, said = run(*command)
        assert code == 0, said
    assert len(steerway.archive.scan(archive).collect()) == 61
    code, _, said = run(*filed, "--smooth")
    assert code == 2 and said.count("\n") == 1 and "profile prior has structures" in said


def test_parts_of_earlier_versions_are_left_out_and_named(inferred, log, tmp_path, caplog):
    old = tmp_path / "old.toml"
    text = inferred.read_text().replace('"wander"]', '"wander", "slips", "quick_error"]')
    old.write_text(text.replace("fix_std =", "slip_std = 0.1\nquick_std = 0.1\nquick_time = 2.0\nfix_std ="))
    assert load_profile(old) == load_profile(inferred)
    assert caplog.messages == [f"profile {old}: without the parts quick_error, slips, which this version no longer has"]
    tables = []
    for profile in (inferred, old):
        code, _, said = run("estimate", log, "-o", tmp_path / "out.csv", "--profile", profile)
        assert code == 0, said
        tables.append((tmp_path / "out.csv").read_bytes())
    assert tables[0] == tables[1]
    caplog.clear()
    stepping = inferred.read_text().replace('"wander"]', '"wander", "steps", "clock"]')
    old.write_text(stepping.replace("fix_std =", "step_every = 9.0\nstep_std = 0.1\ntime_std = 0.02\nfix_std ="))
    receiver = load_profile(old).structures[0].model.receiver[0]
    read = [receiver[name] for name in ("step_rate", "step_variance", "time_variance")]
    assert caplog.messages == [] and read == pytest.approx([1.0 / 9.0, 0.01, 0.0004])
    old.write_text(text.replace("fix_std =", "sail_std = 9.0\nfix_std ="))
    code, _, said = run("estimate", log, "-o", tmp_path / "out.csv", "--profile", old)
    assert code == 2 and said.count("\n") == 1 and "values has sail_std" in said


NEEDED = "speed_noise = 1e-2\ncourse_rate_noise = 1e-2\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (NEEDED + "position_std = 1e300", r"position_std is 1e\+300, expected at most 10000.0 m"),
        (NEEDED + "position_sdt = 0.5", "unknown key position_sdt, expected perhaps position_std"),
        (NEEDED, "position_std is missing, expected 1σ of the white noise of a fix"),
    ],
)
def test_a_profile_is_checked_like_a_scenario(tmp_path, text, message):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(steerway.InputError, match=f"mine.toml: {message}"):
        load_profile(tmp_path / "mine.toml")


def test_the_profile_of_a_log_of_many_vessels_is_the_built_in_one(tmp_path):
    log, made = tmp_path / "ais.nmea", tmp_path / "ours.toml"
    reports = (
        tagged(1_780_300_000 + 10 * k, *sentences(mmsi=257591700 + k % 2, lat=63.5 + 1e-4 * k)) for k in range(9)
    )
    log.write_bytes(b"".join(reports))
    code, out, err = run("profile", "make", log, "--quick", "-o", made)
    assert code == 0, err
    assert out.startswith("built in  vessels as AIS reports them") and load_profile(made).name == "ours"
