"""What the files of the gate share: the error and the array types."""


class MeshError(ValueError):
    """A surface is refused. One line: the file, the defect, how many, where the first is, the remedy."""
