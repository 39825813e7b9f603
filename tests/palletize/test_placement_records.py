"""Records of placements."""

from __future__ import annotations

import json

import numpy as np

from mskgrasp.palletize.placement_records import Placement


def test_a_record_read_from_its_json_equals_the_original():
    one = Placement(
        part="a", number=3, slot=0, correction="truth", target=(0.5, 0.0, 1.0), placed=True, reason="",
        grasp=[0.5, 0.0, 0.02, np.pi / 8], translation_error=0.0015, rotation_error=0.01,
    )  # fmt: skip
    again = Placement.from_json(json.loads(json.dumps(one.to_json())))
    assert again == one and again.name == "a-003-00-truth"
