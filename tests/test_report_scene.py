"""The page's script in a real browser: colours, sections, gestures, narrow windows, and a browser without WebGL."""

from __future__ import annotations

import asyncio
import base64
import json

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.image import imread

import iga_nn
import solve
from iga_nn.batch.surfaces import Entry
from iga_nn.batch.table import Batch, Row
from iga_nn.batch.table import page as batch_page
from iga_nn.cli.commands import main
from iga_nn.figures import fields, palette
from iga_nn.figures.solution import draw_error
from iga_nn.options import Units
from iga_nn.report import document
from iga_nn.report.html import filled
from iga_nn.report.viewer import Frame, scene_of, scene_of_frames
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


def given(control, value, event):
    """A value in one of the controls, by its id."""
    heard = f"one.value = {json.dumps(value)}; one.dispatchEvent(new Event('{event}'))"
    return f"(one => {{ {heard}; }})(document.getElementById('{control}'))"


def moved(slider, value):
    return given(slider, value, "input")


def typed(control, value):
    return given(control, value, "change")


def clicked(across, down):
    """A click into the view, at shares of its width and height."""
    return f"""(view => {{
      const box = view.getBoundingClientRect(), where = {{pointerId: 1, clientX: box.x + {across} * box.width,
        clientY: box.y + {down} * box.height}};
      view.dispatchEvent(new MouseEvent('click', where));
    }})(document.getElementById('view'))"""


READ = """Object.fromEntries([...document.querySelectorAll('#picked .reading')].map(
  one => [one.firstChild.data.split(' = ')[0], one.querySelector('.number')?.textContent ?? '']))"""


def written(tmp_path, scene):
    """A page of the view alone."""
    (tmp_path / "view.html").write_text(
        filled("report/scene.html", title="view", scene=scene, still=""), encoding="utf-8"
    )
    return tmp_path / "view.html"


def numbers(text):
    return np.array([float(part) for part in text.split(",")])


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
    assert [field["name"] for field in scene["fields"]] == ["solution", "distortion"]
    assert scene["fields"][0]["high"] > 0.04 and scene["fields"][0]["low"] == pytest.approx(0.0, abs=1e-9)
    assert scene["opening"] == {"field": "solution", "part": "cut"}  # zero on the boundary
    drawn = "solution.png" not in json.loads((solved / "report.json").read_text()).get("not_drawn", {})
    assert drawn == (solved / "solution.png").exists() == ("The solution on the boundary and inside" in text)


def test_a_field_has_one_range_in_figure_and_view(monkeypatch):
    monkeypatch.setattr("iga_nn.figures.style.draw", lambda _, views, *__: [np.zeros((2, 2, 3), np.uint8)] * len(views))
    volume, problem = benchmark_volume(2), solve.Poisson(exact="exp(x)*sin(4*y)*z")
    solution = solve.solve_problem(volume, problem, refine=1)
    low, high = draw_error(None, volume, solution, problem).axes[-1].get_ylim()
    scene = scene_of(volume, solution, problem)
    (shown,) = [field for field in scene["fields"] if field["name"] == "error"]
    assert (shown["low"], shown["high"]) == pytest.approx((low, high)) and shown["logarithmic"]
    values = scene["frames"][0]["values"]["error"]["lattice"]
    packed = np.frombuffer(base64.b64decode(values), "<u2").reshape((fields.LATTICE,) * 3)
    x, y, z = volume([(0.25, 0.5, 0.75)])[0]
    value = abs(np.exp(x) * np.sin(4 * y) * z - solution([(0.25, 0.5, 0.75)])[0])
    share = np.clip(np.log(value / low) / np.log(high / low), 0.0, 1.0)
    assert packed[10, 20, 30] / 65535 == pytest.approx(share, abs=1e-3)


