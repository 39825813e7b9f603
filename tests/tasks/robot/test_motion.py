from __future__ import annotations

import numpy as np
import pytest
import torch

from mskgrasp.core.grasp import TABLE_CLEARANCE, lowest_grasp_z
from mskgrasp.core.minimum_jerk import minimum_jerk_steps
from mskgrasp.core.settings import Physics
from tasks.attempt.attempt import AHEAD
from tasks.robot.motion import PandaMotion, run_up

SOFT = {"finger_stiffness": 2000.0, "finger_damping": 50.0}


@pytest.mark.parametrize(
    "depth", [0.005, *(pytest.param(depth, marks=pytest.mark.slow) for depth in (0.02, 0.06)), 0.15]
)
@pytest.mark.parametrize("place", [(0.4, -0.1), (0.5, 0.0), (0.6, 0.1)])
def test_a_descent_overshoots_by_less_than_half_the_table_clearance(env, boxes, depth, place):
    far = np.array([[0.5, -0.5, 0.015, 1, 0, 0, 0]])
    env.reset(seed=0, options=dict(parts=[str(boxes["light"].folder)], reconfigure=True, pose_base_obj=far))
    goal = torch.tensor([[*place, lowest_grasp_z(0.0) + 0.05, 0.5]])
    start = goal + torch.tensor([0.0, 0.0, depth, 0.0])
    path = env.attempt._line(start, goal, env.physics.descend_speed)
    env.motion.place(path[0])
    env.motion.step(20)
    heights = []
    env.motion.follow(
        path, check=lambda _: heights.append(float(env.tcp_pose().position[0, 2])), check_every=1
    )
    for _ in range(60):
        env.motion.step()
        heights.append(float(env.tcp_pose().position[0, 2]))
    assert float(goal[0, 2]) - min(heights) < TABLE_CLEARANCE / 2
    assert heights[-1] == pytest.approx(float(goal[0, 2]), abs=1e-4)


def test_steps_are_coarse_as_long_as_they_are_asked_to_be(env, place):
    place("lead")
    motion, scene = env.motion, env.scene
    began = motion.seconds
    with pytest.raises(KeyboardInterrupt), motion.coarsely():
        assert (motion.rate_hz, scene.timestep, motion.n_steps(0.1)) == (500, pytest.approx(0.002), 50)
        motion.step(50)
        raise KeyboardInterrupt
    assert (motion.rate_hz, scene.timestep, motion.n_steps(0.1)) == (1000, pytest.approx(0.001), 100)
    motion.step(100)
    assert motion.seconds - began == pytest.approx(0.2)


@pytest.mark.parametrize("part", ["feather", "light", "lead"])
def test_parts_are_lifted_coarsely_and_observed_finely(env, attempt, monkeypatch, part):
    found: list[tuple[str, int, float]] = []
    for name in ("step", "move_fingers", "follow"):
        inner = getattr(PandaMotion, name)

        def noted(self, *given, inner=inner, name=name, **named):
            began = self.seconds
            result = inner(self, *given, **named)
            found.append((name, self.rate_hz, self.seconds - began))
            return result

        monkeypatch.setattr(PandaMotion, name, noted)
    outcome = attempt((0.5, 0.0, 0.02, 0.0), part=part, at=(0.5, 0.004), turn=0.1)
    assert bool(outcome["success"])
    assert outcome["penetration"] < 1e-3
    assert [rate for name, rate, _ in found if name == "move_fingers"] == [1000]
    # Take-off, and the rest of the lift.
    assert [rate for name, rate, _ in found if name == "follow"] == [1000, 500]
    assert found[0][:2] == ("step", 1000)  # it settles
    assert found[-1] == ("step", 1000, pytest.approx(0.02))


def test_a_part_in_the_hand_gets_more_iterations(env, place, monkeypatch):
    place("light")
    arm, physics = env.agent.robot._objs[0], env.physics.model_copy(update={"position_iterations": 25})
    monkeypatch.setattr(env.motion, "_physics", physics)
    counts = []
    for holding in (False, True, False):
        env.motion.hold(holding)
        counts.append(arm.solver_position_iterations)
    assert counts == [physics.position_iterations, physics.hold_iterations, physics.position_iterations]


