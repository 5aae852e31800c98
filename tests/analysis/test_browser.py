"""The report in a real browser: no errors, no network, figures that react."""

import base64
import itertools
import json
import os
import shutil
import subprocess
import time

import pytest

from analysis.report import write_report
from hard_cases.trials import TrialBox, trial_session

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


class Page:
    """One page of a headless Chromium, driven through its debugging pipe."""

    def __init__(self, program, folder):
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()
        command = (
            f"exec {program} --headless=new --no-sandbox --disable-gpu"
            " --disable-dev-shm-usage --no-first-run --disable-extensions"
            f" --user-data-dir={folder} --remote-debugging-pipe about:blank"
            f" 3<&{theirs_in} 4>&{theirs_out}"
        )
        self.process = subprocess.Popen(
            ["bash", "-c", command],
            pass_fds=(theirs_in, theirs_out),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self.inbox, self.outbox = ours_in, ours_out
        self.buffer, self.events, self.numbers = b"", [], itertools.count(1)
        self.session = None
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.ask("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method, **parameters):
        number = next(self.numbers)
        message = {"id": number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.outbox, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]
            self.events.append(answer)

    def _next(self):
        while b"\0" not in self.buffer:
            piece = os.read(self.inbox, 1 << 20)
            assert piece, "the browser has gone"
            self.buffer += piece
        line, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(line)

    def run(self, script):
        said = self.ask("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in said, said
        return said["result"].get("value")

    def open(self, path, width, height=900):
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        self.ask("Page.navigate", url=path.as_uri())
        deadline = time.monotonic() + 60
        while self.run("document.body && document.body.dataset.ready") != "yes":
            assert time.monotonic() < deadline, "the page never got ready"

    def complaints(self):
        bad = []
        for event in self.events:
            method, said = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown":
                bad.append(said)
            if method == "Log.entryAdded" and said["entry"]["level"] == "error":
                bad.append(said)
            if method == "Runtime.consoleAPICalled" and said["type"] == "error":
                bad.append(said)
        return bad

    def requests(self):
        return [
            event["params"]["request"]["url"]
            for event in self.events
            if event.get("method") == "Network.requestWillBeSent"
        ]

    def screenshot(self, path):
        data = self.ask("Page.captureScreenshot", captureBeyondViewport=True)["data"]
        path.write_bytes(base64.b64decode(data))

    def close(self):
        self.process.terminate()
        self.process.wait(20)
        os.close(self.inbox)
        os.close(self.outbox)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    program = next((p for p in map(shutil.which, BROWSERS) if p), None)
    if program is None:
        pytest.skip("no Chromium here (Debian: apt-get install -y chromium)")
    page = Page(program, tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    import numpy as np

    box = TrialBox(sample_rate=16000, duration=0.2)
    session = trial_session(5, {1: "gain"}, np.random.default_rng(0), box=box)
    return write_report([session], tmp_path_factory.mktemp("report"))["html"]


PICTURE = """(() => {
  const canvas = document.querySelector('[data-figure="%s"] canvas');
  return canvas.toDataURL();
})()"""


@pytest.mark.parametrize("width", [390, 1200])
def test_page_opens_without_errors_or_network(page, report, width, tmp_path):
    page.open(report, width)
    assert page.complaints() == []
    assert all(url.startswith(("file:", "data:", "about:")) for url in page.requests())
    assert page.run("document.documentElement.scrollWidth") <= width
    assert page.run("parseFloat(getComputedStyle(document.body).fontSize)") >= 14
    page.screenshot(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 10_000


def test_figures_follow_the_chosen_pair(page, report):
    page.open(report, 1000)
    kinds = ("paired", "unpaired", "decay", "spectrogram-forward")
    before = [page.run(PICTURE % kind) for kind in kinds]
    assert page.run("document.querySelector('.detail h3').textContent") == "Pair 0"
    page.run("document.querySelectorAll('tr[data-pair]')[2].click()")
    assert page.run("document.querySelector('.detail h3').textContent") == "Pair 2"
    after = [page.run(PICTURE % kind) for kind in kinds]
    assert all(a != b for a, b in zip(before, after, strict=True))
    assert page.run("document.querySelectorAll('tr.chosen').length") == 1


def test_map_dots_and_list_of_outliers_choose_pairs_too(page, report):
    page.open(report, 1000)
    for number in (2, 3):
        marks = f"document.querySelectorAll('g[data-pair=\"{number}\"]')"
        assert page.run(f"{marks}.length") > 3
        page.run(
            f"{marks}[{marks}.length - 1].dispatchEvent("
            "new MouseEvent('click', {bubbles: true, cancelable: true}))"
        )
        said = page.run("document.querySelector('.detail h3').textContent")
        assert said == f"Pair {number}"
    page.run(
        "document.querySelectorAll('g[data-pair=\"3\"]')[0]"
        ".dispatchEvent(new MouseEvent('click', {bubbles: true, cancelable: true}))"
    )
    assert page.run("document.querySelector('.detail h3').textContent") == "Pair 3"
    page.run("document.querySelector('a[data-pair]').click()")
    assert page.run("document.querySelector('.detail h3').textContent") == "Pair 1"
    note = page.run("document.querySelector('.detail .note').textContent")
    assert "gain step of +0." in note


def test_zoom_and_keyboard_work(page, report):
    page.open(report, 390)
    before = page.run(PICTURE % "paired")
    page.run(
        "const s = document.querySelector('input[type=range]'); s.value = 10;"
        "s.dispatchEvent(new Event('input'))"
    )
    assert page.run(PICTURE % "paired") != before
    page.run(
        "document.querySelectorAll('tr[data-pair]')[4]"
        ".dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter'}))"
    )
    assert page.run("document.querySelector('.detail h3').textContent") == "Pair 4"
    assert page.complaints() == []
