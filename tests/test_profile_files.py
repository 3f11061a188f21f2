"""A profile that `tune` or `profile make` wrote is taken wherever a profile is named."""

import pytest

import steerway.archive
from steerway.estimation import load_profile
from steerway.estimation.testing import prior_profile
from tests.command_line import run
from tests.messages import sentences, tagged
from tests.scenes import turning

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


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "log.csv"
    steerway.write(turning(2.0, 0.5, 60.0, rate=1.0).fixes(0.3, 1), path)
    return path


def test_every_command_takes_it(inferred, log, tmp_path):
    scenario, archive = tmp_path / "scenario.toml", tmp_path / "archive"
    scenario.write_text(SCENARIO.format(path=inferred))
    filed = ("archive", "run", log, "-o", archive, "--workers", "1", "--profile", inferred)
    for command in (
        ("estimate", log, "-o", tmp_path / "out.csv", "--profile", inferred),
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
