"""Names the types of arrays in signatures, which autodoc spells out where annotations are not kept as text."""

import re
from typing import Any

from numpy.typing import ArrayLike
from sphinx.application import Sphinx
from sphinx.util.typing import stringify_annotation

from parameterize.arrays import Array, IntArray, Mask

NAMED = {"ArrayLike": ArrayLike, "Array": Array, "IntArray": IntArray, "Mask": Mask}
SPELLED = {stringify_annotation(kind, "smart"): name for name, kind in NAMED.items()}


def shorten(
    app: Sphinx, what: str, name: str, found: Any, options: Any, *signature: str | None
) -> tuple[str | None, ...]:
    """Return arguments and result of a signature with the names of the types."""
    return tuple(part and _short(part) for part in signature)


def _short(text: str) -> str:
    for spelled, name in SPELLED.items():
        text = text.replace(spelled, name)
    return re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text)  # of autodoc_type_aliases


def setup(app: Sphinx) -> dict[str, Any]:
    """Shorten signatures once autodoc has made them."""
    app.connect("autodoc-process-signature", shorten)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
