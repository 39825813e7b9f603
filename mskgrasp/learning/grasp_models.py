"""A trained pair of networks: its predictions, and its description and weights on disk."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
from pydantic import Field, ValidationError, field_validator, model_validator
from safetensors import SafetensorError, safe_open
from safetensors.torch import load_file, save
from torch import Tensor

from mskgrasp.core.config import Config
from mskgrasp.core.errors import BadModel, MissingModel
from mskgrasp.core.files import read_bounded, write_whole
from mskgrasp.core.grasp import HAND_GEOMETRY, SAME_HAND
from mskgrasp.core.json_text import parse_json
from mskgrasp.core.predicted_intervals import IntervalTable, normal_half_width
from mskgrasp.core.shipped import PRETRAINED
from mskgrasp.learning.hand_features import HandFeatures
from mskgrasp.learning.label_source import LabelSource
from mskgrasp.learning.network_config import NetworkConfig, Normalisation
from mskgrasp.learning.networks import GraspDisplacementNetwork, GraspQualityNetwork
from mskgrasp.learning.symmetry import N_VIEWS, views

SCHEMA_VERSION = 2
MOST_BYTES = 2**24
"""Largest description of a model; the shipped one has 130 kB."""
WEIGHTS = "model.safetensors"
DESCRIPTION = "model.json"


class ModelCalibration(Config):
    """Corrections measured on held-out parts; the defaults change nothing."""

    quality_slope: float = Field(default=1.0, gt=0.0)
    quality_offset: float = 0.0
    """Platt scaling of the quality (1999): its log odds become slope * log odds + offset."""
    variance_scale: tuple[Annotated[float, Field(gt=0.0)], ...] = ()
    """Factor of each variance, so that the central 90 % interval holds 90 %; empty: 1."""
    intervals: IntervalTable | None = None
    """Widths of the central intervals of all probabilities; None: a normal distribution's."""

    def half_width(self, level: float, variance: np.ndarray) -> float | np.ndarray:
        """Half widths (n, k) of the central interval of a probability, in predicted standard deviations.

        Args:
            level: Probability.
            variance: (n, k) predicted.
        """
        return (self.intervals.half_width if self.intervals else normal_half_width)(level, variance)


class ModelMeta(Config):
    """Description in ``model.json`` of the weights beside it."""

    schema_version: int = SCHEMA_VERSION
    network: NetworkConfig
    normalisation: Normalisation
    calibration: ModelCalibration = ModelCalibration()
    labels: tuple[LabelSource, ...] = ()
    """Simulations that the labels come from; empty: not recorded."""
    training: dict[str, Any] = {}
    metrics: dict[str, Any] = {}

    @model_validator(mode="after")
    def _numbers_fit_the_network(self) -> ModelMeta:
        n, intervals = self.network.n_outputs, self.calibration.intervals
        sizes = {
            "normalisation.target_mean": len(self.normalisation.target_mean),
            "normalisation.target_std": len(self.normalisation.target_std),
            "calibration.variance_scale": len(self.calibration.variance_scale) or n,
            "calibration.intervals": len(intervals.deviations[0]) if intervals else n,
        }
        for name, size in sizes.items():
            if size != n:
                raise ValueError(f"{name} has {size} numbers, the network predicts {n}")
        return self

    @field_validator("training")
    @classmethod
    def _parts_are_names(cls, values: dict[str, Any]) -> dict[str, Any]:
        for name, parts in values.items():
            listed = isinstance(parts, list | tuple) and all(isinstance(one, str) for one in parts)
            if name.endswith("_parts") and not listed:
                raise ValueError(f"training.{name} must be a list of names")
        return values


