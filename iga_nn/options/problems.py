"""Lists the problems of the command line by their names."""

from .elasticity import ElasticityOptions
from .finite import FiniteOptions
from .plastic import PlasticOptions
from .poisson import PoissonOptions
from .problem import ProblemOptions

KINDS = (PoissonOptions, ElasticityOptions, PlasticOptions, FiniteOptions)
PROBLEMS: dict[str, type[ProblemOptions]] = {kind.section: kind for kind in KINDS}
