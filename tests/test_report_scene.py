"""The page's script in a real browser: colours, sections, gestures, narrow windows, and a browser without WebGL."""

from __future__ import annotations

import asyncio
import base64
import json

import numpy as np
import pytest
from browser import running
from matplotlib import colormaps

import solve
from iga_nn.batch.surfaces import Entry
from iga_nn.batch.table import Batch, Row
from iga_nn.batch.table import page as batch_page
from iga_nn.cli.commands import main
from iga_nn.figures import evaluate, fields
from iga_nn.figures.solution import draw_error
from iga_nn.report import document
from iga_nn.report.viewer import scene_of
from solve.study import benchmark_volume

PARTS = """(() => {  // of the canvas, read back: the box of what is drawn, in pixels, and its colours
  const gl = document.getElementById("view").getContext("webgl2");
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const data = new Uint8Array(4 * w * h), box = [w, h, 0, 0], colors = {};
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, data);
  for (let i = 0; i < w * h; i++) {
    if (data[4 * i + 3] < 255) continue;
    const [x, y] = [i % w, h - 1 - Math.floor(i / w)], name = data.slice(4 * i, 4 * i + 3).join();
    box.splice(0, 4, Math.min(box[0], x), Math.min(box[1], y), Math.max(box[2], x), Math.max(box[3], y));
    colors[name] = (colors[name] || 0) + 1;
  }
  return {box, colors};
})()"""
WITHOUT_WEBGL = "HTMLCanvasElement.prototype.getContext = () => null"


def choice(value):
    return f"document.querySelector('input[value={value}]').click()"


def in_browser(chromium, folder, work):
    """What a coroutine of a running browser returns."""

    async def all_of_it():
        async with running(chromium, folder) as browser:
            return await work(browser)

    return asyncio.run(all_of_it())


async def opened(browser, file, width=1000, before=""):
    """A tab with a page in a window of that width, its view in sight; `before` is a script that runs first."""
    tab = await browser.open("about:blank")
    if before:
        await tab.call("Page.addScriptToEvaluateOnNewDocument", source=before)
    await tab.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
    await tab.call("Page.navigate", url=file.as_uri())
    await tab.until("document.readyState == 'complete' && document.querySelector('#scene-data, #surfaces') !== null")
    await tab.value("document.getElementById('scene')?.scrollIntoView()")
    return tab


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """The folder of -div grad u = 1 with u = 0 on the boundary of a twisted cube."""
    folder = tmp_path_factory.mktemp("solved")
    benchmark_volume(4).save(folder / "map.npz")
    command = ["solve", "poisson", str(folder / "map.npz"), "--source", "1", "--boundary", "0", "--refine", "0"]
    assert main([*command, "--quiet", "--out", str(folder / "out")]) == 0
    return folder / "out"


def test_a_solve_of_data_alone_has_its_picture_and_a_field_in_the_view(solved):
    text = (solved / "report.html").read_text(encoding="utf-8")
    scene = json.loads(text.split('id="scene-data">')[1].split("</script>")[0])
    assert [field["name"] for field in scene["fields"]] == ["distortion", "solution"]
    assert float(scene["fields"][1]["high"]) > 0.04 and float(scene["fields"][1]["low"]) == pytest.approx(0.0, abs=1e-9)
    drawn = "solution.png" not in json.loads((solved / "report.json").read_text()).get("not_drawn", {})
    assert drawn == (solved / "solution.png").exists() == ("The solution on the boundary and inside" in text)


