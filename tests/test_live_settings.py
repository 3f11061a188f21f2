"""The settings file of `steerway live`, the messages that all settings files share, and what the keys choose aboard."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from steerway.core import InputError
from steerway.estimation.testing import HeadingEstimatorTable
from steerway.formats.testing import gga, rmc
from steerway.live import testing as live
from tests.command_line import run
from tests.desk import OTTER, Desk, square

EXAMPLES = Path(__file__).parent.parent / "examples" / "live"
NOON = 1_719_835_200.0


def output(tmp_path, text):
    path = tmp_path / "boat.toml"
    path.write_text(text)
    return live.Settings.load(path)


def test_what_a_file_says_and_the_command_line_goes_first(tmp_path):
    settings = output(
        tmp_path,
        'from = "udp://:10110"\nto = ["stdout:", "file:run.csv"]\nprofile = "mine.toml"\nsource = "GP"\n'
        'aid = ["yaw-rate"]\nrate = 10\nmission = "m.toml"\nengage = true\n'
        "max_dead_reckoning = 5\nlatency = 0.1\nhelm = true\n"
        '[speed]\ncontroller = "adaptive"\n[autopilot]\nkind = "lqg"\n'
        '[estimator.speed]\nkind = "fusion"\nsog_std = 0.2\n[estimator.heading]\nkind = "aided"\n',
    )
    assert settings.inputs == ("udp://:10110",) and settings.outputs == ("stdout:", f"file:{tmp_path}/run.csv")
    assert settings.profile == str(tmp_path / "mine.toml") and settings.mission == str(tmp_path / "m.toml")
    assert (settings.source, settings.aid, settings.rate, settings.engage) == (("GP",), ("yaw-rate",), 10.0, True)
    assert (settings.max_dead_reckoning, settings.latency, settings.helm) == (5.0, 0.1, "127.0.0.1:8080")
    assert (settings.speed.controller, settings.autopilot.kind) == ("adaptive", "lqg")
    assert (settings.estimator.speed.kind, settings.estimator.heading.kind) == ("fusion", "aided")
    tuning = live.measured_speed(settings.estimator.speed).fusion.tuning
    assert (tuning.sog_std, tuning.bottom_std) == (0.2, 0.02) and live.measured_speed(
        live.Settings().estimator.speed
    ) is None
    other = settings.overridden(rate=2.0, engage=False, profile=None, helm="127.0.0.1:9000")
    assert (other.rate, other.engage, other.profile) == (2.0, False, settings.profile)
    assert other.helm == "127.0.0.1:9000" and other.inputs == settings.inputs
    with pytest.raises(InputError, match="expected mission too"):
        live.launch_launch(output(tmp_path, '[speed]\ncontroller = "adaptive"\n'))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("rates = 10", "unknown key rates, expected perhaps rate"),
        ("rate = -1", "rate is -1, expected more than 0"),
        ('aid = ["sonar"]', "aid[0] is 'sonar', expected one of auto, sog, cog, heading, water-speed, yaw-rate"),
        ("from = 7", "from is 7, expected a list"),
        ('rate = "600"', "rate is '600', expected a number"),
        ("rate = true", "rate is True, expected a number"),
        ("rate = inf", "rate is inf, expected"),
        ("rate = \n", "is not valid TOML: Invalid value"),
        ('[estimator.heading]\nkind = "composite"\nweight = 0.2\n', "estimator.heading: weight has no effect"),
        ('[speed]\ncontroller = "mrac"\n', "speed.controller is 'mrac'"),
    ],
)
def test_what_is_wrong_is_said_in_words(tmp_path, text, words):
    with pytest.raises(InputError) as refused:
        output(tmp_path, text)
    assert words in str(refused.value) and str(refused.value).startswith(f"settings {tmp_path / 'boat.toml'}")
    assert "\n" not in str(refused.value)


def test_helm_without_an_address_is_the_usual_one(monkeypatch):
    taken = []
    monkeypatch.setattr(live.build_service, "launch", taken.append)
    for arguments in (["--helm"], ["--helm", "--rate", "5"], ["--helm=10.0.0.1:80"], ["--rate", "5"]):
        run("live", *arguments)
    assert [settings.helm for settings in taken] == ["127.0.0.1:8080", "127.0.0.1:8080", "10.0.0.1:80", None]


def test_mistakes_end_in_one_sentence(monkeypatch, tmp_path):
    monkeypatch.delenv("STEERWAY_HELM_TOKEN", raising=False)
    log = str(tmp_path / "log.nmea")
    for arguments, words in (
        ([], "expected --from with an address"),
        (["--from", f"file:{log}", "--helm", "0.0.0.0:8080"], "STEERWAY_HELM_TOKEN"),
        (["--from", f"file:{log}", "--engage"], "expected --mission"),
        (["--from", f"file:{log}", "--missions", "udpin:127.0.0.1:9"], "expected --mission FILE"),
        (["--from", f"file:{log}", "--lag", "70"], "lag is 70.0, expected at most 60.0 s"),
        (["--from", f"file:{log}", "--aid", "sonar"], "aid[0] is 'sonar', expected one of auto, sog"),
        ([str(tmp_path / "none.toml")], "none.toml cannot be read: No such file"),
    ):
        code, _, message = run("live", *arguments)
        assert code == 2 and words in message and message.count("\n") == 1


def test_the_example_sails(tmp_path):
    """The example with changed links: a log instead of the receiver, the default output, and no page."""
    settings = live.Settings.load(EXAMPLES / "boat.toml")
    route = live.GeodeticRoute.load(settings.mission)
    lines = []
    for k in range(300):
        place = route.latitude[0] + 3e-8 * k, route.longitude[0]
        lines.append(gga(NOON + 0.2 * k, *place) + rmc(NOON + 0.2 * k, *place))
    (tmp_path / "log.nmea").write_text("".join(lines))
    text = re.sub(r"^to = \[.*?^\]$", "", (EXAMPLES / "boat.toml").read_text(), flags=re.DOTALL | re.MULTILINE)
    text = text.replace("serial:/dev/ttyACM0?baud=38400", "file:log.nmea?speed=max").replace('helm = "', '# helm = "')
    (tmp_path / "boat.toml").write_text(text)
    (tmp_path / "square.toml").write_text((EXAMPLES / "square.toml").read_text())
    code, said, _ = run("live", tmp_path / "boat.toml")
    rows = [json.loads(line) for line in said.splitlines()]
    assert code in (0, None)
    assert len(rows) == pytest.approx(600, abs=12)  # at the file's rate, not one per fix
    assert rows[-1]["lat_deg"] == pytest.approx(math.degrees(place[0]), abs=1e-5) and rows[-1]["status"] != "lost"


@pytest.mark.parametrize(
    ("autopilot", "speed", "heading", "by"),
    [
        ("pole-placement", "disturbance-observer", "composite", "yaw-rate"),
        ("mpc", "adaptive", "composite", "propellers"),
        ("lqg", "disturbance-observer", "interval", "yaw-rate"),
    ],
)
def test_every_controller_sails_two_legs_in_a_current_of_half_the_speed(autopilot, speed, heading, by):
    """Without a compass a heading filter has no input, so that the steering filter has to give the heading."""
    pytest.importorskip("daqp")
    chosen = {
        "kinds": (autopilot, speed),
        "estimators": live.EstimatorSettings(heading=HeadingEstimatorTable(kind=heading)),
    }
    corners = ((0.0, 0.0), (25.0, 0.0), (25.0, 60.0), (0.0, 60.0))
    desk = Desk(square(corners, boat=OTTER), by=by, current=0.6, noise=0.3, **chosen).start()
    desk.until(lambda: desk.leg.destination == "WP2", 180.0)
    desk.sail(15.0)
    first, off = len(desk.rows), []
    while desk.leg.destination == "WP2":
        off.append(desk.state[6] - 25.0)  # the second leg leads east
        desk.sail(0.2)
    assert np.sqrt(np.mean(np.square(off))) < 3.0
    assert np.mean([row.sog for row in desk.rows[first:]]) == pytest.approx(1.2, abs=0.2)


def test_speed_from_whatever_the_links_report():
    """GNSS at 1 Hz, a log with an error of 0.5 %, a biased accelerometer at 20 Hz; their times are not in order."""
    measured, draws = live.MeasuredSpeed(), np.random.default_rng(1)
    assert math.isnan(measured.speed(0.0))
    for k in range(2400):
        time, speed = 0.05 * k, 2.0 + 0.5 * math.sin(0.02 * k)
        row = live.InputRow("imu", time, acceleration=0.2 * math.cos(0.02 * k) + 0.05 + 0.02 * draws.standard_normal())
        measured.take(row)
        if k % 20 == 0:
            measured.take(live.InputRow("gps", time, sog=speed + 0.1 * draws.standard_normal()))
        if k % 4 == 0:
            measured.take(live.InputRow("log", time - 0.01, bottom_speed=1.005 * speed, shaft=7.0))
    assert measured.speed(time) == pytest.approx(speed, abs=0.03) and measured.shaft == 7.0
    assert math.isnan(measured.speed(time + 10.0))


def test_a_silent_compass_leaves_the_heading_unknown_and_another_takes_over():
    measured = live.MeasuredHeading(HeadingEstimatorTable(kind="composite"), 1.5, 0.3, 1.2, 1.0)
    assert math.isnan(measured.at(0.0))
    for k in range(100):
        measured.take(live.InputRow("one", 0.1 * k, heading=1.0))
        measured.take(live.InputRow("two", 0.1 * k, heading=2.0))
    assert measured.at(10.0) == pytest.approx(1.0, abs=0.05) and measured.filter.heading_std < 0.2
    assert math.isnan(measured.at(13.0))
    for k in range(100):
        measured.take(live.InputRow("two", 16.0 + 0.1 * k, heading=2.0))
    assert measured.at(26.0) == pytest.approx(2.0, abs=0.05)
    for k in range(100):  # the clock was set back
        measured.take(live.InputRow("two", -500.0 + 0.1 * k, heading=-2.0))
    assert measured.at(-490.0) == pytest.approx(-2.0, abs=0.05)
