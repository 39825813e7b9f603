from __future__ import annotations

import json

import pytest

from mskgrasp.core.config import read_config
from mskgrasp.learning.config import LearningConfig
from tests.benchmarks import ablation
from tests.benchmarks.paper_choices import CONFIGS, OURS
from tests.programs import run_here


def test_every_choice_differs_from_ours_and_from_the_others():
    ours = read_config(LearningConfig, CONFIGS / "pretrained.yaml")
    found = list(ablation.variants(ours).values())
    assert found[0] == ours
    assert len({one.model_dump_json() for one in found}) == len(found)


@pytest.mark.slow
def test_the_command_compares_a_choice_with_ours(boxes, tmp_path):
    done = run_here(
        ablation.main, "--data", str(boxes.data), "--out", str(tmp_path), "--gqn-epochs", "1",
        "--gdn-epochs", "2", "--share", "0.5", "--only", "no swing",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    scores = json.loads((tmp_path / "report.json").read_text())["scores"]
    assert list(scores) == [OURS, "no swing"]
    ours, other = scores.values()
    # The quality network learns the same in both, the displacement network does not.
    assert ours["AUROC"] == other["AUROC"] and ours["NLL"] != other["NLL"]
