import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from mskgrasp.core.geometry import Pose, quat_about_z
from mskgrasp.perception.height_patches import crop_patches, height_image
from tests.synthetic import INTRINSICS, OVERHEAD, TILTED, Box, render


def heights_of(boxes, T_base_camera=OVERHEAD):
    return torch.from_numpy(height_image(render(boxes, T_base_camera), INTRINSICS, T_base_camera, 0.0))


@pytest.mark.parametrize("camera", [OVERHEAD, TILTED])
def test_the_table_is_at_zero_and_a_top_at_its_height(camera):
    box = Box(x=0.455, y=0.0, yaw=0.3, size=(0.06, 0.05, 0.04))
    heights = heights_of([box], camera).numpy()
    assert heights.min() == pytest.approx(0.0, abs=1e-6)
    assert heights.max() == pytest.approx(0.04, abs=1e-6)


def test_heights_of_many_images_use_each_its_own_camera_and_table():
    box = Box(x=0.455, y=0.0, yaw=0.0, size=(0.05, 0.05, 0.03))
    depth = np.stack([render([box], OVERHEAD), render([box], TILTED)])
    depth[0, 3, 4] = np.nan
    cameras = Pose(
        position=np.stack([OVERHEAD.position, TILTED.position]),
        quat_wxyz=np.stack([OVERHEAD.quat_wxyz, TILTED.quat_wxyz]),
    )
    both = height_image(torch.from_numpy(depth), np.stack([INTRINSICS] * 2), cameras, np.array([0.0, -0.1]))
    assert np.isnan(both[0, 3, 4]) and int(torch.isnan(both).sum()) == 1
    assert float(both[1].min()) == pytest.approx(0.1, abs=1e-6)
    single = height_image(depth[1], INTRINSICS, TILTED, -0.1)
    assert np.allclose(both[1].numpy(), single, atol=1e-6)


def bump(x, y, z, half=0.004):
    return Box(x=x, y=y, yaw=0.0, size=(2 * half, 2 * half, z))


@pytest.mark.parametrize(
    ("theta", "offset", "pixel"),
    [
        (0.0, (0.03, 0.0), (31.5, 46.5)),  # along the grasp's x: right
        (0.0, (0.0, 0.03), (16.5, 31.5)),  # along its y, the closing direction: up
        (-np.pi / 2, (0.03, 0.0), (16.5, 31.5)),
        (np.pi / 4, (0.03 / np.sqrt(2), 0.03 / np.sqrt(2)), (31.5, 46.5)),
    ],
)
def test_a_bump_appears_where_the_grasp_frame_says(theta, offset, pixel):
    grasp = torch.tensor([[0.45, 0.01, 0.02, theta]])
    patch = crop_patches(
        heights_of([bump(0.45 + offset[0], 0.01 + offset[1], 0.02)]), grasp, INTRINSICS, OVERHEAD
    )
    high = torch.nonzero(patch[0, 0] > 0.01).double()
    assert torch.allclose(high.mean(dim=0), torch.tensor(pixel).double(), atol=0.5)


def test_the_scale_of_a_patch_is_metric():
    heights = heights_of([Box(x=0.455, y=0.0, yaw=0.0, size=(0.08, 0.04, 0.001))])
    patch = crop_patches(heights, torch.tensor([[0.455, 0.0, 0.0, 0.0]]), INTRINSICS, OVERHEAD)[0, 0]
    high = patch > 0.0005
    assert int(high.any(dim=0).sum()) == pytest.approx(40, abs=1)
    assert int(high.any(dim=1).sum()) == pytest.approx(20, abs=1)


def test_pixel_centres_lie_at_integer_coordinates():
    # A height map that is linear in the pixel is sampled exactly; its value tells where the sample was.
    rows, columns = torch.meshgrid(torch.arange(160.0), torch.arange(160.0), indexing="ij")
    grasp = torch.tensor([[0.43, 0.02, 0.013, 0.4]])
    x_camera, y_camera, depth = OVERHEAD.inverse().apply(grasp[0, :3].double().numpy())
    for image, centre, along in ((columns, 79.5, x_camera), (rows, 79.5, y_camera)):
        patch = crop_patches(image, grasp, INTRINSICS, OVERHEAD, n_pixels=33, side=0.05)
        assert float(patch[0, 0, 16, 16]) == pytest.approx(365.5 * along / depth + centre, abs=1e-3)