def test_a_field_has_one_range_in_figure_and_view(monkeypatch):
    monkeypatch.setattr("iga_nn.figures.style.draw", lambda *_: np.zeros((2, 2, 3)))
    volume, problem = benchmark_volume(2), solve.Poisson(exact="exp(x)*sin(4*y)*z")
    solution = solve.solve_problem(volume, problem, refine=1)
    low, high = draw_error(None, volume, solution, problem).axes[-1].get_ylim()
    (shown,) = [field for field in scene_of(volume, solution, problem)["fields"] if field["name"] == "error"]
    assert (shown["low"], shown["high"]) == (f"≤ {low:.1e}", f"{high:.1e}")
    packed = np.frombuffer(base64.b64decode(shown["values"]["lattice"]), "<u2").reshape((fields.LATTICE,) * 3)
    x, y, z = volume([(0.25, 0.5, 0.75)])[0]
    value = abs(np.exp(x) * np.sin(4 * y) * z - solution([(0.25, 0.5, 0.75)])[0])
    share = np.clip(np.log(value / low) / np.log(high / low), 0.0, 1.0)
    assert packed[10, 20, 30] / 65535 == pytest.approx(share, abs=1e-3)


def test_view_shows_fields_in_the_colours_of_the_bar_and_one_section_at_a_time(chromium, solved, tmp_path):
    async def work(browser):
        tab, seen = await opened(browser, solved / "report.html"), {}
        for name, script in {
            "faces": "0",
            "cut": choice("solution"),
            "surface": choice("surface"),
            "u": choice("u"),
            "moved": "(at => { at.value = 0.1; at.dispatchEvent(new Event('input')); })(document.getElementById('at'))",
        }.items():
            await tab.value(script)
            seen[name] = await tab.value(PARTS)
        return seen, await tab.value("document.getElementById('where').textContent"), tab.complaints

    seen, where, complaints = in_browser(chromium, tmp_path, work)
    assert complaints == [] and where == "u = 0.100"
    table = np.rint(255 * colormaps[evaluate.MAP](np.arange(256))[:, :3])

    def share_of(counted, colors):
        """Share of the pixels that have one of these colours, up to rounding."""
        names = {name: np.array(name.split(","), dtype=float) for name in counted}
        near = {name for name, color in names.items() if np.abs(colors - color).max(axis=1).min() <= 1}
        return sum(counted[name] for name in near) / sum(counted.values())

    assert share_of(seen["surface"]["colors"], table[:2]) > 0.99  # zero all over
    for part in ("cut", "u", "moved"):
        assert share_of(seen[part]["colors"], table) > (0.97 if part == "cut" else 0.9)  # the rest are outlines
        assert share_of(seen[part]["colors"], table[64:]) > 0.02  # not zero inside
    assert share_of(seen["faces"]["colors"], table) < 0.2
    inside = {part: sum(seen[part]["colors"].values()) for part in ("u", "moved")}
    assert seen["u"]["colors"] != seen["moved"]["colors"] and min(inside.values()) > 1000


