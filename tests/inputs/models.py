"""Folders of models."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from mskgrasp.learning.grasp_models import DESCRIPTION, WEIGHTS
from tests.inputs.row import Place, Row

NUT = ["--parts", "hex_nut_m30"]
OTHER_HAND = {
    "simulation": "7", "fidelity": "cpu", "physics": {}, "noise": {}, "hand": {"max_opening": 0.2},
    "camera_height": 0.8, "seed": 0,
}  # fmt: skip


def _of(program: str, name: str, change: Callable[[Place], str], says: str, code: int = 1) -> Row:
    """A row whose program gets the model that a function makes."""
    nut = {"assess": ["hex_nut_m30"]} | dict.fromkeys(("evaluate", "palletize", "benchmark"), NUT)
    return Row(program, name, lambda at: [*nut.get(program, []), "--models", change(at)], says, code)


def _described(text: str) -> Callable[[Place], str]:
    def change(at: Place) -> str:
        folder = at.model()
        Path(folder, DESCRIPTION).write_text(text)
        return folder

    return change


def _weights(content: bytes | None, cut: int | None = None) -> Callable[[Place], str]:
    def change(at: Place) -> str:
        folder = at.model()
        path = Path(folder, WEIGHTS)
        path.write_bytes(path.read_bytes()[:cut] if content is None else content)
        return folder

    return change


def _each(operation: Callable[[torch.Tensor], Any]) -> Callable[[Place], str]:
    def change(at: Place) -> str:
        def all_of(weights: dict[str, torch.Tensor]) -> None:
            for name, value in weights.items():
                weights[name] = operation(value)

        return at.model(all_of)

    return change


def _intervals(half_widths: list[list[float]]) -> dict[str, Any]:
    return {"deviations": [[0.001] * len(half_widths[0])], "half_widths": [half_widths]}


ROWS = [
    _of(
        "plan",
        "a variance below zero",
        lambda at: at.model(calibration__variance_scale=[-1.0, 1, 1, 1]),
        "'calibration.variance_scale.0': .*greater than 0",
    ),
    _of(
        "plan",
        "intervals that become narrower",
        lambda at: at.model(calibration__intervals=_intervals([[1.0 - 0.01 * k] * 4 for k in range(20)])),
        "'calibration.intervals': .*no less than the one before",
    ),
    _of(
        "plan",
        "too few intervals",
        lambda at: at.model(calibration__intervals=_intervals([[1.0] * 4])),
        "'calibration.intervals': .*20 are needed",
    ),
    _of(
        "plan",
        "intervals of too few components",
        lambda at: at.model(calibration__intervals=_intervals([[1.0, 1.0]] * 20)),
        "intervals has 2 numbers, the network predicts 4",
    ),
    _of(
        "evaluate",
        "an infinite slope",
        lambda at: at.model(calibration__quality_slope=float("inf")),
        "'calibration.quality_slope': .*finite number",
    ),
    _of(
        "assess",
        "an offset that is no number",
        lambda at: at.model(calibration__quality_offset=float("nan")),
        "'calibration.quality_offset': .*finite number",
    ),
    _of(
        "serve",
        "a mean that is no number",
        lambda at: at.model(normalisation__target_mean=[float("nan"), 0, 0, 0]),
        "'normalisation.target_mean.0': .*finite number",
    ),
    _of(
        "plan",
        "a side of the patch that is infinite",
        lambda at: at.model(network__patch_side=float("inf")),
        "'network.*patch_side': ",
    ),
    _of(
        "plan",
        "layers of a billion numbers",
        lambda at: at.model(network__head_width=10**9),
        "'network.*head_width': .*less than or equal to",
    ),
    _of("plan", "layers wider than the weights", lambda at: at.model(network__head_width=4096), "has shape"),
    _of("benchmark", "a depth of brackets", _described("[" * 100_000), "model.json is damaged"),
    _of(
        "palletize",
        "a description of another schema",
        lambda at: at.model(schema_version=99),
        "schema version 99, legal: 2",
    ),
    _of("plan", "a description that is a list", _described("[]"), "schema version None|is damaged"),
    _of(
        "plan",
        "a description without a network",
        _described('{"schema_version": 2}'),
        "'network': field required",
    ),
    _of(
        "plan",
        "a key twice",
        _described('{"schema_version": 2, "schema_version": 2}'),
        "key 'schema_version' occurs twice",
    ),
    _of("plan", "an unknown key", lambda at: at.model(layers_of="x"), "'layers_of': .*not permitted"),
    _of("plan", "a description without an end", _described('{"a": "' + "x" * 20_000_000), "larger than"),
    _of(
        "plan",
        "a hand of another size",
        lambda at: at.model(labels=[OTHER_HAND]),
        "another hand",
    ),
    _of("plan", "weights in integers", _each(lambda value: (1000 * value).long()), "type I64, F32 is needed"),
    _of("plan", "weights in half precision", _each(lambda value: value.half()), "type F16, F32 is needed"),
    _of("plan", "weights that are no numbers", _each(lambda value: value * float("nan")), "is not finite"),
    _of("plan", "weights of 1e30", _each(lambda value: value * 1e30), "predicts values that are not finite"),
    _of("plan", "weights cut off", _weights(None, 1000), "is damaged"),
    _of("plan", "weights whose header claims an exabyte", _weights(b"\xff" * 7 + b"\x0f{}"), "is damaged"),
    _of("plan", "no weights", _weights(b""), "is damaged"),
    _of("plan", "weights in the way of pickle", _weights(b"\x80\x04\x95cos\nsystem\n."), "is damaged"),
    _of("serve", "no model", lambda at: "nowhere", "no model.json in nowhere", 2),
]
