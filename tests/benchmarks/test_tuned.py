from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.grasp_models import load_models
from mskgrasp.learning.held_out import predict_grasp_displacement, prediction_errors
from mskgrasp.learning.samples import read_samples
from tests.benchmarks import tuned
from tests.programs import run_here


@pytest.mark.slow
def test_the_displacement_of_known_parts_is_learned_and_the_quality_is_left(boxes, tmp_path: Path):
    out = tmp_path / "tuned"
    words = ("--data", boxes.data, "--attempts", "40", "--epochs", "12", "--learning-rate", "0.001")
    done = run_here(tuned.main, *map(str, words), "--out", str(out))
    assert done.returncode == 0, done.stderr
    before, after = load_models(PRETRAINED), load_models(out)
    samples = read_samples(boxes.data, before.meta.network)
    last = torch.cat([torch.nonzero(samples.part == part)[40:, 0] for part in range(len(samples.parts))])
    held = last[samples.success[last]]
    errors = [
        prediction_errors(samples, held, *predict_grasp_displacement(one, samples, held)).translation_rmse
        for one in (before, after)
    ]
    assert errors[1] < 0.9 * errors[0]
    for a, b in zip(before.gqn.state_dict().values(), after.gqn.state_dict().values(), strict=True):
        assert torch.equal(a, b)
    training = after.meta.training
    assert training["training_parts"] == list(samples.parts) and not training["validation_parts"]
    assert not after.meta.metrics


def test_too_few_attempts_are_refused(boxes, tmp_path: Path):
    done = run_here(tuned.main, "--data", str(boxes.data), "--out", str(tmp_path / "tuned"))
    assert done.returncode == 2 and "48 attempts at a part, 400 are needed" in done.stderr
