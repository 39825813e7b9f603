from __future__ import annotations

import pytest
import torch

from mskgrasp.learning.grasp_models import ModelMeta
from mskgrasp.learning.symmetry import views
from tests.benchmarks.oracle_networks import builder, number_images, read_numbers
from tests.learning.small import HAND, NORMAL


@pytest.mark.parametrize("shape", [(33, 33), (65, 33), (64, 32)])
def test_a_flip_of_the_images_mirrors_the_point_and_leaves_the_numbers(shape):
    known = torch.tensor([[0.3, -0.2, 0.5, 1.7], [-0.1, 0.4, -0.6, -2.0]])
    images = number_images(known, shape, has_point=True)
    torch.testing.assert_close(read_numbers(images), known)
    for view, _, signs in views(images, known[:, :3]):
        torch.testing.assert_close(read_numbers(view)[:, :3], known[:, :3] * signs[:3])
        torch.testing.assert_close(read_numbers(view)[:, 3], known[:, 3])


@pytest.mark.parametrize(("n_more", "n_numbers"), [(0, 0), (2, 0), (0, 4), (2, 2)])
def test_a_network_uses_every_image_and_number_that_it_is_given(n_more, n_numbers):
    torch.manual_seed(0)
    models = builder(n_more, n_numbers)(ModelMeta(network=HAND.network, normalisation=NORMAL))
    shape = HAND.network.patch_shape
    patches = 0.02 * torch.rand((3, 1 + n_more + n_numbers, *shape))
    centre, height = 0.01 * torch.randn((3, 3)), torch.full((3,), 0.02)
    before, _ = models.grasp_displacement(patches, centre, height)
    assert before.shape == (3, 4)
    for image in range(patches.shape[1]):
        changed = patches.clone()
        changed[:, image] += 0.01
        after, _ = models.grasp_displacement(changed, centre, height)
        assert (after - before).abs().amax(dim=1).gt(0).all(), f"image {image} has no effect"
