"""A headless browser for tests of pages, skipped where none is installed, and the helm page's process."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from steerway.live.testing import server


@contextmanager
def chromium(height: int = 1000) -> Iterator:
    """Chromium, 1280 wide."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    for name in ("chromium", "chromedriver"):
        if shutil.which(name) is None:
            pytest.skip(f"{name} is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for each in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage", f"window-size=1280,{height}"):
        options.add_argument(f"--{each}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        driver.set_page_load_timeout(20)
        yield driver
    finally:
        driver.quit()


@contextmanager
def helm_page(port: int, token: str | None = None) -> Iterator:
    """The page's process as the service starts it; gives a function that sends it a message."""
    settings = {"host": "127.0.0.1", "port": port, "token": token, "origin": None}
    settings |= {"route": [[0.0, 0.0], [60.0, 0.0]], "fence": [], "has_autopilot": True}
    command = (sys.executable, "-m", server.__name__)
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:

        def send(message):
            process.stdin.write(json.dumps(message).encode() + b"\n")
            process.stdin.flush()

        send(settings)
        assert json.loads(process.stdout.readline()) == {"ready": True}
        yield send
