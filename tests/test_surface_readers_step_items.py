"""What stands beside the solids in the text of a STEP file, without OpenCASCADE."""

from __future__ import annotations

import pytest
from step_files import Step, solid_and

from parameterize.surface.readers.cad import passed_over


@pytest.mark.parametrize(
    ("make", "found"),
    [
        (lambda step: step.point((5, 5, 5)), {"point": 1}),
        (lambda step: step.segment((5, 5, 5), (6, 6, 6)), {"curve": 1}),
        (Step.composite, {"curve": 1}),
        (lambda step: step.line((5, 5, 5), (6, 6, 6)), {"curve": 1}),
        (lambda step: step.add(f"PLANE('',{step.placement()})"), {"surface without an outline": 1}),
        (Step.loose, {"loose shell": 1}),
        (Step.placement, {}),
        (lambda step: step.box(low=(9, 0, 0)), {}),  # shapes that OpenCASCADE makes, which it counts
        (lambda step: step.surfaces(step.loose()), {}),
        (lambda step: step.set_of(step.point((1, 1, 9))), {}),
    ],
)
def test_items_are_counted_of_which_no_shape_is_made(make, found):
    assert dict(passed_over(solid_and(make))) == found


def test_an_item_of_two_representations_is_one_and_points_of_the_solid_are_none():
    step = Step()
    point = step.point((5, 5, 5))
    step.part(step.box(), point)
    step.part(point, kind="SHAPE_REPRESENTATION")
    step.representation([step.point((1, 1, 1))], "CONSTRUCTIVE_GEOMETRY_REPRESENTATION")
    assert dict(passed_over(step.data())) == {"point": 2}


def test_annotations_are_counted_once():
    step = Step()
    step.part(step.box())
    step.note()
    step.note()
    step.add("(ANNOTATION_OCCURRENCE() DRAUGHTING_ANNOTATION_OCCURRENCE() STYLED_ITEM('',(),#2))")
    step.add("TESSELLATED_ANNOTATION_OCCURRENCE('',(),#2)")
    step.add("ANNOTATION_PLANE('',(),#2,())")  # where annotations lie
    assert dict(passed_over(step.data())) == {"annotation": 4}
