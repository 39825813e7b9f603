"""World, camera, arm and cell as far as they are the same in every simulator."""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from hal.arm import Arm
from hal.camera import Camera, RgbdFrame
from hal.cell import BoardHolder, Cell, Workspace
from hal.config import SimulatedCellConfig, TableError
from hal.device import SharingDevice
from hal.errors import MotionAborted, NotConnected, OutOfWorkspace
from hal.gripper import FRANKA_HAND
from hal.keep_out import KeepOut, camera_keep_out
from hal.keep_out_config import keep_outs
from hal.limits import ArmLimits, shown
from hal.sensor_noise import SensorNoise, add_noise
from mskgrasp.core.config import Config
from mskgrasp.core.geometry import Pose, pose_distance, straight_line
from mskgrasp.core.grasp import TABLE_CLEARANCE
from mskgrasp.core.minimum_jerk import minimum_jerk_duration
from mskgrasp.core.panda_body import PANDA_LINKS
from mskgrasp.core.panda_kinematics import (
    JOINT_LOWER,
    JOINT_UPPER,
    POSE_TOLERANCE,
    forward_pose,
    reachable,
    within_limits,
)
from mskgrasp.core.settings import TABLE_Z, Overhead, Region
from mskgrasp.parts import Part, find_part

JOINT_SPEED = 2.0
"""Greatest joint speed, rad/s (Panda datasheet: 2.175 rad/s for joints 1 to 4)."""
JOINT_ACCELERATION = 5.0
"""Greatest acceleration of a joint, or of the hand's turn, rad/s^2 (Panda datasheet: 7.5 for joint 2)."""
PEAK_ACCELERATION = 1.5
"""Greatest acceleration of the hand on straight lines, m/s^2, as in `tasks.robot.motion`."""
TURN_SPEED = 1.0
"""Greatest turning speed of the hand on a straight motion, rad/s."""
WATCH_S = 0.02
"""Simulated time between two calls of `SimulatedWorld.watch`, s."""
_WAYPOINT_M, _WAYPOINT_RAD = 0.01, 0.05


@dataclass(kw_only=True, eq=False)
class SimulatedWorld(ABC):
    """Parts on a table under a Panda, shared by the devices of a cell; built when first connected.

    Attributes:
        overhead: Settings of the camera.
        region: x_min, x_max, y_min, y_max where parts lie, base frame, metres.
        home: (7,) joints of the arm while a part is placed, radians.
        part: Part on the table at first: a name or a folder.
        seed: Determines its position and turn.
        table_error: Difference of the table from what the cell states.
        presented: Number of parts placed so far.
        presented_seed: Seed of the last placement.
        arm_reset: Called when the arm is put home, its hand empty, for a new part; None: there is no arm.
        watch: Called every `WATCH_S` of a motion, by the thread that commands it; None: nothing is.
    """

    overhead: Overhead
    region: Region
    home: np.ndarray
    part: str
    seed: int
    table_error: TableError = field(default_factory=TableError)
    presented: int = field(default=0, init=False)
    presented_seed: int = field(default=0, init=False)
    arm_reset: Callable[[], None] | None = field(default=None, init=False)
    watch: Callable[[], None] | None = field(default=None, init=False)
    _users: int = field(default=0, init=False)

    @property
    def T_base_camera(self) -> Pose:
        """Pose of the camera, over the middle of the region."""
        x_min, x_max, y_min, y_max = self.region
        return self.overhead.T_base_camera(((x_min + x_max) / 2, (y_min + y_max) / 2))

    @property
    def table_motion(self) -> Pose | None:
        """Motion, in the base, from the stated table to the true one; None where they are the same."""
        if self.table_error == TableError():
            return None
        x_min, x_max, y_min, y_max = self.region
        return self.table_error.motion(np.array([(x_min + x_max) / 2, (y_min + y_max) / 2]), TABLE_Z)

    def open(self) -> None:
        """Build the world for its first user.

        Raises:
            DriverMissing: The simulator is not installed.
        """
        if self._users == 0:
            self._build()
        self._users += 1

    def close(self) -> None:
        """Free the world after its last user."""
        self._users = max(0, self._users - 1)
        if self._users == 0:
            self._free()

    def call_watch(self) -> None:
        """Call `watch`, if there is one; a simulator does so during motions."""
        if self.watch is not None:
            self.watch()

    def present(self, part: str, seed: int, *, keep: bool = False) -> None:
        """Place a part on the table, arm at home with an empty hand, everything at rest.

        A new simulation each time, so that a trial does not depend on those before it.

        Args:
            part: Name or folder.
            seed: Determines its position and turn, in all simulators from the same distribution. They are
                the same ones where all resting poses of the part stand in the engine.
            keep: Parts outside the region, such as on a pallet, stay; else the table is cleared.

        Raises:
            BadPart: There is no such part.
            DriverMissing: The simulator is not installed.
            TapeDoesNotFit: The part is there, and has no room for the cell's tape.
        """
        new = find_part(part)
        self.presented, self.presented_seed = self.presented + 1, seed
        if self.arm_reset is not None:
            self.arm_reset()
        self._place(new, _in_32_bits(seed), keep)

    @abstractmethod
    def _place(self, part: Part, seed: int, keep: bool) -> None:
        """Build the simulation anew, as in `present`."""

    @abstractmethod
    def part_pose(self) -> Pose:
        """``T_base_obj`` of the part, the simulator's ground truth."""

    @abstractmethod
    def _build(self) -> None:
        """Build the world with its first part, or leave nothing behind."""

    @abstractmethod
    def _free(self) -> None: ...


