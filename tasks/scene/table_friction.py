"""Coulomb friction of a part on the table, in place of PhysX's."""

from __future__ import annotations

import numpy as np
from sapien.physx import PhysxCpuSystem, PhysxRigidBaseComponent, PhysxRigidDynamicComponent
from scipy.linalg.lapack import dposv

ROUNDS = 6
"""Iterations of the least squares of a step, which start from the present velocity. Where a part slides or
turns they end before they converge: of 320 grasps, displacements differ from those with Newton's method to
convergence by 0.04 mm (median), and so they do with half of the rounds or five times as many."""
STILL = 1e-5
"""Speed below which friction is viscous instead of Coulomb's, m/s."""
MEMORY = 0.98
"""Share of the last step's change of velocity, without friction's, that is expected of the next step. With
all of it, this friction and that of a finger on the same part amplify each other; with less, a part that is
pushed almost hard enough to slide creeps, at 1000 Hz by 0.1 mm/s."""
AT_REST = 1e-6
"""A part slower than this, m/s and rad/s, that nothing accelerates needs no friction."""


class TableFriction:
    """Friction at the contact points of a part and the table, for which the engine has none.

    PhysX replaces a flat contact by its two farthest points, and friction that slides there does not oppose
    the slip (tests.benchmarks.spinning): a bar that a pad pushes turns by half or by too much, depending on
    the order of its corners (tests.benchmarks.pushing). Here every point resists its slip with at most mu
    times its load. The velocity w after a step minimises

        1/2 (w - w0)^T M (w - w0) + sum_i mu n_i |J_i w|

    with the part's spatial inertia M, the impulses n_i of the last step and the points' Jacobians J_i, by
    weighted least squares (maximum dissipation; Moreau, On unilateral constraints, friction and plasticity,
    1974). w0 is the velocity without friction: the present one, changed by `MEMORY` of what everything but
    friction changed in the last step. Without that, a part that is pushed too weakly to slide would creep.

    Args:
        system: Engine of the scene.
        body: The part.
        table: The table, with a horizontal top.
        coefficient: Coulomb's, mu.
    """

    def __init__(
        self,
        system: PhysxCpuSystem,
        body: PhysxRigidDynamicComponent,
        table: PhysxRigidBaseComponent,
        coefficient: float,
    ):
        self._system = system
        self._body = body
        self._table = table
        self._coefficient = coefficient
        self._inertia = np.asarray(body.inertia, dtype=np.float64)
        self._mass_and_inertia = np.diag(np.full(6, float(body.mass)))
        self.reset()

    def reset(self) -> None:
        """Forget the last step, as after the part was put elsewhere: the next step is without friction."""
        self._with_friction: np.ndarray | None = None
        """Velocity (6,) that the part would have now if nothing but friction had changed it."""
        self._timestep = self._system.timestep

    def apply(self) -> None:
        """Apply the friction of the next step; to be called before each."""
        body, step = self._body, self._system.timestep
        ratio, self._timestep = step / self._timestep, step
        now = np.concatenate([body.linear_velocity, body.angular_velocity]).astype(np.float64)
        last, self._with_friction = self._with_friction, now
        if last is None:  # the contacts are those of another place
            return
        free = now + MEMORY * ratio * (now - last)
        if max(abs(free).max(), abs(now).max()) < AT_REST:
            return
        points, impulses = self._contacts()
        if not points:
            return
        pose = body.entity_pose * body.cmass_local_pose
        axes = pose.to_transformation_matrix()[:3, :3].astype(np.float64)
        self._mass_and_inertia[3:, 3:] = (axes * self._inertia) @ axes.T
        jacobian = _jacobian(np.array(points, dtype=np.float64) - pose.p)
        most = self._coefficient * ratio * np.array(impulses)
        momentum, velocity = self._mass_and_inertia @ free, now
        for _ in range(ROUNDS):
            slip = jacobian @ velocity
            along, across = slip[::2], slip[1::2]
            drag = (most / np.sqrt(along * along + across * across + STILL * STILL)).repeat(2)
            velocity = dposv(self._mass_and_inertia + (jacobian.T * drag) @ jacobian, momentum)[1]
        change = velocity - free
        self._with_friction = now + change
        wrench = (self._mass_and_inertia @ change / step).astype(np.float32)
        body.add_force_torque(wrench[:3], wrench[3:])

    def _contacts(self) -> tuple[list[np.ndarray], list[float]]:
        """Points that pressed on the table in the last step, and their impulses, N s."""
        points, impulses = [], []
        for contact in self._system.get_contacts():
            bodies = contact.bodies
            if self._body in bodies and self._table in bodies:
                for point in contact.points:
                    impulse = abs(float(point.impulse[2]))
                    if impulse > 0:
                        points.append(point.position)
                        impulses.append(impulse)
        return points, impulses


def _jacobian(arms: np.ndarray) -> np.ndarray:
    """(2 k, 6) from a body's velocity, linear and angular, to the points' x and y of it.

    Args:
        arms: (k, 3) points seen from the centre of mass, m.
    """
    jacobian = np.zeros((len(arms), 2, 6))
    jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1
    jacobian[:, 0, 4], jacobian[:, 0, 5] = arms[:, 2], -arms[:, 1]
    jacobian[:, 1, 3], jacobian[:, 1, 5] = -arms[:, 2], arms[:, 0]
    return jacobian.reshape(-1, 6)
