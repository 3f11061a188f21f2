"""`steerway identify` on logs of boats that are known."""

import math

import numpy as np
import polars as pl

from steerway.identification import SurgeModel
from tests.command_line import run


def zigzag(path, gain=0.2, time_constant=2.0, bias_deg=1.0):
    """A 10–10 zigzag of a first-order Nomoto ship, heading in whole tenths of a degree."""
    dt, heading, rate, rudder = 0.1, 0.0, 0.0, math.radians(10.0)
    rows = []
    for k in range(3000):
        if heading > math.radians(10.0):
            rudder = -math.radians(10.0)
        elif heading < -math.radians(10.0):
            rudder = math.radians(10.0)
        rows.append((k * dt, math.degrees(rudder), round(math.degrees(heading), 1) % 360.0))
        steady = gain * (rudder + math.radians(bias_deg))
        left = math.exp(-dt / time_constant)
        heading += steady * dt + (rate - steady) * time_constant * (1.0 - left)
        rate = steady + (rate - steady) * left
    pl.DataFrame(rows, schema=["time_s", "rudder_deg", "heading_deg"], orient="row").write_csv(path)


def test_yaw_gives_back_a_known_ship_and_her_gains(tmp_path):
    log = tmp_path / "zigzag.csv"
    zigzag(log)
    code, out, err = run("identify", "yaw", log, "--bandwidth", "0.5")
    assert (code, err) == (0, "")
    gain, time_constant = (
        float(line.split("  ", 1)[1].split()[0]) for line in out.splitlines() if line[:4] in ("gain", "time")
    )
    assert abs(gain / 0.2 - 1.0) < 0.05
    assert abs(time_constant / 2.0 - 1.0) < 0.05
    assert "K_p" in out and "T_i" in out


def test_surge_tells_a_staircase_from_a_constant_speed(tmp_path):
    time = np.arange(0.0, 600.0, 0.5)
    steps = np.repeat([4.0, 8.0, 12.0, 8.0, 4.0, 10.0], 200)
    log_of = SurgeModel(0.02, 0.02, 0.05).start(0.0)
    speed = np.array([0.0] + [(log_of.step(shaft, 0.5), log_of.speed)[1] for shaft in steps[1:]])
    noise = np.random.default_rng(1).normal(0.0, 0.01, len(time))
    for name, shaft, measured, verdict in (
        ("staircase.csv", steps, speed + noise, "Identified"),
        ("steady.csv", np.full_like(steps, 8.0), np.full_like(speed, 3.0) + noise, "Not identified"),
    ):
        log = tmp_path / name
        pl.DataFrame({"time_s": time, "speed_mps": measured, "shaft_rps": shaft}).write_csv(log)
        code, out, _ = run("identify", "surge", log, "--diameter", "0.8")
        assert code == 0 and verdict in out.splitlines()[-1]
        if verdict == "Identified":
            assert abs(float(out.splitlines()[3].split()[2]) / 0.05 - 1.0) < 0.1
    code, out, _ = run("identify", "surge", tmp_path / "staircase.csv", "--shaft", "shaft_rps")
    assert code == 0 and "for one unit of shaft_rps" in out
    assert run("identify", "surge", log, "--diameter", "0.8", "--shaft", "shaft_rps")[0] == 2


def test_a_log_without_the_columns_is_refused_by_their_names(tmp_path):
    log = tmp_path / "empty.csv"
    log.write_text("time_s,depth_m\n1,2\n2,3\n")
    code, _, err = run("identify", "yaw", log)
    assert code == 2 and "rudder" in err and "depth_m" in err
    assert run("identify", "surge", tmp_path / "gone.csv")[0] == 2


def test_a_log_of_sentences_is_no_table_of_a_manoeuvre(tmp_path):
    log = tmp_path / "sortie.nmea"
    log.write_text("$GPHDT,1.0,T*0E\n$GPGGA,120000,6326.0,N,01023.0,E,1,8,1.0,1,M,1,M,,*00\n")
    for arguments, columns in ((("yaw", log, "--bandwidth", "0.5"), "for time, rudder"), (("surge", log), "time_s")):
        code, _, err = run("identify", *arguments)
        assert code == 2 and "is no table, expected a CSV" in err and f"columns {columns}" in err, err