def test_running_fingers_move_as_those_that_began_long_ago(env, place):
    place("light")
    motion, robot = env.motion, env.agent.robot
    home = torch.as_tensor(env.agent.rest_qpos[None, :7], dtype=torch.float64)

    def ramp(opening: float, running: bool, until: float) -> np.ndarray:
        """(steps, 2) places of both fingers."""
        motion.place(home, torch.tensor([opening]))
        motion.run_fingers(torch.tensor([running]))
        start, places = motion.finger_target, []
        # The mean of a step's iterations is aimed at.
        within = (1 - 1 / env.physics.position_iterations) / 2
        while not places or places[-1].mean() > until:
            steps = len(places) + 1 - within
            motion.set_fingers(start - steps * env.physics.finger_speed / motion.rate_hz)
            motion.step()
            places.append(robot.get_qpos()[0, 7:9].numpy())
        return np.array(places)

    slow, quick = ramp(0.08, False, 0.006), ramp(0.03, True, 0.006)
    speed = env.physics.finger_speed
    assert np.diff(quick, axis=0) * motion.rate_hz == pytest.approx(-speed, rel=2e-3)
    # The last centimetre takes both as many steps.
    steps = [(places.mean(axis=1) < 0.014).sum() for places in (slow, quick)]
    assert abs(int(steps[0]) - int(steps[1])) <= 1
    assert ramp(0.03, False, 0.0148)[0] == pytest.approx(0.015, abs=2e-5), (
        "fingers that do not run start at rest"
    )


def test_in_an_attempt_fingers_begin_near_the_part_and_run_as_if_they_had_come_all_the_way(
    env, attempt, monkeypatch
):
    places: list[np.ndarray] = []
    move, step = PandaMotion.move_fingers, PandaMotion.step

    def watched(self, *given, **named):
        def looked(motion, n_steps=1):
            step(motion, n_steps)
            places.append(motion._agent.robot.get_qpos()[0, 7:9].numpy())

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(PandaMotion, "step", looked)
            return move(self, *given, **named)

    monkeypatch.setattr(PandaMotion, "move_fingers", watched)
    attempt((0.5, 0.0, 0.02, 0.0))  # a block 20 mm wide in the middle
    first = np.array(places[:10])
    pace = env.physics.finger_speed / env.physics.rate_hz
    assert ((0.010 + AHEAD - pace < first[0]) & (first[0] < 0.010 + AHEAD)).all()
    assert np.diff(first, axis=0) * env.physics.rate_hz == pytest.approx(-env.physics.finger_speed, rel=5e-3)
    places.clear()
    monkeypatch.setattr(env, "physics", env.physics.model_copy(update={"skip_air": False}))
    attempt((0.5, 0.0, 0.02, 0.0))
    # The same places, step by step, to micrometres: a fiftieth of what a step closes.
    whole = np.array(places)
    begin = int(np.abs(whole - first[0]).sum(axis=1).argmin())
    assert begin > 100
    assert whole[begin : begin + 10] == pytest.approx(first, abs=2e-6)


@pytest.mark.parametrize(
    ("drive", "millimetres"),
    [
        ({}, (1.95, 2.25)),
        (SOFT, (3.7, 4.5)),
        (SOFT | {"finger_armature": 1.0}, (12.0, 14.5)),
        (SOFT | {"finger_damping": 500.0}, (75.0, 90.0)),
        ({"finger_damping": 0.0}, (np.inf, np.inf)),
    ],
)
def test_the_run_up_of_fingers_is_that_of_their_drives(drive, millimetres):
    physics = Physics(**drive)
    way = 1e3 * run_up(physics)
    assert millimetres[0] <= way <= millimetres[1]
    if not np.isfinite(way):
        return
    # The drive itself, integrated: what is missing of its steady lag after that way is under two hundredths.
    mass, dt = physics.finger_armature + 0.015, 1e-5
    lag = speed = 0.0
    for _ in range(round(way * 1e-3 / physics.finger_speed / dt)):
        pull = physics.finger_stiffness * lag - physics.finger_damping * speed
        speed += dt * pull / mass
        lag += dt * (physics.finger_speed - speed)
    assert lag == pytest.approx(
        physics.finger_damping / physics.finger_stiffness * physics.finger_speed, rel=0.02
    )


@pytest.mark.parametrize("at", [(0.5, 0.0, 0.15), (0.503, 0.006, -0.2), (0.498, -0.008, 0.02)])
def test_a_coarse_lift_leaves_a_block_where_a_fine_one_does(env, attempt, monkeypatch, at):
    *place, turn = at
    coarse = attempt((0.5, 0.0, 0.02, 0.0), part="lead", at=place, turn=turn)
    fine = env.physics.model_copy(update={"coarse_rate_hz": env.physics.rate_hz})
    monkeypatch.setattr(env, "physics", fine)
    whole = attempt((0.5, 0.0, 0.02, 0.0), part="lead", at=place, turn=turn)
    assert bool(coarse["success"]) and bool(whole["success"])
    difference = (coarse["displacement"] - whole["displacement"]).abs()
    assert difference[:3].max() < 5e-5 and difference[3] < 1e-3


