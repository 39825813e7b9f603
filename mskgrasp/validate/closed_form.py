"""Experiments whose outcome follows from closed-form physics."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from mskgrasp.core.settings import Physics
from mskgrasp.validate.body_scene import BodyScene, Workshop
from mskgrasp.validate.check import Check
from mskgrasp.validate.hand_experiments import centring, holding_limit, mirroring, torsion, wedge
from mskgrasp.validate.table_experiments import free_fall, rolling, sliding, toppling

EXPERIMENTS = (holding_limit, torsion, wedge, free_fall, sliding, rolling, toppling, centring, mirroring)


def run_checks(physics: Physics, report: Callable[[Check], None]) -> list[Check]:
    """Run all checks under some settings, and call ``report`` with each when it is done."""
    with tempfile.TemporaryDirectory(prefix="mskgrasp-validate-") as scratch:
        workshop = Workshop(Path(scratch))
        scene = BodyScene(physics, workshop.block())
        done = []
        try:
            for experiment in EXPERIMENTS:
                for check in experiment(scene, workshop):
                    report(check)
                    done.append(check)
        finally:
            scene.close()
    return done
