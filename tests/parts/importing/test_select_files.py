"""Selection of CAD files by paths, folders and patterns."""

from pathlib import Path

import pytest

from mskgrasp.parts.importing.select_files import select_files


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    root = tmp_path / "cad"
    (root / "deep").mkdir(parents=True)
    for name in ("b.stl", "a.step", "readme.txt", "deep/c.obj"):
        (root / name).write_text("x")
    return root


def test_a_folder_gives_its_own_cad_files_by_name_and_lists_the_rest(folder):
    found = select_files([folder])
    assert [path.name for path in found.files] == ["a.step", "b.stl"]
    assert [path.name for path in found.skipped] == ["readme.txt"]
    assert found.refused == ()


def test_a_pattern_descends_and_no_file_is_selected_twice(folder):
    found = select_files([folder / "b.stl", folder / "**" / "*.*", folder])
    assert [path.name for path in found.files] == ["b.stl", "a.step", "c.obj"]


def test_links_out_of_a_folder_are_refused_unless_the_user_names_them(folder, tmp_path):
    (tmp_path / "outside.stl").write_text("x")
    (folder / "link.stl").symlink_to(tmp_path / "outside.stl")
    (folder / "dangling.stl").symlink_to(folder / "nowhere.stl")
    reasons = {path.name: reason for path, reason in select_files([folder]).refused}
    assert "leads out of" in reasons["link.stl"] and "does not exist" in reasons["dangling.stl"]
    assert select_files([folder / "link.stl"]).files == (folder / "link.stl",)


def test_nothing_that_matches_is_a_refusal_with_a_remedy(tmp_path):
    (tmp_path / "empty").mkdir()
    asked = [tmp_path / "empty", tmp_path / "*.stl", tmp_path / "nothere", tmp_path / "gone.stl"]
    found = select_files(asked)
    reasons = [reason for _, reason in found.refused]
    assert "holds no CAD file" in reasons[0] and "no file matches" in reasons[1] and not found.files
    for path, said in zip(asked[2:], reasons[2:], strict=True):
        assert f"there is no file or folder {path}" in said