def test_mouse_wheel_and_fingers_turn_move_and_enlarge(chromium, solved, tmp_path):
    async def work(browser):
        tab = await opened(browser, solved / "report.html")
        x, y = await tab.value(
            "(b => [b.x + b.width / 2, b.y + b.height / 2])(document.getElementById('view').getBoundingClientRect())"
        )

        async def mouse(kind, dx=0, dy=0, **more):
            await tab.call("Input.dispatchMouseEvent", type=kind, x=x + dx, y=y + dy, **more)

        async def drag(dx, **how):
            await mouse("mousePressed", clickCount=1, **how)
            await mouse("mouseMoved", dx, **{"buttons": 2 if how["button"] == "right" else 1} | how)
            await mouse("mouseReleased", dx, **how)

        async def fingers(kind, *offsets):
            points = [{"x": x + dx, "y": y, "id": number} for number, dx in enumerate(offsets)]
            await tab.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

        async def size():
            await asyncio.sleep(0.2)
            return np.array((await tab.value(PARTS))["box"], dtype=float)

        seen = {"first": await size()}
        before = await tab.value("scrollY")
        await mouse("mouseWheel", deltaX=0, deltaY=60)
        await tab.until(f"scrollY > {before}")
        hint = await tab.value("document.getElementById('hint').classList.contains('shown')")
        await tab.value(f"scrollTo(0, {before})")
        seen["scrolled"], before = await size(), await tab.value("scrollY")
        await mouse("mouseWheel", deltaX=0, deltaY=300, modifiers=2)
        seen["smaller"], scrolled = await size(), await tab.value("scrollY") - before
        await drag(80, button="right")
        seen["right"] = await size()
        await drag(-80, button="left", modifiers=8)
        seen["shift"] = await size()
        await fingers("touchStart", -40, 40)
        await fingers("touchMove", -60, 60)
        await fingers("touchEnd")
        seen["pinched"] = await size()
        await drag(60, button="left")
        seen["turned"] = await size()
        return seen, hint, scrolled

    seen, hint, scrolled = in_browser(chromium, tmp_path, work)
    width = {name: box[2] - box[0] for name, box in seen.items()}
    assert hint and scrolled == 0 and np.array_equal(seen["first"], seen["scrolled"])
    assert width["smaller"] / width["first"] == pytest.approx(np.exp(-0.3), rel=0.02)
    assert seen["right"] - seen["smaller"] == pytest.approx(np.array([80, 0, 80, 0]), abs=2)
    assert seen["shift"] == pytest.approx(seen["smaller"], abs=2)
    assert width["pinched"] / width["shift"] == pytest.approx(1.5, rel=0.03)
    assert abs(width["turned"] - width["pinched"]) > 5


@pytest.mark.parametrize("width", [400, 1400])
def test_pages_fit_the_window(chromium, solved, tmp_path, width):
    report = document.read(solved)
    rows = [Row(Entry("a_part.npz", "a_part.npz", solved), "certified", "", report)]
    rows += [Row(Entry("long_name_" * 9, "x", tmp_path / "x"), "refused", "3 edges belong to one face: " + "w" * 90)]
    (tmp_path / "batch.html").write_text(batch_page(Batch(solved, tuple(rows))), encoding="utf-8")

    async def work(browser):
        found = []
        for file in (solved / "report.html", tmp_path / "batch.html"):
            tab = await opened(browser, file, width)
            found.append(await tab.value("document.documentElement.scrollWidth <= innerWidth"))
            cut = "[...document.querySelectorAll('figure, .wide:has(#surfaces)')]"
            cut += ".filter(e => e.scrollWidth > e.clientWidth).length"
            found.append(await tab.value(cut))
        return found

    assert in_browser(chromium, tmp_path, work) == [True, 0, True, 0]


def test_without_webgl_the_page_says_so_and_shows_a_picture(chromium, solved, tmp_path):
    async def work(browser):
        tab = await opened(browser, solved / "report.html", before=WITHOUT_WEBGL)
        shown = "(e => e !== null && e.offsetParent !== null)(document.querySelector('%s'))"
        places = [await tab.value(shown % place) for place in ("p.needs", "#view", ".tools", ".how")]
        still = "(e => !e.hidden && e.naturalWidth > 0 && e.src === document.querySelector('figure img').src)"
        still += "(document.getElementById('still'))"
        pictures = await tab.value("document.querySelectorAll('figure img').length")
        return places, pictures == 0 or await tab.value(still), tab.complaints

    places, still, complaints = in_browser(chromium, tmp_path, work)
    assert places == [True, False, False, False] and still and complaints == []


def test_a_page_around_the_view_chooses_light_or_dark(chromium, solved, tmp_path):
    async def work(browser):
        tab, found = await opened(browser, solved / "report.html"), []
        for theme in ("dark", "light", "dark"):
            heard = "new Promise(done => addEventListener('message', done, {once: true}))"
            await tab.value(f"(heard => (postMessage({{theme: '{theme}'}}, '*'), heard))({heard})")
            found.append(await tab.value("getComputedStyle(document.body).backgroundColor"))
        return found

    assert in_browser(chromium, tmp_path, work) == ["rgb(20, 25, 31)", "rgb(255, 255, 255)", "rgb(20, 25, 31)"]
