"""Settings of palletizing."""

from __future__ import annotations

import pytest

from mskgrasp.palletize.config import PalletizeConfig


def test_a_malformed_target_is_refused(tmp_path):
    with pytest.raises(ValueError, match="target must be x,y,theta"):
        PalletizeConfig(out=tmp_path, target="0.5;0.1;90")
