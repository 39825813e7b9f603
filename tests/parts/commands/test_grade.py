"""Grades in words."""

from dataclasses import replace

from mskgrasp.parts.commands.grade import coarse_note, grade_text


def test_only_coarse_parts_are_named_with_the_distance_of_their_hulls(builtin_parts):
    fine = builtin_parts["l_bracket_60x40"]
    coarse = replace(fine, name="spring", hull_error_p95=1.236e-3)
    assert grade_text(coarse) == "coarse, 95 % of the surface within 1.24 mm"
    assert coarse_note([fine]) is None
    text = coarse_note([fine, coarse])
    assert text is not None and text.startswith("coarse: spring (1.24 mm). At 0.7 mm")
    assert fine.name not in text and "part_filter.coarse" in text and "\n" not in text
