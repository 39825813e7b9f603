"""Values of options."""

from __future__ import annotations

from collections.abc import Callable

from tests.inputs.row import Place, Row

NUT = ["--parts", "hex_nut_m30"]


def _words(*words: str) -> Callable[[Place], list[str]]:
    return lambda at: list(words)


def _full(at: Place) -> str:
    at.file("full/thesis.tex", "mine")
    return str(at.folder / "full")


ROWS = [
    Row(
        "collect",
        "a million million attempts",
        _words("--attempts-per-part", "1000000000000"),
        "--attempts-per-part: .*less than or equal to",
    ),
    Row(
        "collect",
        "a number of attempts that is no integer",
        _words("--attempts-per-part", "1e12"),
        "--attempts-per-part needs",
    ),
    Row(
        "collect",
        "more shards than a disk holds",
        _words("--attempts-per-part", "1000000", "--shard-size", "1", *NUT),
        "1,000,000 files, at most 200,000 are written; raise shard_size",
    ),
    Row("collect", "an image of three pixels", _words("--camera.n-pixels", "3"), "--camera.n-pixels: "),
    Row("collect", "a negative number of workers", _words("--workers", "-1"), "--workers: "),
    Row(
        "collect",
        "a bound that is no number",
        _words("--part-filter.min-length", "nan"),
        "--part-filter.min-length: .*finite number",
    ),
    Row(
        "collect",
        "a least length above the greatest",
        _words("--part-filter.min-length", "0.2", "--part-filter.max-length", "0.1"),
        "min_length 0.2 is above max_length 0.1",
    ),
    Row(
        "collect",
        "a least success above the greatest",
        _words("--part-filter.min-success", "0.9", "--part-filter.max-success", "0.1"),
        "min_success 0.9 is above max_success 0.1",
    ),
    Row("collect", "an empty name", _words("--parts", ""), "the name of a part is empty"),
    Row(
        "collect",
        "a file as the dataset's folder",
        lambda at: ["--out", at.file("data", ""), *NUT],
        "is a file; choose a folder",
    ),
    Row(
        "collect",
        "a folder that holds something else",
        lambda at: ["--out", _full(at), *NUT],
        "holds other files",
    ),
    Row(
        "collect",
        "labels that are no labels",
        lambda at: ["--labels", at.file("a.labels", "none"), *NUT],
        "a.labels",
        1,
    ),
    Row(
        "plan",
        "more candidates than memory",
        _words("--planner.n-candidates", "100000000000"),
        "--planner.n-candidates: .*less than or equal to",
    ),
    Row("plan", "a seed of forty digits", _words("--seed", "9" * 40), "--seed: .*less than"),
    Row(
        "plan",
        "a mistyped option",
        _words("--planer.policy", "quality"),
        "unknown option --planer.policy; similar: --planner.policy",
    ),
    Row(
        "plan",
        "a policy that does not exist",
        _words("--planner.policy", "best"),
        "'best' is not legal; legal: .*low_variance",
    ),
    Row("plan", "an infinite quality", _words("--planner.min-quality", "inf"), "--planner.min-quality: "),
    Row("plan", "a word too many", _words("bracket.stl"), "unexpected argument 'bracket.stl'"),
    Row("plan", "no such part", _words("--part", "hex_nut_m31"), "hex_nut_m31"),
    Row(
        "plan",
        "a file in the way of the folder",
        lambda at: ["--out", at.file("out", "")],
        "cannot make folder",
    ),
    Row("train", "epochs below zero", _words("--epochs", "-3"), "--epochs: "),
    Row("train", "a seed of forty digits", _words("--seed", "9" * 40), "--seed: .*less than"),
    Row(
        "train",
        "an option of what is not chosen",
        _words("--network.channels", "2"),
        "--network.channels belongs to settings that are not chosen",
    ),
    Row("train", "no data", _words("--out", "model"), "--data is needed"),
    Row("evaluate", "no such part", _words("--parts", "hex_nut_m31"), "hex_nut_m31"),
    Row("evaluate", "an empty name", _words("--parts", ""), "the name of a part is empty"),
    Row(
        "evaluate", "a missing file of names", _words("--parts", "no.txt"), "cannot read the names in no.txt"
    ),
    Row("evaluate", "parts below zero", _words("--n-parts", "-1"), "--n-parts: "),
    Row(
        "evaluate",
        "a tape that is no number",
        _words("--tape", "nan", "0.01", "--measure", "markers", *NUT),
        "--tape",
    ),
    Row(
        "evaluate",
        "a billion trials",
        _words("--trials", "1000000000", *NUT),
        "--trials: .*less than or equal to",
    ),
    Row("evaluate", "a replayed run that does not exist", _words("--replay", "no", "a-000"), "no"),
    Row("palletize", "a target that is no number", _words("--target", "nan,0,0"), "--target: "),
    Row("palletize", "a target out of reach", _words("--target", "5,0,0", *NUT), "5"),
    Row("palletize", "a negative seed", _words("--seed", "-1"), "--seed: "),
    Row("assess", "no part", _words(), "name a part"),
    Row(
        "assess",
        "a tolerance of nothing",
        _words("hex_nut_m30", "--tolerance", "0mm,0deg"),
        "a tolerance is a distance in mm or m and an angle",
    ),
    Row(
        "assess",
        "a tolerance of more than half a turn",
        _words("hex_nut_m30", "--tolerance", "1mm,500deg"),
        "at most 100 mm and 180 deg",
    ),
    Row(
        "assess",
        "fewer simulations than any grasp comes of",
        _words("hex_nut_m30", "--simulations", "19"),
        "--simulations: at least 24",
    ),
    Row("plan", "the unit of no CAD file", _words("--part", "hex_nut_m30", "--unit", "mm"), "--unit is for"),
    Row(
        "calibrate",
        "a board to print and pictures of one",
        _words("--print-board", "b.pdf", "--from", "pictures"),
        "exclude each other",
    ),
    Row("benchmark", "a cell that does not exist", _words("--cell", "gazebo"), "legal: sapien, mujoco"),
    Row("evaluate", "a file without names", lambda at: ["--parts", at.file("a.txt", "\n")], "holds no name"),
    Row("assess", "a folder without CAD files", lambda at: [_full(at)], "holds no CAD file"),
    Row(
        "assess",
        "a billion simulations",
        _words("hex_nut_m30", "--simulations", "1000000000"),
        "--simulations: .*less than or equal to",
    ),
    Row("benchmark", "a planner twice", _words("--planners", "ours", "ours"), "named twice"),
    Row("benchmark", "a planner that does not exist", _words("--planners", "theirs"), "theirs"),
    Row(
        "benchmark",
        "grasps that are no grasps",
        lambda at: ["--grasps", at.file("a.yaml", "format: [1"), "--part", "hex_nut_m30"],
        "a.yaml",
    ),
    Row("benchmark", "a part without grasps", _words("--part", "hex_nut_m30"), "that of --grasps"),
    Row(
        "serve",
        "an address that is no address",
        _words("--host", "999.0.0.1", "--token-file", "none"),
        "--token-file none",
    ),
    Row("serve", "an address for all without a token", _words("--host", "0.0.0.0"), "needs --token-file"),
    Row(
        "serve",
        "a short token",
        lambda at: ["--token-file", at.file("token", "abc")],
        "16 characters or more",
    ),
    Row(
        "validate",
        "an option without its values",
        _words("--rates-hz"),
        "rates_hz.* at least one value each: --rates-hz",
    ),
    Row("doctor", "no cell", _words(), "--cell"),
    Row("home", "no cell", _words(), "--cell"),
    Row("touch", "a force of nothing", _words("--cell", "cell.yaml", "--force", "0"), "--force: "),
    Row(
        "record",
        "another program",
        _words("--cell", "cell.yaml", "--out", "a.h5", "--run", "rm -rf x"),
        "must be a program of this project",
    ),
    Row(
        "record",
        "frames of a program",
        _words("--cell", "cell.yaml", "--out", "a.h5", "--frames", "3", "--run", "mskgrasp.plan"),
        "leave out --frames",
    ),
    Row(
        "record",
        "a folder that does not exist and cannot be made",
        lambda at: [
            "--cell",
            at.file("cell.yaml", "type: sapien\n"),
            "--out",
            "/proc/none/a.h5",
            "--frames",
            "1",
        ],
        "/proc/none",
    ),
    Row(
        "calibrate",
        "a board in a format that is not printed",
        _words("--print-board", "board.txt"),
        "board.txt",
    ),
    Row("calibrate", "fewer pictures than it needs", _words("--poses", "2"), "--poses: "),
    Row("dataset", "no such command", _words("chekc", "data"), "unknown command 'chekc'; legal: check"),
    Row("dataset", "an export without a file", _words("export", "data", "--format", "npz"), "missing: --out"),
    Row("parts", "no such command", _words("improt", "a.stl"), "unknown command 'improt'"),
    Row("parts", "no such part", _words("build", "hex_nut_m31"), "no built-in part is called 'hex_nut_m31'"),
    Row("demo", "a seed below zero", _words("--seed", "-1"), "--seed: "),
    Row("demo", "an unknown option", _words("--prat", "a.stl"), "unknown option --prat; similar: --part"),
    Row("view", "a port that is none", _words("--port", "70000"), "--port: .*less than or equal to 65535"),
]
