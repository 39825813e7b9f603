"""Pictures of parts."""

import numpy as np

from mskgrasp.parts.figures.picture import resting_classes


def test_equal_looking_poses_are_shown_once(builtin_parts):
    classes = resting_classes(builtin_parts["parallel_pin_20x100"])
    assert classes[0].count == 16
    assert np.isclose(sum(group.probability for group in classes), 1.0)
    assert [group.count for group in resting_classes(builtin_parts["washer_m36"])] == [2]
