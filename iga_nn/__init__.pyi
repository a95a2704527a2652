from parameterize.certificate.certify import certify as certify
from parameterize.config import preset as preset
from parameterize.meshes.certify import certify_mesh as certify_mesh
from parameterize.meshes.mesh import VolumeMesh as VolumeMesh
from parameterize.run import Parameterization as Parameterization
from parameterize.run import parameterize as parameterize
from parameterize.spline.body import Body as Body
from parameterize.spline.interface import Interface as Interface
from parameterize.spline.volume import BSplineVolume as BSplineVolume
from parameterize.surface.surface import MeshError as MeshError
from parameterize.surface.surface import Surface as Surface
from parameterize.surface.surface import load_surface as load_surface
from solve import Adapted as Adapted
from solve import Ask as Ask
from solve import Elasticity as Elasticity
from solve import Form as Form
from solve import Grading as Grading
from solve import March as March
from solve import Material as Material
from solve import Modes as Modes
from solve import Poisson as Poisson
from solve import Problem as Problem
from solve import Region as Region
from solve import SplineField as SplineField
from solve import System as System
from solve import adaptive as adaptive
from solve import convergence as convergence
from solve import discretize as discretize
from solve import integrate as integrate
from solve import march as march
from solve import material as material
from solve import modes as modes
from solve import newton as newton
from solve import resultant as resultant
from solve import solve_problem
from solve.forms.conditions import *
from solve.forms.hyperelasticity import MooneyRivlin as MooneyRivlin
from solve.forms.hyperelasticity import NeoHookean as NeoHookean
from solve.forms.hyperelasticity import Yeoh as Yeoh
from solve.forms.plasticity import Plasticity as Plasticity

from .batch.run_batch import run_batch as run_batch
from .errors import InputError as InputError
from .errors import TimeLimitError as TimeLimitError
from .io.export import export as export
from .io.formats import load_volume as load_volume
from .io.meshes import load_mesh as load_mesh
from .io.solutions import load_solution as load_solution
from .options import ElasticityOptions as ElasticityOptions
from .options import FiniteOptions as FiniteOptions
from .options import MapOptions as MapOptions
from .options import PlasticOptions as PlasticOptions
from .options import PoissonOptions as PoissonOptions
from .options import WorkerOptions as WorkerOptions
from .samples import sample as sample
from .version import __version__ as __version__
from .workflow.pipeline import run as run

__all__: list[str]
solve = solve_problem
