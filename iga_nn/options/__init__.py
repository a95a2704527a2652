"""Holds the options of the pipeline and of the command line, and checks their values."""

from .analysis import ModesOptions as ModesOptions
from .analysis import StudyOptions as StudyOptions
from .elasticity import ElasticityOptions as ElasticityOptions
from .finite import FiniteOptions as FiniteOptions
from .mapping import MapOptions as MapOptions
from .mapping import SurfaceOptions as SurfaceOptions
from .plastic import PlasticOptions as PlasticOptions
from .poisson import PoissonOptions as PoissonOptions
from .problem import NO_UNITS as NO_UNITS
from .problem import UNITS as UNITS
from .problem import ProblemOptions as ProblemOptions
from .problem import Units as Units
from .problems import PROBLEMS as PROBLEMS
from .space_check import check_size as check_size
from .space_check import check_space as check_space
from .workers import WorkerOptions as WorkerOptions
