"""Configuration files: read back equal, and refused in one line that names the key."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import Field, ValidationError, field_validator

from mskgrasp.core.config import Config, check_config, read_config, read_yaml, write_config
from mskgrasp.core.errors import BadConfig


class Round(Config):
    """A round part."""

    shape: Literal["round"] = "round"
    radius: float = Field(default=0.01, gt=0)


class Square(Config):
    """A square part."""

    shape: Literal["square"] = "square"
    side: float = Field(default=0.02, gt=0)


class Scene(Config):
    """A scene."""

    out: Path = Path("out")
    seed: int = 0
    places: tuple[tuple[float, float], ...] = ()
    part: Annotated[Round | Square, Field(discriminator="shape")] = Round()

    @field_validator("seed")
    @classmethod
    def _even(cls, seed: int) -> int:
        if seed % 2:
            raise ValueError(f"seed must be even; take {seed + 1}")
        return seed


def test_a_configuration_is_read_back_equal_and_cannot_be_changed(tmp_path: Path):
    scene = Scene(out=Path("a b/ü"), seed=2, places=((0.1, 1e-7), (-2.0, 3.0)), part=Square(side=0.1 + 0.2))
    write_config(scene, tmp_path / "scene.yaml")
    assert read_config(Scene, tmp_path / "scene.yaml") == scene
    with pytest.raises(ValidationError, match="frozen"):
        scene.seed = 4


def test_an_empty_file_holds_the_defaults(tmp_path: Path):
    path = tmp_path / "empty.yaml"
    path.write_text("# nothing\n")
    assert read_yaml(path) == {} and read_config(Scene, path) == Scene()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a: 1\nb: [1, 2\n", "is not valid YAML: .* in line 3, column 1"),
        (b"- 1\n- 2\n", "expected a mapping of keys to values, got list"),
        (b"seven", "expected a mapping of keys to values, got str"),
        (b"\xff\xfe\x00", "cannot read configuration"),
        (b"!!python/object/apply:os.system [ls]", "is not valid YAML: could not determine a constructor"),
        (b"sead: 1", "unknown key 'sead'; legal keys here: out, part, places, seed"),
        (b"part: {shape: round, side: 1}", "unknown key 'part.round.side'; legal keys here: radius, shape"),
        (b"part: {shape: oval}", "'part': unknown shape 'oval'; legal: round, square"),
        (b"part: {radius: 1}", "'part': shape is missing; legal: round, square"),
        (b"part: {shape: round, radius: 0}", "'part.round.radius': input should be greater than 0, got 0"),
        (b"places: [[1, 2], [3]]", r"'places.1': 2 values are needed, got 1$"),
        (b"places: [[], [3]]", r"'places.0': 2 values are needed, got 0; 'places.1': 2 .*, got 1$"),
        (b"a: 1\nb: 2", "unknown key 'a'; unknown key 'b'; legal keys here: out, part, places, seed$"),
        (b"seed: 3", "'seed': seed must be even; take 4, got 3"),
        (b"seed: many\nout: 3", "'out': .*; 'seed': .*, got 'many'"),
    ],
)
def test_a_wrong_file_is_an_error_of_one_line_with_its_path(tmp_path: Path, content: bytes, message: str):
    path = tmp_path / "scene.yaml"
    path.write_bytes(content)
    with pytest.raises(BadConfig, match=message) as raised:
        read_config(Scene, path)
    assert str(path) in str(raised.value) and "\n" not in str(raised.value)


def test_a_missing_file_and_a_folder_are_named_with_the_reason(tmp_path: Path):
    for path, reason in ((tmp_path / "no.yaml", "No such file"), (tmp_path, "Is a directory")):
        with pytest.raises(
            BadConfig, match=f"cannot read configuration {path}: {reason}.*; name a readable YAML file"
        ):
            read_yaml(path)


def test_names_of_values_in_messages_can_be_those_of_options():
    def option(location: tuple[int | str, ...]) -> str:
        return "--" + ".".join(map(str, location))

    with pytest.raises(BadConfig, match="^command line: --seed: input should be a valid integer.*, got 'x'$"):
        check_config(Scene, {"seed": "x"}, "command line", name=option)
    with pytest.raises(BadConfig, match="^command line: expected a mapping of keys to values, got list$"):
        check_config(Scene, [1], "command line")
