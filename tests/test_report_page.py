"""The interactive page: what is packed into it, and how it behaves in a real browser."""

import base64
import gzip
import json
import math
import os
import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

pytest.importorskip("bokeh", reason="bokeh is not installed")

import steerway
from steerway.core import REJECTED, Fixes
from steerway.report import write_page
from steerway.report.testing import events, mercator, summarise, write_report
from steerway.simulation import parse_scenario, sail_scenario
from steerway.simulation.testing import write_story
from tests.browser import chromium
from tests.scenes import turning

CODES = {"single": "<f4", "linear": "<u2", "logarithmic": "<u2"}


@pytest.fixture(scope="module")
def estimated():
    """A turning boat with a gap of 20 s, a fix that is rejected and the receiver's own velocity."""
    scene = turning(2.0, 0.5, 240.0)
    fixes = scene.fixes(0.3, 1)
    fixes = replace(fixes, sog=np.full(len(fixes), 2.0), cog=np.mod(np.arange(len(fixes)) * 0.01, 2 * math.pi))
    fixes = fixes.rows((fixes.time < fixes.time[0] + 100.0) | (fixes.time > fixes.time[0] + 120.0))
    far = fixes.latitude.copy()
    far[900] += 2e-5
    fixes = replace(fixes, latitude=far)
    return fixes, steerway.estimate(fixes, "otter")