@dataclass(frozen=True)
class Models:
    """Trained pair of networks, in evaluation mode, with their description."""

    gqn: GraspQualityNetwork
    gdn: GraspDisplacementNetwork
    meta: ModelMeta

    @property
    def device(self) -> torch.device:
        """Device of the weights."""
        return next(self.gqn.parameters()).device

    def uncalibrated(self) -> Models:
        """The same networks, without corrections of what they predict."""
        return replace(self, meta=self.meta.model_copy(update={"calibration": ModelCalibration()}))

    @torch.inference_mode()
    def quality(self, patches: Tensor, centre_grasp: Tensor, height: Tensor) -> Tensor:
        """Probability of success (n,) of grasps.

        Args:
            patches: (n, 1, r, c) metres above the table, centred on the grasps and rotated with them, of the
                network's ``quality_shape``.
            centre_grasp: (n, 3) object centre in the grasp frame, metres.
            height: (n,) of the grasps above the table, metres.
        """
        self._check(patches, (1, *self.meta.network.quality_shape))
        return self._probability(self.gqn(patches, centre_grasp.to(patches.dtype), height.to(patches.dtype)))

    @torch.inference_mode()
    def grasp_displacement(
        self,
        patches: Tensor,
        centre_grasp: Tensor,
        height: Tensor,
        theta: Tensor | None = None,
        *,
        all_views: bool = True,
    ) -> tuple[Tensor, Tensor | None]:
        """Mean and variance (n, k) of grasp displacement and swing, of patches (n, 1, r, c) in metres.

        k is 6 if the network predicts the swing, radians about x and y of the grasp frame, otherwise 4.

        Args:
            patches: Centred on the grasps and rotated with them; with ``image: object`` centred on the part
                and not rotated.
            centre_grasp: (n, 3) object centre in the grasp frame, metres.
            height: (n,) of the grasps above the table, metres.
            theta: (n,) the grasps' angles, for ``image: object``.
            all_views: With ``symmetric_views``: False predicts from one view, in a quarter of the time.
        """
        self._check(patches, (self.gdn.features.n_images, *self.meta.network.patch_shape))
        centre_grasp, height = (values.to(patches.dtype) for values in (centre_grasp, height))
        if not (self.meta.network.symmetric_views and all_views):
            return self._calibrated(*self.gdn(patches, centre_grasp, height, theta))
        seen, centres, signs = (list(values) for values in zip(*views(patches, centre_grasp), strict=True))
        # In one pass: batches of a few grasps take a quarter longer for each.
        mean, variance = self.gdn(torch.cat(seen), torch.cat(centres), height.repeat(N_VIEWS))
        each = mean.unflatten(0, (N_VIEWS, -1)) * torch.stack(signs)[:, None, : mean.shape[1]]
        mean = each.mean(0)
        if variance is not None:
            variance = variance.unflatten(0, (N_VIEWS, -1)).mean(0) + (each - mean).square().mean(0)
        return self._calibrated(mean, variance)

    def _probability(self, logits: Tensor) -> Tensor:
        calibration = self.meta.calibration
        _check_predicted(logits)
        odds = torch.logit(self.gqn.quality(logits).double(), eps=1e-12)
        return torch.sigmoid(calibration.quality_slope * odds + calibration.quality_offset).to(logits.dtype)

    def _calibrated(self, mean: Tensor, variance: Tensor | None) -> tuple[Tensor, Tensor | None]:
        _check_predicted(mean)
        scale = self.meta.calibration.variance_scale
        return mean, variance * mean.new_tensor(scale) if scale and variance is not None else variance

    def _check(self, patches: Tensor, shape: tuple[int, int, int]) -> None:
        if tuple(patches.shape[1:]) != shape:
            wanted = ", ".join(map(str, ("n", *shape)))
            raise BadModel(f"patches have shape {tuple(patches.shape)}, this model takes ({wanted})")


def build_models(meta: ModelMeta, device: torch.device | str = "cpu") -> Models:
    """Build networks with fresh weights, in evaluation mode."""
    gqn = GraspQualityNetwork(meta.network, meta.normalisation)
    gdn = GraspDisplacementNetwork(meta.network, meta.normalisation)
    gqn.to(device).eval()
    gdn.to(device).eval()
    # Measured on a CPU: with channels last our quality network takes a fifth longer, all others less.
    if not isinstance(gqn.features, HandFeatures):
        gqn.to(memory_format=torch.channels_last)  # pyright: ignore
    gdn.to(memory_format=torch.channels_last)  # pyright: ignore
    return Models(gqn, gdn, meta)


def save_model(folder: Path, models: Models) -> None:
    """Write ``model.safetensors`` and ``model.json``, each atomically.

    Raises:
        BadModel: A weight is not finite.
    """
    weights = _weights(models)
    _check_finite(weights, "the trained networks", "train again with a lower learning rate")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / WEIGHTS, save({name: value.contiguous().cpu() for name, value in weights.items()}))
    described = json.dumps(models.meta.model_dump(mode="json"), indent=2) + "\n"
    write_whole(folder / DESCRIPTION, described.encode())


