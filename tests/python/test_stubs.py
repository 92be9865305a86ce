"""The type stubs say what the module has, and an example that uses them is accepted by mypy --strict."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import lumihull
import lumihull._lumihull as module

STUB = Path(module.__file__).with_name("_lumihull.pyi")


def members(tree: ast.Module) -> dict[str, set[str]]:
    """Public names of the stub; for a class its members."""
    out: dict[str, set[str]] = {}
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            names = {n.name for n in node.body if isinstance(n, ast.FunctionDef)}
            names |= {n.target.id for n in node.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)}
            out[node.name] = {n for n in names if not n.startswith("__")}
        elif isinstance(node, ast.FunctionDef):
            out[node.name] = set()
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            out[node.target.id] = set()
    return out


def test_stubs_agree_with_the_module() -> None:
    declared = members(ast.parse(STUB.read_text()))
    defined = {n for n in dir(module) if not n.startswith("_")} | {"__version__"}
    assert set(declared) == defined
    for name in defined:
        thing = getattr(module, name)
        if isinstance(thing, type) and thing is not lumihull.Error:
            assert declared[name] == {n for n in vars(thing) if not n.startswith("_")}, name
    assert {n for n in dir(lumihull) if not n.startswith("_")} == defined - {"__version__"}


@pytest.mark.skipif(shutil.which("mypy") is None, reason="needs mypy")
def test_an_example_is_typed(tmp_path: Path) -> None:
    source = Path(os.environ["LUMIHULL_SOURCE_DIR"])
    mypy = shutil.which("mypy")
    assert mypy is not None
    done = subprocess.run(
        [mypy, "--strict", "--python-executable", sys.executable, "--cache-dir", str(tmp_path / "cache")]
        + ["-p", "lumihull", "-m", "turntable"],
        env={**os.environ, "MYPYPATH": os.pathsep.join([str(STUB.parent.parent), str(source / "examples" / "python")])},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout
