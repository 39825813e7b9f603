"""Train both networks on a dataset, and compare them with those that ship on parts held out of the training.

    python examples/train_and_compare.py data/demo models/mine [epochs]

The shipped networks may have been trained on the held-out parts: with the demo's parts they were.
"""

import sys
from pathlib import Path

from mskgrasp import load_models
from mskgrasp.learning import measure_models, read_samples, split
from mskgrasp.train import default_config, run_training


def main(data: Path, out: Path, epochs: int) -> None:
    config = default_config(data=data, out=out, epochs=epochs)
    run_training(config)

    for name, models in {"shipped": load_models(), "trained": load_models(out)}.items():
        samples = read_samples(data, models.meta.network)  # each network sees the depth image in its own way
        sides = split(samples, config)
        found = measure_models(models, samples, sides.training, sides.validation)
        millimetres = found.gdn.errors.translation_rmse * 1e3
        print(f"{name}  AUROC {found.gqn.auroc:.3f}  RMSE {millimetres:.2f} mm")


if __name__ == "__main__":
    data, out, *epochs = sys.argv[1:]
    main(Path(data), Path(out), int(epochs[0]) if epochs else 2)
