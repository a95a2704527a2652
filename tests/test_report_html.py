from __future__ import annotations

import base64
import json
import re
from functools import cache

import numpy as np
import pytest
from browser import browse
from matplotlib.colors import rgb_to_hsv, to_rgb

import iga_nn
import solve
from iga_nn.cli.commands import main
from iga_nn.figures.colors import FACE_COLORS
from iga_nn.report import html as page
from iga_nn.report import viewer as scene
from solve.study import benchmark_volume

VERDICT = "det J &gt; 0: certified; one-to-one: yes"


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """report.json and report.html of a small solve, and their folder."""
    folder = tmp_path_factory.mktemp("page")
    benchmark_volume(3).save(folder / "map <b>.npz")
    arguments = ["--refine", "0", "1", "--exact", "x*y*z", "--quiet", "--out", str(folder / "out")]
    assert main(["solve", "poisson", str(folder / "map <b>.npz"), *arguments]) == 0
    return folder / "out"


def drawn(image: np.ndarray) -> np.ndarray:
    """Hue, saturation and value (k, 3) of the strongly coloured pixels, the page's own faint tints left out."""
    pixels = rgb_to_hsv(image.reshape(-1, 3))
    return pixels[(pixels[:, 1] > 0.35) & (pixels[:, 2] > 0.2)]


def test_extremes_stand_beside_each_other_with_their_place(result):
    text = (result / "report.html").read_text()
    assert "<tr><td>u at most</td><td>1</td><td>1</td><td>at (1, 1, 1)</td></tr>" in text.replace("\n", "")
    found = json.loads((result / "report.json").read_text())["poisson"]["levels"][1]["extremes"]
    assert found["u"]["largest"] == pytest.approx(1.0) and found["u"]["largest_at"] == pytest.approx([1.0] * 3)


def test_units_stand_behind_lengths_and_stresses(in_folder, capsys):
    benchmark_volume(2).save("map.npz")
    load = ["--traction", "u1=0;0;-1", "v0=0", "v1=0", "w0=0", "w1=0", "--refine", "0", "1", "--quiet"]
    for units in ([], ["--unit", "mm", "--stress-unit", "N/mm<2>"]):
        assert main(["solve", "elasticity", "map.npz", *load, *units, "--out", "out", "--force"]) == 0
        told, text = capsys.readouterr(), (in_folder / "out" / "report.html").read_text()
        section = json.loads((in_folder / "out" / "report.json").read_text())["elasticity"]
        shown = "N/mm&lt;2&gt;" in text and '<th scope="col">h [mm]</th>' in text
        assert shown == bool(units) == (section.get("unit") == "mm") == (" N/mm<2> at (" in told.out)
        assert (" mm at (" in told.out) == bool(units) and told.err.count("N/mm<2>") == bool(units)
    command = json.loads((in_folder / "out" / "report.json").read_text())["command"]
    assert "--unit mm" in command and "--stress-unit 'N/mm<2>'" in command


@pytest.fixture(scope="module")
def seen(chromium, result, tmp_path_factory):
    """A function that opens the page in a new browser, coloured by what the address chooses, once for each width."""

    @cache
    def opened(what, width):
        return browse(chromium, tmp_path_factory.mktemp(what), f"{(result / 'report.html').as_uri()}#{what}", width)

    return opened


@pytest.mark.parametrize("width", [1280, 400])
def test_browser_draws_the_scene_and_fetches_nothing(seen, width):
    image, console, asked = seen("faces", width)
    assert console == "" and asked == []
    hues = drawn(image)[:, 0]
    wanted = rgb_to_hsv(np.array([to_rgb(color) for color in FACE_COLORS]))[:, 0]
    seen = [np.count_nonzero(np.abs(hues - hue) < 0.02) for hue in wanted]
    assert sum(count > 1000 for count in seen) >= 3  # three faces of a twisted cube


def test_address_chooses_what_is_coloured(seen):
    faces, (error, console, _) = seen("faces", 400)[0], seen("error", 400)
    assert console == "" and len(drawn(error)) > 5000
    assert np.mean(np.abs(faces - error).max(axis=-1) > 0.1) > 0.05


def test_browser_log_would_show_an_address_and_an_error(chromium, tmp_path):
    (tmp_path / "page.html").write_text('<img src="http://127.0.0.1:9/x.png"><script>unknown()</script>')
    _, console, asked = browse(chromium, tmp_path, (tmp_path / "page.html").as_uri(), 500)
    assert "unknown" in console and "http://127.0.0.1:9/x.png" in asked


