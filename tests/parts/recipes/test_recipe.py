"""Our tables of dimensions against those of bd_warehouse, where both know the size."""

import csv
import math
from collections.abc import Iterator
from importlib import resources

import pytest

from mskgrasp.parts.recipes.recipe import table

# Our table, theirs, their standard, {our column: their column}, how much larger theirs may be, least count.
COMPARED = [
    # Both give the largest width across flats and the largest height of a nut.
    ("iso4017_hex_bolt.csv", "hex_head_parameters.csv", "iso4017", {"s_mm": "s"}, 0.01, 6),
    ("iso4032_hex_nut.csv", "hex_nut_parameters.csv", "iso4032", {"m_mm": "m", "s_mm": "s"}, 0.01, 6),
    ("iso4035_thin_nut.csv", "hex_nut_parameters.csv", "iso4035", {"m_mm": "m", "s_mm": "s"}, 0.01, 3),
    ("iso4762_socket_screw.csv", "socket_head_cap_parameters.csv", "iso4762", {"k_mm": "k"}, 0.01, 6),
    ("iso4762_socket_screw.csv", "socket_head_cap_parameters.csv", "iso4762", {"t_mm": "t"}, 0.01, 6),
    (
        "iso7089_washer.csv",
        "plain_washer_parameters.csv",
        "iso7089",
        {"d1_mm": "d1", "d2_mm": "d2"},
        0.01,
        6,
    ),
    (
        "iso7380_button_screw.csv",
        "button_head_parameters.csv",
        "iso7380_1",
        {"dk_mm": "dk", "k_mm": "k"},
        0.01,
        4,
    ),
    ("iso7379_shoulder_screw.csv", "shoulder_screw.csv", "iso7379", {"dk_mm": "dk", "k_mm": "k"}, 0.01, 5),
    (
        "en1665_flange_bolt.csv",
        "hex_head_with_flange_parameters.csv",
        "din1665",
        {"dc_mm": "dc", "s_mm": "s", "c_mm": "c"},
        0.01,
        4,
    ),
    (
        "din6923_flange_nut.csv",
        "hex_nut_with_flange_parameters.csv",
        "din1665",  # so they call it
        {"dc_mm": "dc", "s_mm": "s", "c_mm": "c", "m_mm": "m"},
        0.01,
        4,
    ),
    (
        "din1587_cap_nut.csv",
        "domed_cap_nut_parameters.csv",
        "din1587",
        {"dk_mm": "dk", "s_mm": "s", "m_mm": "m"},
        0.01,
        3,
    ),
    (
        "iso7093_large_washer.csv",
        "plain_washer_parameters.csv",
        "iso7093",
        {"d1_mm": "d1", "d2_mm": "d2"},
        0.01,
        2,
    ),
    (
        "iso10642_countersunk_screw.csv",
        "countersunk_head_parameters.csv",
        "iso10642",
        {"dk_mm": "dk", "t_mm": "t"},
        0.01,
        4,
    ),
    # Ours is the nominal height or thickness, theirs the largest that the tolerance allows.
    ("iso4017_hex_bolt.csv", "hex_head_parameters.csv", "iso4017", {"k_mm": "k"}, 0.6, 6),
    ("iso7089_washer.csv", "plain_washer_parameters.csv", "iso7089", {"h_mm": "h"}, 0.6, 6),
    # Ours is the largest plain head, theirs the largest knurled one.
    ("iso4762_socket_screw.csv", "socket_head_cap_parameters.csv", "iso4762", {"dk_mm": "dk"}, 0.5, 6),
    # Ours is the nominal width of the key, theirs the least width of the socket.
    ("iso4762_socket_screw.csv", "socket_head_cap_parameters.csv", "iso4762", {"s_mm": "s"}, 0.2, 6),
]


def rows_of(file_name: str, standard: str) -> Iterator[tuple[float, dict[str, float]]]:
    """The metric sizes (thread diameter and columns, millimetres) that bd_warehouse knows of a standard."""
    text = (resources.files("bd_warehouse") / "data" / file_name).read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        size = next(iter(row.values()))
        columns = {
            key.strip().removeprefix(f"{standard}:"): float(value)
            for key, value in row.items()
            if key.strip().startswith(f"{standard}:") and number(value)
        }
        if size.startswith("M") and columns:
            yield float(size[1:].split("-")[0]), columns


def number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


@pytest.mark.parametrize(("ours", "theirs", "standard", "columns", "larger", "least"), COMPARED)
def test_sizes_that_both_tables_know_agree(ours, theirs, standard, columns, larger, least):
    known = dict(rows_of(theirs, standard))
    wrong, compared = [], 0
    for row in table(ours):
        if row["d_mm"] in known:
            compared += 1
            for mine, other in columns.items():
                more = known[row["d_mm"]][other] - row[mine]
                if not -0.01 - 1e-9 <= more <= larger + 1e-9:
                    wrong.append((f"M{row['d_mm']:g}", mine, row[mine], known[row["d_mm"]][other]))
    assert compared >= least
    assert not wrong


def test_bearings_have_the_boundary_dimensions_of_their_series():
    # Its ball bearings end at a bore of 10 mm; roller bearings NJ 2xx share the boundary dimensions of 62xx.
    known = {}
    for kind in ("deep_groove_ball", "cylindrical_roller"):
        path = resources.files("bd_warehouse") / "data" / f"single_row_{kind}_bearing_parameters.csv"
        for row in csv.DictReader(path.read_text(encoding="utf-8").splitlines()):
            code = row["SKT:Designation"].strip().removesuffix(" ECP").replace("NJ 2", "62")
            known[code] = [float(row[f"SKT:{key}"]) for key in ("d", "D", "B")]
    rows = [row for row in table("iso15_bearing.csv") if f"{row['code']:g}" in known]
    assert len(rows) >= 2
    for row in rows:
        assert [row["d_mm"], row["D_mm"], row["B_mm"]] == known[f"{row['code']:g}"], row["code"]


def test_keys_have_the_heights_of_the_standard():
    text = (resources.files("bd_warehouse") / "data" / "shaft_key_parameters.csv").read_text(encoding="utf-8")
    known = {float(row["din6885:b"]): float(row["din6885:h"]) for row in csv.DictReader(text.splitlines())}
    rows = [row for row in table("din6885_parallel_key.csv") if row["b_mm"] in known]
    assert len(rows) >= 4
    assert {row["b_mm"]: row["h_mm"] for row in rows} == {row["b_mm"]: known[row["b_mm"]] for row in rows}
