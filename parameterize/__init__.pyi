from .certificate.certify import Certificate as Certificate
from .certificate.certify import certify as certify
from .certificate.jacobian import PatchCertificate as PatchCertificate
from .config import Config as Config
from .config import preset as preset
from .cube.boundary_map import BoundaryMap as BoundaryMap
from .quality.quality import QualityReport as QualityReport
from .quality.quality import measure as measure
from .run import Parameterization as Parameterization
from .run import parameterize as parameterize
from .spline.body import Body as Body
from .spline.volume import BSplineVolume as BSplineVolume
from .surface.surface import MeshError as MeshError
from .surface.surface import Surface as Surface
from .surface.surface import load_surface as load_surface
from .surface.surface import surface_from_arrays as surface_from_arrays

__all__: list[str]
