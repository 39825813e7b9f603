"""Train both networks on a dataset, and compare them with those that ship on parts held out of the training.

    python examples/train_and_compare.py data/demo models/mine [epochs]

The shipped networks may have been trained on the held-out parts: with the demo's parts they were.
"""

import sys
from pathlib import Path

from mskgrasp import load_models
from mskgrasp.core.config import read_config
from mskgrasp.learning.held_out import predict_grasp_displacement, prediction_errors, quality_metrics
from mskgrasp.learning.samples import read_samples
from mskgrasp.learning.trainer import split
from mskgrasp.train.config import DEFAULT_CONFIG, TrainConfig
from mskgrasp.train.run import run


def main(data: Path, out: Path, epochs: int) -> None:
    settings = {"data": data, "out": out, "epochs": epochs}
    config = read_config(TrainConfig, DEFAULT_CONFIG).model_copy(update=settings)
    run(config)

    for name, models in {"shipped": load_models(), "trained": load_models(out)}.items():
        samples = read_samples(data, models.meta.network)  # each network sees the depth image in its own way
        rows = split(samples, config).validation
        quality = quality_metrics(models, samples, rows)
        lifted = rows[samples.success[rows]]
        errors = prediction_errors(samples, lifted, *predict_grasp_displacement(models, samples, lifted))
        print(f"{name}  AUROC {quality.auroc:.3f}  RMSE {errors.translation_rmse * 1e3:.2f} mm")


if __name__ == "__main__":
    data, out, *epochs = sys.argv[1:]
    main(Path(data), Path(out), int(epochs[0]) if epochs else 2)
