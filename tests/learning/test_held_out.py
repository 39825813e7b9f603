import torch

from mskgrasp.learning.grasp_models import load_models, save_model
from mskgrasp.learning.samples import read_samples
from mskgrasp.learning.trainer import train as learn
from tests import synthetic
from tests.learning.small import HAND


def test_our_network_learns_and_its_intervals_hold_what_they_say(tmp_path):
    dataset = synthetic.write_dataset(tmp_path, n_parts=8, n_attempts=250, seed=1)
    samples = read_samples(dataset, HAND.network)
    assert samples.patches.shape == (2000, 1, 33, 33) and samples.patches.dtype == torch.int16
    rows = torch.tensor([3, 5])
    seen = samples.quality_patches_of(rows, "cpu", HAND.network)
    assert torch.equal(seen, samples.patches_of(rows, "cpu")[..., ::2, 8:25:2])
    models, _ = learn(samples, HAND, checkpoint_path=tmp_path / "checkpoint")
    report, found = models.meta.metrics, models.meta.calibration
    assert report["gqn"]["auroc"] > 0.85
    assert report["gdn"]["translation_rmse"] < 0.6 * report["gdn"]["zero_displacement"]["translation_rmse"]
    # Scaled on these very rows, 90 % of them lie inside.
    assert report["gdn"]["n"] >= 50 and max(found.variance_scale) != 1.0
    assert all(0.87 <= share <= 0.93 for share in report["gdn"]["coverage_90"].values())
    assert found.quality_slope > 0 and min(found.variance_scale) > 0
    save_model(tmp_path / "model", models)
    assert load_models(tmp_path / "model").meta.calibration == found
