"""Coulomb friction of a part on the table, in place of PhysX's."""

from __future__ import annotations

import numpy as np
from numba import njit
from sapien.physx import PhysxCpuSystem, PhysxRigidBaseComponent, PhysxRigidDynamicComponent

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
        self._moments = np.asarray(body.inertia, dtype=np.float64)
        self._mass = float(body.mass)
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
        now = _velocity(body.linear_velocity, body.angular_velocity)
        last, self._with_friction = self._with_friction, now
        if last is None:  # the contacts are those of another place
            return
        free, at_rest = _without_friction(now, last, ratio)
        if at_rest:
            return
        points, impulses = self._contacts()
        if not points:
            return
        pose = body.entity_pose * body.cmass_local_pose
        change, impulse = _friction(
            pose.to_transformation_matrix(),
            self._mass,
            self._moments,
            now,
            free,
            np.array(points),
            self._coefficient * ratio * np.array(impulses),
        )
        self._with_friction = now + change
        wrench = (impulse / step).astype(np.float32)
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


@njit(cache=True)
def _velocity(linear: np.ndarray, angular: np.ndarray) -> np.ndarray:
    """Velocity (6,) of linear and angular velocity (3,)."""
    velocity = np.empty(6)
    velocity[:3] = linear
    velocity[3:] = angular
    return velocity


@njit(cache=True)
def _without_friction(now: np.ndarray, last: np.ndarray, ratio: float) -> tuple[np.ndarray, bool]:
    """Velocity (6,) after the next step without friction, and whether nothing moves with it or now.

    Args:
        now: (6,) velocity of the part.
        last: (6,) velocity that it would have now if nothing but friction had changed it in the last step.
        ratio: Duration of the next step, in that of the last.
    """
    free = now + MEMORY * ratio * (now - last)
    return free, max(np.abs(free).max(), np.abs(now).max()) < AT_REST


@njit(cache=True)
def _friction(
    T_world_body: np.ndarray,
    mass: float,
    moments: np.ndarray,
    now: np.ndarray,
    free: np.ndarray,
    points: np.ndarray,
    most: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Change of a body's velocity by friction in a step, and its impulse.

    Compiled, as it is called at every step: array by array it would take a tenth of an attempt's time.

    Args:
        T_world_body: (4, 4) its principal axes at its centre of mass.
        mass: kg.
        moments: (3,) principal moments of inertia, kg m2.
        now: (6,) its velocity, m/s and rad/s.
        free: (6,) its velocity after the step without friction.
        points: (k, 3) of contact, m.
        most: (k,) greatest friction of each, N s.

    Returns:
        change: (6,) m/s and rad/s.
        impulse: (6,) N s and N m s.
    """
    inertia = np.zeros((6, 6))
    for i in range(3):
        inertia[i, i] = mass
        for j in range(3):
            for k in range(3):
                turned = np.float64(T_world_body[i, k]) * moments[k]
                inertia[3 + i, 3 + j] += turned * np.float64(T_world_body[j, k])
    momentum = _product(inertia, free)
    velocity = now.copy()
    matrix = np.empty((6, 6))
    for _ in range(ROUNDS):
        matrix[:] = inertia
        for i in range(len(points)):
            x = np.float64(points[i, 0]) - np.float64(T_world_body[0, 3])
            y = np.float64(points[i, 1]) - np.float64(T_world_body[1, 3])
            z = np.float64(points[i, 2]) - np.float64(T_world_body[2, 3])
            along = velocity[0] + z * velocity[4] - y * velocity[5]
            across = velocity[1] - z * velocity[3] + x * velocity[5]
            drag = most[i] / np.sqrt(along * along + across * across + STILL * STILL)
            # The lower triangle of drag J^T J, with J = [1 0 0 0 z -y; 0 1 0 -z 0 x].
            matrix[0, 0] += drag
            matrix[1, 1] += drag
            matrix[3, 1] -= drag * z
            matrix[3, 3] += drag * z * z
            matrix[4, 0] += drag * z
            matrix[4, 4] += drag * z * z
            matrix[5, 0] -= drag * y
            matrix[5, 1] += drag * x
            matrix[5, 3] -= drag * z * x
            matrix[5, 4] -= drag * z * y
            matrix[5, 5] += drag * (x * x + y * y)
        _solve(matrix, momentum, velocity)
    change = velocity - free
    return change, _product(inertia, change)


@njit(cache=True)
def _product(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    product = np.zeros(6)
    for i in range(6):
        for j in range(6):
            product[i] += matrix[i, j] * vector[j]
    return product


@njit(cache=True)
def _solve(matrix: np.ndarray, right: np.ndarray, solution: np.ndarray) -> None:
    """Solve a positive definite system (6, 6) by Cholesky's decomposition, in place of its lower triangle."""
    for i in range(6):
        for j in range(i + 1):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = np.sqrt(rest) if i == j else rest / matrix[j, j]
    for i in range(6):
        rest = right[i]
        for k in range(i):
            rest -= matrix[i, k] * solution[k]
        solution[i] = rest / matrix[i, i]
    for i in range(5, -1, -1):
        rest = solution[i]
        for k in range(i + 1, 6):
            rest -= matrix[k, i] * solution[k]
        solution[i] = rest / matrix[i, i]
