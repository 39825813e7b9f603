"""Parallel building: on all cores, what is up to date is kept, what failed is not tried again."""

import pytest

from mskgrasp.parts import build_part, read_part
from mskgrasp.parts.builtin import recipe_hash
from mskgrasp.parts.catalogue import Index, LeftOut
from mskgrasp.parts.commands.build_parts import build_parts

EMPTY = Index(parts={}, left_out={})
NAMES = ("hex_nut_m20", "parallel_key_b20x12x80", "parallel_pin_12x60", "washer_m36")


@pytest.mark.slow
def test_two_workers_build_what_one_builds(builtin_parts):
    found = {built.name: built for built in build_parts(NAMES, EMPTY, 2)}
    assert set(found) == set(NAMES)
    for name in NAMES:
        assert found[name].entry is not None and found[name].seconds > 0
        assert found[name].entry.content_hash == builtin_parts[name].content_hash


def test_what_is_up_to_date_is_kept_and_what_is_missing_is_built(own_cache):
    build_part("washer_m36")
    before = (own_cache / "washer_m36" / "part.json").stat().st_mtime_ns
    built = {built.name: built.seconds for built in build_parts(NAMES[2:], EMPTY, 1)}
    assert built["washer_m36"] == 0 and built["parallel_pin_12x60"] > 0
    assert (own_cache / "washer_m36" / "part.json").stat().st_mtime_ns == before


def test_a_part_without_one_of_its_files_is_made_again(own_cache):
    build_part("washer_m36")
    (own_cache / "washer_m36" / "hulls.glb").unlink()
    [built] = build_parts(["washer_m36"], EMPTY, 1)
    assert built.seconds > 0 and read_part(own_cache / "washer_m36").n_hulls


def test_a_recipe_that_failed_is_not_tried_again_until_it_changes():
    failed = LeftOut(reason="too thin", recipe_hash=recipe_hash("washer_m36"))
    [built] = build_parts(["washer_m36"], Index(parts={}, left_out={"washer_m36": failed}), 1)
    assert built.entry is None and built.reason == "too thin"
    changed = LeftOut(reason="too thin", recipe_hash="of an older recipe")
    [built] = build_parts(["washer_m36"], Index(parts={}, left_out={"washer_m36": changed}), 1)
    assert built.entry is not None
