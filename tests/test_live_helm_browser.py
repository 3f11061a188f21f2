"""The helm page in a real browser: values change, the autopilot is started and stopped, a login is needed."""

import contextlib
import math
import os
import re
import signal
import time

import pytest

from steerway.formats.testing import gga, rmc
from steerway.live.testing import warm
from tests.browser import chromium, helm_page
from tests.command_line import STEERWAY
from tests.ports import free_port, running, wait_until

pytest.importorskip("nicegui", reason="nicegui is not installed: pip install steerway[helm]")
webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
from selenium.common.exceptions import StaleElementReferenceException, WebDriverException  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402

NOON = 1_719_835_200.0
ROUTE = "".join(f"[[waypoint]]\nlat_deg = {54.0 + 1e-3 * k}\nlon_deg = {10.0 + 1e-4 * k}\n" for k in (0, 20, 22))
PHONE, LAPTOP = (390, 844), (1280, 800)


@pytest.fixture(scope="module")
def browser():
    """Headless Chromium."""
    with chromium(height=800) as driver:
        yield driver


@pytest.fixture(scope="module")
def sea(tmp_path_factory):
    """A folder with a log of twenty minutes of a boat going north at 2 m/s, and the route that it follows."""
    folder = tmp_path_factory.mktemp("sea")
    warm()
    lines = []
    for k in range(6000):
        place = math.radians(54.0 + 3.6e-6 * k), math.radians(10.0 + 3.6e-7 * k)
        lines.append(gga(NOON + 0.2 * k, *place) + rmc(NOON + 0.2 * k, *place))
    (folder / "log.nmea").write_text("".join(lines))
    (folder / "route.toml").write_text(ROUTE)
    return folder


@contextlib.contextmanager
def sailing(sea, port, *more):
    """A running `steerway live` with a helm page."""
    surroundings = {name: value for name, value in os.environ.items() if name != "STEERWAY_HELM_TOKEN"}
    command = (
        *(*STEERWAY, "live", "--from", f"file:{sea / 'log.nmea'}?speed=5", "--to", f"file:{sea / 'run.csv'}"),
        *("--helm", f"127.0.0.1:{port}", *more),
    )
    with open(sea / "said.txt", "wb") as out:
        with running(*command, ends=signal.SIGINT, stdout=out, stderr=out, env=surroundings, cwd=sea) as process:
            yield process


def until(condition, seconds=20.0):
    """Wait until the condition is true; return its value."""

    def tried():
        with contextlib.suppress(WebDriverException, StaleElementReferenceException):
            return condition()

    return wait_until(tried, seconds, every=0.05)  # a browser is slow to answer


class Page:
    """The page's texts and buttons by name."""

    def __init__(self, browser):
        self.browser = browser

    def size(self, width, height):
        settings = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", settings)

    def find(self, name):
        return self.browser.find_element(By.CSS_SELECTOR, f'[data-name="{name}"]')

    def text(self, name):
        return self.find(name).text

    def number(self, name):
        found = re.search(r"\d+(\.\d+)?", self.text(name))
        return float(found[0]) if found else math.nan

    def is_stale(self):
        return "stale" in self.browser.find_element(By.TAG_NAME, "body").get_attribute("class")

    def click(self, name):
        until(lambda: self.find(name).is_enabled())
        self.find(name).click()

    def press(self, name, condition):
        """Click until the condition is true, as a person does: the page refuses a click while it is out of date."""
        for left in (3, 2, 1):
            self.click(name)
            with contextlib.nullcontext() if left == 1 else contextlib.suppress(AssertionError):
                return until(condition, 8.0)


@pytest.fixture
def page(browser):
    page = Page(browser)
    page.size(*LAPTOP)
    yield page
    browser.get("about:blank")


def test_the_helm(page, sea):
    """One run: values, start, stop, and a service that ends."""
    port = free_port()
    mission = ("--mission", str(sea / "route.toml"))
    motors = ("--to", f"udp://127.0.0.1:{free_port()}?format=propellers")
    with sailing(sea, port, *mission, *motors) as process:
        until(lambda: page.browser.get(f"http://127.0.0.1:{port}/") is None, 120.0)
        until(lambda: page.text("state") == "ready" and page.text("leg") == "WP1", 60.0)
        page.browser.get_log("browser")  # until the page was there, connections were refused
        sees_what_is(page)
        works(page)
        fits(page)
        # The policy of its content lets nothing in from elsewhere; what it stops would be an error here.
        assert not [each for each in page.browser.get_log("browser") if each["level"] == "SEVERE"]
        process.kill()
        process.wait()
        until(page.is_stale)
        assert "No connection" in page.browser.find_element(By.CLASS_NAME, "banner").text
        assert float(page.find("sog").value_of_css_property("opacity")) < 0.5


def sees_what_is(page):
    assert until(lambda: page.number("sog") > 3.0) and page.number("sog") == pytest.approx(3.9, abs=0.4)
    assert min(page.number("cog"), 360.0 - page.number("cog")) < 8.0
    assert page.text("cog_within").startswith("±") and page.text("status") == "good" and page.text("source") == "SW"
    assert page.number("cross_track") < 3.0
    first = page.number("distance"), page.text("position"), page.text("time"), page.number("counts")
    until(lambda: page.number("distance") < first[0] - 5.0 and page.text("position") != first[1])
    assert page.text("time") > first[2] and page.number("counts") > first[3]
    drawn = page.find("moving").get_attribute("innerHTML")
    until(lambda: page.find("moving").get_attribute("innerHTML") != drawn)
    for each in ("boat", "vector", "ellipse", "track", "route", "curve", "band"):
        assert page.browser.find_elements(By.CSS_SELECTOR, f"svg .{each}"), each


