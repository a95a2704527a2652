"""Configures the site, which `make docs` builds. Nothing is fetched, neither here nor in the browser."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT), str(HERE / "_ext"), str(ROOT / "examples")]

from iga_nn import __version__  # noqa: E402 the path stands first

project = "iga-nn"
copyright = "iga-nn contributors"  # noqa: A001 Sphinx' own name
release = version = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "gallery_results",
    "short_types",
]
exclude_patterns = ["_build", "gallery/*.ipynb", "sg_execution_times.rst", "gallery/sg_execution_times.rst"]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = "iga-nn"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["theme.js"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_type_aliases = {name: name for name in ("Array", "ArrayLike", "Data", "IntArray", "Natural", "Robin", "Scalar")}
python_maximum_signature_line_length = 90
default_role = "code"  # single backticks in docstrings
autodoc_preserve_defaults = True
napoleon_google_docstring = True  # the options of the command line, whose parser wants that style
napoleon_use_ivar = True
napoleon_use_rtype = False

EXECUTED = (  # the others train for minutes: their pages show results that are kept
    "boundary_conditions", "bracket", "compare", "convection_diffusion", "elasticity", "heat", "large_strain",
    "l_shape", "nonlinear_conductivity", "own_law", "plate_with_hole", "pulled_ring", "rational_ring",
    "thermal_stress", "vibration",
)  # fmt: skip
TOOLS = ("common", "gallery")  # no examples of their own
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": rf"/({'|'.join(EXECUTED)})\.py$",
    "ignore_pattern": rf"^({'|'.join(TOOLS)})\.py$",
    "nested_sections": False,
    "image_scrapers": (),
    "reset_modules": (),
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,  # seconds differ between machines
    "write_computation_times": False,
}
suppress_warnings = ["config.cache"]  # the pattern of the gallery is a computed one