def test_view_shows_fields_in_the_colours_of_the_bar_and_one_section_at_a_time(in_browser, solved):
    async def work(browser):
        tab, seen = await opened(browser, solved / "report.html"), {}
        for name, script in {
            "faces": choice("faces"),
            "cut": choice("solution"),
            "surface": choice("surface"),
            "u": choice("u"),
            "moved": moved("at", 0.1),
        }.items():
            await tab.value(script)
            seen[name] = await tab.value(PARTS)
        return seen, await tab.value("document.getElementById('where').textContent"), tab.complaints

    seen, where, complaints = in_browser(work)
    assert complaints == [] and where == "u = 0.100"
    table = np.rint(255 * colormaps[palette.MAP](np.arange(256))[:, :3])

    def share_of(counted, colors):
        """Share of the pixels that have one of these colours, up to rounding."""
        names = {name: np.array(name.split(","), dtype=float) for name in counted}
        near = {name for name, color in names.items() if np.abs(colors - color).max(axis=1).min() <= 1}
        return sum(counted[name] for name in near) / sum(counted.values())

    assert share_of(seen["surface"]["colors"], table[:2]) > 0.97  # zero all over
    for part in ("cut", "u", "moved"):
        assert share_of(seen[part]["colors"], table) > (0.97 if part == "cut" else 0.9)  # the rest are outlines
        assert share_of(seen[part]["colors"], table[64:]) > 0.02  # not zero inside
    assert share_of(seen["faces"]["colors"], table) < 0.2
    inside = {part: sum(seen[part]["colors"].values()) for part in ("u", "moved")}
    assert seen["u"]["colors"] != seen["moved"]["colors"] and min(inside.values()) > 1000


@pytest.mark.slow
def test_mouse_wheel_and_fingers_turn_move_and_enlarge(in_browser, solved):
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

    seen, hint, scrolled = in_browser(work)
    width = {name: box[2] - box[0] for name, box in seen.items()}
    assert hint and scrolled == 0 and np.array_equal(seen["first"], seen["scrolled"])
    assert width["smaller"] / width["first"] == pytest.approx(np.exp(-0.3), rel=0.02)
    assert seen["right"] - seen["smaller"] == pytest.approx(np.array([80, 0, 80, 0]), abs=2)
    assert seen["shift"] == pytest.approx(seen["smaller"], abs=2)
    assert width["pinched"] / width["shift"] == pytest.approx(1.5, rel=0.03)
    assert abs(width["turned"] - width["pinched"]) > 5


@pytest.mark.parametrize("width", [390, pytest.param(1400, marks=pytest.mark.slow)])
def test_pages_fit_the_window(in_browser, solved, tmp_path, width):
    report = document.read(solved)
    rows = [Row(Entry("a_part.npz", "a_part.npz", solved), "certified", "", report)]
    rows += [Row(Entry("long_name_" * 9, "x", tmp_path / "x"), "refused", "3 edges belong to one face: " + "w" * 90)]
    (tmp_path / "batch.html").write_text(batch_page(Batch(solved, tuple(rows))), encoding="utf-8")

    async def work(browser):
        found = []
        for file in (solved / "report.html", tmp_path / "batch.html"):
            tab = await opened(browser, file, width)
            await tab.value("document.querySelector('input[value=x]')?.click()")
            found.append(await tab.value("document.documentElement.scrollWidth <= innerWidth"))
            cut = "[...document.querySelectorAll('figure, .wide:has(#surfaces)')]"
            cut += ".filter(e => e.scrollWidth > e.clientWidth).length"
            found.append(await tab.value(cut))
        return found

    assert in_browser(work) == [True, 0, True, 0]


