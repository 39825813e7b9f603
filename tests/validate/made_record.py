"""A made-up record of a validation, as it is stored."""

from __future__ import annotations

from typing import Any

from mskgrasp.validate.check import near
from mskgrasp.validate.fidelity import Fidelity


def difference(**changes: Any) -> dict[str, Any]:
    """One setting against another, with tests of equivalence."""
    values = dict(
        success_rate=0.42, agreement=0.98, shift_median=4e-5, shift_p90=1.2e-3, turn_median=0.001,
        turn_p90=0.1, bias=2e-6, cpu_ms=80.0, n=620, n_both=250, equivalent=True,
        equivalence={
            "displacement": dict(estimate=1e-5, low=-2e-5, high=5e-5),
            "success": dict(estimate=-0.002, low=-0.01, high=0.006),
        },
    )  # fmt: skip
    return values | changes


UNKNOWN = dict(
    success_rate=None, agreement=None, shift_median=None, shift_p90=None, turn_median=None, turn_p90=None,
    bias=None, equivalent=False, equivalence={"displacement": dict(estimate=None), "success": None},
)  # fmt: skip


def record(**changes: Any) -> dict[str, Any]:
    closed_form = [
        near("fall", "g t^2 / 2", "m", 0.2, 0.201, 0.025),
        near("way", "v^2 / (2 mu g)", "m", 0.03, 0.04, 0.05),
    ]
    fine = Fidelity(
        part="nut", hulls=3, surface_p95=2e-4, volume_ratio=1.01, mass_error=1e-6, inertia_error=1e-3
    )
    values = dict(
        closed_form=[check.to_json() for check in closed_form], parts=[fine.to_json()],
        settings={"margins": {"displacement": 2.5e-4, "success": 0.02}},
        production="1000 Hz, 50 it", yardstick="2000 Hz, 100 it",
        errors=[dict(difference(), setting="moved", reference="production", origin="chaos")],
        grid=[
            difference(setting="1000 Hz, 50 it"),
            difference(setting="250 Hz, 8 it", cpu_ms=30.0, equivalent=False),
            difference(setting="500 Hz, 8 it", **UNKNOWN),
        ],
        choice={"setting": "1000 Hz, 50 it", "shown": True, "production_fails": []},
        sensitivity=[
            difference(group="friction", label="0.3", parts=31),
            difference(group="friction", label="0.8", parts=31),
            difference(group="hulls", label="exact", parts=0, **UNKNOWN),
        ],
        size=dict(
            n=620, success_rate=0.42, shift_median=0.003, shift_p90=0.009, turn_median=0.05, turn_p90=0.3
        ),
        label_error=difference(ranges={"finger_force": [20.0, 40.0]}),
        impossible=dict(
            attempts=620, penetration=2e-4, fastest=0.4, displaced=0.04,
            dropped={"unsettled": 3, "penetrated": 0, "too_fast": 1},
        ),
    )  # fmt: skip
    return values | changes
