"""What the files of the gate share: the error and the array types."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


class MeshError(ValueError):
    """A surface is refused. One line: the file, the defect, how many, where the first is, the remedy."""