def test_without_webgl_the_page_says_so_and_shows_a_picture(in_browser, solved):
    async def work(browser):
        tab = await opened(browser, solved / "report.html", before=WITHOUT_WEBGL)
        shown = "(e => e !== null && e.offsetParent !== null)(document.querySelector('%s'))"
        places = [await tab.value(shown % place) for place in ("p.needs", "#view", ".tools", ".how")]
        still = "(e => !e.hidden && e.naturalWidth > 0 && e.src === document.querySelector('figure img').src)"
        still += "(document.getElementById('still'))"
        pictures = await tab.value("document.querySelectorAll('figure img').length")
        return places, pictures == 0 or await tab.value(still), tab.complaints

    places, still, complaints = in_browser(work)
    assert places == [True, False, False, False] and still and complaints == []


def test_a_page_around_the_view_chooses_light_or_dark(in_browser, solved):
    async def work(browser):
        tab, found = await opened(browser, solved / "report.html"), []
        for theme in ("dark", "light", "dark"):
            heard = "new Promise(done => addEventListener('message', done, {once: true}))"
            await tab.value(f"(heard => (postMessage({{theme: '{theme}'}}, '*'), heard))({heard})")
            found.append(await tab.value("getComputedStyle(document.body).backgroundColor"))
        return found

    assert in_browser(work) == ["rgb(20, 25, 31)", "rgb(255, 255, 255)", "rgb(20, 25, 31)"]


def test_a_click_reads_the_field_the_error_and_the_place(in_browser, tmp_path):
    """u = x y + z^2 on a twisted cube: on the boundary, on a section of the cube, and on a plane of space."""
    volume, problem = benchmark_volume(2), solve.Poisson(exact="x*y+z*z")
    file = written(tmp_path, scene_of(volume, solve.solve_problem(volume, problem), problem))

    async def work(browser):
        tab, seen = await opened(browser, file), {}
        key = "new KeyboardEvent('keydown', {key: 'Enter'})"
        nothing = await tab.value(f"{clicked(0.01, 0.01)}, document.getElementById('picked').textContent")
        for part, view, at in (("surface", "iso", 0.5), ("cut", "iso", 0.5), ("v", "+y", 0.5), ("x", "+x", 0.3)):
            await tab.value(", ".join([choice(part), typed("views", view), moved("at", at), clicked(0.5, 0.5)]))
            seen[part] = await tab.value(READ)
            by_key = await tab.value(f"document.getElementById('view').dispatchEvent({key}), {READ}")
            assert numbers(by_key["x, y, z"]) == pytest.approx(numbers(seen[part]["x, y, z"]), abs=5e-3)
        return nothing, seen, await tab.value("document.getElementById('where').textContent"), tab.complaints

    nothing, seen, where, complaints = in_browser(work)
    assert complaints == [] and nothing == "Click the body to read the values there."
    for part, read in seen.items():
        (x, y, z), uvw = numbers(read["x, y, z"]), numbers(read["u, v, w"])
        assert float(read["u"]) == pytest.approx(x * y + z * z, abs=2e-3)
        assert volume([uvw])[0] == pytest.approx([x, y, z], abs=3e-3)
        assert float(read["|u − uₕ|"].removeprefix("≤")) < 0.05
        on_boundary = any(name.startswith("Face ") for name in read)
        assert not on_boundary or np.abs(uvw - 0.5).max() == 0.5
        assert on_boundary if part == "surface" else part == "cut" or not on_boundary
    assert numbers(seen["v"]["u, v, w"])[1] == 0.5
    assert numbers(seen["x"]["x, y, z"])[0] == pytest.approx(float(where.split(" = ")[1]), abs=1e-3)


def test_a_tap_reads_values_on_a_phone(in_browser, tmp_path):
    volume = benchmark_volume(1)
    file = written(tmp_path, scene_of(volume, solve.solve_problem(volume, solve.Poisson(exact="2+x"))))

    async def work(browser):
        tab = await opened(browser, file, 390)
        await tab.call("Emulation.setTouchEmulationEnabled", enabled=True)
        x, y = await tab.value(
            "(b => [b.x + b.width / 2, b.y + b.height / 2])(document.getElementById('view').getBoundingClientRect())"
        )
        await tab.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
        await tab.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        await tab.until("document.querySelectorAll('.reading').length > 3")
        return await tab.value(READ), await tab.value("document.documentElement.scrollWidth")

    read, width = in_browser(work)
    assert float(read["u"]) == pytest.approx(2 + numbers(read["x, y, z"])[0], abs=1e-3) and width == 390


