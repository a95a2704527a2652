"""The live page, driven in Chromium as a user does it, and its server asked for what it must not give."""

from __future__ import annotations

import asyncio
import base64
import http.client
import json
import os
import re
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import Mock
from urllib.parse import quote

import numpy as np
import pytest
from matplotlib.colors import rgb_to_hsv, to_rgb
from mesh_files import CUBE, TRIANGLES, obj
from shapes import ball

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.figures.colors import FACE_COLORS
from iga_nn.io.formats import load_volume
from iga_nn.samples import write_obj
from parameterize.surface.surface import surface_from_arrays

QUICK = ("--steps-factor", "0.02", "--control-points", "6", "--refine", "0", "--solve-anyway")
OPEN = obj(CUBE, TRIANGLES[:-1])
PATIENCE = 200.0  # seconds; on an idle machine a job takes some 15


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Port of a running page."""
    with served(tmp_path_factory.mktemp("page")) as (port, _):
        yield port


@contextmanager
def served(folder):
    """Port and process of a page; uploads up to 1 MB. Its terminal stays silent, whatever it is asked."""
    pytest.importorskip("trame")
    environment = os.environ | {
        "PYTHONPATH": str(Path(iga_nn.__file__).parents[1]),
        "TRAME_DEFAULT_HOST": "0.0.0.0",
        "TRAME_ARGS": "--host 0.0.0.0",
        "TMPDIR": str(folder),
        "VTK_DEFAULT_OPENGL_WINDOW": "none",  # jobs draw no figures: the browser draws what is looked at here
    }
    command = [sys.executable, "-m", "iga_nn", "app", "--port", "0", "--max-upload", "1", *QUICK]
    terminal = folder / "stderr"
    with (
        terminal.open("w") as stderr,
        subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=stderr, text=True) as server,
    ):
        try:
            said = server.stdout.readline()
            yield int(re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\n", said)[1]), server
        finally:
            server.terminate()
            assert server.wait(timeout=30) == 0
            assert terminal.read_text() == ""


@pytest.fixture
def root(page, tmp_path_factory):
    """The folder of the running page's jobs."""
    return next(tmp_path_factory.getbasetemp().glob("page*/iga-nn-*"))


def ask(port, method, path, body=None, **headers):
    """Status and text of an answer; as a browser does, the page that posts is named."""
    if method == "POST":
        headers = {"Origin": f"http://127.0.0.1:{port}"} | headers
    headers = {name: value for name, value in headers.items() if value is not None}
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
TYPED = """(() => {
  const field = document.querySelector("form [name=%s]");
  field.value = "%s";
  field.dispatchEvent(new Event("input", {bubbles: true}));
})()"""
BY_FACES = """(() => {
  const report = document.querySelector("iframe").contentDocument;
  report.querySelector("input[name=field][value=faces]").click();
  report.getElementById("stage").scrollIntoView();
})()"""
RELOADED = "window.reloaded = false; location.reload()"
SHOWN = """[document.querySelector("h2").innerText,
  [...document.querySelectorAll("form .poisson .field input")].map((one) => one.value),
  [...document.querySelectorAll("form :checked[type=checkbox]")].map((one) => one.name)]"""
REPORT = "document.querySelector('iframe')?.contentDocument?.body?.innerText"


def test_from_a_dropped_file_to_the_downloaded_volume(in_browser, page, tmp_path, capsys):
    in_browser(lambda browser: walk(browser, page, tmp_path, capsys))


async def walk(browser, port, folder, capsys):
    first = await browser.open(f"http://127.0.0.1:{port}/")
    await refused(first, folder, capsys)
    await dropped_and_started(first, folder)
    second = await browser.open(f"http://127.0.0.1:{port}/")
    await seen_by_another_tab(second, folder)
    await trained(first, folder)
    await finished(first, folder)
    assert ask(port, "GET", "/files/3/report.json")[0] == 200
    assert ask(port, "GET", "/files/%D9%A3/report.json")[0] == 404  # an Arabic three
    await another_problem(first)
    await stopped(second)
    await kept(first)
    await deleted(first, second)
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
    """What is solved is stated before the run."""
    content = write_ball(folder / "ball.obj").read_text()
    await tab.value(DROP % content)
    await tab.sees("200 vertices, 396 faces", PATIENCE)
    assert "Accepted" in await tab.text()
    await tab.value(TYPED % ("reaction", "0"))
    await tab.click("Start")


