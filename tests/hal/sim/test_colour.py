"""The fine colour image shows the block where a pinhole says."""

from __future__ import annotations

import numpy as np
import pytest
import sapien

from hal.sim import SapienCellConfig, sapien_cell
from hal.sim.colour import SUPERSAMPLING, FineColour
from hal.sim.world import SapienWorld
from mskgrasp.parts import Part
from tasks.scene.frames import to_world

SCALE = 3
CENTRE = SCALE * (79.5 + 0.5) - 0.5


def sides(high: float, low: float) -> tuple[float, float]:
    """Fine pixels from the centre to the outermost edges of the block, metres off the camera's axis.

    Its top is 0.77 m below the camera, its foot 0.8 m.
    """
    seen = [SCALE * 365.5 * offset / depth for offset in (high, low) for depth in (0.77, 0.8)]
    return max(seen), min(seen)


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.0), (0.462, 0.071), (0.553, -0.0433)])
def test_the_block_is_at_the_fine_pixels_of_its_rays(
    block_world: SapienWorld, block: Part, x: float, y: float
):
    """The camera has 365.5 px and hangs over (0.5, 0); a fine pixel is a third of a pixel."""
    block_world.present(str(block.folder), 0)
    away = sapien.Pose(p=to_world(np.array([0.5, 0.0, -1.0])))
    block_world.env.part.set_pose(away)
    empty = block_world.fine_colour()
    block_world.env.part.set_pose(sapien.Pose(p=to_world(np.array([x, y, 0.015]))))
    fine = block_world.fine_colour()
    assert empty is not None and fine is not None
    assert fine.shape == (480, 480, 3) and fine.dtype == np.uint8
    rows, columns = np.nonzero(np.abs(fine.astype(int) - empty).max(axis=-1) > 2)
    # The image's top is away from the base, its left along +y.
    top, bottom = (CENTRE - side for side in sides(x + 0.02 - 0.5, x - 0.02 - 0.5))
    left, right = (CENTRE - side for side in sides(y + 0.01, y - 0.01))
    seen = [rows.min() - 0.5, rows.max() + 0.5, columns.min() - 0.5, columns.max() + 0.5]
    assert seen == pytest.approx([top, bottom, left, right], abs=1.0)


def test_a_fine_image_is_the_mean_of_its_rays(block_world: SapienWorld):
    """Twice as fine and averaged over 2 x 2 pixels, each of 2 x 2 rays: the same 4 x 4 rays as at scale 1."""
    world = block_world
    images = {scale: FineColour(world.env, world.overhead, scale).capture().astype(float) for scale in (1, 2)}
    assert images[1].shape == (160, 160, 3) and images[2].shape == (320, 320, 3)
    averaged = images[2].reshape(160, 2, 160, 2, 3).mean(axis=(1, 3))
    assert SUPERSAMPLING == 2
    # Where the picture is flat both are the same; along edges twice as many rays round more finely.
    assert np.median(np.abs(averaged - images[1])) <= 0.5
    assert np.abs(averaged - images[1]).mean() < 1.0


def test_there_is_none_unless_it_is_asked_for(block: Part):
    world = sapien_cell(SapienCellConfig(type="sapien", part=str(block.folder))).feeder
    assert isinstance(world, SapienWorld)
    assert world.fine_colour() is None