@pytest.mark.slow
def test_a_page_around_the_view_hears_which_face_is_clicked_and_where(in_browser, tmp_path):
    volume = benchmark_volume(1)
    written(tmp_path, scene_of(volume))
    outer = "<script>addEventListener('message', one => { if (one.data.face) window.heard = one.data; })</script>"
    outer += '<iframe src="view.html" style="width: 900px; height: 800px; border: 0"></iframe>'
    (tmp_path / "outer.html").write_text(outer, encoding="utf-8")

    async def work(browser):
        tab = await browser.open((tmp_path / "outer.html").as_uri())
        await tab.until("document.readyState == 'complete' && document.querySelector('iframe') !== null")
        for kind in ("mousePressed", "mouseReleased"):
            await tab.call("Input.dispatchMouseEvent", type=kind, x=450, y=400, button="left", clickCount=1)
        return await tab.until("window.heard")

    heard = in_browser(work)
    places = np.stack(np.meshgrid(*3 * [np.linspace(0.0, 1.0, 81)], indexing="ij"), axis=-1)
    on_face = np.take(places, -int(heard["face"][1]), axis="uvw".index(heard["face"][0])).reshape(-1, 3)
    assert np.linalg.norm(volume(on_face) - heard["point"], axis=1).min() < 0.02  # beside a chord of the picture


def test_a_plane_of_space_cuts_the_body_in_its_colours(in_browser, tmp_path):
    """u = x has one colour on a plane across x."""
    volume = benchmark_volume(2)
    file = written(tmp_path, scene_of(volume, solve.solve_problem(volume, solve.Poisson(exact="x"))))

    async def work(browser):
        tab = await opened(browser, file)
        await tab.value(choice("x") + ", " + moved("at", 0.5))
        return (await tab.value(PARTS))["colors"]

    seen = in_browser(work)
    middle = np.rint(255 * np.array(colormaps[palette.MAP](128))[:3])
    near = {name: np.abs(np.array(name.split(","), dtype=float) - middle).max() < 6 for name in seen}
    assert sum(count for name, count in seen.items() if near[name]) > 0.9 * sum(seen.values()) > 1000


@pytest.mark.slow
def test_element_lines_are_those_of_the_solutions_mesh(in_browser, tmp_path):
    """A cube of 3 x 3 x 3 elements as seen along x: two dark lines cross a row, at a third and at two thirds."""
    volume = benchmark_volume(3, amplitude=0.0)
    scene = scene_of(volume, solve.solve_problem(volume, solve.Poisson(exact="x")))
    assert scene["spans"] == [[pytest.approx([0, 1 / 3, 2 / 3, 1])] * 3]
    finer = scene_of(volume, solve.solve_problem(volume, solve.Poisson(exact="x"), refine=1))
    assert [len(row) for row in finer["spans"][0]] == [7, 7, 7]
    row = """(() => {
      const gl = document.getElementById("view").getContext("webgl2"), w = gl.drawingBufferWidth;
      const data = new Uint8Array(4 * w);
      gl.readPixels(0, Math.round(0.42 * gl.drawingBufferHeight), w, 1, gl.RGBA, gl.UNSIGNED_BYTE, data);
      return [...data];
    })()"""

    async def work(browser):
        tab = await opened(browser, written(tmp_path, scene))
        await tab.value(typed("views", "+x") + ", document.getElementById('lined').click()")
        return await tab.value(row)

    found = np.array(in_browser(work), dtype=float).reshape(-1, 4)
    body = np.flatnonzero(found[:, 3] == 255)
    light = found[body, :3].sum(axis=1)
    dark = (np.flatnonzero(light < 0.85 * np.median(light)) + 0.5) / len(body)
    inner = dark[(dark > 0.05) & (dark < 0.95)]
    assert len(inner) >= 2 and np.abs(inner[:, None] - [1 / 3, 2 / 3]).min(axis=1).max() < 0.01


