"""``python -m mskgrasp.collect``."""

from mskgrasp.runtime.cli import run
from mskgrasp.runtime.ctrl_c import ctrl_c_deferred


def main() -> int | None:
    """Import the program and run it."""
    with ctrl_c_deferred():
        from mskgrasp.collect.run import main as collect
    return collect()


if __name__ == "__main__":
    run("mskgrasp.collect", main)