@pytest.fixture(scope="module")
def page(estimated, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    fixes, motion = estimated
    write_report(path, "A boat <turning>", fixes, motion, summarise(fixes, motion, "otter"))
    return path


def unpacked(path):
    """The columns of a page, as its script reads them."""
    text = re.search(r'<script type="application/json" id="data">(.*?)</script>', path.read_text(), re.DOTALL)[1]
    header = json.loads(text)
    block, columns, at = gzip.decompress(base64.b64decode(header["bytes"])), {}, 0
    for name, length, code, *ends in header["columns"]:
        values = np.frombuffer(block, CODES[code], length, at)
        at += values.nbytes
        if code == "single":
            columns[name] = values.astype(float)
            continue
        first, step = ends
        found = first + step * values if code == "linear" else first * np.exp(step * values.astype(float))
        columns[name] = np.where(values == 65535, np.nan, found)
    assert at == len(block)
    return header, columns


def test_the_page_has_the_numbers_of_the_estimate(estimated, page):
    fixes, motion = estimated
    header, columns = unpacked(page)
    assert "<title>A boat &lt;turning&gt;</title>" in page.read_text() and "<turning>" not in page.read_text()
    assert_allclose(header["begins"] + np.cumsum(columns["step"]), motion.time, atol=2e-3)
    assert_allclose(columns["sog"], motion.sog, atol=1e-3)
    assert_allclose(columns["sog_std"], motion.sog_std, rtol=1e-3)
    assert_allclose(columns["cog_std"], np.degrees(motion.cog_std), rtol=1e-3)
    cog = np.mod(columns["cog"] - np.degrees(motion.cog) + 180.0, 360.0) - 180.0
    assert np.nanmax(np.abs(cog)) < 0.01 and (np.isnan(cog) == np.isnan(motion.cog)).all()
    assert (np.round(columns["status"]) == motion.status).all()
    latitude = np.arctan(np.sinh((header["origin"][1] + columns["y"]) / 6378137.0))
    assert_allclose(latitude, motion.latitude, atol=1e-9)
    assert_allclose((header["origin"][0] + columns["fix_x"]) / 6378137.0, fixes.longitude, atol=1e-9)


def test_the_list_of_events_has_the_gap_and_the_rejected_fix(estimated):
    found = events(*estimated)
    (gap,) = [each for each in found if each[2] == "no fixes"]
    assert 19.9 < gap[1] - gap[0] < 20.5
    rejected = estimated[1].time[estimated[1].status == REJECTED]
    spans = [each for each in found if "rejected" in each[2]]
    assert len(rejected) and all(any(start <= time <= stop for start, stop, _ in spans) for time in rejected)
    fixes, motion = estimated
    contradicted = replace(fixes, sog=np.where(np.arange(len(fixes)) > 300, fixes.sog, 5.0))
    assert any("own SOG differs" in what for *_, what in events(contradicted, motion))


def test_the_page_of_a_run_has_the_truth_beside_the_estimate(tmp_path):
    scenario = parse_scenario(
        "duration = 40.0\n[route]\nwaypoints = [{ north = 0.0, east = 0.0 }, { north = 90.0, east = 0.0 }]"
    )
    sailed = sail_scenario(scenario)
    write_story(sailed, tmp_path / "page.html")
    header, columns = unpacked(tmp_path / "page.html")
    run = sailed.run.rows(np.isfinite(sailed.run["read_north"]))
    assert_allclose(columns["true_sog"], run.true_sog, atol=1e-3)
    assert_allclose(columns["sog"], run["estimated_sog"], atol=1e-3)
    assert_allclose((columns["true_y"] - columns["true_y"][0]) / header["scale"][1], run["true_north"], atol=0.01)


@pytest.fixture(scope="module")
def browser():
    with chromium() as driver:
        yield driver


def opened(browser, path):
    """Runs scripts in a page whose charts are drawn."""
    browser.get(path.as_uri())
    deadline = time.monotonic() + 20.0
    charts = "return !document.getElementById('data') || Boolean(document.body.dataset.ready)"
    while not browser.execute_script(charts) and time.monotonic() < deadline:
        time.sleep(0.05)
    return browser.execute_script


def test_in_a_browser_the_charts_move_together(page, browser):
    run = opened(browser, page)
    assert run("return performance.getEntriesByType('resource').length") == 0, "the page opens offline"
    span = "const r = Bokeh.documents[0].get_model_by_name('time'); return r.end - r.start"
    whole = run(span)
    number = run(
        "return [...document.querySelectorAll('[data-event]')].findIndex(e => e.textContent.includes('no fixes'))"
    )
    run(f"document.querySelector('[data-event=\"{number}\"]').click()")
    assert run(span) < whole / 2.0
    assert re.search(r"SOG [12]\.\d+ ± 0\.\d+ m/s", run("return document.getElementById('values').textContent"))
    run("document.querySelector('input[value=kn]').click()")
    assert "kn · COG" in run("return document.getElementById('values').textContent")
    values = run("return Array.from(Bokeh.documents[0].get_model_by_name('line_sog').data.value)")
    assert 3.5 < np.nanmedian([each for each in values if each is not None]) < 4.3
    run("document.getElementById('whole').click()")
    assert run(span) == pytest.approx(whole, rel=1e-6)
    assert [each for each in browser.get_log("browser") if each["level"] in ("SEVERE", "WARNING")] == []


def test_a_row_without_a_position_does_not_hide_the_others():
    longitude = np.array([np.nan, 3.14, -3.14, np.nan, -3.13])
    x, y = mercator(np.array([np.nan, 0.1, 0.1, 0.1, 0.1]), longitude)
    assert np.isnan(x).tolist() == [True, False, False, True, False] and np.all(np.diff(x[[1, 2, 4]]) > 0.0)
    assert np.isnan(y[0]) and np.isfinite(y[1:]).all()


RULES = ["wcag2a", "wcag2aa", "wcag21aa", "best-practice"]
CHECK = """
const done = arguments[0];
axe.run(document, {runOnly: %s}).then(found => done(found.violations.map(each => each.id + ": " + each.nodes[0].html)));
"""


@pytest.fixture(scope="module")
def axe():
    path = Path(os.environ.get("STEERWAY_NODE_MODULES", "nowhere")) / "axe-core" / "axe.min.js"
    if not path.exists():
        pytest.skip("axe-core is not in STEERWAY_NODE_MODULES")
    return path.read_text(encoding="utf-8")


def test_pages_are_accessible(page, axe, browser, tmp_path):
    """By axe-core: contrast, names of controls, headings, tables (WCAG 2.1 AA)."""
    vessels, plain = tmp_path / "vessels.html", tmp_path / "plain.html"
    time, mmsi = np.tile(1.7e9 + 10.0 * np.arange(30.0), 2), np.repeat([211000001, 211000002], 30)
    fixes = Fixes(time, 0.9 + 1e-6 * np.arange(60.0), np.full(60, 0.2), mmsi=mmsi)
    motion = steerway.estimate(fixes, "ais")
    write_report(vessels, "Two vessels", fixes, motion, summarise(fixes, motion, "ais"))
    tables = [("Table", ("", "value"), [("a", "1"), ("b", "missed")])]
    write_page(plain, "A page", tables, remarks=["A remark."], lead="Lead.")
    for each in (page, vessels, plain):
        opened(browser, each)
        browser.execute_script(axe)
        assert browser.execute_async_script(CHECK % RULES) == [], each