def test_page_says_the_verdict_the_numbers_and_the_command(result):
    report = json.loads((result / "report.json").read_text())
    text = (result / "report.html").read_text(encoding="utf-8")
    finest = report["poisson"]["levels"][-1]
    for norm, relative in (("l2", "Relative L2"), ("h1_seminorm", "Relative H1")):
        assert re.search(rf"{relative} error</dt><dd>[\d.e-]+</dd><small>absolute {finest[norm]:.3e}</small>", text)
    for expected in (VERDICT, f"{finest['l2']:.3e}", f"{report['poisson']['rates']['l2'][0]:.2f}", "x*y*z"):
        assert expected in text
    assert text.index(VERDICT) < text.index("Convergence") < text.index("--exact")
    assert "map &lt;b&gt;" in text and "<b>" not in text
    assert re.search(r"""(?:src|href)=["'](?!data:)|url\(|@import""", text) is None


def test_verdicts_of_what_went_wrong(result):
    report = json.loads((result / "report.json").read_text())
    picture = scene.scene_of(benchmark_volume(1))
    report["parameterization"] |= {"bijective": "folded", "witness": [0.25, 0.5, 1.0]}
    report["poisson"]["levels"][0]["converged"] = False
    text = page.page(report, picture, result)
    assert "The map folds" in text and "0.25, 0.5, 1" in text and "did not converge" in text


@pytest.mark.parametrize(
    ("origin", "words"),
    [
        ("network", "the network"),
        ("growth", "a growing cube"),
        ("blocks", "blocks along the skeleton"),
        ("extension", "the surface&#39;s layout on a cube"),  # the names of earlier versions
        ("columns", "blocks"),
        ("magic", "magic"),
    ],
)
def test_page_says_where_the_map_comes_from(result, origin, words):
    report = json.loads((result / "report.json").read_text())
    report["parameterization"]["origin"] = origin
    assert f"<dt>The map comes from</dt><dd>{words}</dd>" in page.page(report, None, result)


def test_a_boundary_that_meets_itself_comes_first(result):
    report = json.loads((result / "report.json").read_text())
    meeting = {"parameters": [[0, 0, 0], [1, 1, 1]], "point": [0.125, 2.0, 3.0]}
    report["parameterization"] |= {"bijective": "certified", "boundary_injective": False, "boundary_meeting": meeting}
    text = page.page(report, scene.scene_of(benchmark_volume(1)), result)
    assert "one-to-one: no" in text and "boundary meet at x, y, z = 0.125, 2, 3." in text
    report["parameterization"] |= {"boundary_injective": True, "boundary_meeting": None}
    assert "the map is one-to-one" in page.page(report, scene.scene_of(benchmark_volume(1)), result)


def test_scene_holds_places_and_values(result):
    volume = benchmark_volume(2)
    problem = solve.Poisson(exact="x+2*y")
    drawing = scene.scene_of(volume, solve.solve_problem(volume, problem), problem)
    n, k = drawing["samples"]["faces"], drawing["samples"]["lattice"]
    faces = np.frombuffer(base64.b64decode(drawing["places"]["faces"]), "<u2").reshape(6, n, n, 3) / 65535
    inside = np.frombuffer(base64.b64decode(drawing["places"]["lattice"]), "<u2").reshape(k, k, k, 3) / 65535
    low, high = np.array(drawing["low"]), np.array(drawing["high"])
    middle, last = (n - 1) // 2, n - 1
    places = {(1, 0, 1): faces[1, 0, last], (0.5, 1, 0): faces[4, middle, last], (0, 0.5, 0.25): inside[0, 20, 10]}
    for at, place in places.items():
        assert np.abs(low + place * (high - low) - volume([at])).max() < 1e-4
    assert [field["name"] for field in drawing["fields"]] == ["solution", "error", "distortion"]
    values = drawing["frames"][0]["values"]["solution"]["faces"]
    values = np.frombuffer(base64.b64decode(values), "<u2").reshape(6, n, n)
    x, y, _ = volume([(1, 0, 1)])[0]
    low_u, high_u = drawing["fields"][0]["low"], drawing["fields"][0]["high"]
    assert values[1, 0, last] / 65535 == pytest.approx((x + 2 * y - low_u) / (high_u - low_u), abs=1e-4)


def test_scene_of_a_body_has_stress_and_displacements():
    volume = benchmark_volume(1)
    body = solve.Elasticity(body_force=("0", "0", "-1"))
    solution = solve.solve_problem(volume, body)
    drawing = scene.scene_of(volume, solution, body)
    titles = ["von Mises stress", "|u|", "u_x", "u_y", "u_z", "tanh(√ARAP / 2), at volume 1"]
    assert [field["title"] for field in drawing["fields"]] == titles
    n, vectors = drawing["samples"]["lattice"], drawing["frames"][0]["vectors"]
    packed = np.frombuffer(base64.b64decode(vectors["lattice"]), "<u2").reshape(n, n, n, 3)
    found = (packed[20, 10, 30] / 65535 * 2 - 1) * drawing["bound"]
    assert found == pytest.approx(solution([[0.5, 0.25, 0.75]])[0], abs=2e-5 * drawing["bound"])


