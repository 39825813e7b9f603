"""Planners in processes of their own: what they read, and what is said when they fail."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from mskgrasp.core.errors import BadPlanner, NoGraspFound
from mskgrasp.core.geometry import Pose
from mskgrasp.planning.program_planner import ProgramPlanner, write_frame
from tests.planning.hand_made import FRAME
from tests.planning.workspaces import WORKSPACE


@pytest.fixture
def program(tmp_path: Path) -> Iterator:
    """Starts a program of some lines, which finds ``request`` and ``frame`` set for each request."""
    started = []

    def start(lines: str, timeout_s: float = 30.0) -> ProgramPlanner:
        path = tmp_path / f"planner{len(started)}.py"
        path.write_text(
            "import json, sys, time\nimport numpy as np\nfor number, line in enumerate(sys.stdin):\n"
            "    request = json.loads(line)\n    frame = np.load(request['frame'])\n"
            + "".join(f"    {one}\n" for one in lines.splitlines())
        )
        planner = ProgramPlanner(f"{shlex.quote(sys.executable)} {path}", WORKSPACE, timeout_s)
        started.append(planner)
        return planner

    yield start
    for planner in started:
        planner.close()


def ask(planner: ProgramPlanner, seed: int = 0):
    return planner.plan(FRAME, np.random.default_rng(seed))


def answer(values: str) -> str:
    return f"print(json.dumps({values}), flush=True)"


def test_a_frame_is_written_with_all_that_a_planner_needs(tmp_path):
    write_frame(tmp_path / "frame.npz", FRAME, WORKSPACE)
    frame = np.load(tmp_path / "frame.npz", allow_pickle=False)
    assert frame["depth"].dtype == np.float32 and (frame["depth"] == FRAME.depth).all()
    pose = Pose.from_matrix(frame["T_base_camera"])
    assert pose.position == pytest.approx(FRAME.T_base_camera.position)
    assert tuple(frame["region"]) == WORKSPACE.region
    assert (float(frame["table_z"]), float(frame["min_height"])) == (0.0, 0.002)


def test_one_process_answers_request_after_request(program):
    planner = program(
        answer("{'grasp': [float(frame['region'][0]), 0.01 * number, 0.02, 0.3], 'quality': 0.7, "
               "'displacement': [0.001, 0, 0, 0.1], 'point_base': [0.4, 0, 0]}")
    )  # fmt: skip
    first, second = ask(planner), ask(planner)
    assert first.grasp.as_vector() == pytest.approx([WORKSPACE.region[0], 0.0, 0.02, 0.3])
    assert second.grasp.position[1] == pytest.approx(0.01)  # the same process counts on
    assert first.quality == 0.7 and first.displacement_cov is None
    assert first.displacement == pytest.approx([0.001, 0, 0, 0.1])
    assert first.point_base == pytest.approx([0.4, 0, 0])


def test_a_request_has_a_seed_of_the_generator(program):
    planner = program(answer("{'grasp': [0.4, 0.0, 0.02, request['seed'] / 2**31]}"))
    same, again, other = ask(planner, 1), ask(planner, 1), ask(planner, 2)
    assert same.grasp.theta == again.grasp.theta != other.grasp.theta


def test_a_program_may_refuse_a_part(program):
    with pytest.raises(NoGraspFound, match="too wide"):
        ask(program(answer("{'refused': 'too wide'}")))
    assert ask(program(answer("{'grasp': [0.4, 0.0, 0.02, 0], 'refused': None}"))).quality is None


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("print('hello', flush=True)", "must answer a line such as .* got 'hello'"),
        (answer("{'grasp': [0.4, 0.0, 0.02]}"), "must answer a line such as"),
        (answer("{'grasp': [0.4, 0.0, 0.02, 0], 'qality': 1}"), "must answer a line such as"),
        (answer("{'grasp': [0.4, 0.0, 0.02, 0], 'refused': False}"), "must answer a line such as"),
        (answer("{'refused': ' '}"), "must answer a line such as"),
        ("print('[' * 100_000, flush=True)", "must answer a line such as"),
        (answer("[1, 2]"), "must answer a line such as"),
        ("raise RuntimeError('no licence')", r"ended with exit code 1 \(RuntimeError: no licence\)"),
        ("sys.exit(3)", "ended with exit code 3"),
        (
            r"sys.stdout.buffer.write(b'\xe9\n'); sys.stdout.flush()",
            r"must answer .*'\\\\xe9'",
        ),
    ],
)
def test_a_program_that_fails_is_one_line(lines, message, program):
    with pytest.raises(BadPlanner, match=message) as caught:
        ask(program(lines))
    assert "\n" not in str(caught.value)


def test_a_second_line_for_a_request_is_not_taken_for_the_answer_to_the_next(program):
    answered = answer("{'grasp': [0.4, 0.0, 0.02, 0.1 * number]}")
    planner = program(f"{answered}\n{answered}")
    ask(planner)
    deadline = time.monotonic() + 30
    while planner._lines.empty():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    with pytest.raises(BadPlanner, match="more than one line for a request"):
        ask(planner)


def test_a_program_that_does_not_answer_is_ended(program):
    planner = program("time.sleep(60)", timeout_s=1.0)
    for _ in range(2):  # that it was ended is not its own fault
        with pytest.raises(BadPlanner, match="did not answer within 1 s; does it flush"):
            ask(planner)


@pytest.mark.parametrize("child", ["sleep 600", "sleep 600 >/dev/null 2>&1"])
@pytest.mark.parametrize(("ends", "message"), [("wait", "did not answer"), ("exit 1", "exit code 1|did not")])
def test_what_a_program_started_ends_with_it(child, ends, message, tmp_path):
    command = f"sh -c '{child} & echo $! > {tmp_path}/child; {ends}'"
    planner = ProgramPlanner(command, WORKSPACE, timeout_s=1.0)
    with pytest.raises(BadPlanner, match=message):  # a child may keep the output of a program that has ended
        ask(planner)
    planner.close()
    wait_until(lambda: not lives((tmp_path / "child").read_text().strip()))


def test_a_program_its_children_and_its_frames_do_not_outlive_a_killed_run(tmp_path):
    command = f"sh -c 'sleep 600 & echo $! $$ > {tmp_path}/started; wait'"
    (tmp_path / "tmp").mkdir()
    code = (
        "import numpy as np\nfrom mskgrasp.planning.program_planner import ProgramPlanner\n"
        "from tests.planning.hand_made import FRAME\nfrom tests.planning.workspaces import WORKSPACE\n"
        f"ProgramPlanner({command!r}, WORKSPACE).plan(FRAME, np.random.default_rng(0))"
    )
    run = subprocess.Popen([sys.executable, "-c", code], env=os.environ | {"TMPDIR": str(tmp_path / "tmp")})
    wait_until(lambda: run.poll() is not None or (tmp_path / "started").exists())
    started = (tmp_path / "started").read_text().split()
    wait_until(lambda: len(children(run.pid)) == 2)  # one of them cleans up
    run.kill()
    assert run.wait() == -signal.SIGKILL
    wait_until(lambda: not any(map(lives, started)))
    wait_until(lambda: not list((tmp_path / "tmp").iterdir()))


def children(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/task/{pid}/children").read_text().split()


def wait_until(true: Callable[[], bool]) -> None:
    """Wait for what another process does; one that is killed ends when it gets a turn."""
    deadline = time.monotonic() + 30
    while not true():
        assert time.monotonic() < deadline, "it goes on"
        time.sleep(0.05)


def lives(number: str) -> bool:
    """Whether the process runs, and does not only wait for its parent to notice its end."""
    try:
        stat = Path("/proc", number, "stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return stat.rsplit(")", 1)[1].split()[0] != "Z"


def test_a_program_that_closes_its_output_and_runs_on_is_ended():
    planner = ProgramPlanner("sh -c 'exec 1>&-; exec sleep 600'", WORKSPACE, timeout_s=30.0)
    with pytest.raises(BadPlanner, match="closed its output"):
        ask(planner)
    planner.close()


def test_a_program_that_is_missing_is_named():
    planner = ProgramPlanner("no_such_program --fast", WORKSPACE)
    with pytest.raises(BadPlanner, match="'no_such_program --fast' cannot be started"):
        ask(planner)
    planner.close()
