"""Shows on every page of the gallery what its script leaves: a picture, and an interactive view of a volume.

The view is that of report.html. A script that is executed leaves volume.npz and solution.npz in examples/out/NAME; of
one that trains for long, the volume is kept in docs/kept.
"""

import base64
import shutil
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from iga_nn.io.formats import load_volume
from iga_nn.report.html import filled
from iga_nn.report.viewer import scene_of
from solve import BodyField

FRAME = """
.. raw:: html

   <iframe class="scene" src="../scenes/{name}.html#{shown}" title="Interactive view: {name}" loading="lazy"></iframe>
"""
PICTURE = """
.. image:: /../examples/pictures/{name}.png
   :alt: What {name}.py draws
"""


def add_result(app: Sphinx, document: str, source: list[str]) -> None:
    """Insert the view and the picture into a page of the gallery, before the code."""
    folder, _, name = document.partition("/")
    if folder != "gallery" or name not in pictures(app):
        return
    shown = write_view(app, name)
    view = FRAME.format(name=name, shown=shown) if shown else ""
    before, code, after = source[0].partition("\n.. code-block:: Python\n")
    source[0] = f"{before}\n{view}{PICTURE.format(name=name)}{code}{after}"


def pictures(app: Sphinx) -> dict[str, Path]:
    """Return the kept pictures by the name of their example."""
    return {file.stem: file for file in (Path(app.confdir).parent / "examples" / "pictures").glob("*.png")}


def add_thumbnails(app: Sphinx) -> None:
    """Put the kept pictures in place of the thumbnails, which examples that are not executed do not have."""
    for name, picture in pictures(app).items():
        thumbnail = Path(app.srcdir) / "gallery" / "images" / "thumb" / f"sphx_glr_{name}_thumb.png"
        if thumbnail.exists():
            shutil.copy(picture, thumbnail)


def write_view(app: Sphinx, name: str) -> str:
    """Write the interactive view of an example into the site; return what it shows first, "" without a volume."""
    docs = Path(app.confdir)
    left = docs.parent / "examples" / "out" / name
    files = [file for file in (left / "volume.npz", docs / "kept" / f"{name}.npz") if file.exists()]
    if not files:
        return ""
    solved = left / "solution.npz"
    body = load_volume(files[0])
    scene = scene_of(body, BodyField.load(solved) if solved.exists() else None, coarser=2)
    still = base64.b64encode(pictures(app)[name].read_bytes()).decode("ascii")
    target = Path(app.outdir) / "scenes" / f"{name}.html"
    target.parent.mkdir(parents=True, exist_ok=True)
    page = filled("report/scene.html", title=name.replace("_", " "), scene=scene, still=still)
    target.write_text(page, encoding="utf-8")
    return "solution" if solved.exists() else "faces"


def setup(app: Sphinx) -> dict[str, Any]:
    """Add the thumbnails once the gallery is there, and the results when its pages are read."""
    app.connect("builder-inited", add_thumbnails, priority=900)
    app.connect("source-read", add_result)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