def test_a_range_colours_what_lies_outside_by_its_ends(in_browser, solved):
    """u lies between 0 and 0.06."""
    table = np.rint(255 * colormaps[palette.MAP](np.arange(256))[:, :3])

    async def work(browser):
        tab, seen = await opened(browser, solved / "report.html"), {}
        await tab.value(choice("u"))
        first = await tab.value("document.getElementById('high').valueAsNumber")
        for name, script in {
            "above": typed("low", "-2") + ", " + typed("high", "-1"),
            "below": typed("high", "9") + ", " + typed("low", "8"),
            "whole": "document.getElementById('whole').click()",
        }.items():
            await tab.value(script)
            seen[name] = (await tab.value(PARTS))["colors"]
        await tab.value(typed("low", "5"))
        refused = await tab.value("document.getElementById('refused').textContent")
        seen["refused"] = (await tab.value(PARTS))["colors"]
        await tab.value("document.getElementById('decades').click()")
        low = await tab.value("document.getElementById('low').valueAsNumber")
        ticks = await tab.value("[...document.querySelectorAll('.tick')].map(one => Number(one.textContent))")
        return seen, refused, first, low, ticks

    seen, refused, first, low, ticks = in_browser(work)
    for name, end in (("above", 255), ("below", 0)):
        ends = ",".join(str(int(part)) for part in table[end])
        assert seen[name].get(ends, 0) > 0.9 * sum(seen[name].values())
    assert len(seen["whole"]) > 100 and seen["whole"] == seen["refused"]
    assert refused == "The lower end of the range must be below the upper one."
    assert 0.04 < first < 0.06 and low == pytest.approx(1e-4 * first, rel=1e-3)
    assert ticks == pytest.approx([1e-5, 1e-4, 1e-3, 1e-2])


@pytest.fixture(scope="module")
def pulled():
    """A bar along x, 4 long, held at x = 0 and stretched by 1 %, sideways free: u_x = x / 100, stress 1."""
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 4)] * 3, indexing="ij"), axis=-1)
    bar = iga_nn.BSplineVolume.uniform(grid * [4, 1, 1])
    return bar, solve.solve_problem(bar, solve.Elasticity(exact=("x/100", "0", "0"), young=100.0, poisson_ratio=0.0))


def test_a_body_opens_deformed_and_its_displacements_are_enlarged(in_browser, pulled, tmp_path):
    """At most 0.04 of a diagonal of sqrt(18): 0.08 sqrt(18) / 0.04 is 8.49, rounded 8."""
    scene = scene_of(*pulled)
    assert scene["warp"] == 8.0 and scene["opening"]["field"] == "von Mises"

    async def work(browser):
        tab, widths = await opened(browser, written(tmp_path, scene)), {}
        await tab.value(typed("views", "+z"))
        words = await tab.value("document.getElementById('warped').textContent")
        for factor in (8, 0, 16):
            await tab.value(moved("warp", factor))
            box = (await tab.value(PARTS))["box"]
            widths[factor] = box[2] - box[0]
        await tab.value(clicked(0.5, 0.5))
        return words, widths, await tab.value(READ), tab.complaints

    words, widths, read, complaints = in_browser(work)
    assert complaints == [] and words == "displacements × 8"
    assert widths[8] / widths[0] == pytest.approx(1.08, abs=0.01)
    assert widths[16] / widths[0] == pytest.approx(1.16, abs=0.01)
    x = numbers(read["x, y, z"])[0]
    assert float(read["u_x"]) == float(read["|u|"]) == pytest.approx(x / 100, abs=2e-5)
    assert "everywhere" in read["von Mises stress"] and read["von Mises stress"].startswith("1 ")