WorldT = TypeVar("WorldT", bound=SimulatedWorld)


class SimulatedCamera(SharingDevice, Camera, Generic[WorldT]):
    """Camera over the table of a simulated world; the arm is in its image.

    Args:
        world: The simulated world.
        noise: Noise of the sensor; off by default.

    Attributes:
        serial: Serial number in the frames: the simulator's name.
    """

    serial: str

    def __init__(self, world: WorldT, noise: SensorNoise | None = None):
        self._resource = self._world = world
        self._noise = noise or SensorNoise()
        self._rng = np.random.default_rng(self._noise.seed)
        self._presented = 0

    def connect(self) -> None:
        """Build the world unless the arm has built it, and restart the sensor's noise."""
        if not self._open:
            self._presented = 0
        super().connect()

    def capture(self, timeout_s: float = 5.0) -> RgbdFrame:
        """Take a frame now; ``timeout_s`` is not needed.

        Raises:
            NotConnected: Outside the camera's context.
        """
        if not self._open:
            raise NotConnected(
                f"{type(self).__name__} is not connected; use it inside its context (with ...)"
            )
        world = self._world
        if self._presented != world.presented:
            # Reset with every part: its image must not depend on the number of parts before.
            self._presented = world.presented
            self._rng = np.random.default_rng([self._noise.seed, world.presented_seed])
        taken = time.monotonic()
        colour, depth, fine_colour = self._render()
        intrinsics = world.overhead.intrinsics()
        return RgbdFrame(
            colour=colour,
            depth=add_noise(depth, intrinsics, self._noise, self._rng),
            intrinsics=intrinsics,
            T_base_camera=world.T_base_camera,
            timestamp_s=taken,
            serial=self.serial,
            fine_colour=fine_colour,
        )

    @property
    def T_base_camera(self) -> Pose:
        """See `Camera.T_base_camera`."""
        return self._world.T_base_camera

    @abstractmethod
    def _render(self) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Colour, depth without noise, and fine colour or None, as in `RgbdFrame`."""


class SimulatedArm(SharingDevice, Arm, Generic[WorldT]):
    """The Panda of a simulated world; a contact force over the reflex limit ends a motion."""

    simulated = True
    links = PANDA_LINKS

    def __init__(self, world: WorldT, limits: ArmLimits):
        super().__init__(limits)
        self._resource = self._world = world
        world.arm_reset = self._reset

    def _reset(self) -> None:
        """The world puts the arm home, its hand empty."""
        self._held = self._load = None

    def watch(self, call: Callable[[], None] | None) -> None:
        """Have a function called every `WATCH_S` of simulated time during motions; None ends that.

        The thread that commands the motion calls it; there `state` and the tracker may be read, which another
        thread must not do while the simulation runs.
        """
        self._world.watch = call

    def _forward(self, joints: np.ndarray) -> Pose:
        return forward_pose(joints)

    def _forward_all(self, joints: np.ndarray) -> Pose:
        return forward_pose(joints)

    def _reachable(self, T_base_tcp: Pose) -> bool:
        return reachable(T_base_tcp, self.limits.joint_lower, self.limits.joint_upper)

    def _halt(self) -> None:
        """The drives hold their last targets; a motion in progress sees the stop flag."""

    def _line(self, here: Pose, T_base_tcp: Pose, speed: float) -> tuple[Pose, float]:
        """Waypoints (k,) of the straight line to a pose, without its start, and its duration, s."""
        distance, angle = pose_distance(here, T_base_tcp)
        seconds = max(
            minimum_jerk_duration(distance, speed, PEAK_ACCELERATION),
            minimum_jerk_duration(angle, TURN_SPEED, JOINT_ACCELERATION),
        )
        n = max(2, math.ceil(distance / _WAYPOINT_M), math.ceil(angle / _WAYPOINT_RAD))
        return straight_line(here, T_base_tcp, np.linspace(0, 1, n + 1)[1:]), seconds

    def _check_tracked(self, joints: np.ndarray, error: float, T_base_tcp: Pose) -> None:
        """Refuse a line whose joints (k, 7) miss a waypoint by ``error``, or pass their limits."""
        limits = self.limits
        if error > POSE_TOLERANCE or not within_limits(joints, limits.joint_lower, limits.joint_upper):
            raise OutOfWorkspace(
                f"no straight line from here to TCP {shown(T_base_tcp.position)} m within the joint limits"
            )


def _in_32_bits(seed: int) -> int:
    """The seed, or where simulators could not take one so large, a number drawn from it."""
    return seed if seed < 2**32 else int(np.random.SeedSequence(seed).generate_state(1)[0])


def joint_motion_s(way: float, speed: float) -> float:
    """Duration of a motion whose farthest joint moves by ``way`` radians, s; ``speed`` as in `Arm`."""
    return minimum_jerk_duration(way, speed * JOINT_SPEED, JOINT_ACCELERATION)


def contact_fault(limit: float) -> MotionAborted:
    """Fault of a motion that ended at a contact force over the limit, N."""
    return MotionAborted(f"contact force over {limit:.0f} N: the arm stopped; call recover() when it is safe")


def panda_limits(clearance: float = TABLE_CLEARANCE, keep_out: tuple[KeepOut, ...] = ()) -> ArmLimits:
    """Limits of the Panda over the simulated table, from which the hand keeps a clearance, metres."""
    return ArmLimits(
        joint_lower=np.array(JOINT_LOWER),
        joint_upper=np.array(JOINT_UPPER),
        box_lower=np.array([0.25, -0.4, TABLE_Z]),
        box_upper=np.array([0.75, 0.4, 0.75]),
        table_z=TABLE_Z,
        max_force=FRANKA_HAND.force[1],
        clearance=clearance,
        keep_out=keep_out,
    )


def cell_limits(config: SimulatedCellConfig, world: SimulatedWorld) -> ArmLimits:
    """Limits of the Panda in a simulated cell, whose camera it keeps off as a real one."""
    camera = camera_keep_out(world.T_base_camera)
    return panda_limits(config.clearance, (camera, *keep_outs(config.keep_out)))


def simulated_cell(
    config: SimulatedCellConfig,
    world: SimulatedWorld,
    camera: Camera,
    arm: Arm,
    physics: Config,
    board_holder: BoardHolder | None = None,
) -> Cell:
    """Cell of devices in one simulated world, which places parts and measures their poses."""
    return Cell(
        camera=camera,
        arm=arm,
        workspace=Workspace(
            table_z=TABLE_Z,
            region=config.region,
            home=world.home,
            min_height=config.noise.least_height if config.min_height is None else config.min_height,
            lift_height=config.lift_height,
            grasp_force=config.grasp_force,
            clearance=config.clearance,
        ),
        feeder=world,
        tracker=world,
        board_holder=board_holder,
        physics=physics,
        simulated=True,
    )