async def on_paper(tab, path):
    """The picture of a surface that was shown before the tab was opened has the page's background."""
    x, y = await tab.value("(({x, y}) => [x, y])(document.querySelector('.drawing').getBoundingClientRect())")
    end = asyncio.get_running_loop().time() + 30.0
    while not np.all((await tab.picture(path))[round(y) + 9, round(x) + 9] == 1.0):
        assert asyncio.get_running_loop().time() < end, f"not on white: {path}"


async def seen_by_another_tab(tab, folder):
    """It shows the running job at first; its own surface has to wait."""
    await tab.sees("my ball.obj\nrunning", PATIENCE)
    await tab.until("document.querySelector('.drawing canvas') !== null", PATIENCE)
    await on_paper(tab, folder / "second.png")
    await tab.sees("Stop")
    await tab.click("bean")
    await tab.sees("bean.obj\naccepted", PATIENCE)
    await tab.click("Start")
    await tab.sees("waiting, 1 job ahead; one job runs at a time", PATIENCE)
    await tab.click("Remove")
    await tab.sees("bean.obj\naccepted")


async def trained(tab, folder):
    """Loss and time, and the six faces' colours on the surface."""
    await tab.sees("Time passed", PATIENCE)
    assert re.search(r"Loss\n\d\.\d\de[+-]\d\d\n", await tab.text())
    await tab.sees("each colour is one face of the cube", PATIENCE)
    await shows_faces(tab, folder / "training.png")


async def finished(tab, folder):
    await tab.until(f"{REPORT}?.includes('iga-nn run poisson')", PATIENCE)  # near its end
    text = await tab.value(REPORT)
    assert "my ball.obj: Poisson's equation" in text
    assert re.search("iga-nn run poisson 'my ball.obj'.* --reaction 0", text)
    (folder / "volume.npz").write_bytes(base64.b64decode(await tab.value(FETCHED)))
    assert load_volume(folder / "volume.npz").shape == (6, 6, 6)
    await tab.value(BY_FACES)
    await shows_faces(tab, folder / "done.png")
    await tab.value("window.scrollTo(0, 0)")


async def another_problem(tab):
    """A face clicked in the report's picture is chosen in the form; the problem is solved on the same volume."""
    await tab.value(CLICKED)
    await tab.until("document.querySelectorAll('form [type=checkbox]:checked').length === 1")
    chosen = (await tab.value("document.querySelector('form [type=checkbox]:checked').name")).removeprefix("face ")
    assert f"Face {chosen}: " in await tab.value(REPORT)
    await tab.value(TYPED % ("kappa", "1+X*X"))
    await tab.click("Solve")
    await tab.until(f"{REPORT}?.includes('iga-nn solve poisson')", PATIENCE)
    assert f"--kappa '1+X*X' --reaction 0 --neumann {chosen}\n" in await tab.value(REPORT)


async def kept(tab):
    """A reload keeps the job and what was typed, also into the form of a job that was left."""
    await tab.click("3 · my ball.obj\ndone")
    await tab.value(TYPED % ("source", "x*"))
    await tab.click("4 · bean.obj\nstopped")
    await tab.sees("Resume continues")
    await tab.click("3 · my ball.obj\ndone")
    await tab.value(RELOADED)
    await tab.until("window.reloaded === undefined && document.querySelector('form [name=source]')?.value === 'x*'")
    heading, values, chosen = await tab.value(SHOWN)
    assert heading == "3 · my ball.obj" and values == ["1+X*X", "", "0", "", "x*", ""] and len(chosen) == 1
    await tab.call("Emulation.setDeviceMetricsOverride", width=400, height=900, deviceScaleFactor=1, mobile=False)
    assert await tab.value("document.documentElement.scrollWidth") <= 400


