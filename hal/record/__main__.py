"""``python -m hal.record``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Import the program and run it."""
    with ctrl_c_deferred():
        from hal.record.run import main as record
    return record()


if __name__ == "__main__":
    run("hal.record", main)
