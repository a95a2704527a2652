"""The live page, driven in Chromium as a user does it, and its server asked for what it must not give."""

from __future__ import annotations

import asyncio
import base64
import http.client
import os
import re
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from browser import running
from matplotlib.colors import rgb_to_hsv, to_rgb
from mesh_files import CUBE, TRIANGLES, obj
from shapes import ball

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.figures.evaluate import FACE_COLORS
from iga_nn.io.formats import load_volume
from iga_nn.samples import write_obj
from parameterize.surface.surface import surface_from_arrays

QUICK = ("--steps-factor", "0.02", "--control-points", "6", "--refine", "0")
OPEN = obj(CUBE, TRIANGLES[:-1])
PATIENCE = 200.0  # seconds; on an idle machine a job takes some 15


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Port of a running page; uploads up to 1 MB. Its terminal stays silent, whatever it is asked."""
    pytest.importorskip("trame")
    environment = os.environ | {
        "PYTHONPATH": str(Path(iga_nn.__file__).parents[1]),
        "TRAME_DEFAULT_HOST": "0.0.0.0",
        "TRAME_ARGS": "--host 0.0.0.0",
    }
    command = [sys.executable, "-m", "iga_nn", "app", "--port", "0", "--max-upload", "1", *QUICK]
    terminal = tmp_path_factory.mktemp("page") / "stderr"
    with (
        terminal.open("w") as stderr,
        subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=stderr, text=True) as server,
    ):
        try:
            said = server.stdout.readline()
            yield int(re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\n", said)[1])
        finally:
            server.terminate()
            assert server.wait(timeout=30) == 0
            assert terminal.read_text() == ""


def ask(port, method, path, body=None, **headers):
    """Status and text of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
    answer = connection.getresponse()
    return answer.status, answer.read().decode(errors="replace")


def write_ball(path):
    points, faces = ball(200)
    write_obj(surface_from_arrays(points * [1.3, 1.0, 0.8], faces), path)
    return path


def pixels_of(image, color):
    """How many strongly coloured pixels have that hue."""
    pixels = rgb_to_hsv(image.reshape(-1, 3))
    strong = pixels[(pixels[:, 1] > 0.35) & (pixels[:, 2] > 0.2)]
    return np.count_nonzero(np.abs(strong[:, 0] - rgb_to_hsv(np.array(to_rgb(color)))[0]) < 0.02)


DROP = """(() => {
  const carried = new DataTransfer();
  carried.items.add(new File([%r], "my ball.obj"));
  document.querySelector(".drop").dispatchEvent(new DragEvent("drop", {dataTransfer: carried, bubbles: true}));
})()"""
FETCHED = """(async () => {
  const link = document.querySelector('a[download="volume.npz"]');
  const bytes = new Uint8Array(await (await fetch(link.href)).arrayBuffer());
  return btoa(String.fromCharCode(...bytes));
})()"""
CLICKED = """(() => {
  const view = document.querySelector("iframe").contentDocument.getElementById("view");
  const box = view.getBoundingClientRect();
  const middle = {clientX: box.left + box.width / 2, clientY: box.top + box.height / 2, bubbles: true};
  view.dispatchEvent(new MouseEvent("click", middle));
})()"""
REPORT = "document.querySelector('iframe')?.contentDocument?.body?.innerText"


def test_from_a_dropped_file_to_the_downloaded_volume(chromium, page, tmp_path, capsys):
    asyncio.run(walk(chromium, page, tmp_path, capsys))


async def walk(chromium, port, folder, capsys):
    async with running(chromium, folder) as browser:
        first = await browser.open(f"http://127.0.0.1:{port}/")
        await refused(first, folder, capsys)
        await dropped_and_started(first, folder)
        second = await browser.open(f"http://127.0.0.1:{port}/")
        await seen_by_another_tab(second)
        await trained(first, folder)
        await finished(first, folder)
        await another_problem(first)
        await stopped(second)
        await first.click("cube.obj\nstopped")  # away from the report
        await first.sees("Resume continues")
        for tab in (first, second):
            await asyncio.sleep(0.5)
            await tab.text()  # whatever it has to say by now
            assert tab.complaints == []
            assert tab.asked
            own = (f"http://127.0.0.1:{port}/", f"ws://127.0.0.1:{port}/", "data:", "blob:")
            assert [address[:80] for address in tab.asked if not address.startswith(own)] == []


async def refused(tab, folder, capsys):
    """The command line's own words, and a file that is too large."""
    (folder / "open.obj").write_text(OPEN)
    assert main(["check", str(folder / "open.obj")]) == 2
    line = capsys.readouterr().err.removeprefix("iga-nn: ").replace(f"{folder}/", "").strip()
    await tab.until("document.querySelector('#file') !== null", PATIENCE)
    await tab.choose("#file", folder / "open.obj")
    await tab.sees("Refused", PATIENCE)
    assert line.startswith("open.obj: open surface") and line in (await tab.text()).splitlines()
    (folder / "large.obj").write_bytes(b"#" * ((1 << 20) + 1))
    await tab.choose("#file", folder / "large.obj")
    await tab.sees("large.obj: larger than 1 MB", PATIENCE)


