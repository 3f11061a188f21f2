"""A headless browser for tests of pages; they are skipped where none is installed."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def chromium(height: int = 1000, log: bool = False) -> Iterator:
    """Chromium, 1280 wide; with `log` it writes down what it asks for."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    for name in ("chromium", "chromedriver"):
        if shutil.which(name) is None:
            pytest.skip(f"{name} is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for each in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage", f"window-size=1280,{height}"):
        options.add_argument(f"--{each}")
    kinds = {"performance": "ALL", "browser": "ALL"} if log else {"browser": "ALL"}
    options.set_capability("goog:loggingPrefs", kinds)
    driver = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        driver.set_page_load_timeout(20)
        yield driver
    finally:
        driver.quit()
