import shutil

import pytest

from mskgrasp.core.errors import BadPart, UnknownPart
from mskgrasp.core.shipped import example_file
from mskgrasp.parts import builtin, find_part, load_part, read_part, store
from mskgrasp.parts.recipes import cad


def test_a_cad_file_a_name_and_a_folder_give_the_same_part():
    from_file = load_part(example_file("bracket.stl"), unit="mm")
    assert from_file.name == "example_bracket" and 0.01 < from_file.longest_axis < 0.2
    for source in ("example_bracket", from_file.folder):
        assert load_part(source).content_hash == from_file.content_hash
        with pytest.raises(BadPart, match="is no CAD file, whose unit could be in: leave unit out"):
            load_part(source, unit="in")
    assert read_part(from_file.folder).mass == from_file.mass


def test_a_file_that_is_not_there_is_named_as_a_file(tmp_path, monkeypatch):
    with pytest.raises(UnknownPart, match=r"there is no file .*bracket\.STL; check the path"):
        load_part(tmp_path / "bracket.STL")
    with pytest.raises(UnknownPart, match="check the path, or name the part hex_nut_m30"):
        find_part("hex_nut_m30.stl")
    file = example_file("bracket.stl")
    assert file is not None
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(UnknownPart, match=r"bracket\.stl is a CAD file: import it, .*, and name the part"):
        find_part(file)
    (store.parts_folder() / "bracket").mkdir(parents=True)
    with pytest.raises(UnknownPart, match=r"bracket\.stl is a CAD file: name the part bracket, or import"):
        find_part(file)


def test_a_folder_stays_that_part_where_its_bare_name_is_another_ones(tmp_path, monkeypatch):
    folder = shutil.copytree(find_part("washer_m36").folder, tmp_path / "hex_nut_m30")
    monkeypatch.chdir(tmp_path)
    found = find_part("./hex_nut_m30")
    assert found.folder == folder and found.name == "washer_m36"
    assert find_part(str(found.folder)).content_hash == found.content_hash  # as a worker looks it up
    assert find_part("hex_nut_m30").name == "hex_nut_m30"


def test_an_unknown_name_lists_similar_ones():
    with pytest.raises(UnknownPart, match=r"hex_nut_m3.*did you mean .*hex_nut_m30"):
        load_part("hex_nut_m3x")


def test_a_part_that_is_drawn_in_cad_names_the_extra_where_it_is_missing(monkeypatch):
    name = next(recipe.name for recipe in cad.recipes())
    monkeypatch.setattr(cad, "available", lambda: False)
    builtin._recipes.cache_clear()
    try:
        with pytest.raises(UnknownPart, match=f"{name} is drawn in CAD.*run EXTRAS=dev,cad .ci/setup"):
            find_part(name)
    finally:
        builtin._recipes.cache_clear()