async def dropped_and_started(tab, folder):
    content = write_ball(folder / "ball.obj").read_text()
    await tab.value(DROP % content)
    await tab.sees("200 vertices, 396 faces", PATIENCE)
    assert "Accepted" in await tab.text()
    await tab.click("Start")


async def seen_by_another_tab(tab):
    """It shows the running job at first; its own surface has to wait."""
    await tab.sees("my ball.obj\nrunning", PATIENCE)
    await tab.sees("Stop")
    await tab.click("cube")
    await tab.sees("cube.obj\naccepted", PATIENCE)
    await tab.click("Start")
    await tab.sees("waiting, 1 job ahead; one job runs at a time", PATIENCE)
    await tab.click("Remove")
    await tab.sees("cube.obj\naccepted")


async def trained(tab, folder):
    """Loss and time left, and the six faces' colours on the surface."""
    await tab.sees("Time left", PATIENCE)
    assert re.search(r"Loss\n\d\.\d\de[+-]\d\d\n", await tab.text())
    await tab.sees("each colour is one face of the cube", PATIENCE)
    await shows_faces(tab, folder / "training.png")


async def finished(tab, folder):
    await tab.until(f"{REPORT}?.includes('iga-nn run poisson')", PATIENCE)  # near its end
    text = await tab.value(REPORT)
    assert "my ball.obj: Poisson's equation" in text and "iga-nn run poisson 'my ball.obj'" in text
    (folder / "volume.npz").write_bytes(base64.b64decode(await tab.value(FETCHED)))
    assert load_volume(folder / "volume.npz").shape == (6, 6, 6)
    await shows_faces(tab, folder / "done.png")


async def another_problem(tab):
    """A face clicked in the report's picture is chosen in the form; the problem is solved on the same volume."""
    await tab.value(CLICKED)
    await tab.until("document.querySelectorAll('form [type=checkbox]:checked').length === 1")
    chosen = (await tab.value("document.querySelector('form [type=checkbox]:checked').name")).removeprefix("face ")
    assert f"Face {chosen}: " in await tab.value(REPORT)
    await tab.value("document.querySelector('form [name=kappa]').value = '1+X*X'")
    await tab.click("Solve")
    await tab.until(f"{REPORT}?.includes('iga-nn solve poisson')", PATIENCE)
    assert f"--kappa '1+X*X' --neumann {chosen}\n" in await tab.value(REPORT)


async def shows_faces(tab, path, seconds=30.0):
    """Wait until three of the cube's faces are drawn in their colours."""
    end = asyncio.get_running_loop().time() + seconds
    seen = 0
    while seen < 3:
        assert asyncio.get_running_loop().time() < end, f"the faces are not drawn: {path}"
        image = await tab.picture(path)
        seen = sum(pixels_of(image, color) > 500 for color in FACE_COLORS)


async def stopped(tab):
    await tab.click("Start")
    await tab.sees("Time left", PATIENCE)
    await tab.click("Stop")
    await tab.sees("Resume continues where it was stopped", PATIENCE)


def test_other_sites_and_other_computers_are_not_answered(page):
    assert ask(page, "GET", "/index.html")[0] == 200
    assert ask(page, "GET", "/index.html", Host="example.org")[0] == 403
    assert ask(page, "POST", "/upload?name=a.obj", "x", Origin="http://example.org")[0] == 403
    assert ask(page, "GET", "/ws", Origin="http://example.org", Upgrade="websocket")[0] == 403
    with pytest.raises(ConnectionRefusedError):  # would be answered by a server on 0.0.0.0
        socket.create_connection(("127.0.0.2", page), timeout=5)


@pytest.mark.parametrize(("path", "headers"), [("/ws", {}), ("/upload?name=a.obj", {"Content-Length": "-5"})])
def test_what_is_no_request_is_answered_with_400(path, headers, page):
    assert ask(page, "POST" if headers else "GET", path, **headers)[0] == 400


def test_only_results_are_given_out(page):
    number = ask(page, "POST", "/upload?name=../../x.obj", OPEN)[1]
    for path in (f"{number}/x.obj", f"{number}/..%2Fx.obj", f"{number}/volume.npz", "0/report.json", "x/report.json"):
        assert ask(page, "GET", f"/files/{path}")[0] == 404


def test_a_page_without_its_packages_says_what_to_install(tmp_path):
    code = (
        "import sys; sys.modules['trame'] = None\n"
        "from iga_nn.cli.commands import main\nsys.exit(main(['app', '--port', '0']))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr == "iga-nn: the live page needs trame, which is not installed: pip install 'iga-nn[app]'\n"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--port", "70000"], "port 70000"),
        (["--max-upload", "0"], "max upload 0"),
        (["--host", "0.0.0.0"], "--host"),
        (["--control-points", "2"], "control points 2"),
        (["--resume"], "resume"),
    ],
)
def test_bad_options_are_refused_in_one_line(arguments, says, capsys):
    assert main(["app", *arguments]) == 2
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1


def test_a_taken_port_is_named(page):
    environment = os.environ | {"PYTHONPATH": str(Path(iga_nn.__file__).parents[1])}
    command = [sys.executable, "-m", "iga_nn", "app", "--port", str(page)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and str(page) in done.stderr and done.stderr.count("\n") == 1
