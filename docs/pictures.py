"""The pictures of the README: docs/images/closed-loop.png, the figure of its tutorial, demo.png, helm.png and helm.gif.

python docs/pictures.py   (make pictures; needs chromium and chromedriver)

demo.png and helm.png show a page in a real browser, on a laptop and on a phone, beside each other.
"""

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.error import URLError
from urllib.request import urlopen

import numpy as np
from build import DOCS, ROOT, executed
from matplotlib.image import imread, imsave
from PIL import Image
from selenium import webdriver

IMAGES = DOCS / "images"
STEERWAY = (sys.executable, "-c", "from steerway.commands.cli import main; main()")
LAPTOP, PHONE = (1200, 940), (390, 940)
GAP, GROUND = 24, (0.88, 0.90, 0.92)
HALFWAY_AROUND, AROUND = 112.0, 240.0
"""Seconds in which the boat of the desk starts and sails two legs of the square, and the whole of it."""
FRAME, SHOWN = 4.0, 0.24
"""Seconds from one frame of helm.gif to the next, as sailed and as shown."""
FRAME_SIZE = (640, 502)


@contextmanager
def browser(size: tuple[int, int]) -> Iterator[webdriver.Chrome]:
    """Headless Chromium with a window of `size` pixels."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for each in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage", "hide-scrollbars"):
        options.add_argument(f"--{each}")
    driver = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
    width, height = size
    window = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", window)
    try:
        yield driver
    finally:
        driver.quit()


def taken(address: str, size: tuple[int, int], script: str = "", wait: float = 3.0) -> np.ndarray:
    """The page at an address as an image, `wait` seconds after it was loaded and `script` was run in it."""
    with browser(size) as driver:
        driver.get(address)
        time.sleep(wait)
        driver.execute_script(script)
        time.sleep(1.0)
        return screen(driver)


def screen(driver: webdriver.Chrome) -> np.ndarray:
    """The visible part of the page, as an image."""
    return imread(BytesIO(driver.get_screenshot_as_png()))[..., :3]


def beside(laptop: np.ndarray, phone: np.ndarray) -> np.ndarray:
    """Two images beside each other."""
    ground = np.ones((max(len(laptop), len(phone)), laptop.shape[1] + GAP + phone.shape[1], 3)) * GROUND
    ground[: len(laptop), : laptop.shape[1]] = laptop
    ground[: len(phone), -phone.shape[1] :] = phone
    return ground


def closed_loop(folder: Path) -> np.ndarray:
    """The figure of the tutorial on a closed loop."""
    page = DOCS / "tutorials" / "closed-loop.md"
    executed(page.read_text("utf-8"), page.name, folder, folder)
    (image,) = folder.glob("*.png")
    return imread(image)


def demo(folder: Path) -> np.ndarray:
    """The page of the demo, with the cursor in a turn."""
    subprocess.run((*STEERWAY, "demo", "-o", str(folder)), check=True, cwd=ROOT)
    address = (folder / "index.html").as_uri()
    cursor = """
        const slider = document.querySelector('input[type=range]');
        slider.value = Number(slider.min) + 0.43 * (slider.max - slider.min);
        slider.dispatchEvent(new Event('input'));
    """
    return beside(taken(address, LAPTOP, cursor), taken(address, PHONE))


def helm(_: Path) -> np.ndarray:
    """The helm page, with the boat of the desk half-way around its square; helm.gif shows the whole way."""
    link, address = "127.0.0.1:14550", "http://127.0.0.1:8080"
    boat = ("simulate", "examples/otter-square.toml", "--live", "--mavlink", f"udpout:{link}")
    pilot = ("--from", f"mavlink:udpin:{link}", "--to", f"mavlink:udpin:{link}", "--helm", "--engage")
    with ExitStack() as running:
        for command in (boat, ("live", *pilot, "--mission", "examples/live/square.toml")):
            process = subprocess.Popen((*STEERWAY, *command), cwd=ROOT)
            running.callback(process.wait)
            running.callback(process.send_signal, signal.SIGINT)
        with browser(LAPTOP) as laptop, browser(PHONE) as phone:
            for page in (laptop, phone):
                answered(address)
                page.get(address)
            frames: list[Image.Image] = []
            begin = time.monotonic()
            for at in np.arange(FRAME, AROUND, FRAME):
                time.sleep(max(begin + at - time.monotonic(), 0.0))
                frames.append(Image.open(BytesIO(laptop.get_screenshot_as_png())).convert("RGB").resize(FRAME_SIZE))
                if at == HALFWAY_AROUND:
                    halfway = beside(screen(laptop), screen(phone))
            animate(frames, IMAGES / "helm.gif")
            return halfway


def animate(frames: list[Image.Image], path: Path) -> None:
    """Write frames as one GIF, in the colours of the middle one."""
    colours = frames[len(frames) // 2].quantize(48)
    first, *rest = (frame.quantize(palette=colours, dither=Image.Dither.NONE) for frame in frames)
    first.save(path, save_all=True, append_images=rest, duration=round(1000 * SHOWN), loop=0)


def answered(address: str, patience: float = 120.0) -> None:
    """Wait until a page is served."""
    end = time.monotonic() + patience
    while True:
        try:
            urlopen(address).close()
            return
        except URLError:
            if time.monotonic() > end:
                raise
            time.sleep(0.5)


if __name__ == "__main__":
    for make in (closed_loop, demo, helm):
        name = f"{make.__name__.replace('_', '-')}.png"
        with TemporaryDirectory() as folder:
            imsave(IMAGES / name, make(Path(folder)))
        print(f"wrote docs/images/{name}", flush=True)
