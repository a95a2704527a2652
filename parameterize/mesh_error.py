"""MeshError: the one exception for a surface that cannot be used."""


class MeshError(ValueError):
    """A surface is refused. One line: the file, the defect, how many, where the first is, the remedy."""