def test_frames_of_steps_in_time_and_of_modes_are_played(in_browser, pulled, tmp_path):
    bar, solution = pulled
    heat = [solve.solve_problem(bar, solve.Poisson(exact=f"{k}+x*0")) for k in (1, 2, 3)]
    stress = {"stress": lambda u, grad, x: 100 * grad[0, 0]}
    steps = scene_of_frames(bar, [Frame.of(f"t = {k} s", one) for k, one in enumerate(heat)])
    modes = scene_of_frames(bar, [Frame.of("mode 1", solution.field, stress)], oscillates=True)
    assert (steps["fields"][0]["low"], steps["fields"][0]["high"]) == pytest.approx((1.0, 3.0))
    assert [field["name"] for field in modes["fields"]] == ["stress", "|u|", "u_x", "u_y", "u_z", "distortion"]
    with pytest.raises(ValueError, match="same fields"):
        scene_of_frames(bar, [Frame.of("", heat[0]), Frame.of("", solution)])

    async def work(browser):
        tab, seen = await opened(browser, written(tmp_path, steps)), {}
        await tab.value(clicked(0.5, 0.5))
        for k in range(3):
            await tab.value(moved("frame", k))
            seen[await tab.value("document.getElementById('moment').textContent")] = (await tab.value(READ))["u"]
        await tab.click("Play")
        await tab.until("document.getElementById('moment').textContent === 't = 1 s'")
        await tab.click("Pause")
        tab = await opened(browser, written(tmp_path, modes))
        await tab.click("Play")
        await tab.value("new Promise(done => setTimeout(done, 700))")
        swinging = (await tab.value(PARTS))["box"]
        await tab.click("Pause")
        return seen, swinging, (await tab.value(PARTS))["box"], tab.complaints

    seen, swinging, at_rest, complaints = in_browser(work)
    assert complaints == [] and seen == {"t = 0 s": "1", "t = 1 s": "2", "t = 2 s": "3"}
    assert swinging != at_rest


def test_the_saved_picture_has_the_view_and_its_bar(in_browser, pulled, tmp_path):
    async def work(browser):
        tab = await opened(browser, written(tmp_path, scene_of(*pulled)))
        await tab.value(choice("u_x"))
        await tab.value("HTMLAnchorElement.prototype.click = function () { window.saved = this; }")
        await tab.click("Save PNG")
        return await tab.value("[saved.download, saved.href]"), await tab.value(
            "document.getElementById('view').clientHeight"
        )

    (name, address), height = in_browser(work)
    (tmp_path / name).write_bytes(base64.b64decode(address.removeprefix("data:image/png;base64,")))
    image = np.rint(255 * imread(tmp_path / name)[..., :3])
    table = np.rint(255 * colormaps[palette.MAP](np.arange(256))[:, :3])
    row = image[height + 29]  # through the bar
    assert np.abs(row[60] - table[:20]).max(axis=1).min() <= 2 and np.abs(row[-60] - table[-20:]).max(axis=1).min() <= 2
    assert np.all(image[2, 2] == 255)


def test_controls_are_named(in_browser, pulled, tmp_path):
    """Every control has words that a screen reader says."""
    named = "one => one.labels?.[0]?.innerText.trim() || one.getAttribute('aria-label') || one.innerText.trim()"

    async def work(browser):
        tab = await opened(browser, written(tmp_path, scene_of(*pulled)))
        return await tab.value(f"[...document.querySelectorAll('#scene :is(input, button, select)')].map({named})")

    found = in_browser(work)
    assert all(found) and len(found) > 20


