"""The front door: public names are there when they are asked for, and nothing heavy before."""

import importlib
import importlib.util
import subprocess
import sys

import pytest

import steerway
from steerway.core.moved import MOVED
from steerway.pilot import Pilot


def test_every_public_name_is_there():
    assert set(steerway.__all__) <= set(dir(steerway))
    for name in steerway.__all__:
        assert getattr(steerway, name).__name__ == name
    assert steerway.estimation.estimate is steerway.estimate  # rooms need no import of their own


def test_any_other_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'steerway' has no attribute 'nothing'"):
        steerway.nothing  # noqa: B018


def test_the_door_alone_is_light():
    asked_for = "import steerway, sys; print('numba' in sys.modules); steerway.read; print(steerway.Fixes.__name__)"
    printed = subprocess.run([sys.executable, "-c", asked_for], capture_output=True, text=True, check=True)
    assert printed.stdout.split() == ["False", "Fixes"]


def test_modules_that_moved_are_found_by_their_old_names():
    with pytest.warns(FutureWarning, match="steerway.guidance.leg is now steerway.core.leg"):
        old = importlib.import_module("steerway.guidance.leg")
    assert old is importlib.import_module("steerway.core.leg")
    assert old.__spec__.name == "steerway.core.leg"
    with pytest.warns(FutureWarning, match="steerway.papers is now steerway_studies.papers"):
        from steerway.papers.ekf_5states import ekf_5states
    assert steerway.papers.ekf_5states is ekf_5states
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("steerway.guidance.legs")


def test_every_old_name_leads_somewhere():
    assert all(importlib.util.find_spec(new) for new in MOVED.values())


def test_old_methods_and_arguments():
    with pytest.warns(FutureWarning, match="Profile.model is now Profile.parameters"):
        assert steerway.Profile.named("otter").model().size
    with pytest.warns(FutureWarning, match="the argument patience is now max_dead_reckoning"):
        assert Pilot(*5 * [None], patience=3.0).max_dead_reckoning == 3.0
