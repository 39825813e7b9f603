"""The contact sheet: a tile for each part, coloured by its density."""

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from mskgrasp.parts import build_part
from mskgrasp.parts.catalogue import Index, entry_of, make_index
from mskgrasp.parts.figures.sheet import draw_sheet

BRONZE, STEEL = "bushing_20x26x30", "washer_m36"


@pytest.fixture
def index() -> Index:
    for name in (BRONZE, STEEL):
        build_part(name)
    return make_index([entry_of(BRONZE), entry_of(STEEL)], {}, Index(parts={}, left_out={}))


def test_bronze_is_yellow_and_steel_is_blue_in_their_own_tiles(index: Index, tmp_path: Path):
    steps: list[tuple[int, int]] = []
    draw_sheet(index, tmp_path / "sheet.png", 2, lambda done, total: steps.append((done, total)))
    assert steps == [(0, 2), (1, 2), (2, 2)]
    picture = matplotlib.image.imread(tmp_path / "sheet.png")[..., :3]
    tile, top = picture.shape[1] // 16, picture.shape[0] * 62 // 168
    warmth = [
        float(np.median(part[dark]))
        for column in range(2)
        for body in [picture[top:-30, column * tile : (column + 1) * tile]]
        for dark, part in [(body.min(axis=2) < 0.6, body[..., 0] - body[..., 2])]
    ]
    assert warmth[0] > 0.1 and warmth[1] < -0.02
    assert picture[top:, 2 * tile :].min() > 0.99  # no other tile