def test_the_titles_of_bars_have_the_units_that_are_given():
    body = solve.Elasticity(fix="u0", load={"u1": (0, 0, 1)})
    scene = scene_of(
        solve.benchmark_volume(1), solve.solve_problem(solve.benchmark_volume(1), body), units=Units("mm", "MPa")
    )
    assert [field["title"] for field in scene["fields"]][:2] == ["von Mises stress [MPa]", "|u| [mm]"]


@pytest.fixture(scope="module")
def rod():
    """Three cubes along x, and u = x on them."""
    cubes = [iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: (a + u, v, w), 4) for a in range(3)]
    body = iga_nn.Body.from_patches(cubes)
    return body, solve.solve_problem(body, solve.Poisson(exact="x"))


def test_a_body_of_several_patches_is_one_view(in_browser, rod, tmp_path):
    """Glued faces are not drawn; sections of space go through all patches, and values are read on each."""
    scene = scene_of(*rod)
    assert [tuple(place) for place in scene["outer"]].count((1, 0)) == 0 and len(scene["outer"]) == 14
    assert scene["axes"] == [] and [label for _, label in scene["legend"]] == ["p0", "p1", "p2"]
    seen = {}

    async def work(browser):
        tab = await opened(browser, written(tmp_path, scene))
        await tab.value(typed("views", "+z"))
        for share in (0.2, 0.5, 0.8):
            await tab.value(clicked(share, 0.5))
            seen[share] = await tab.value(READ)
        await tab.value(typed("views", "+x"))
        await tab.value(choice("x"))
        for share in (0.25, 0.75):
            await tab.value(moved("at", share))
            await tab.value(clicked(0.5, 0.5))
            seen[f"x {share}"] = await tab.value(READ)
        await tab.value(choice("faces"))
        await tab.value(choice("surface"))
        swatches = await tab.value("[...document.querySelectorAll('.swatch')].map((one) => one.innerText.trim())")
        return swatches, (await tab.value(PARTS))["box"], tab.complaints

    swatches, box, complaints = in_browser(work)
    assert complaints == [] and swatches == ["p0", "p1", "p2"] and box[2] > box[0]
    for share, patch in ((0.2, "p0"), (0.5, "p1"), (0.8, "p2"), ("x 0.25", "p0"), ("x 0.75", "p2")):
        x = numbers(seen[share]["x, y, z"])[0]
        assert seen[share]["patch"] == patch and float(seen[share]["u"]) == pytest.approx(x, abs=1e-3)
    assert numbers(seen["x 0.25"]["x, y, z"])[0] == pytest.approx(0.75, abs=1e-3)
    assert "Face p2_w1" in seen[0.8]


def test_a_body_cut_open_shows_what_lies_behind(in_browser, rod, tmp_path):
    """With the octants in front left out, the middle of the picture is a section: it has no face."""
    scene = scene_of(*rod)
    assert scene["cut"]["planes"] and all(
        1 <= row[-1] <= 15 for row in (*scene["cut"]["planes"], *scene["cut"]["faces"])
    )

    async def work(browser):
        tab = await opened(browser, written(tmp_path, scene))
        whole = (await tab.value(PARTS))["colors"]
        await tab.value(choice("cut"))
        return whole, (await tab.value(PARTS))["colors"], tab.complaints

    whole, cut, complaints = in_browser(work)
    assert complaints == [] and 0.3 * sum(whole.values()) < sum(cut.values()) < sum(whole.values())


@pytest.mark.slow
def test_modes_of_a_body_are_frames(rod):
    body, _ = rod
    held = solve.Elasticity(fix="p0_u0", load={"p2_u1": (0, 0, 1)})
    bent = solve.solve_problem(body, held)
    frames = scene_of_frames(body, [Frame.of("mode 1", bent), Frame.of("mode 2", bent)], oscillates=True)
    assert [frame["label"] for frame in frames["frames"]] == ["mode 1", "mode 2"] and frames["warp"] > 0.0
    assert frames["meshes"] == [0, 0, 0] and len(frames["spans"]) == 1
