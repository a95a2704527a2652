"""Chromium for the tests: a page opened once with a picture, or driven step by step through the DevTools protocol."""

from __future__ import annotations

import asyncio
import base64
import json
import re
import subprocess
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
from matplotlib.image import imread

QUIET = (
    "--headless", "--no-sandbox", "--hide-scrollbars", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--enable-logging=stderr", "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--disable-default-apps", "--disable-extensions",
)  # fmt: skip

OWN = "not an origin"
MOVED = -32000  # the protocol's code of an error: the page was left, or loaded anew, before it could answer


def browse(chromium: str, folder: Path, url: str, width: int) -> tuple[np.ndarray, str, list[str]]:
    """Picture (height, width, 3) of a page, what its console said, and the addresses that were asked for."""
    shot, log = folder / "shot.png", folder / "net.json"
    places = (f"--user-data-dir={folder / 'profile'}", f"--log-net-log={log}", f"--screenshot={shot}")
    done = subprocess.run(
        [chromium, *QUIET, *places, f"--window-size={width},1000", url], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    console = "\n".join(line for line in done.stderr.splitlines() if "CONSOLE" in line)
    return imread(shot)[..., :3], console, addresses(log)


def addresses(log: Path) -> list[str]:
    """What the page asked for; the browser's own errands have no initiator."""
    events = [event.get("params", {}) for event in json.loads(log.read_text(encoding="utf-8"))["events"]]
    return [event["url"] for event in events if "url" in event and event.get("initiator", OWN) != OWN]


class Moved(AssertionError):
    """The page was loaded anew while a command was under way."""


class Tab:
    """An open page: what its console complained of, and the addresses it asked for."""

    def __init__(self, socket, session):
        self.socket, self._session, self._count = socket, session, 0
        self.complaints: list[str] = []
        self.asked: list[str] = []

    async def call(self, method, **parameters):
        """A command of the protocol and its answer; events on the way are kept."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        await self.socket.send_json(message)
        while True:
            answer = await self.socket.receive_json(timeout=60)
            if answer.get("id") == self._count and answer.get("sessionId") == self._session:
                if "error" in answer:
                    raise (Moved if answer["error"].get("code") == MOVED else AssertionError)(answer)
                return answer["result"]
            self._note(answer.get("method"), answer.get("params", {}))

    def _note(self, method, event):
        if method in ("Network.requestWillBeSent", "Network.webSocketCreated"):
            self.asked.append(event["request"]["url"] if "request" in event else event["url"])
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(event["exceptionDetails"]["text"])
        elif method == "Runtime.consoleAPICalled" and event["type"] in ("error", "warning", "assert"):
            self.complaints.append(" ".join(str(part.get("value", part)) for part in event["args"]))
        elif method == "Log.entryAdded" and event["entry"]["level"] in ("error", "warning"):
            self.complaints.append(event["entry"]["text"])

    async def value(self, script):
        """What a JavaScript expression gives, promises awaited."""
        answer = await self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    async def until(self, script, seconds=30.0):
        """Wait for an expression to be true and return it."""
        end = asyncio.get_running_loop().time() + seconds
        while not (found := await self._value_once_loaded(script)):
            if asyncio.get_running_loop().time() > end:
                raise AssertionError(f"not within {seconds} s: {script}\n{await self.text()}")
            await asyncio.sleep(0.1)
        return found

    async def _value_once_loaded(self, script):
        """The value of an expression; nothing while the page is being loaded anew."""
        try:
            return await self.value(script)
        except Moved:
            return None

    async def text(self):
        """What a reader sees."""
        return await self.value("document.body?.innerText")

    async def sees(self, words, seconds=30.0):
        """Wait for words to be on the page."""
        await self.until(f"document.body?.innerText.includes({json.dumps(words)})", seconds)

    async def click(self, words):
        """Press the button that says so."""
        found = f"[...document.querySelectorAll('button')].find((one) => one.innerText === {json.dumps(words)})"
        await self.until(found + " !== undefined")
        await self.value(found + ".click()")

    async def choose(self, selector, path):
        """Choose a file in an input element."""
        document = await self.call("DOM.getDocument")
        node = await self.call("DOM.querySelector", nodeId=document["root"]["nodeId"], selector=selector)
        await self.call("DOM.setFileInputFiles", files=[str(path)], nodeId=node["nodeId"])

    async def picture(self, path, width=1280, height=1300, whole=False):
        """A PNG of what is seen at that size of window, or of the whole page."""
        await self.call("Page.bringToFront")  # a tab behind another one is not drawn
        await self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )
        await asyncio.sleep(0.5)  # layout and drawing
        shot = await self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(shot["data"]))
        return imread(path)[..., :3]


class Browser:
    """A running Chromium."""

    def __init__(self, http, address, context=None):
        self._http, self._address, self._context = http, address, context

    async def _connected(self):
        return Tab(await self._http.ws_connect(self._address, max_msg_size=0), None)

    @asynccontextmanager
    async def fresh(self):
        """The same browser as a new one is: nothing is stored, no other tab is open; its tabs are closed at the end."""
        tab = await self._connected()
        context = await tab.call("Target.createBrowserContext")
        try:
            yield Browser(self._http, self._address, context)
        finally:
            await tab.call("Target.disposeBrowserContext", **context)

    async def open(self, url):
        """A new tab on that address."""
        tab = await self._connected()
        target = (await tab.call("Target.createTarget", url="about:blank", **(self._context or {})))["targetId"]
        session = (await tab.call("Target.attachToTarget", targetId=target, flatten=True))["sessionId"]
        tab = Tab(tab.socket, session)
        for domain in ("Page", "Runtime", "Network", "Log", "DOM"):
            await tab.call(f"{domain}.enable")
        await tab.call("Page.navigate", url=url)
        return tab


@asynccontextmanager
async def running(chromium, folder):
    """A Chromium that tabs can be opened in."""
    import aiohttp

    arguments = [
        *QUIET,
        f"--user-data-dir={folder / 'profile'}",
        "--remote-debugging-port=0",
        "--window-size=1280,1000",
    ]
    with (folder / "chromium.log").open("w") as log:
        process = subprocess.Popen([chromium, *arguments, "about:blank"], stderr=log)
        try:
            async with asyncio.timeout(30):
                said = None
                while said is None:
                    await asyncio.sleep(0.1)
                    said = re.search(r"DevTools listening on (\S+)", (folder / "chromium.log").read_text())
            async with aiohttp.ClientSession() as http:
                yield Browser(http, said[1])
        finally:
            process.terminate()
            process.wait(timeout=20)
