"""Predictions hold for the point that is meant: parts whose seen centre is far from their centroid."""

import dataclasses

import numpy as np
import pytest
import trimesh

from hal.camera import RgbdFrame
from mskgrasp.core.geometry import Pose, quat_about_z, quat_multiply, wrap_angle
from mskgrasp.core.grasp import object_displacement, to_grasp_displacement
from mskgrasp.parts import Part, find_part
from mskgrasp.perception.markers import Markers, planar_displacement
from mskgrasp.planning.grasp_plan import GraspPlan
from mskgrasp.planning.place_pose import Target, place_error, place_pose
from mskgrasp.trials.engine import ExecutedGrasp
from tests import synthetic
from tests.planning.hand_made import planner
from tests.planning.workspaces import WORKSPACE

SHIFT = np.array([0.008, -0.006, 0.0])
TURNS = np.radians([10.0, -15.0, 20.0])


@dataclasses.dataclass(frozen=True)
class Moved:
    """A part before it moved in the hand and put down again after, and the plan that knew its motion."""

    before: Pose
    after: Pose
    displacement: np.ndarray
    plan: GraspPlan

    @property
    def off(self) -> np.ndarray:
        """(2,) from the centroid to the seen centre, base axes."""
        return self.plan.view.centre_base[:2] - self.before.position[:2]


def pictured(part: Part, pose: Pose) -> RgbdFrame:
    """A frame of a part, from points that lie densely on its surface."""
    mesh = trimesh.load_mesh(part.mesh_path)
    points, _ = trimesh.sample.sample_surface(mesh, 200_000, seed=0)
    points_camera = (synthetic.OVERHEAD.inverse() @ pose).apply(np.asarray(points))
    pixels = points_camera @ synthetic.INTRINSICS.T
    column, row = np.rint(pixels[:, :2] / pixels[:, 2:]).astype(int).T
    frame = synthetic.frame([])
    depth = frame.depth.copy()
    np.minimum.at(depth, (row, column), points_camera[:, 2].astype(np.float32))
    return dataclasses.replace(frame, depth=depth)


@pytest.fixture(
    params=[("l_bracket_60x40", 0), ("hinge_60x30", 1)], ids=lambda param: param[0], scope="module"
)
def seen(request: pytest.FixtureRequest) -> tuple[Pose, GraspPlan]:
    """A part on the table, and a plan of a grasp in its picture."""
    name, resting = request.param
    part = find_part(name)
    yaw = quat_about_z(np.array(0.7))
    pose = Pose(
        position=part.resting.position[resting] + [0.45, 0.02, synthetic.TABLE_Z],
        quat_wxyz=quat_multiply(yaw, part.resting.quat_wxyz[resting]),
    )
    return pose, planner().plan(pictured(part, pose), np.random.default_rng(0))


@pytest.fixture(params=TURNS, ids=lambda turn: f"{np.degrees(turn):.0f}")
def moved(seen: tuple[Pose, GraspPlan], request: pytest.FixtureRequest) -> Moved:
    before, plan = seen
    motion = Pose(position=SHIFT, quat_wxyz=quat_about_z(np.array(request.param)))
    T_base_grasp = plan.grasp.T_base_grasp
    after = T_base_grasp @ motion @ T_base_grasp.inverse() @ before
    T_tcp_base = plan.grasp.T_base_tcp.inverse()
    displacement, _ = object_displacement(T_tcp_base @ before, T_tcp_base @ after)
    origin_grasp = T_base_grasp.inverse().apply(before.position)
    known = to_grasp_displacement(displacement, origin_grasp)
    plan = dataclasses.replace(plan, grasp_displacement=known)
    return Moved(before=before, after=after, displacement=displacement, plan=plan)


def test_a_displacement_is_known_of_the_centroid_and_of_the_seen_centre(moved: Moved):
    assert 0.005 < np.hypot(*moved.off) < 0.015
    of_centroid, _ = moved.plan.displacement_of(moved.before.position)
    np.testing.assert_allclose(of_centroid, moved.displacement, atol=1e-9)
    tracked = ExecutedGrasp(reason="", before=moved.before, displacement=moved.displacement)
    np.testing.assert_allclose(tracked.displacement_of_centre(moved.plan), moved.plan.displacement, atol=1e-9)
    # What one point's displacement misses another point by.
    apart = np.hypot(*(of_centroid - moved.plan.displacement)[:2])
    assert apart == pytest.approx(2 * np.hypot(*moved.off) * np.sin(abs(moved.displacement[3]) / 2))


def test_a_part_whose_motion_is_known_is_placed_without_error(moved: Moved):
    plan, target = moved.plan, Target(x=0.52, y=-0.06, theta=1.1)
    pose = place_pose(plan.grasp, plan.displacement, plan.view.centre_base, target, WORKSPACE.lowest_grasp_z)
    held = plan.grasp.T_base_grasp.inverse() @ moved.after
    missed, turned = place_error(moved.before, pose.T_base_grasp @ held, moved.off, target)
    assert missed < 1e-9 and turned < 1e-7


def test_tape_measures_what_is_predicted_of_the_seen_centre(moved: Moved):
    plan, z = moved.plan, moved.plan.view.table_z + moved.plan.view.size[2]
    on_top = np.array([[0.012, 0.003, z], [-0.008, 0.006, z]]) + [*plan.view.centre_base[:2], 0.0]
    sides = np.array([[0.012, 0.012], [0.008, 0.008]])
    first, second = (
        Markers(pixels=np.zeros((2, 2)), points_base=points, sides=sides)
        for points in (on_top, (moved.after @ moved.before.inverse()).apply(on_top))
    )
    measured = planar_displacement(first, second, plan.grasp, plan.view.centre_base)
    error = measured - plan.displacement[[0, 1, 3]]
    assert np.abs([*error[:2], wrap_angle(error[2])]).max() < 1e-9