async def deleted(tab, other):
    """A job is deleted where that is confirmed; the tab that showed it says so."""
    for one in (tab, other):
        await one.click("4 · bean.obj\nstopped")
        await one.sees("Resume continues")
    await tab.click("Delete")
    await tab.click("Keep it")
    await tab.click("Delete")
    assert "bean.obj" in await other.text()
    await tab.click("Yes, delete")
    await other.sees("Job 4, which this tab showed, was deleted.")
    for one in (tab, other):
        await one.until("!document.body.innerText.includes('bean.obj')")


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
    await tab.sees("Time passed", PATIENCE)
    await tab.click("Stop")
    await tab.sees("Resume continues where it was stopped", PATIENCE)


def test_what_is_read_stays_when_the_program_ends(in_browser, tmp_path):
    in_browser(lambda browser: read_on(browser, tmp_path))


async def read_on(browser, folder):
    """The page is neither drawn anew nor emptied: a frame in it would be loaded again, from nowhere."""
    with served(folder) as (port, server):
        tab = await browser.open(f"http://127.0.0.1:{port}/")
        await tab.click("cube")
        await tab.sees("1,538 vertices, 3,072 faces", PATIENCE)
        await tab.value("document.querySelector('h2').marked = 'the same'")
        server.terminate()
        await tab.sees("The page's program has ended")
    assert await tab.value("document.querySelector('h2').marked") == "the same"
    text = await tab.text()
    assert "1,538 vertices, 3,072 faces" in text and "Start\n" not in text and "Drop a surface" not in text


LISTS = "[...document.querySelectorAll('form .poisson textarea')].map((one) => one.value)"
PICKED = "document.querySelector('.picked')?.innerText"
BOX = [1.0, 2.0, 3.0]


@pytest.mark.slow
def test_a_click_on_the_part_names_its_face(in_browser, page, tmp_path):
    in_browser(lambda browser: pick(browser, page, tmp_path))


async def pick(browser, port, folder):
    """At a screen's and at a phone's width."""
    tab = await with_box(browser, port, folder / "box.obj")
    first = await clicked_face(tab, folder, 1280, (0.06, 0.06))
    assert await tab.value(LISTS) == [first, "", "", ""]
    await tab.value("document.querySelector('form [name=flux]').focus()")
    second = await clicked_face(tab, folder, 400, (-0.18, 0.04))
    assert second != first and await tab.value("document.documentElement.scrollWidth") <= 400
    assert await tab.value(LISTS) == [first, f"{second}=", "", ""]
    await drag(tab)
    assert (await tab.value(PICKED)).startswith(second)
    assert tab.complaints == []
    await tab.value(TYPED % ("kappa", "x*"))
    await tab.click("Start")
    await tab.until("document.querySelector('form [role=alert]').innerText.includes('kappa')")
    assert "Start\n" in await tab.text()  # it has not begun


async def with_box(browser, port, path):
    """A tab in which a box, written to a file of a name of its own, is accepted and drawn."""
    path.write_text(obj(CUBE * BOX, TRIANGLES))
    tab = await browser.open(f"http://127.0.0.1:{port}/")
    await tab.until("document.querySelector('#file') !== null", PATIENCE)
    await tab.choose("#file", path)
    await tab.until(f"document.querySelector('h2')?.innerText.endsWith('{path.name}')", PATIENCE)
    await tab.sees("8 vertices, 12 faces", PATIENCE)
    await tab.until("document.querySelector('.drawing canvas') !== null", PATIENCE)
    return tab


@pytest.mark.slow
def test_an_elastic_body_is_held_and_loaded_by_clicks(in_browser, page, tmp_path):
    in_browser(lambda browser: bend(browser, page, tmp_path))


