"""Figures of a training."""

from mskgrasp.train.figures import draw_curves


def test_curves_of_a_run_without_variances_are_drawn(tmp_path):
    trivial = {"translation_rmse": 0.01, "rotation_rmse": 0.2}
    history = [
        {"stage": "gqn", "epoch": 1, "train_loss": 0.6, "validation_loss": 0.5, "auroc": 0.8},
        {"stage": "gdn", "epoch": 1, "train_loss": 4.0, "validation_loss": 3.0} | trivial,
    ]
    report = {
        "gqn": {"brier": 0.1, "brier_of_base_rate": 0.2},
        "gdn": trivial | {"zero_displacement": trivial, "training_mean": trivial},
    }
    draw_curves(history, report, tmp_path / "curves.png")
    assert (tmp_path / "curves.png").stat().st_size > 10_000