@given(st.floats(-1.5, 1.5))
def test_turning_scene_and_grasp_together_leaves_the_patch_unchanged(angle):
    def scene(turn):
        T = Pose(position=np.array([0.455, 0.0, 0.0]), quat_wxyz=quat_about_z(np.array(turn)))
        first, second = T.apply(np.array([[0.01, 0.0, 0.0], [0.02, 0.03, 0.0]]))
        sizes = ((0.06, 0.03, 0.02), (0.02, 0.02, 0.02))
        boxes = [Box(x=p[0], y=p[1], yaw=turn, size=s) for p, s in zip((first, second), sizes, strict=True)]
        return crop_patches(
            heights_of(boxes), torch.tensor([[0.455, 0.0, 0.02, turn]]), INTRINSICS, OVERHEAD
        )[0, 0]

    still, turned = scene(0.0), scene(angle)
    # Edges fall differently on the camera's pixels; away from them nothing changes.
    inner = torch.nn.functional.max_pool2d
    low, high = -inner(-still[None], 5, 1, 2)[0], inner(still[None], 5, 1, 2)[0]
    flat = high - low < 1e-4
    assert float(flat.double().mean()) > 0.7
    assert float((still - turned)[flat].abs().max()) < 0.003
    assert float((still - turned).abs().mean()) < 0.0006


def test_one_image_for_all_grasps_and_one_image_each_agree():
    heights = heights_of([Box(x=0.455, y=0.0, yaw=0.5, size=(0.06, 0.03, 0.03))])
    rng = np.random.default_rng(0)
    grasps = torch.from_numpy(rng.uniform([0.4, -0.05, 0.01, -1.5], [0.5, 0.05, 0.03, 1.5], (7, 4)))
    one = crop_patches(heights, grasps, INTRINSICS, OVERHEAD)
    each = crop_patches(heights.expand(7, -1, -1), grasps, INTRINSICS, OVERHEAD)
    cameras = Pose(position=np.tile(OVERHEAD.position, (7, 1)), quat_wxyz=np.tile(OVERHEAD.quat_wxyz, (7, 1)))
    own = crop_patches(heights.expand(7, -1, -1), grasps, np.tile(INTRINSICS, (7, 1, 1)), cameras)
    assert one.shape == (7, 1, 64, 64) and one.dtype == torch.float32
    assert torch.allclose(one, each, atol=1e-6) and torch.allclose(one, own, atol=1e-6)


def test_a_narrow_patch_is_the_middle_of_a_square_one():
    heights = heights_of([Box(x=0.455, y=0.0, yaw=0.5, size=(0.06, 0.03, 0.03))])
    grasps = torch.tensor([[0.46, 0.01, 0.02, 0.7]])
    square = crop_patches(heights, grasps, INTRINSICS, OVERHEAD, n_pixels=33, side=0.132)
    narrow = crop_patches(heights, grasps, INTRINSICS, OVERHEAD, n_pixels=33, side=0.132, n_columns=17)
    assert narrow.shape == (1, 1, 33, 17) and torch.allclose(narrow, square[..., 8:25], atol=1e-6)


def test_invalid_pixels_become_table_and_do_not_spread():
    heights = torch.full((160, 160), 0.02)
    heights[70:75, 70:75] = torch.nan
    patch = crop_patches(heights, torch.tensor([[0.455, 0.0, 0.02, 0.3]]), INTRINSICS, OVERHEAD)
    assert set(np.unique(patch.numpy().round(6)).tolist()) == {0.0, np.float32(0.02).round(6).item()}
    hole = float((patch == 0).sum()) * 0.002**2
    assert hole == pytest.approx((5 * 0.78 / 365.5) ** 2, rel=0.25)


def test_outside_the_image_is_table():
    heights = torch.full((160, 160), 0.02)
    patch = crop_patches(heights, torch.tensor([[0.455, 0.3, 0.0, 0.0]]), INTRINSICS, OVERHEAD)
    assert float(patch.abs().max()) == 0.0


def test_an_image_ends_at_the_same_place_with_and_without_invalid_pixels():
    heights = torch.full((160, 160), 0.02)
    broken = heights.clone()
    broken[-1, -1] = torch.nan  # in no patch
    grasps = torch.tensor([[0.455, 0.13, 0.0, 0.2], [0.6, 0.13, 0.01, 0.7], [0.455, 0.0, 0.01, 0.7]])
    whole, other = (crop_patches(image, grasps, INTRINSICS, OVERHEAD) for image in (heights, broken))
    assert torch.allclose(whole, other, atol=1e-6)
    edge = [float((patch == 0).float().mean()) for patch in whole]
    assert 0.05 < edge[0] < 0.6 and 0.1 < edge[1] < 0.9 and edge[2] == 0
