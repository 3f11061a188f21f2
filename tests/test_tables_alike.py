"""The same table in every form a spreadsheet or a library writes, for every command that reads one."""

import math

import numpy as np
import polars as pl
import pytest

from tests.command_line import run

FORMS = ("csv", "semicolons", "tabs", "parquet", "milliseconds")


def written(frame, folder, form):
    path = folder / f"log-{form}.{'parquet' if form == 'parquet' else 'csv'}"
    if form == "milliseconds":  # whatever the name says: a number means what its size tells
        frame = frame.with_columns((1e3 * pl.col("time_s")).round().cast(pl.Int64))
    if form == "parquet":
        frame.write_parquet(path)
    elif form == "semicolons":
        path.write_text(frame.write_csv(separator=";").replace(".", ","))
    else:
        frame.write_csv(path, separator="\t" if form == "tabs" else ",")
    return path


def manoeuvre():
    """A weaving boat: time, rudder, heading, and shaft speed with its speed."""
    time = 1.7e9 + np.arange(0.0, 400.0, 0.5)
    rudder = 10.0 * np.sign(np.sin((time - time[0]) / 12.0) + 0.3 * np.sin((time - time[0]) / 5.0))
    shaft = np.repeat([4.0, 8.0, 12.0, 6.0], 200)
    rate = heading = speed = 0.0
    rows = []
    for k in range(len(time)):
        rows.append((time[k], rudder[k], math.degrees(heading) % 360.0, speed, shaft[k]))
        rate += 0.5 * (0.2 * math.radians(rudder[k]) - rate) / 2.0
        heading += 0.5 * rate
        speed += 0.5 * (0.0005 * shaft[k] ** 2 * 10.0 - 0.02 * speed - 0.05 * speed * speed)
    return pl.DataFrame(rows, ["time_s", "rudder_deg", "heading_deg", "speed_mps", "shaft_rps"], orient="row")


@pytest.mark.parametrize("command", [("identify", "yaw"), ("identify", "surge", "--diameter", "0.8")])
def test_identify_finds_the_same_in_every_form(command, tmp_path):
    outputs = set()
    for form in FORMS:
        path = written(manoeuvre().with_columns(pl.all().round(6)), tmp_path, form)
        code, out, said = run(*command[:2], path, *command[2:])
        assert code == 0, (form, said)
        outputs.add(out.replace(path.name, ""))
    assert len(outputs) == 1


def test_estimate_reads_the_same_fixes_in_every_form(tmp_path):
    frame = pl.DataFrame(
        {
            "time_s": 1.7e9 + np.arange(60.0),
            "lat_deg": np.round(54.0 + 2e-5 * np.arange(60.0), 7),
            "lon_deg": np.round(10.0 + 1e-5 * np.arange(60.0), 7),
        }
    )
    tables = []
    for form in FORMS:
        out = tmp_path / f"{form}.csv"
        assert run("estimate", written(frame, tmp_path, form), "-o", out, "--profile", "small-usv")[0] == 0
        tables.append(out.read_text())
    assert len(set(tables)) == 1


@pytest.mark.parametrize("kind", ["yaw", "surge"])
def test_what_is_no_table_is_refused_in_one_sentence(kind, tmp_path):
    for content in (b"PAR1 and no more", b"\x00\x01\x02", b"a;b\n1;2\n"):
        path = tmp_path / "log"
        path.write_bytes(content)
        code, out, said = run("identify", kind, path)
        assert (code, out) == (2, "") and said.count("\n") == 1 and str(path) in said
