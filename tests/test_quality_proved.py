"""What report.json says of what is proved of a body."""

import pytest
from bodies import ring
from patches import cells, frame, plate_with_hole

from parameterize.quality.quality import euler_number
from parameterize.spline.body import Body

ELL = Body.from_patches(cells([(0, 0, 0), (1, 0, 0), (0, 1, 0)]))


@pytest.mark.parametrize(
    ("body", "number"), [(ELL, 2), (ring(3), 0), (ring(1), 0), (plate_with_hole(), 0), (frame(), -8)]
)
def test_the_euler_number_counts_holes(body, number):
    assert euler_number(body) == number
