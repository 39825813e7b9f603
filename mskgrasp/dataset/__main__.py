"""``python -m mskgrasp.dataset``: check, describe and export datasets."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Import the program and run it."""
    with ctrl_c_deferred():
        from mskgrasp.dataset.commands.command_line import main as dataset
    return dataset()


if __name__ == "__main__":
    run("mskgrasp.dataset", main)
