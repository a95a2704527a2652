"""Lists the problems of the command line by their names."""

from .elasticity import ElasticityOptions
from .poisson import PoissonOptions
from .problem import ProblemOptions

PROBLEMS: dict[str, type[ProblemOptions]] = {kind.section: kind for kind in (PoissonOptions, ElasticityOptions)}
