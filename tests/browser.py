"""A real browser without a screen, driven over the WebDriver protocol by the standard library."""

import base64
import json
import os
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from contextlib import contextmanager

WINDOW = (1280, 1000)
PATIENCE_S = 60
# No proxy stands between this machine and itself.
OPENER = urllib.request.build_opener(urllib.request.ProxyHandler({}))
TELEPHONE = {"width": 390, "height": 844, "mobile": True}
WIDTHS = "return [document.documentElement.scrollWidth, document.documentElement.clientWidth]"
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"
ARGUMENTS = [
    "--headless=new",
    "--disable-dev-shm-usage",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--no-first-run",
    f"--window-size={WINDOW[0]},{WINDOW[1]}",
]


def missing():
    """What a test in a browser lacks here, or None; nothing where a browser is required."""
    if "browser" in os.environ.get("PALPATE_TESTS_REQUIRE", ""):
        return None
    if not any(shutil.which(name) for name in ("chromium", "chromium-browser", "google-chrome")):
        return "no chromium here (Debian: apt-get install chromium)"
    return None if shutil.which("chromedriver") else "no chromedriver here (chromium-driver)"


@contextmanager
def browser(profile):
    """Start a browser with an empty profile; it ends with the block."""
    driver = subprocess.Popen(
        ["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    try:
        started = next(line for line in driver.stdout if "started successfully" in line)
        port = started.split()[-1].rstrip(".")
        page = Browser(f"http://127.0.0.1:{port}", profile)
        try:
            yield page
        finally:
            page.ask("DELETE", "")
    finally:
        driver.terminate()
        driver.wait(timeout=PATIENCE_S)
        driver.stdout.close()


def shown(folder, text):
    """A page in a window until it is drawn; the folder goes with it."""
    page = folder / "page.html"
    page.write_text(text)
    with browser(folder / "profile") as opened:
        opened.open(page)
        opened.until("return document.body.dataset.drawn === 'yes'")
        yield opened
    shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def wide(window, size):
    """A window of another size."""
    window.tell("Emulation.setDeviceMetricsOverride", {"deviceScaleFactor": 1, **size})
    try:
        yield
    finally:
        window.tell("Emulation.clearDeviceMetricsOverride", {})


class Browser:
    """One window."""

    def __init__(self, address, profile):
        self.session = address
        arguments = [*ARGUMENTS, f"--user-data-dir={profile}"]
        arguments += ["--no-sandbox"] * (os.geteuid() == 0)
        wanted = {
            "browserName": "chrome",
            "goog:chromeOptions": {"args": arguments},
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
        }
        found = self.ask("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self.session = f"{address}/session/{found['sessionId']}"

    def ask(self, method, path, content=None):
        """Send one command; what the browser says against it is raised."""
        body = None if method in ("GET", "DELETE") else json.dumps(content or {}).encode()
        request = urllib.request.Request(self.session + path, data=body, method=method)
        request.add_header("Content-Type", "application/json")
        try:
            with OPENER.open(request, timeout=PATIENCE_S) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(error.read().decode()[:500]) from None

    def open(self, path):
        self.ask("POST", "/url", {"url": path.as_uri()})

    def run(self, script, *arguments):
        """Run a script; what it promises is awaited."""
        return self.ask("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def until(self, script, *arguments):
        """Wait until a script gives something true."""
        end = time.monotonic() + PATIENCE_S
        while not (found := self.run(script, *arguments)):
            if time.monotonic() > end:
                raise TimeoutError(f"script: expected something true of {script}, found {found}")
            time.sleep(0.1)
        return found

    def element(self, css):
        return self.ask("POST", "/element", {"using": "css selector", "value": css})[ELEMENT]

    def press(self, css, keys):
        """Send keys to an element."""
        self.ask("POST", f"/element/{self.element(css)}/value", {"text": keys})

    def type(self, keys):
        """Send keys to what has the focus."""
        actions = [{"type": kind, "value": key} for key in keys for kind in ("keyDown", "keyUp")]
        hand = {"type": "key", "id": "keys", "actions": actions}
        self.ask("POST", "/actions", {"actions": [hand]})

    def tell(self, command, content):
        """Send a command of the browser's own protocol."""
        self.ask("POST", "/goog/cdp/execute", {"cmd": command, "params": content})

    def picture(self, css):
        """An element as the screen shows it, as PNG."""
        text = self.ask("GET", f"/element/{self.element(css)}/screenshot")
        return base64.b64decode(text)

    def errors(self):
        """What scripts complained of since the last look."""
        lines = self.ask("POST", "/se/log", {"type": "browser"})
        return [line["message"] for line in lines if line["level"] == "SEVERE"]

    def requests(self):
        """Addresses that were asked for since the last look."""
        lines = self.ask("POST", "/se/log", {"type": "performance"})
        events = [json.loads(line["message"])["message"] for line in lines]
        return [
            event["params"]["request"]["url"]
            for event in events
            if event["method"] == "Network.requestWillBeSent"
        ]
