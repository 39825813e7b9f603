"""The task as a ManiSkill task: registration, control modes, wrappers, demo."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from pathlib import Path

import gymnasium
import h5py
import numpy as np
import pytest
import torch
from mani_skill.utils.wrappers import RecordEpisode

from mskgrasp.core.errors import BadConfig, BadPart
from tasks import GraspDisplacementEnv


def make(boxes, **options):
    options = dict(parts=[str(boxes["light"].folder)], render_backend="none") | options
    return gymnasium.make("GraspDisplacement-v1", **options)


def test_one_step_is_one_attempt_and_the_reward_is_success(boxes):
    env = make(boxes, obs_mode="state_dict")
    env.reset(seed=3)
    pose = env.unwrapped.part_pose()
    x, y, z = pose.position[0].tolist()
    grasp = np.array([x, y, max(z, 0.0105), 0.0], dtype=np.float32)
    observation, reward, terminated, truncated, info = env.step(grasp)
    assert bool(terminated[0]) and not bool(truncated[0])
    assert float(reward[0]) == float(info["success"][0])
    assert info["displacement"].shape == (1, 4)
    assert observation["extra"]["part_pose"].shape == (1, 7)
    env.close()


def test_the_same_seed_lays_the_part_at_the_same_place(boxes):
    env = make(boxes, obs_mode="none")
    poses = []
    for seed in (7, 8, 7):
        env.reset(seed=seed)
        poses.append(env.unwrapped.part_pose().as_vector())
    assert torch.equal(poses[0], poses[2]) and not torch.equal(poses[0], poses[1])
    env.close()


def test_placing_a_part_begins_the_same_episode_as_a_reset(boxes):
    env = make(boxes, obs_mode="none", noise=dict(arm_position_std=0.001, friction_pad_part=(0.4, 0.5)))
    base = env.unwrapped
    found = []
    for begin, seed in itertools.product((lambda seed: base.reset(seed=seed), base.begin_episode), (7, 8)):
        begin(seed)
        pose = base.part_pose().as_vector()
        x, y, _ = pose[0, :3].tolist()
        outcome = base.try_grasp(torch.tensor([[x, y, 0.015, 0.1 * seed]]))
        found.append(torch.cat([pose[0], outcome["pose_tcp_obj_after"][0], outcome["width_after"]]))
    assert torch.equal(found[0], found[2]) and torch.equal(found[1], found[3])
    assert not torch.equal(found[0], found[1])
    env.close()


@pytest.mark.parametrize("mode", ["pd_joint_pos", "pd_ee_delta_pose"])
def test_in_the_usual_control_modes_the_hand_follows_and_nothing_is_lifted(boxes, mode):
    env = make(boxes, obs_mode="state", control_mode=mode)
    env.reset(seed=0)
    base = env.unwrapped
    joints = base.agent.robot.get_qpos()[0, :7].clone()
    start = base.tcp_pose().position[0].clone()
    if mode == "pd_joint_pos":
        goal = joints + torch.tensor([0.1, 0, 0, 0, 0, 0, 0])
        action = torch.cat([goal, torch.ones(1)])
    else:
        action = torch.tensor([0, 0, 0.1, 0, 0, 0, 1.0])  # of 0.1 m a step: up by 1 cm
    for _ in range(10):
        _, reward, _, _, info = env.step(action.numpy())
    if mode == "pd_joint_pos":
        assert float((base.agent.robot.get_qpos()[0, :7] - goal).abs().max()) < 0.01
    else:
        moved = base.tcp_pose().position[0] - start
        assert float(moved[2]) == pytest.approx(0.1, abs=0.02) and float(moved[:2].norm()) < 0.01
    assert not bool(info["success"][0]) and float(reward[0]) == 0.0
    env.close()


@pytest.mark.parametrize(("mode", "friction"), [("pd_joint_delta_pos", 0.4), ("pd_ee_delta_pose", 0.1)])
def test_in_the_usual_control_modes_the_table_brakes_a_part_as_coulomb_says(boxes, mode, friction):
    env = make(boxes, obs_mode="none", control_mode=mode, physics=dict(friction_table_part=friction))
    base = env.unwrapped
    assert isinstance(base, GraspDisplacementEnv)
    env.reset(seed=0)
    rest = np.zeros(env.action_space.shape, np.float32)
    env.step(rest)
    start, speed = base.part_pose().position, 0.2
    base.part.set_linear_velocity(torch.tensor([0.0, speed, 0.0]))
    for _ in range(6):
        env.step(rest)
    way = float((base.part_pose().position - start).norm())
    env.close()
    assert way == pytest.approx(speed**2 / (2 * friction * 9.81), rel=0.03)


def test_state_can_be_saved_and_restored(boxes):
    env = make(boxes, obs_mode="none")
    base = env.unwrapped
    assert isinstance(base, GraspDisplacementEnv)
    env.reset(seed=0)
    state = base.get_state_dict()
    pose = base.part_pose().as_vector()
    env.reset(seed=1)
    base.set_state_dict(state)
    assert torch.allclose(base.part_pose().as_vector(), pose, atol=1e-6)
    x, y, z = pose[0, :3].tolist()
    *_, info = env.step(np.array([x, y, max(z, 0.0105), 0.0], dtype=np.float32))
    assert "displacement" in info
    base.set_state_dict(state)
    assert "displacement" not in base.get_info()  # that was the outcome of the attempt before
    env.close()


def test_the_table_does_not_brake_a_part_that_a_restored_state_puts_into_the_air(env):
    env.reset(seed=0)
    env.motion.step(20)
    state = env.get_state_dict()
    flying = state["actors"]["part"].clone()
    flying[0, 2] += 0.1
    flying[0, 7] = 0.3
    env.set_state_dict({"actors": {"part": flying}})
    env.motion.step()
    assert float(env.part.linear_velocity[0, 0]) == pytest.approx(0.3, rel=1e-5)
    assert np.asarray(env.part.angular_velocity[0]) == pytest.approx(flying[0, 10:].numpy(), abs=1e-5)


def test_record_episode_writes_a_trajectory(boxes, tmp_path):
    env = RecordEpisode(
        make(boxes, obs_mode="state"), str(tmp_path), save_video=False, trajectory_name="grasps"
    )
    env.reset(seed=0)
    env.step(np.array([0.5, 0.0, 0.02, 0.0], dtype=np.float32))
    env.close()
    episodes = json.loads((tmp_path / "grasps.json").read_text())["episodes"]
    assert len(episodes) == 1
    with h5py.File(tmp_path / "grasps.h5") as file:
        assert file["traj_0/actions"].shape == (1, 4)
        assert file["traj_0/env_states/actors/part"].shape == (2, 13)


@pytest.mark.slow
def test_maniskills_demo_finds_and_runs_the_task():
    command = [sys.executable, "-m", "mani_skill.examples.demo_random_action"]
    command += ["-e", "tasks:GraspDisplacement-v1", "--quiet", "-o", "state", "--render-mode", "none"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, cwd=Path(__file__).parents[2])
    assert done.returncode == 0, done.stderr[-2000:]


def test_wrong_settings_are_named(boxes):
    with pytest.raises(BadConfig, match=r"rate_hz.*greater than or equal to 100"):
        make(boxes, physics=dict(rate_hz=90))
    with pytest.raises(BadConfig, match="unknown key 'gravitiy'"):
        make(boxes, physics=dict(gravitiy=9.8))
    with pytest.raises(BadPart, match="no_such_part"):
        make(boxes, parts=["no_such_part"])


def test_on_a_gpu_a_part_of_more_hulls_than_there_is_room_for_is_refused(boxes, monkeypatch):
    made = make(boxes, obs_mode="none").unwrapped
    monkeypatch.setattr(
        type(made), "gpu_sim_enabled", True
    )  # there is none: what is drawn up, not what it does
    with pytest.raises(BadConfig, match="this environment's memory is for 1: name the part when"):
        made._load_scene({"parts": ["hex_nut_m30"]})
    monkeypatch.undo()
    made.close()


def test_other_parts_without_a_new_scene_are_refused(env):
    with pytest.raises(BadConfig, match="other parts are loaded with reconfigure=True alone"):
        env.reset(seed=0, options=dict(parts=["hex_nut_m30"]))


def test_wrong_options_of_a_reset_and_wrong_actions_are_refused(boxes):
    env = make(boxes, obs_mode="none")
    env.reset(seed=0)
    for options in (dict(pose_base_objct=[0.5, 0, 0.02, 1, 0, 0, 0]), dict(pose_base_obj=np.zeros(7))):
        with pytest.raises(BadConfig, match=next(iter(options))):
            env.reset(options=options)
    with pytest.raises(BadConfig, match=r"is \(1, 4\), x y z theta; got \(2, 4\)"):
        env.unwrapped.step(np.zeros((2, 4)))
    env.close()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (dict(region=(0.2, 1.2, -0.6, 0.6)), "the camera sees 0.35 m of the table, less than the region"),
        (dict(region=(0.6, 0.4, -0.1, 0.1)), "region must be x_min < x_max"),
        (
            dict(camera=dict(height=0.31, n_pixels=424), parts=["l_bracket_140x60"]),
            "camera.height 0.31 is too low for l_bracket_140x60, of up to 0.140 m: at least 0.34",
        ),
        pytest.param(
            dict(num_envs=2), "2 scenes need PhysX on a GPU",
            marks=pytest.mark.skipif(torch.cuda.is_available(), reason="this machine has a GPU"),
        ),
    ],
)  # fmt: skip
def test_what_the_camera_or_the_machine_cannot_do_is_refused_when_the_task_is_made(boxes, settings, message):
    with pytest.raises(BadConfig, match=message):
        make(boxes, obs_mode="none", **settings)
