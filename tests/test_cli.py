"""The commands as a user types them."""

import gzip
import json
import os
import subprocess
from importlib.metadata import version
from pathlib import Path

import polars as pl
import pytest

import steerway
from steerway.estimation import load_profile
from tests.command_line import STEERWAY, run
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
