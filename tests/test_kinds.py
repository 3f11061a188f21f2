"""What a scenario can name: every entry of every table can be simulated, and a new one needs its entry only."""

from typing import Literal

import numpy as np
import pytest
from pydantic import ValidationError

from steerway.core import InputError
from steerway.core.testing import NotNegative, Table, one_of_kinds, refusal
from steerway.guidance.testing import LAWS, SHAPERS
from steerway.sensors import Gnss, Suite
from steerway.sensors.testing import INSTRUMENTS
from steerway.simulation import parse_scenario, sail_scenario
from steerway.vessels.testing import TABLES, OtterTable, VesselTable

ROUTE = "duration = 20\n[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 400, east = 0 }]\n[compass]\n"
KINDS = [
    *(f'[vessel]\nkind = "{table.model_fields["kind"].default}"' for table in TABLES),
    *(f'[guidance]\nlaw = "{name}"' for name in LAWS),
    *(f'[reference]\nkind = "{name}"' for name in SHAPERS),
]


@pytest.mark.parametrize("text", KINDS)
def test_every_kind_can_be_simulated(text):
    unstable = '[gyro]\n[guidance]\nlaw = "integral-line-of-sight"\n' if "caldas" in text else ""
    run = sail_scenario(parse_scenario(ROUTE + unstable + text)).run
    assert len(run) == 1000 and np.isfinite(run.command).all() and run["true_north"][-1] > 5.0


def test_every_instrument_gives_what_it_measures_and_nothing_else():
    for name, table in INSTRUMENTS.items():
        vessel = '[vessel]\nkind = "surge"\n' if name == "tachometer" else ""
        scenario = parse_scenario(ROUTE.replace("[compass]\n", f"[{name}]\n{vessel}"))
        run = sail_scenario(scenario).run
        measured = np.isfinite(run[f"read_{table.measures}"])
        assert measured.sum() == pytest.approx(20.0 * getattr(scenario, name).rate, abs=1)
        others = {each.measures for each in INSTRUMENTS.values()} - {table.measures}
        assert not any(np.isfinite(run[f"read_{each}"]).any() for each in others)


def test_an_instrument_draws_the_same_numbers_whatever_else_is_aboard():
    alone = sail_scenario(parse_scenario(ROUTE.replace("[compass]\n", "[log]\n"))).run
    together = sail_scenario(parse_scenario(ROUTE + "[gyro]\n[log]\n")).run
    for read, true in (("read_north", "true_north"), ("read_water_speed", "true_surge")):
        assert np.allclose(alone[read] - alone[true], together[read] - together[true], atol=1e-9, equal_nan=True)


def test_an_instrument_that_does_not_exist():
    with pytest.raises(InputError, match="instrument is 'sextant', expected one of compass, gyro, log"):
        Suite(Gnss(), sextant=1)


class RaftTable(VesselTable):
    """A vessel of a user."""

    kind: Literal["raft"] = "raft"
    logs: NotNegative = 4.0

    def build(self):
        return OtterTable().build()

    def boat(self):
        return OtterTable().boat()


class Scene(Table):
    """A file with a vessel."""

    vessel: one_of_kinds((OtterTable, RaftTable)) = OtterTable()


def test_a_vessel_is_added_by_its_table():
    assert Scene(vessel={"kind": "raft", "logs": 6}).vessel == RaftTable(logs=6.0)
    assert Scene(vessel={"payload_mass": 5}).vessel == OtterTable(payload_mass=5.0)


@pytest.mark.parametrize(
    ("vessel", "sentence"),
    [
        ({"kind": "raft", "payload_mass": 5}, "unknown key vessel.payload_mass for kind raft, expected one of method"),
        ({"kind": "raft", "log": 5}, "unknown key vessel.log for kind raft, expected perhaps logs"),
        ({"kind": "raft", "logs": -1}, "vessel.logs is -1, expected at least 0"),
        ({"kind": "ark"}, "vessel.kind is 'ark', expected one of otter, raft"),
        (3, "vessel is 3, expected a table"),
    ],
)
def test_errors_name_key_value_and_what_was_expected(vessel, sentence):
    with pytest.raises(ValidationError) as caught:
        Scene(vessel=vessel)
    assert f"scene: {sentence}" in str(refusal("scene", caught.value, Scene))
