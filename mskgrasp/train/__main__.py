"""``python -m mskgrasp.train``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Import the program and run it."""
    with ctrl_c_deferred():
        from mskgrasp.train.run import main as train
    return train()


if __name__ == "__main__":
    run("mskgrasp.train", main)