@pytest.mark.slow
def test_a_clicked_face_is_given_a_moment_and_an_ask(in_browser, page, tmp_path):
    in_browser(lambda browser: give(browser, page, tmp_path))


GIVEN = """((value) => {
  const select = document.querySelector(".give select");
  select.dispatchEvent(new Event("focus"));
  select.value = value;
  select.dispatchEvent(new Event("change"));
  const lists = [...document.querySelectorAll("form textarea")].filter((one) => one.value);
  return lists.map((one) => one.name + ": " + one.value);
})('%s')"""


async def give(browser, port, folder):
    """What the click entered moves to the list that is chosen, and the form states the chosen problem alone."""
    tab = await with_box(browser, port, folder / "given.obj")
    await tab.value("document.querySelector('form [value=elasticity]').click()")
    turned = await clicked_face(tab, folder, 1280, (0.06, 0.06))
    assert await tab.value(GIVEN % "moment") == [f"moment: {turned}=0;0;0"]
    seen = await clicked_face(tab, folder, 1280, (-0.18, 0.04))
    lists = await tab.value(GIVEN % "ask von_mises max over")
    assert lists == [f"moment: {turned}=0;0;0", f"ask: von_mises max over {seen}"]
    stated = await tab.value("[...statedBy(document.querySelector('form'))].filter(([, value]) => value)")
    assert stated[0] == ["problem", "elasticity"] and len(stated) == 3
    await tab.picture(folder / "given 400.png", width=400)
    assert await tab.value("document.documentElement.scrollWidth") <= 400 and tab.complaints == []


LEVEL = """(async () => (await (await fetch(
  document.querySelector('a[download="report.json"]').href)).json()).elasticity.levels[0])()"""


async def bend(browser, port, folder):
    """The force on the face that is loaded is answered by the one that is held, also where it is solved again."""
    tab = await with_box(browser, port, folder / "body.obj")
    await tab.value("document.querySelector('form [value=elasticity]').click()")
    held = await clicked_face(tab, folder, 1280, (0.06, 0.06))
    await tab.value("document.querySelector('form [name=load]').focus()")
    pushed = await clicked_face(tab, folder, 400, (-0.18, 0.04))
    await tab.until(f"document.querySelector('form [name=load]').value === '{pushed}=0;0;0'")
    area = float((await tab.value(PICKED)).split("area ")[1].split(",")[0])
    await tab.until("document.activeElement.name === 'load'")
    await tab.call("Input.insertText", text="0;0;-2")
    assert await tab.value("document.querySelector('form [name=load]').value") == f"{pushed}=0;0;-2"
    assert await tab.value("document.documentElement.scrollWidth") <= 400
    await tab.picture(folder / "body 400.png", width=400)
    await tab.picture(folder / "body 1280.png", width=1280)
    assert await tab.value("document.documentElement.scrollWidth") <= 1280
    await tab.click("Start")
    await tab.until(f"{REPORT}?.includes('iga-nn run elasticity')", PATIENCE)
    assert "linear elasticity" in await tab.value(REPORT) and held in await tab.value(REPORT)
    first = await tab.value(LEVEL)
    # The small map bulges: its face is some 3 % larger than the part's.
    np.testing.assert_allclose(first["load"], [0.0, 0.0, -2.0 * area], rtol=5e-2, atol=1e-3)
    np.testing.assert_allclose(first["reactions"][f"fix '{held}'"], -np.array(first["load"]), atol=1e-6)
    await tab.value("document.querySelector('.problem').open = true")
    await tab.value(TYPED % ("young", "2"))
    await tab.click("Solve")
    await tab.until(f"{REPORT}?.includes('iga-nn solve elasticity')", PATIENCE)
    again = await tab.value(LEVEL)
    ratio = again["extremes"]["magnitude"]["largest"] / first["extremes"]["magnitude"]["largest"]
    assert ratio == pytest.approx(0.5)
    await tab.picture(folder / "bent.png", width=1280)
    assert tab.complaints == []


