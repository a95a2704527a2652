"""Finds the geometry files of other programs in the folder of models, where there is one."""

import os
from pathlib import Path


def patch_files(*names):
    """The named files, or all; none where the folder is absent."""
    folder = Path(os.environ.get("IGA_NN_DATA", Path(__file__).parents[3] / "shared" / "models"), "patches")
    found = sorted(folder.iterdir()) if folder.is_dir() else []
    return [path for path in found if not names or path.name in names]