def load_models(folder: Path = PRETRAINED, device: torch.device | str = "cpu") -> Models:
    """Read a model folder.

    Raises:
        MissingModel: There is no model in the folder.
        BadModel: It is damaged or of another schema, or the weights do not fit the description.
    """
    folder = Path(folder)
    require_model(folder)
    meta = read_meta(folder / DESCRIPTION)
    require_hand(meta, HAND_GEOMETRY, folder)
    path = folder / WEIGHTS
    try:
        # What the description needs is compared before any of it takes memory.
        with safe_open(path, framework="pt") as file:
            stored = {name: file.get_slice(name) for name in file.keys()}
            _check_weights(path, stored, meta)
        weights = load_file(path)
    except (SafetensorError, OSError) as error:
        raise BadModel(f"{path} is damaged ({error}); copy it again or train again") from error
    _check_finite(weights, str(path), "train again")
    models = build_models(meta)
    with torch.no_grad():
        for name, value in _weights(models).items():
            value.copy_(weights[name])
    models.gqn.to(device)
    models.gdn.to(device)
    return models


def require_model(folder: Path) -> None:
    """Refuse a folder that holds no model, without reading it.

    Raises:
        MissingModel: A file of a model is missing.
    """
    for name in (DESCRIPTION, WEIGHTS):
        if not (folder / name).is_file():
            raise MissingModel(
                f"no {name} in {folder}; train a model: python -m mskgrasp.train --data DATASET "
                f"--out {folder}"
            )


def read_meta(path: Path) -> ModelMeta:
    """Read a model's description alone, without its weights.

    Raises:
        BadModel: It is damaged or of another schema.
    """
    try:
        values = parse_json(read_bounded(path, MOST_BYTES), constants=True)  # metrics may be NaN
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise BadModel(f"{path} is damaged ({reason}); copy it again or train again") from error
    version = values.get("schema_version") if isinstance(values, dict) else None
    if version != SCHEMA_VERSION:
        raise BadModel(f"{path} has schema version {version}, legal: {SCHEMA_VERSION}; train again")
    try:
        return ModelMeta.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise BadModel(f"{path}: '{key}': {first['msg'].lower()}; copy it again or train again") from error


def require_hand(meta: ModelMeta, hand: Mapping[str, float], folder: Path) -> None:
    """Refuse a model that was made for another hand.

    Args:
        meta: The model's description; where it records no hand, it is that which grasps are sampled for.
        hand: Dimensions as in `mskgrasp.core.grasp.HAND_GEOMETRY`, metres.
        folder: The model's folder, for the message.

    Raises:
        BadModel: A dimension differs by more than `SAME_HAND`.
    """
    for model_hand in (HAND_GEOMETRY, *(source.hand for source in meta.labels)):
        other = [name for name, size in model_hand.items() if abs(hand.get(name, 0) - size) > SAME_HAND]
        if other:
            sizes = ", ".join(
                f"{name} {1e3 * model_hand[name]:.1f} mm, this one's {1e3 * hand.get(name, 0):.1f} mm"
                for name in other
            )
            raise BadModel(
                f"the model in {folder} was trained for another hand ({sizes}): no data can be "
                "simulated with this one yet"
            )


def _weights(models: Models) -> dict[str, Tensor]:
    pairs = (("gqn", models.gqn), ("gdn", models.gdn))
    return {f"{name}.{key}": value for name, net in pairs for key, value in net.state_dict().items()}


def _check_predicted(values: Tensor) -> None:
    if not torch.isfinite(values).all():
        raise BadModel(
            "the model predicts values that are not finite: its weights are too large; train again"
        )


def _check_weights(path: Path, stored: Mapping[str, Any], meta: ModelMeta) -> None:
    """Compare a file's names, shapes and numbers with those that a description needs.

    Raises:
        BadModel: They differ.
    """
    with torch.device("meta"):  # shapes without numbers
        expected = _weights(build_models(meta, "meta"))
    for name in sorted(expected.keys() ^ stored.keys()):
        state = "lacks" if name in expected else "has the unknown"
        raise BadModel(f"{path} {state} weight {name}; it does not belong to the {DESCRIPTION} beside it")
    for name, value in expected.items():
        shape, number = tuple(stored[name].get_shape()), stored[name].get_dtype()
        if shape != tuple(value.shape):
            raise BadModel(
                f"{path}: {name} has shape {shape}, {DESCRIPTION} (patches of {meta.network.patch_pixels} "
                f"pixels) needs {tuple(value.shape)}; use the pair that was saved"
            )
        if number != "F32":
            raise BadModel(
                f"{path}: {name} holds numbers of type {number}, F32 is needed; use those that were saved"
            )


def _check_finite(weights: dict[str, Tensor], source: str, remedy: str) -> None:
    for name, value in weights.items():
        if not torch.isfinite(value).all():
            raise BadModel(f"{source}: weight {name} is not finite; {remedy}")
