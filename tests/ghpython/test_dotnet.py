"""The way through .NET's arrays, in a process of its own on mono, against an assembly with RhinoCommon's signatures."""

from __future__ import annotations

import ast
import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

DOTNET = Path(__file__).resolve().parent / "dotnet"
NAMES = [
    node.name
    for node in ast.parse((DOTNET / "checks.py").read_text("utf-8")).body
    if isinstance(node, ast.FunctionDef) and any(getattr(d, "id", "") == "check" for d in node.decorator_list)
]
SECONDS = 120


def run(*command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)


def why_not() -> str:
    """What is missing, or nothing."""
    if importlib.util.find_spec("pythonnet") is None:
        return "pythonnet is not installed: pip install pythonnet"
    missing = [name for name in ("mono", "mcs") if shutil.which(name) is None]
    if missing:
        return f"{' and '.join(missing)} not found: apt-get install mono-devel"
    probe = run(sys.executable, "-W", "ignore", "-c", "import pythonnet; pythonnet.load('mono'); import clr, System")
    return f"mono cannot be hosted here (status {probe.returncode})" if probe.returncode else ""


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    reason = why_not()
    if reason:
        pytest.skip(reason)
    assembly = tmp_path_factory.mktemp("dotnet") / "RhinoLike.dll"
    built = run("mcs", "-langversion:latest", "-target:library", f"-out:{assembly}", str(DOTNET / "RhinoLike.cs"))
    assert built.returncode == 0, built.stdout + built.stderr
    ran = run(sys.executable, str(DOTNET / "checks.py"), str(assembly))
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


@pytest.mark.parametrize("name", NAMES)
def test_on_dotnet(name: str, said: dict[str, str]) -> None:
    assert said[name] == "", said[name]
