"""A real browser shows what a robot says: the page of `toposlam serve` in Chromium.

`TOPOSLAM=path/to/toposlam python3 -m unittest test_page`, with what requirements-page.txt names, and Debian's packages chromium and
chromium-driver. With SCREENSHOT=FILE.png the page is also written to that file.
"""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import time
import unittest
from pathlib import Path

from frames import frame, varint
from requirement import require

REPOSITORY = Path(__file__).resolve().parents[2]
TOPOSLAM = os.environ.get("TOPOSLAM", str(REPOSITORY / "target" / "debug" / "toposlam"))
CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
SCREENSHOT = os.environ.get("SCREENSHOT")
# Longer than anything takes; who waits so long has failed.
FOREVER_S = 60
WINDOW = 1200, 1000

missing = [name for name, found in (("chromium", CHROMIUM), ("chromedriver", DRIVER)) if found is None]
if not Path(TOPOSLAM).exists():
    missing.append(TOPOSLAM)
try:
    from selenium import webdriver
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.wait import WebDriverWait
except ImportError as error:
    missing.append(str(error.name))


def setUpModule() -> None:
    require(missing, "no browser has shown the page")


class Program:
    """A `toposlam` that runs until it is stopped; `address` is the last word of its first line."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen([TOPOSLAM, *arguments], stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().split()[-1]

    def stop(self) -> None:
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


def robot(address: str = "127.0.0.1:0") -> Program:
    return Program("robot", "--speed", "60", "--listen", address)


def serve(line: str, address: str = "127.0.0.1:0") -> Program:
    return Program("serve", line, "--listen", address)


def command(line: str, *arguments: str) -> str:
    done = subprocess.run([TOPOSLAM, "command", line, *arguments], capture_output=True, text=True, timeout=FOREVER_S, check=True)
    return done.stdout


def hello(version: int) -> bytes:
    """A robot of a protocol version, with four sonars (docs/wire.md, Hello)."""
    return bytes([0]) + varint(version) + varint(7) + bytes([1, 1, 1, 16, 10]) + varint(400) + bytes([5, 2, 4])


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=%d,%d" % WINDOW):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        cls.browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=DRIVER))
        cls.addClassCleanup(cls.browser.quit)

    def setUp(self) -> None:
        # Also what a test that failed has left.
        self.browser.get("about:blank")
        self.browser.get_log("browser")

    def start(self, program: Program) -> Program:
        self.addCleanup(program.stop)
        return program

    def count(self, selector: str) -> int:
        return self.browser.execute_script("return document.querySelectorAll(arguments[0]).length", selector)

    def text(self, name: str) -> str:
        return self.browser.execute_script("return document.getElementById(arguments[0]).textContent", name)

    def banners(self) -> set[str]:
        shown = self.browser.execute_script("return [...document.querySelectorAll('.banner')].filter((b) => b.checkVisibility()).map((b) => b.id)")
        return set(shown)

    def wait(self, what: str, condition):
        return WebDriverWait(self.browser, FOREVER_S, poll_frequency=0.1).until(lambda _: condition(), what)

    def test_it_draws_the_map_of_a_robot_that_explores(self) -> None:
        line = self.start(robot()).address
        self.browser.get(self.start(serve(line)).address)
        self.wait("ten vertices", lambda: self.count("#map .vertex") >= 10)
        if SCREENSHOT:
            time.sleep(0.5)
            self.browser.save_screenshot(SCREENSHOT)
        # From here on it stands, so that its map stays as it is while it is compared.
        command(line, "pause", "on")
        # Where it is comes round less often than its map.
        received = self.wait("a place", lambda: text if "at vertex" in (text := command(line, "map")) else None)
        vertices, edges = map(int, re.search(r"map: (\d+) vertices, (\d+) edges", received).groups())
        radii = [int(radius) for radius in re.findall(r"vertex +\d+: radius +(\d+) mm", received)]
        names = sorted(re.search(r"edges: (.*)", received).group(1).split())
        here = re.search(r"at vertex (\d+)", received).group(1)
        self.assertGreaterEqual(vertices, 10)

        def is_drawn() -> bool:
            return (
                self.count("#map .vertex") == vertices == len(radii)
                and sorted(self.browser.execute_script("return [...document.querySelectorAll('#map .edge')].map((e) => e.dataset.edge)")) == names
                and self.browser.execute_script("return [...document.querySelectorAll('#map .here')].map((v) => v.dataset.vertex)") == [here]
            )

        self.wait(received, is_drawn)
        self.assertEqual(len(names), edges)
        labels = self.browser.execute_script("return [...document.querySelectorAll('#map .label')].map((label) => label.textContent)")
        self.assertEqual([int(label.split(" mm")[0]) for label in labels], radii)
        self.assertEqual(self.count("#table tr"), vertices)
        self.assertEqual(self.banners(), set())
        frontiers = re.search(r"frontiers: (.*)", received)
        frontiers = frontiers.group(1).split() if frontiers else []
        drawn = self.browser.execute_script("return [...document.querySelectorAll('#map .frontier')].map((f) => f.dataset.way)")
        self.assertEqual(sorted(drawn), sorted(frontiers))
        explored = r"(, \d+ frontiers?(, exploration complete)?)?"
        self.assertRegex(self.text("summary"), f"{vertices} vertices, {edges} edges{explored}; the robot is at vertex {here}")
        self.assertTrue(self.browser.find_element(By.ID, "map").accessible_name.startswith(f"The map: {vertices} vertices"))
        self.assertRegex(self.text("belief"), r"this map\d+\.\d %its rivals\d+\.\d %consistency(\d+ mm|infinite)")
        self.wait("it stands", lambda: "speed0.0 %" in self.text("drive"))
        # The policy of the page lets everything through that the page does.
        self.assertEqual(self.browser.get_log("browser"), [])

        for name in ("number", "radius", "probability"):
            self.browser.find_element(By.NAME, name).click()
        self.wait("no labels", lambda: self.count("#map text") == 0)
        self.browser.find_element(By.NAME, "visits").click()
        self.wait("visits", lambda: self.count("#map .label") == vertices)

    def test_it_says_when_the_robot_or_the_server_is_gone_and_goes_on_when_they_are_back(self) -> None:
        first_robot = self.start(robot())
        first_server = self.start(serve(first_robot.address))
        line, address = first_robot.address.removeprefix("tcp:"), first_server.address.removeprefix("http://").rstrip("/")
        self.browser.get(first_server.address)
        self.wait("a robot", lambda: self.text("connection") == "connected" and self.count("#map .vertex") > 0)
        self.assertEqual(self.banners(), set())
        first_robot.stop()
        self.wait("the line is cut", lambda: self.banners() == {"banner-line"})
        self.assertIn("No line to the robot: ", self.text("banner-line"))
        self.assertGreater(self.count("#map .vertex"), 0, "what was received stays")
        self.start(robot(line))
        self.wait("the line is back", lambda: self.banners() == set())
        first_server.stop()
        self.wait("the server is gone", lambda: self.banners() == {"banner-server"})
        self.start(serve(f"tcp:{line}", address))
        self.wait("the server is back", lambda: self.banners() == set() and self.text("connection") == "connected")

    def test_it_shows_the_ring_and_the_faults_and_does_not_trust_a_robot_of_another_version(self) -> None:
        damaged = bytearray(frame(2, bytes([8, 1, 1])))
        damaged[-3] ^= 0x80
        ring = bytes([10, 7, 4]) + varint(502) + bytes([1, 0]) + varint(1002)
        said = frame(0, hello(99)) + frame(1, bytes([8, 0, 5])) + bytes(damaged) + frame(3, ring)
        with socket.create_server(("127.0.0.1", 0)) as port:
            self.browser.get(self.start(serve(f"tcp:127.0.0.1:{port.getsockname()[1]}")).address)
            with port.accept()[0] as robots_end:
                robots_end.sendall(said)
                self.wait("another version", lambda: self.banners() == {"banner-version"})
                self.assertIn("protocol version 99", self.text("banner-version"))
                self.wait("the ring", lambda: [self.count(f"#ring .{kind}") for kind in ("echo", "silence", "dead")] == [2, 1, 1])
                self.assertIn("500 mm, silence, dead, 1000 mm", self.browser.find_element(By.ID, "ring").accessible_name)
                self.assertIn("SonarSilent5", self.text("health"))
                self.assertIn("frames lost1damaged1", self.text("health"))

    def test_it_goes_on_to_show_what_the_standard_input_told_and_warns_when_others_can_look(self) -> None:
        arguments = [TOPOSLAM, "serve", "-", "--listen", "0.0.0.0:0"]
        with subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=False) as program:
            self.addCleanup(program.kill)
            # An edge from 0 to 1 (docs/wire.md, Edge).
            program.stdin.write(frame(0, bytes([4, 0, 1, 1])))
            program.stdin.close()
            self.assertIn(b"warning: whoever reaches 0.0.0.0:", program.stderr.readline())
            self.browser.get(program.stdout.readline().split()[-1].decode())
            self.wait("the end", lambda: self.text("connection") == "the input has ended")
            self.wait("two vertices", lambda: (self.count("#map .vertex"), self.count("#map .edge")) == (2, 1))
            program.kill()

    def test_a_tab_that_slept_shows_the_newest_state_and_the_colours_are_those_that_the_system_prefers(self) -> None:
        self.browser.get(self.start(serve(self.start(robot()).address)).address)
        self.wait("a robot", lambda: self.count("#map .vertex") > 0)
        received = lambda: int(re.search(r"frames received(\d+)", self.text("health")).group(1))
        self.browser.minimize_window()
        asleep = received()
        self.browser.execute_cdp_cmd("Page.setWebLifecycleState", {"state": "frozen"})
        time.sleep(2)
        self.assertLess(received(), asleep + 100, "nothing is drawn that is not seen")
        self.browser.execute_cdp_cmd("Page.setWebLifecycleState", {"state": "active"})
        self.browser.set_window_rect(0, 0, *WINDOW)
        self.wait("it continues", lambda: received() > asleep + 500)
        self.assertEqual(self.banners(), set())
        self.addCleanup(self.browser.execute_cdp_cmd, "Emulation.setEmulatedMedia", {"features": []})
        grounds = set()
        for scheme in ("light", "dark"):
            self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
            grounds.add(self.browser.execute_script("return getComputedStyle(document.body).backgroundColor"))
        self.assertEqual(grounds, {"rgb(246, 246, 243)", "rgb(21, 23, 26)"})


if __name__ == "__main__":
    unittest.main()
