"""``python -m hal.record``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Imports the program and runs it."""
    with ctrl_c_deferred():
        from hal.record.run import main as record
    return record()


if __name__ == "__main__":
    run("hal.record", main)
