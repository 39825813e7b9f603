"""Configuration files, files of cells and of slots."""

from __future__ import annotations

from tests.inputs.row import Row

LAUGHS = "a0: &a0 [ha, ha, ha, ha, ha, ha, ha, ha, ha]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 10)
)
IN_LIST = "parts:\n" + "".join(f"- {line.split(': ', 1)[1]}\n" for line in LAUGHS.splitlines())
SAPIEN = "type: sapien\n"


ROWS = [
    Row("collect", "a billion laughs", lambda at: at.config(LAUGHS), "more than 200000 values in line 6"),
    Row("train", "a billion laughs in a list", lambda at: at.config(IN_LIST), "more than 200000 values"),
    Row(
        "evaluate",
        "brackets in brackets",
        lambda at: at.config("[" * 3000),
        "more than 50 collections inside",
    ),
    Row(
        "palletize",
        "a key twice",
        lambda at: at.config("trials: 1\nseed: 2\ntrials: 3\n"),
        "key 'trials' occurs twice in line 3",
    ),
    Row(
        "palletize",
        "a key twice in a group",
        lambda at: at.config("planner: {min_quality: 0.1, min_quality: 0.2}"),
        "key 'min_quality' occurs twice",
    ),
    Row(
        "validate",
        "a device without an end",
        lambda at: ["--config", "/dev/zero"],
        "/dev/zero: larger than 1,048,576 bytes",
    ),
    Row(
        "assess",
        "a file of two megabytes",
        lambda at: at.config(b"# " + b"x" * 2_000_000),
        "larger than 1,048,576 bytes",
    ),
    Row(
        "benchmark",
        "a list in itself",
        lambda at: at.config("parts: &a [*a]"),
        "a value that contains itself",
    ),
    Row(
        "serve",
        "an object of Python",
        lambda at: at.config("host: !!python/object/apply:os.getcwd []"),
        "could not determine a constructor",
    ),
    Row(
        "plan",
        "a number of 5000 digits",
        lambda at: at.config("seed: " + "9" * 5000),
        "config.yaml is not valid YAML: ",
    ),
    Row(
        "plan",
        "a day that does not exist",
        lambda at: at.config("part: 2024-99-99"),
        "config.yaml is not valid YAML: month must be",
    ),
    Row(
        "collect",
        "many aliases",
        lambda at: at.config("seed: &a 1\nparts: [" + "*a, " * 200 + "*a]"),
        "more than 100 aliases",
    ),
    Row(
        "collect",
        "a key of a megabyte",
        lambda at: at.config("k" * 1_000_000 + ": 1"),
        "not valid YAML",
    ),
    Row(
        "collect",
        "thousands of wrong values",
        lambda at: at.config("parts: [" + "[1], " * 5000 + "1]"),
        "and 4997 more",
    ),
    Row(
        "collect",
        "a long wrong value",
        lambda at: at.config("seed: " + "x" * 100_000),
        r"'seed': .*, got 'xxx.*\.\.\..*x'",
    ),
    Row(
        "train",
        "a list in place of a mapping",
        lambda at: at.config("- 1\n- 2\n"),
        "expected a mapping of keys to values, got list",
    ),
    Row(
        "train", "bytes that are no text", lambda at: at.config(b"\xff\xfe\x00"), "cannot read configuration"
    ),
    Row(
        "train",
        "control characters",
        lambda at: at.config(b"seed: \x1b[31m\n"),
        "config.yaml is not valid YAML: ",
    ),
    Row(
        "train",
        "an indentation by tab",
        lambda at: at.config("network:\n\tdropout: 0\n"),
        r"is not valid YAML: .* in line 2",
    ),
    Row("train", "a number as a key", lambda at: at.config("1: 2\n"), "config.yaml: .*(string|unknown key)"),
    Row(
        "train",
        "an infinite rate",
        lambda at: at.config("gqn: {learning_rate: .inf}"),
        "'gqn.learning_rate': input should be a finite number",
    ),
    Row("evaluate", "a folder as configuration", lambda at: ["--config", str(at.folder)], "Is a directory"),
    Row(
        "collect",
        "a key of a thousand letters",
        lambda at: at.config("k" * 1000 + ": 1"),
        r"unknown key 'k+\.\.\.; legal keys here: .*attempts_per_part",
    ),
    Row("evaluate", "no such configuration", lambda at: ["--config", "no.yaml"], "no.yaml: No such file"),
    Row("evaluate", "a configuration without a name", lambda at: ["--config"], "--config needs a file"),
    Row(
        "doctor",
        "a billion laughs as a cell",
        lambda at: ["--cell", at.file("cell.yaml", LAUGHS)],
        "more than 200000 values",
    ),
    Row(
        "home",
        "a cell with a key twice",
        lambda at: ["--cell", at.file("cell.yaml", SAPIEN + SAPIEN)],
        "key 'type' occurs twice",
    ),
    Row("touch", "no such cell", lambda at: ["--cell", "no.yaml"], "no.yaml: No such file"),
    Row(
        "record",
        "a cell that is a word",
        lambda at: ["--cell", at.file("cell.yaml", "sapien"), "--out", "a.h5"],
        "expected a mapping",
    ),
    Row(
        "calibrate",
        "a cell of an unknown type",
        lambda at: ["--cell", at.file("cell.yaml", "type: gazebo\n")],
        "'type'.*gazebo.*sapien",
    ),
    Row(
        "evaluate",
        "a cell whose region is no number",
        lambda at: [
            "--cell",
            at.file("cell.yaml", SAPIEN + "region: [.nan, 0.6, -0.1, 0.1]"),
            "--parts",
            "hex_nut_m30",
        ],
        "'region.0': .* finite number",
    ),
    Row(
        "evaluate",
        "a cell whose region is far away",
        lambda at: [
            "--cell",
            at.file("cell.yaml", SAPIEN + "region: [1.9, 2.1, -0.1, 0.1]"),
            "--parts",
            "hex_nut_m30",
        ],
        "reaches beyond the arm",
    ),
    Row(
        "evaluate",
        "a region wider than the image and out of reach",
        lambda at: [
            "--cell",
            at.file("cell.yaml", SAPIEN + "region: [0.4, 2.0, -0.1, 0.1]"),
            "--parts",
            "hex_nut_m30",
        ],
        "reaches beyond the arm",
    ),
    Row(
        "plan",
        "a cell recorded by itself",
        lambda at: [
            "--cell",
            at.file("cell.yaml", f"type: recorded\ncell: {at.folder}/cell.yaml\nout: a.h5\n"),
        ],
        "recorded itself",
    ),
    Row(
        "serve",
        "a cell with an unknown key",
        lambda at: ["--cell", at.file("cell.yaml", SAPIEN + "tabel_z: 0\n")],
        "unknown key 'tabel_z'; legal keys here: .*camera",
    ),
    Row(
        "palletize",
        "no slot",
        lambda at: ["--slots", at.file("slots.yaml", "{}"), "--parts", "hex_nut_m30"],
        "slots.yaml.*slot",
    ),
    Row(
        "palletize",
        "a slot that is nowhere",
        lambda at: ["--slots", at.file("slots.yaml", "slots: [{x: .nan, y: 0}]"), "--parts", "hex_nut_m30"],
        "'slots.0.x': .* finite number",
    ),
]
