"""Part folders: the same bytes every time, whole or not at all, refused when damaged."""

import json
import multiprocessing
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import trimesh

import mskgrasp.parts
from mskgrasp.core.errors import BadPart, UnknownPart
from mskgrasp.parts import build_part, find_part, parts_folder, read_part, store
from mskgrasp.parts.importing.import_file import import_part, part_of_file

FILES = ("mesh.ply", "hulls.glb", "part.json")


def contents(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in FILES}


def test_the_public_names_exist():
    assert all(hasattr(mskgrasp.parts, name) for name in mskgrasp.parts.__all__)


def test_the_package_needs_neither_torch_nor_sapien():
    code = "import sys, mskgrasp.parts; print({'torch', 'sapien', 'coacd', 'matplotlib'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "set()"


def test_parts_lie_in_the_users_cache_folder(own_cache, monkeypatch):
    assert parts_folder() == own_cache
    for unusable in ("", "relative/path"):
        monkeypatch.setenv("XDG_CACHE_HOME", unusable)
        assert parts_folder() == Path.home() / ".cache" / "mskgrasp" / "parts"


def test_building_twice_from_nothing_gives_the_same_bytes(builtin_parts):
    for name in ("spur_gear_m2_z18", "hinge_60x30"):
        assert contents(build_part(name).folder) == contents(builtin_parts[name].folder)


def test_a_part_that_is_up_to_date_is_not_built_again():
    folder = build_part("washer_m36").folder
    before = {name: (folder / name).stat().st_mtime_ns for name in FILES}
    build_part("washer_m36")
    assert {name: (folder / name).stat().st_mtime_ns for name in FILES} == before


def test_a_part_of_another_recipe_is_built_again():
    folder = build_part("washer_m36").folder
    good = contents(folder)
    record = json.loads(good["part.json"])
    record["recipe_hash"] = "0" * 64
    (folder / "part.json").write_text(json.dumps(record))
    build_part("washer_m36")
    assert contents(folder) == good


@pytest.mark.parametrize("file_name", FILES)
def test_a_truncated_file_is_refused_when_loaded_and_rebuilt(file_name):
    folder = build_part("washer_m36").folder
    good = contents(folder)
    (folder / file_name).write_bytes(good[file_name][:-50])
    with pytest.raises(BadPart, match="build or import the part again"):
        read_part(folder)
    find_part("washer_m36")
    assert contents(folder) == good


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("mass", -1.0),
        ("mass", "heavy"),
        ("mass", 10**400),
        ("hull_error", float("nan")),
        ("inertia", [[1, 2], [3, 4]]),
        ("resting_probability", []),
        ("resting_probability", [0.2]),
        ("resting", {"position": [[0, 0, 0]]}),
        ("dimensions", None),
        ("schema_version", 99),
        ("name", 3),
        ("name", "../elsewhere"),
        ("quat_obj_principal", [0, 0, 0, 0]),
    ],
)
def test_a_damaged_record_is_refused_in_one_line(key, value):
    folder = build_part("washer_m36").folder
    record = json.loads((folder / "part.json").read_text())
    record[key] = value
    (folder / "part.json").write_text(json.dumps(record))
    with pytest.raises(BadPart) as caught:
        read_part(folder)
    assert "\n" not in str(caught.value) and str(folder) in str(caught.value)


def test_a_folder_without_its_files_is_refused(tmp_path):
    with pytest.raises(BadPart, match="mesh.ply is missing"):
        read_part(tmp_path)
    with pytest.raises(BadPart, match="is missing"):
        read_part(tmp_path / "nowhere")


def test_a_file_that_leads_out_of_the_folder_is_refused(tmp_path):
    folder = build_part("washer_m36").folder
    outside = tmp_path / "mesh.ply"
    (folder / "mesh.ply").rename(outside)
    (folder / "mesh.ply").symlink_to(outside)
    with pytest.raises(BadPart, match="leads out of its folder"):
        read_part(folder)


def test_a_part_is_found_by_name_and_by_folder(own_cache):
    part = find_part("washer_m36")
    assert part.folder == own_cache / "washer_m36"
    assert find_part(part.folder).content_hash == part.content_hash
    assert find_part(str(part.folder)).content_hash == part.content_hash


