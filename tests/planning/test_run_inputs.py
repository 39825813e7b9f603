from mskgrasp.planning.run_inputs import inputs_of, part_digests
from tests.boxes import make_box


def test_the_digests_name_every_input_and_change_with_its_content(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    make_box(tmp_path / "cache", "block", (0.05, 0.03, 0.02), 0.1)
    cell, models = tmp_path / "cell.yaml", tmp_path / "model"
    models.mkdir()
    for path in (cell, models / "model.json", models / "model.safetensors"):
        path.write_text("first")
    before = inputs_of(cell, models, ["block"])
    assert set(before) == {"cell", "model.json", "model.safetensors", "part block"}
    (models / "model.safetensors").write_text("second")
    after = inputs_of(cell, models, ["block"])
    assert {name for name in before if before[name] != after[name]} == {"model.safetensors"}
    make_box(tmp_path / "other", "block", (0.05, 0.03, 0.021), 0.1)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))
    assert part_digests(["block"]) != {"part block": before["part block"]}


def test_another_folder_with_a_part_of_the_same_name_is_another_input(tmp_path):
    folders = [
        make_box(tmp_path / name, "block", (0.05, 0.03, height), 0.1).folder
        for name, height in (("a", 0.02), ("b", 0.021))
    ]
    first, second = (part_digests([str(folder)]) for folder in folders)
    assert set(first) == set(second) == {"part block"} and first != second