async def clicked_face(tab, folder, width, place):
    """The region that a click gives, at a place counted from the picture's middle in its heights; it is checked."""
    await tab.picture(folder / "before.png", width=width)
    before = await tab.value(PICKED)
    await tab.value("document.querySelector('.drawing').scrollIntoView({block: 'center'})")
    x, y = await on_drawing(tab, place)
    for kind in ("mousePressed", "mouseReleased"):
        await tab.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
    said = await tab.until(f"{PICKED} !== {json.dumps(before)} && {PICKED}")
    region, facts = said.split("\n")
    point = np.array([float(number) for number in region[5:-1].split(",")])
    (axis,) = np.flatnonzero((point == 0.0) | (point == BOX))
    assert facts == f"area {np.prod(np.delete(BOX, axis)):g}, 2 triangles"
    await asyncio.sleep(1.0)  # the colours come from the server
    image = await tab.picture(folder / f"picked {width}.png", width=width)
    x, y = await on_drawing(tab, place)
    red, green, blue = image[round(y), round(x)]
    assert red > 1.3 * green > 1.3 * blue, "the face is not coloured where it was clicked"
    return region


async def on_drawing(tab, place):
    """A place in the window, counted from the picture's middle in its heights."""
    x, y, width, height = await tab.value(
        "(({x, y, width, height}) => [x, y, width, height])(document.querySelector('.drawing').getBoundingClientRect())"
    )
    return x + 0.5 * width + place[0] * height, y + (0.5 + place[1]) * height