def works(page):
    late = "kept = helmBeat; helmBeat = () => { helmLast = Date.now() }; helmSeq = Math.max(helmSeq - 100, 0)"
    page.browser.execute_script(late)  # now the page is twenty seconds late
    page.click("start")
    until(lambda: page.find("sure").is_displayed())
    page.click("sure")
    until(lambda: "This page was out of date" in page.browser.find_element(By.TAG_NAME, "body").text)
    assert page.text("state") == "ready"
    seen = page.browser.execute_script("helmBeat = kept; return helmSeq")
    until(lambda: page.browser.execute_script("return helmSeq") > seen)  # before this the page may still be late
    until(lambda: not page.browser.find_elements(By.CSS_SELECTOR, ".q-dialog__backdrop"))
    page.click("start")
    assert page.text("state") == "ready"  # a dialog asks first
    until(lambda: page.find("sure").is_displayed())
    page.click("sure")
    until(lambda: page.text("state") == "running")
    until(lambda: "0 %" != page.text("thrust") != "–")
    page.press("hold-course", lambda: "is held" in page.text("mode"))
    held = page.text("mode")
    page.press("adjust-+10°", lambda: "is held" in page.text("mode") and page.text("mode") != held)
    page.press("route", lambda: page.text("mode") == "" and page.text("state") == "running")
    page.press("offset-5 m port", lambda: page.text("mode") == "5 m to port of the route")
    page.press("offset", lambda: page.text("mode") == "")
    page.press("mob", lambda: "bearing" in page.text("overboard"))
    assert page.browser.find_elements(By.CSS_SELECTOR, "svg .mob")
    page.press("mob-over", lambda: page.text("overboard") == "")
    assert page.browser.execute_script("return document.documentElement.lang") == "en"
    assert len(page.browser.find_elements(By.CSS_SELECTOR, "[role=heading]")) >= 5
    assert page.find("state").get_attribute("aria-live") == "assertive"
    page.click("stop")
    until(lambda: page.text("state") == "stopped")
    assert "helm page" in page.text("reason")
    until(lambda: not page.browser.find_elements(By.CSS_SELECTOR, ".q-dialog__backdrop"))
    page.click("start")
    until(lambda: page.find("sure").is_displayed())
    time.sleep(0.4)
    page.click("stop")  # STOP works while the dialog is open
    until(lambda: not page.browser.find_elements(By.CSS_SELECTOR, ".q-dialog__backdrop"))
    assert page.text("state") == "stopped"


def colours(element):
    """Red, green and blue of its ground, 0 to 255."""
    return tuple(map(int, re.findall(r"\d+", element.value_of_css_property("background-color"))[:3]))


def is_red(element):
    red, green, blue = colours(element)
    return red > 150 and green < 60 and blue < 60


def is_grey(element):
    return max(colours(element)) - min(colours(element)) < 40


STATES = {"idle": "grey", "ready": "calm", "running": "calm", "degraded": "calm", "stopped": "red", "finished": "calm"}


def test_a_state_is_red_only_where_the_boat_was_stopped(page):
    """The page's process gets the views by hand; without further ones everything is grey and dimmed. When it has begun
    again on the same port, the page goes on.
    """
    port, seq = free_port(), 0

    def shows(send, state, unreachable=""):
        nonlocal seq
        seq += 1
        shown = {"state": state, "reason": f"why {state}", "sog_kn": 2.0, "left": 0.0, "done": 1.0}
        send({"seq": seq, "notice": "", "view": shown | {"unreachable": unreachable}})
        return page.text("state") == state and page.text("reason") == f"why {state}" and not page.is_stale()

    with helm_page(port) as send:
        page.browser.get(f"http://127.0.0.1:{port}/")
        for state, colour in STATES.items():
            until(lambda state=state: shows(send, state))
            pill = page.find("state")
            assert (is_red(pill), is_grey(pill)) == (colour == "red", colour == "grey"), state
            assert page.find("start").is_enabled() is (state in ("ready", "stopped", "finished"))
            assert is_red(page.find("stop")) and page.text("arrival") == "–"
        until(page.is_stale)
        until(lambda: is_grey(page.find("stop")) and is_grey(page.find("state")))
        assert float(page.find("state").value_of_css_property("opacity")) < 0.5
    with helm_page(port) as send:
        until(lambda: shows(send, "running", "it is deaf") and is_grey(page.find("stop")))
        assert page.text("unreachable") == "STOP does not reach the boat: it is deaf"


def fits(page):
    """Nothing exceeds the width of the screen, and the stop button is large and visible."""
    for width, height in (LAPTOP, PHONE):
        page.size(width, height)
        until(lambda width=width: page.find("still").find_element(By.TAG_NAME, "svg").size["width"] <= width)
        across = page.browser.execute_script("return [document.documentElement.scrollWidth, innerWidth]")
        assert across[0] <= across[1] == width
        stop = page.find("stop")
        where = page.browser.execute_script("return arguments[0].getBoundingClientRect().toJSON()", stop)
        assert where["bottom"] <= height and where["height"] >= 56.0 and where["width"] >= 0.5 * width
        until(lambda stop=stop: is_red(stop), 10.0)  # it is grey while no data arrive
        page.browser.execute_script("helmShade()")
        until(lambda: page.browser.execute_script("return Quasar.Dark.isActive") is (width > 600))  # noqa: B023
