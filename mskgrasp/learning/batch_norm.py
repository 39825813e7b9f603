"""Batch normalisation while a network trains (Ioffe and Szegedy 2015, arXiv 1502.03167).

Once trained it scales and shifts each channel by constants. They are folded into the weights of the layer
before it: networks that predict, and files of models, have plain layers and take no more time.
"""

from __future__ import annotations

from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_eval, fuse_linear_bn_eval

from mskgrasp.learning.hand_features import HandFeatures, ResidualBlock
from mskgrasp.learning.networks import PatchFeatures


class Normalised(nn.Module):
    """A layer and the normalisation of its output."""

    def __init__(self, layer: nn.Conv2d | nn.Linear):
        super().__init__()
        self.layer = layer
        device = layer.weight.device
        self.norm = (
            nn.BatchNorm2d(layer.out_channels, device=device)
            if isinstance(layer, nn.Conv2d)
            else nn.BatchNorm1d(layer.out_features, device=device)
        )

    def forward(self, values: Tensor) -> Tensor:
        """Compute the normalised output (n, c, ...)."""
        return self.norm(self.layer(values))

    def folded(self) -> nn.Module:
        """The one layer that both are, in evaluation mode, up to rounding."""
        if isinstance(self.layer, nn.Conv2d):
            return fuse_conv_bn_eval(self.layer, self.norm)
        return fuse_linear_bn_eval(self.layer, self.norm)


def add_batch_norms(features: PatchFeatures | HandFeatures) -> None:
    """Put a normalisation behind every layer of the image branch, in place.

    In training mode it then needs two samples or more at a time.
    """
    for branch in (features.convolutions, features.image):
        _add(branch)


def fold_batch_norms(features: PatchFeatures | HandFeatures) -> None:
    """Fold the normalisations of a trained network into its layers, in place, in evaluation mode."""
    for branch in (features.convolutions, features.image):
        _fold(branch)


def _add(module: nn.Module) -> None:
    for name, child in module.named_children():
        if isinstance(child, nn.Conv2d | nn.Linear):
            setattr(module, name, Normalised(child))
        else:
            _add(child)
    if isinstance(module, ResidualBlock):
        _start_as_identity(module)


def _start_as_identity(block: ResidualBlock) -> None:
    """Let the normalisation keep a block from changing anything at first, instead of weights of zero.

    The deviation of an output that is zero everywhere is zero, too: dividing by it would blow up gradients.
    """
    second: nn.Module = block.second
    assert isinstance(second, Normalised)
    second.layer.reset_parameters()
    nn.init.zeros_(second.norm.weight)


def _fold(module: nn.Module) -> None:
    for name, child in module.named_children():
        if isinstance(child, Normalised):
            setattr(module, name, child.folded())
        else:
            _fold(child)
