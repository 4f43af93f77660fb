"""A headless Chromium that is driven as people drive one: by mouse, touch and keys; with what its console says."""

import base64
import pathlib
import shutil
import time

from selenium import webdriver
from selenium.webdriver import ActionChains
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By

CHROMEDRIVER = shutil.which("chromedriver")
OPTIONS = ["--headless=new", "--no-sandbox", "--no-first-run", "--disable-background-networking", "--disable-gpu-watchdog", "--hide-scrollbars",
           "--host-resolver-rules=MAP * ~NOTFOUND", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


class Browser:
    """One window. Its pages have nothing but themselves: no name of another machine is found."""

    def __init__(self, chromium):
        options = webdriver.ChromeOptions()
        options.binary_location = chromium
        for option in OPTIONS:
            options.add_argument(option)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(service=Service(CHROMEDRIVER), options=options)
        self.driver.set_script_timeout(300)

    def quit(self):
        self.driver.quit()

    def open(self, page: pathlib.Path, width, height, touch=False):
        """The page in a window of so many pixels, of a phone where `touch`. What came before is forgotten."""
        self.driver.get("about:blank")
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": touch}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        self.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": touch, "maxTouchPoints": 2 if touch else 1})
        self.console()
        self.driver.get_log("performance")
        self.driver.get(page.resolve().as_uri())

    def console(self):
        """What the console has said since it was asked last."""
        return [f"{entry['level']}: {entry['message']}" for entry in self.driver.get_log("browser")]

    def requests(self):
        """The addresses that the page has asked for, its own and those within it left out."""
        import json
        sent = (json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance"))
        urls = [one["params"]["request"]["url"] for one in sent if one["method"] == "Network.requestWillBeSent"]
        return [url for url in urls if not url.startswith(("data:", "blob:", "about:", self.driver.current_url.split("#")[0]))]

    def run(self, script, *arguments):
        """What a JavaScript function's body returns."""
        return self.driver.execute_script(script, *arguments)

    def wait(self, script, *arguments, seconds=120):
        """Until the body returns something true, which is returned."""
        end = time.monotonic() + seconds
        while not (result := self.run(script, *arguments)):
            if time.monotonic() > end:
                raise AssertionError(f"waited in vain for: {script}\nthe console: {self.console()}")
            time.sleep(0.05)
        return result

    def find(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def box(self, selector):
        return self.run("const b = document.querySelector(arguments[0]).getBoundingClientRect(); return [b.x, b.y, b.width, b.height];", selector)

    def mouse(self, kind, x, y, **more):
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": kind, "x": x, "y": y, **more})

    def click(self, x, y, count=1):
        for n in range(1, count + 1):
            for kind in ("mousePressed", "mouseReleased"):
                self.mouse(kind, x, y, button="left", clickCount=n)

    def drag(self, *points):
        """The mouse pressed at the first point, moved over the others, and let go at the last."""
        self.mouse("mousePressed", *points[0], button="left", clickCount=1)
        for x, y in points[1:]:
            self.mouse("mouseMoved", x, y, button="left", buttons=1)
        self.mouse("mouseReleased", *points[-1], button="left", clickCount=1)

    def touch(self, *moments):
        """Fingers: each moment is the list of the points that they are at; then all are lifted."""
        for n, points in enumerate(moments):
            fingers = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
            self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchMove" if n else "touchStart", "touchPoints": fingers})
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def press(self, *keys):
        """Keys, one after the other, where the focus is."""
        for key in keys:
            ActionChains(self.driver).send_keys(key).perform()

    def chord(self, held, key):
        ActionChains(self.driver).key_down(held).send_keys(key).key_up(held).perform()

    def picture(self, selector=None):
        """PNG of the window, or of an element as it is shown."""
        clip = {}
        if selector:
            x, y, width, height = self.box(selector)
            clip = {"clip": {"x": x, "y": y, "width": width, "height": height, "scale": 1}}
        return base64.b64decode(self.driver.execute_cdp_cmd("Page.captureScreenshot", {"format": "png", **clip})["data"])
