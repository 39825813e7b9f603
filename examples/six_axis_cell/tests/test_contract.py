"""Both devices pass the contracts that the built-in ones pass."""

from pathlib import Path

import pytest

from hal import cell_from_yaml
from hal.testing import ArmContract, CameraContract, Station

CELL = Path(__file__).parents[1] / "cell.yaml"
PACE = 20.0


def quick_cell(folder):
    path = folder / "cell.yaml"
    path.write_text(CELL.read_text().replace("driver: six_axis", f"driver: six_axis, pace: {PACE}"))
    return cell_from_yaml(path)


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    cell = quick_cell(tmp_path_factory.mktemp("cell"))
    with cell.arm:
        yield cell


class TestSixAxisArm(ArmContract):
    @pytest.fixture
    def fresh_cell(self, tmp_path):
        return quick_cell(tmp_path)

    @pytest.fixture
    def stop_after_s(self):
        return 0.2 / PACE


class TestDepthCamera(CameraContract):
    @pytest.fixture
    def station(self):
        cell = cell_from_yaml(CELL)
        with cell.camera:
            yield Station(cell.camera, cell.workspace, lambda: cell_from_yaml(CELL).camera)