async def drag(tab):
    """Turning the part picks nothing."""
    start, end = await on_drawing(tab, (0.06, 0.06)), await on_drawing(tab, (0.16, 0.06))
    for kind, (x, y) in (("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end)):
        await tab.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)
    await asyncio.sleep(1.0)


SIGHT = [[0.5, 0.5, 9.0], [0.5, 0.5, 8.0]]


def test_a_face_is_named_only_for_a_line_of_sight_of_a_part(page):
    number = ask(page, "POST", "/sample/cube")[1]
    for _ in range(200):
        status, said = ask(page, "POST", f"/face/{number}", json.dumps(SIGHT))
        if status == 200:
            break
        time.sleep(0.1)
    assert set(json.loads(said)) == {"region", "triangles", "area"}
    assert ask(page, "POST", f"/face/{number}", json.dumps([SIGHT[1], SIGHT[0]])) == (200, "null")
    for body in ("", "[", "null", "[[1, 2, 3]]", "[[1, 2, 3], [4, 5, 1e999]]", '[[1, 2, 3], [4, 5, "x"]]', "[" * 9999):
        assert ask(page, "POST", f"/face/{number}", body) == (
            400,
            "a line of sight is two points of three numbers each",
        )
    assert ask(page, "POST", "/face/999", json.dumps(SIGHT))[0] == 404
    assert ask(page, "POST", f"/face/{number}", json.dumps(SIGHT), Origin="http://example.org")[0] == 403


def test_other_sites_and_other_computers_are_not_answered(page):
    assert ask(page, "GET", "/index.html")[0] == 200
    assert ask(page, "GET", "/index.html", Host="example.org")[0] == 403
    assert ask(page, "POST", "/upload?name=a.obj", "x", Origin="http://example.org")[0] == 403
    for origin in (None, "http://example.org", "null", "", f"https://127.0.0.1:{page}", f"127.0.0.1:{page}"):
        assert ask(page, "GET", "/ws", Origin=origin, Upgrade="websocket")[0] == 403
        assert ask(page, "POST", "/sample/cube", Origin=origin)[0] == 403
    with pytest.raises(ConnectionRefusedError):  # would be answered by a server on 0.0.0.0
        socket.create_connection(("127.0.0.2", page), timeout=5)


@pytest.mark.parametrize(
    ("path", "headers"), [("/ws", {"Origin": "own"}), ("/upload?name=a.obj", {"Content-Length": "-5"})]
)
def test_what_is_no_request_is_answered_with_400(path, headers, page):
    own = {"Origin": f"http://127.0.0.1:{page}"}
    assert ask(page, "GET" if path == "/ws" else "POST", path, **(headers | own))[0] == 400


def test_only_results_are_given_out(page):
    number = ask(page, "POST", "/upload?name=../../x.obj", OPEN)[1]
    for path in (f"{number}/x.obj", f"{number}/..%2Fx.obj", f"{number}/volume.npz", "0/report.json", "x/report.json"):
        assert ask(page, "GET", f"/files/{path}")[0] == 404


ARABIC, WIDE = str.maketrans("0123456789", "٠١٢٣٤٥٦٧٨٩"), str.maketrans("0123456789", "０１２３４５６７８９")


@pytest.mark.parametrize(
    "other", [lambda n: n.translate(ARABIC), lambda n: n.translate(WIDE), lambda n: f"0{n}", lambda n: f"+{n}",
              lambda n: n + "9" * 5000, lambda n: n + "\0", lambda n: "٣" * 200]
)  # fmt: skip
def test_a_job_has_one_address(other, page):
    path = quote(other("3"))
    assert ask(page, "GET", f"/files/{path}/report.json")[0] == 404
    assert ask(page, "POST", f"/solve/{path}", "")[0] in (404, 405)


@pytest.mark.parametrize(
    ("size", "body"),
    [
        (3, b"#" * ((1 << 20) + 1)),
        (2 << 20, b""),
        (500, b"#" * 400),
        ("٣", b"#"),
        ("9" * 5000, b"#"),
    ],
)
def test_an_upload_that_lies_about_its_size_leaves_no_file(size, body, page, root):
    status, number = ask(page, "POST", f"/upload?name=lie.obj&size={quote(str(size))}", body)
    assert status == 200
    left = root / number / "lie.obj"
    for _ in range(100):  # what is not refused at once is refused when it is checked
        if not left.exists():
            break
        time.sleep(0.1)
    assert not left.exists() and left.parent.is_dir()


def test_a_page_without_its_packages_says_what_to_install(monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "iga_nn.live.server", raising=False)
    monkeypatch.setitem(sys.modules, "trame.app", None)
    monkeypatch.setitem(sys.modules, "trame", None)
    assert main(["app", "--port", "0"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == "iga-nn: the live page needs trame, which is not installed: pip install 'iga-nn[app]'\n"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--port", "70000"], "port 70000"),
        (["elasticity", "--port", "-1"], "port -1"),
        (["elasticity", "--young", "-1"], "young must be"),
        (["elasticity", "--refine", "9"], "refine 9"),
        (["elasticity", "--load", "nz > 0.9"], "load 'nz > 0.9' has no data"),
        (["--max-upload", "0"], "max upload 0"),
        (["--host", "0.0.0.0"], "--host"),
        (["--control-points", "2"], "at least 4 control points, got 2"),
        (["--resume"], "Unknown option: --resume"),
        (["--corners", "corners.json"], "Unknown option: --corners"),
    ],
)
def test_bad_options_are_refused_in_one_line(arguments, says, capsys):
    assert main(["app", *arguments]) == 2
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1


@pytest.mark.parametrize("more", [(), ("--young", "210"), ("--roller", "nz < 0"), ("--load", "nz > 0=0;0;1")])
def test_a_page_of_a_body_starts_without_loads_and_supports(more, monkeypatch):
    server = pytest.importorskip("iga_nn.live.server")
    monkeypatch.setattr(server, "Page", Mock())
    assert main(["app", "elasticity", *more, "--port", "0"]) == 0
    server.Page.return_value.run.assert_called_once()


def test_help_offers_no_option_that_is_refused(capsys):
    assert main(["app", "--help"]) == 0
    said = capsys.readouterr().out
    assert "--steps-factor" in said and "--max-upload" in said
    assert "--resume" not in said and "--corners" not in said


def test_a_taken_port_is_named(capsys):
    pytest.importorskip("trame")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["app", "--port", port]) == 2
    said = capsys.readouterr().err
    assert port in said and said.count("\n") == 1