def test_an_arm_arrives_exactly_and_keeps_its_fingers(env, place):
    place("light")
    motion, robot = env.motion, env.agent.robot
    goal = torch.tensor([[0.5, 0.05, 0.08, 0.4]])
    path = env.attempt._line(goal + torch.tensor([0.0, 0.0, 0.05, 0.0]), goal, env.physics.descend_speed)
    motion.place(path[0], torch.tensor([0.05]))
    motion.follow(path)
    short = np.abs(robot.get_qpos()[0, :7].numpy() - path[-1, 0])
    motion.arrive(torch.tensor([False]))
    assert np.abs(robot.get_qpos()[0, :7].numpy() - path[-1, 0]).max() < 1e-6 < short.max()
    assert not robot.get_qvel()[0, :7].any()
    assert robot.get_qpos()[0, 7:9].numpy() == pytest.approx(0.025, abs=1e-5)
    tcp = env.tcp_pose().position[0].numpy()
    assert tcp == pytest.approx(goal[0, :3].numpy(), abs=2e-6)


def test_a_hand_that_rests_on_the_part_is_not_pressed_into_it(env, attempt, monkeypatch):
    overlaps: list[float] = []
    short: list[float] = []
    # A pad of the open hand would end 0.07 mm inside the block; no reflex ends the descent before.
    monkeypatch.setattr(env, "physics", env.physics.model_copy(update={"reflex_force": 1e3}))
    z = 0.03 + 0.0095 - 0.00007

    def looked(self, *given, **named):
        overlaps.append(float(env.contacts.penetration()[0]))
        short.append(float(env.tcp_pose().position[0, 2]) - z)
        return move(self, *given, **named)

    move = PandaMotion.move_fingers
    monkeypatch.setattr(PandaMotion, "move_fingers", looked)
    attempt((0.5, 0.0, z, 0.0), part="heavy", at=(0.5, 0.045))
    assert len(overlaps) == 1
    assert overlaps[0] < 2e-5
    assert short[0] > 5e-5


def test_an_arm_that_its_reflex_has_stopped_is_not_put_where_it_was_sent(env, place):
    place("light")
    motion, robot = env.motion, env.agent.robot
    home = torch.as_tensor(env.agent.rest_qpos[None, :7], dtype=torch.float64)
    motion.place(home)
    motion.set_arm(home + 0.3, torch.zeros(1, 7))
    motion.arrive(torch.tensor([True]))
    assert np.abs(robot.get_qpos()[0, :7].numpy() - home[0].numpy()).max() < 0.29


def test_where_an_arm_is_on_its_path_does_not_depend_on_the_rate(env, place, monkeypatch):
    """Aimed at the ends of its steps it would be ahead, the more the longer they are."""
    goal = np.array([[0.5, 0.05, 0.15, 0.0]])

    def leads(rate: int) -> tuple[np.ndarray, np.ndarray]:
        """How far the hand is ahead of its path, every 20 ms, m; and the path's speed then, m/s."""
        place("light")
        motion = env.motion
        monkeypatch.setattr(motion, "rate_hz", rate)
        env.scene.timestep = 1 / rate
        path = env.attempt._line(goal - [0, 0, 0.1, 0], goal, 0.25)
        heights = 0.05 + 0.1 * minimum_jerk_steps(len(path))
        motion.place(path[0])
        found: list[float] = []
        every = rate // 50
        motion.follow(
            path,
            check=lambda i: found.append(float(env.tcp_pose().position[0, 2]) - heights[i]),
            check_every=every,
        )
        env.scene.timestep = 1 / env.physics.rate_hz
        speeds = np.gradient(heights) * rate
        return np.array(found), speeds[every - 1 :: every]

    (finest, speeds), (fine, _), (coarse, _) = leads(1000), leads(500), leads(250)
    n = min(len(finest), len(fine), len(coarse))
    assert n > 20
    assert np.abs(fine[:n] - coarse[:n]).max() < 3e-5
    # In iterations of 20 us joints that turn in float32 jitter by some 20 um: the mean is to be the same.
    for other in (fine, coarse):
        assert np.abs(other[:n] - finest[:n]).max() < 6e-5
        seconds = (other[:n] - finest[:n]) @ speeds[:n] / (speeds[:n] @ speeds[:n])
        assert abs(seconds) < 1e-4