def test_an_unknown_name_lists_similar_ones():
    with pytest.raises(BadPart, match="did you mean hex_nut_m30"):
        find_part("hexnut_m30")
    for name in ("..", "", "no/such/place", "Ω"):
        with pytest.raises(BadPart):
            find_part(name)


def test_a_folder_that_holds_no_part_is_a_wrong_command(tmp_path):
    with pytest.raises(UnknownPart, match=r"is not a part folder: .* is missing") as raised:
        find_part(tmp_path)
    assert raised.value.exit_code == 2


def test_what_a_killed_build_left_is_swept_away_later(own_cache):
    abandoned, recent = own_cache / ".tmp-washer_m36-1", own_cache / ".tmp-washer_m36-2"
    abandoned.mkdir(parents=True)
    recent.mkdir()
    os.utime(abandoned, (time.time() - 7200,) * 2)
    build_part("washer_m36")
    assert not abandoned.exists() and recent.exists()


@pytest.mark.slow
def test_a_killed_build_leaves_whole_parts_only(own_cache):
    build = subprocess.Popen([sys.executable, "-m", "mskgrasp.parts", "build"], stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while not list(own_cache.glob("[a-z]*")) and time.monotonic() < deadline:
        time.sleep(0.001)
    build.kill()
    build.wait()
    finished = list(own_cache.glob("[a-z]*"))
    assert 1 <= len(finished) < 25
    assert all(read_part(folder).name == folder.name for folder in finished)


def _hash_of(name: str) -> str:
    return build_part(name).content_hash


@pytest.mark.slow
def test_two_processes_may_build_the_same_part_at_once(own_cache, builtin_parts):
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        hashes = pool.map(_hash_of, ["hex_nut_m20"] * 4, chunksize=1)
    assert set(hashes) == {builtin_parts["hex_nut_m20"].content_hash}
    assert [path.name for path in own_cache.iterdir()] == ["hex_nut_m20"]


def test_a_part_is_found_while_another_process_replaces_it(tmp_path, monkeypatch):
    file = tmp_path / "box.stl"
    trimesh.creation.box((1, 0.5, 0.4)).export(file)
    part = import_part(file, unit="in", density=2700.0)
    moved, rename = threading.Event(), os.rename

    def slow(source: Path, target: Path) -> None:
        rename(source, target)
        if source == part.folder:
            moved.set()
            time.sleep(0.05)

    monkeypatch.setattr(store.os, "rename", slow)
    for find in (find_part, part_of_file):
        moved.clear()
        replacing = threading.Thread(target=import_part, args=[file], kwargs=dict(unit="in", density=1050.0))
        replacing.start()
        assert moved.wait(10)
        found = find(part.name if find is find_part else file)
        replacing.join()
        assert (found.density, found.extents) == (1050.0, pytest.approx(part.extents))
        import_part(file, unit="in", density=2700.0)


def test_a_part_is_read_whole_while_its_folder_is_replaced_again_and_again(tmp_path):
    part = build_part("washer_m36")
    first = contents(part.folder)
    record = json.loads(first["part.json"]) | {"density": 1.0, "mass": 2.0}
    record["content_hash"] = store.content_hash(first["mesh.ply"], first["hulls.glb"], record)
    second = first | {"part.json": json.dumps(record).encode()}
    stop = threading.Event()

    def replace() -> None:
        while not stop.is_set():
            for files in (second, first):
                store._put(part.folder.parent, part.name, files)

    replacing = threading.Thread(target=replace)
    replacing.start()
    try:
        found = {(one.density, one.mass) for one in (read_part(part.folder) for _ in range(200))}
    finally:
        stop.set()
        replacing.join()
    assert found <= {(part.density, part.mass), (1.0, 2.0)}


def test_a_damaged_part_is_reported_without_waiting(monkeypatch):
    folder = build_part("washer_m36").folder
    (folder / "mesh.ply").write_bytes(b"ply")
    monkeypatch.setattr(store.time, "sleep", lambda seconds: pytest.fail("waits"))
    with pytest.raises(BadPart, match="do not match the hash"):
        read_part(folder)
    (folder / "mesh.ply").unlink()
    with pytest.raises(BadPart, match="mesh.ply is missing"):
        read_part(folder)


def test_arrays_of_a_part_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        build_part("washer_m36").inertia[0, 0] = 1.0
