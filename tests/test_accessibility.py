"""Pages in a real browser, checked by axe-core: contrast, names of controls, headings, tables (WCAG 2.1 AA)."""

import os
import time
from pathlib import Path

import numpy as np
import pytest

import steerway
from steerway.core import Fixes
from steerway.report import write_page
from steerway.report.testing import summarise, write_report
from tests.browser import chromium
from tests.scenes import turning

pytest.importorskip("bokeh", reason="bokeh is not installed")
webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")

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


@pytest.fixture(scope="module")
def browser():
    with chromium() as driver:
        yield driver


def estimate_page(path):
    fixes = turning(2.0, 0.5, 60.0).fixes(0.3, 1)
    motion = steerway.estimate(fixes, "otter")
    write_report(path, "A boat", fixes, motion, summarise(fixes, motion, "otter"))


def vessels_page(path):
    time = np.tile(1.7e9 + 10.0 * np.arange(30.0), 2)
    fixes = Fixes(time, 0.9 + 1e-6 * np.arange(60.0), np.full(60, 0.2), mmsi=np.repeat([211000001, 211000002], 30))
    motion = steerway.estimate(fixes, "ais")
    write_report(path, "Two vessels", fixes, motion, summarise(fixes, motion, "ais"))


def plain_page(path):
    write_page(
        path, "A page", [("Table", ("", "value"), [("a", "1"), ("b", "missed")])], remarks=["A remark."], lead="Lead."
    )


@pytest.mark.parametrize("make", [estimate_page, vessels_page, plain_page])
def test_pages_are_accessible(make, axe, browser, tmp_path):
    make(tmp_path / "page.html")
    browser.get((tmp_path / "page.html").as_uri())
    deadline = time.monotonic() + 15.0
    charts = "return !document.getElementById('data') || Boolean(document.body.dataset.ready)"
    while not browser.execute_script(charts) and time.monotonic() < deadline:
        time.sleep(0.05)
    browser.execute_script(axe)
    assert browser.execute_async_script(CHECK % RULES) == []
