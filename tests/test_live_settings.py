"""The settings of `steerway live` in a file: read, refused in words, overridden by the command line."""

import json
import math
from pathlib import Path

import pytest

from steerway.core import InputError
from steerway.formats.testing import gga, rmc
from steerway.live.testing import GeodeticRoute, Settings
from steerway.live.testing import build_service as launching
from tests.command_line import run

EXAMPLES = Path(__file__).parent.parent / "examples" / "live"
NOON = 1_719_835_200.0


def output(tmp_path, text):
    path = tmp_path / "boat.toml"
    path.write_text(text)
    return Settings.load(path)


def test_what_a_file_says(tmp_path):
    settings = output(
        tmp_path,
        'from = "udp://:10110"\nto = ["stdout:", "file:run.csv"]\nprofile = "mine.toml"\nsource = "GP"\n'
        'aid = ["yaw-rate"]\nrate = 10\nmission = "m.toml"\nengage = true\n'
        "max_dead_reckoning = 5\nlatency = 0.1\nhelm = true\n",
    )
    assert settings.inputs == ("udp://:10110",) and settings.outputs == ("stdout:", f"file:{tmp_path}/run.csv")
    assert settings.profile == str(tmp_path / "mine.toml") and settings.mission == str(tmp_path / "m.toml")
    assert (settings.source, settings.aid, settings.rate, settings.engage) == (("GP",), ("yaw-rate",), 10.0, True)
    assert (settings.max_dead_reckoning, settings.latency, settings.helm) == (5.0, 0.1, "127.0.0.1:8080")


def test_the_command_line_goes_first(tmp_path):
    settings = output(tmp_path, 'from = "udp://:1"\nrate = 10\nengage = true\nhelm = false\n')
    other = settings.overridden(rate=2.0, engage=False, profile=None, helm="127.0.0.1:9000")
    assert (other.rate, other.engage, other.profile, other.helm) == (2.0, False, None, "127.0.0.1:9000")
    assert other.inputs == settings.inputs


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("rates = 10", "unknown key rates, expected perhaps rate"),
        ("rate = -1", "rate is -1, expected more than 0"),
        ('aid = ["sonar"]', "aid[0] is 'sonar', expected one of auto, sog, cog, heading, water-speed, yaw-rate"),
        ("from = 7", "from is 7, expected a list"),
        ("rate 10", "is not valid TOML"),
    ],
)
def test_what_is_wrong_is_said_in_words(tmp_path, text, words):
    with pytest.raises(InputError) as refused:
        output(tmp_path, text)
    assert words in str(refused.value) and str(refused.value).startswith(f"settings {tmp_path / 'boat.toml'}")
    assert "\n" not in str(refused.value)


def test_helm_without_an_address_is_the_usual_one(monkeypatch):
    taken = []
    monkeypatch.setattr(launching, "launch", taken.append)
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
        ([str(tmp_path / "none.toml")], "none.toml cannot be read: No such file"),
    ):
        code, _, message = run("live", *arguments)
        assert code == 2 and words in message and message.count("\n") == 1


def test_the_example_sails(tmp_path):
    """As it stands, but for the links: a log in place of the receiver, and no page."""
    settings = Settings.load(EXAMPLES / "boat.toml")
    route = GeodeticRoute.load(settings.mission)
    lines = []
    for k in range(300):
        place = route.latitude[0] + 3e-8 * k, route.longitude[0]
        lines.append(gga(NOON + 0.2 * k, *place) + rmc(NOON + 0.2 * k, *place))
    (tmp_path / "log.nmea").write_text("".join(lines))
    (tmp_path / "boat.toml").write_text((EXAMPLES / "boat.toml").read_text().replace('helm = "', '# helm = "'))
    (tmp_path / "square.toml").write_text((EXAMPLES / "square.toml").read_text())
    log = f"file:{tmp_path / 'log.nmea'}?speed=max"
    code, said, _ = run("live", tmp_path / "boat.toml", "--from", log, "--to", "stdout:")
    rows = [json.loads(line) for line in said.splitlines()]
    assert code in (0, None)
    assert len(rows) == pytest.approx(600, abs=12)  # at the file's rate, not one a fix
    assert rows[-1]["lat_deg"] == pytest.approx(math.degrees(place[0]), abs=1e-5) and rows[-1]["status"] != "lost"
