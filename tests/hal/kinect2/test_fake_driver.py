"""The fake driver is the published one, as far as it goes."""

from __future__ import annotations

import ast
import importlib.util
import inspect
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from tests.hal.kinect2.bench import FAKE

STUB = Path(__file__).parent / "pylibfreenect2_0_1_4.pyi"


def stub_classes() -> list[ast.ClassDef]:
    return [node for node in ast.parse(STUB.read_text()).body if isinstance(node, ast.ClassDef)]


@pytest.mark.parametrize("described", stub_classes(), ids=lambda node: node.name)
def test_the_fake_has_the_published_signatures(fake: ModuleType, described: ast.ClassDef):
    kind = getattr(fake, described.name)
    public = {name for name in vars(kind) if not name.startswith("_")}
    names = set()
    for node in described.body:
        if isinstance(node, ast.FunctionDef):
            names.add(node.name)
            found = inspect.getattr_static(kind, node.name)
            if isinstance(found, property):
                assert [ast.unparse(d) for d in node.decorator_list] == ["property"]
                continue
            parameters = inspect.signature(found).parameters
            assert list(parameters) == [a.arg for a in node.args.args], node.name
            defaults = [p.default for p in parameters.values() if p.default is not p.empty]
            assert defaults == [ast.literal_eval(d) for d in node.args.defaults], node.name
        elif isinstance(node, ast.AnnAssign):
            assert hasattr(kind(), ast.unparse(node.target))
        elif isinstance(node, ast.Assign):
            names.add(ast.unparse(node.targets[0]))
            assert getattr(kind, ast.unparse(node.targets[0])) == ast.literal_eval(node.value)
    assert public <= names, f"the fake offers {public - names}, which the driver does not"


def test_the_fake_undistorts_as_libfreenect2_does():
    """Pixels read from the real Registration.undistortDepth (pylibfreenect2 0.1.4), same camera."""
    spec = importlib.util.spec_from_file_location("scene", FAKE / "pylibfreenect2" / "scene.py")
    assert spec is not None and spec.loader is not None
    scene = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(scene)
    index = scene.undistortion(SimpleNamespace(**scene.INFRARED))
    measured = [
        (200, 139, 102538), (217, 423, 111528), (320, 131, 164482), (402, 209, 206545), (14, 329, 6985),
        (61, 281, 31001), (348, 43, 177709), (402, 14, 201751), (105, 443, 54204), (132, 385, 67458),
    ]  # fmt: skip
    assert [int(index[row, column]) for row, column, _ in measured] == [value for *_, value in measured]
