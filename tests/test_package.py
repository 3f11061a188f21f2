"""The front door: public names are there when they are asked for, and nothing heavy before."""

import subprocess
import sys

import pytest

import steerway


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


def test_the_package_is_a_command():
    shown = subprocess.run([sys.executable, "-m", "steerway", "--version"], capture_output=True, text=True, check=True)
    assert shown.stdout.split()[-1] == steerway.__version__
