from __future__ import annotations

import numpy as np
import pytest
import torch

from mskgrasp.core import metrics
from mskgrasp.learning.held_out import centroid_displacement
from mskgrasp.learning.samples import Samples, read_samples
from mskgrasp.learning.sides import split
from tests.benchmarks.conftest import Boxes
from tests.benchmarks.known_parts import HELD_OUT_EVERY, held_out_rows, lowess_predictions, recorded_grasps
from tests.benchmarks.paper_choices import paper_choices

OURS = paper_choices(1)[-1].config


@pytest.fixture
def samples(boxes: Boxes) -> Samples:
    return read_samples(boxes.data, OURS.network)


def test_one_in_four_attempts_of_some_training_parts_is_held_out(samples):
    training = split(samples, OURS).training
    rows = held_out_rows(samples, training, 3)
    parts = torch.unique(samples.part[rows])
    assert len(parts) == 3 and bool(torch.isin(rows, training).all())
    for part in parts:
        n = int((samples.part == part).sum())
        assert int((samples.part[rows] == part).sum()) == -(-n // HELD_OUT_EVERY)


def test_recorded_grasps_are_those_of_the_samples(boxes, samples):
    pose, moved = recorded_grasps(boxes.data, "box_2")
    rows = torch.nonzero(samples.success & (samples.part == 2))[:, 0]
    torch.testing.assert_close(torch.from_numpy(pose[:, :3]).float(), samples.origin_grasp[rows])
    torch.testing.assert_close(torch.from_numpy(moved).float(), samples.grasp_displacement[rows])


def test_lowess_of_the_same_part_is_closer_than_predicting_that_nothing_moves(boxes, samples):
    training = split(samples, OURS).training
    rows = held_out_rows(samples, training, 5)
    rest = training[~torch.isin(training, rows)]
    held = rows[samples.success[rows]]
    found = lowess_predictions(samples, rows, rest, None)
    true = samples.displacement[held].double().numpy()
    predicted, _ = centroid_displacement(samples, held, found.mean, found.variance)
    assert metrics.translation_rmse(predicted, true) < metrics.translation_rmse(0 * true, true)
    assert np.isfinite(found.variance).all()


def test_lowess_never_uses_the_grasps_that_it_is_measured_on(boxes, samples):
    training = split(samples, OURS).training
    rows = held_out_rows(samples, training, 5)
    rest = training[~torch.isin(training, rows)]
    # The further dataset is the same one, which holds the measured grasps, too.
    again = lowess_predictions(samples, rows, rest, boxes.data)
    np.testing.assert_allclose(again.mean, lowess_predictions(samples, rows, rest, None).mean, atol=1e-6)
    nothing = lowess_predictions(samples, rows, training, None)
    assert np.abs(nothing.mean - again.mean).max() > 1e-4