def test_the_view_opens_where_the_solution_is_seen():
    volume = benchmark_volume(2)
    cooled = solve.Poisson(source="1", boundary="0", neumann={"u1": "1"})  # zero on five faces
    parts = [scene.scene_of(volume, solve.solve_problem(volume, one))["opening"] for one in (cooled, solve.Poisson())]
    assert parts == [{"field": "solution", "part": "cut"}, {"field": "solution", "part": "surface"}]
    assert scene.scene_of(volume)["opening"] == {"field": "faces", "part": "surface"}


def test_a_solution_of_a_law_of_ones_own_displaces_nothing():
    class Flow(solve.Form):
        components = 3

        def flux(self, u, grad, x):
            return grad

    volume = benchmark_volume(1)
    flow = solve.solve_problem(volume, solve.Problem(Flow(), exact=("x", "y", "z")))
    drawing = scene.scene_of(volume, flow)
    assert drawing["warp"] == 0.0 and [field["name"] for field in drawing["fields"]][:2] == ["|u|", "u_x"]


def test_the_solution_stands_first(result):
    text = (result / "report.html").read_text(encoding="utf-8")
    assert text.index(VERDICT) < text.index("<h2>The solution</h2>") < text.index("The problem")
    if "The solution on the boundary and inside" in text:
        assert text.index("<figure>") > text.index("<h2>The solution on the boundary and inside</h2>")
        assert text.index("<figure>") < text.index("<h2>Errors over the mesh size</h2>")


@pytest.fixture(scope="module")
def loaded(tmp_path_factory):
    """The folder of a solve of a clamped beam, with regions, an ask and units."""
    folder = tmp_path_factory.mktemp("loaded")
    iga_nn.BSplineVolume.from_function(lambda u, v, w: (4.0 * u, v, w), (5, 4, 4)).save(folder / "beam.npz")
    given = ["--fix", "nx < -0.9", "--load", "nx > 0.9=0;0;-1", "--unit", "mm", "--stress-unit", "MPa", "--refine", "0"]
    arguments = [*given, "--ask", "uz at (4, 0.5, 0.5)", "--quiet", "--out", str(folder / "out")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("iga_nn.figures.render.can_draw", lambda: False)
        assert main(["solve", "elasticity", str(folder / "beam.npz"), *arguments]) == 0
    return folder / "out"


def test_what_was_asked_stands_before_a_good_verdict(loaded):
    text = (loaded / "report.html").read_text()
    assert 0 < text.index("What was asked") < text.index(VERDICT) < text.index("In short")


LAYERS = """(() => {
  const shot = () => document.getElementById("view").toDataURL(), found = [shot()];
  for (const name of ["lined", "edges", "blocks", "regions", "singular"]) {
    document.getElementById(name).click();
    found.push(shot());
  }
  return new Set(found).size;
})()"""


@pytest.mark.parametrize("width", [1400, 400])
def test_layers_of_the_view_are_switched_and_named(in_browser, loaded, tmp_path, width):
    async def look(browser):
        tab = await browser.open((loaded / "report.html").as_uri())
        await tab.picture(tmp_path / "page.png", width=width)
        legend = await tab.value("document.getElementById('layers').innerText")
        assert "fix: nx < -0.9" in legend and "load: nx > 0.9 = 0;0;-1" in legend and "infinite at" in legend
        assert "99 % of the body away from singular places; largest" in await tab.value(
            "document.getElementById('legend').innerText"
        )
        assert await tab.value(LAYERS) == 6  # each layer changes the picture
        assert await tab.value("document.getElementById('layers').innerText") == ""
        assert await tab.value("document.documentElement.scrollWidth") <= width
        assert tab.complaints == []

    in_browser(look)


def test_one_page_is_printed_to_sign(in_browser, loaded):
    async def print_it(browser):
        tab = await browser.open((loaded / "report.html").as_uri())
        await tab.until("document.readyState === 'complete'")
        pdf = base64.b64decode((await tab.call("Page.printToPDF", preferCSSPageSize=True))["data"])
        assert len(re.findall(rb"/Type\s*/Page\b", pdf)) == 1
        await tab.call("Emulation.setEmulatedMedia", media="print")
        sheet = await tab.text()
        for words in ("SHA-256", "certified", "Supports and loads", "uz at (4, 0.5, 0.5)", "between", "Signature"):
            assert words in sheet
        assert "The command that repeats this" not in sheet

    in_browser(print_it)
