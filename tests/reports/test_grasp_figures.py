import cv2
import numpy as np

from mskgrasp.reports.grasp_figures import draw_contact_sheet
from tests import synthetic


def test_a_contact_sheet_shows_held_and_failed_attempts(tmp_path):
    attempts = synthetic.random_attempts(8, (0.05, 0.02, 0.03), np.random.default_rng(3))
    path = tmp_path / "sheet.png"
    draw_contact_sheet([(attempts, synthetic.info("box"), row) for row in range(8)], path, title="Boxes")
    picture = cv2.imread(str(path))
    assert picture is not None and picture.std() > 10
