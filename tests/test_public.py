"""The names that others build on, as `import partwright as pw` gives them."""

from __future__ import annotations

import importlib
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import partwright as pw


def test_importing_imports_nothing_heavy() -> None:
    code = (
        "import sys, partwright; assert not {'numpy', 'scipy', 'trimesh', 'torch', 'rich'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_importing_takes_less_than_150_milliseconds() -> None:
    code = "import time; start = time.process_time(); import partwright; print(time.process_time() - start)"
    command = [sys.executable, "-c", code]
    taken = [float(subprocess.run(command, check=True, capture_output=True).stdout) for _ in range(3)]
    assert min(taken) < 0.15  # of the processor, so that what else the machine does counts for nothing


def test_the_version_is_the_same_wherever_it_is_said() -> None:
    root = Path(__file__).parents[1]
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    assert "version" in project["dynamic"]
    assert "version" not in project
    assert f"\nversion: {pw.__version__}\n" in (root / "CITATION.cff").read_text()
    assert f"\n## {pw.__version__} " in (root / "CHANGELOG.md").read_text()


def test_every_public_name_is_there() -> None:
    for name in pw.__all__:
        assert getattr(pw, name) is not None
    assert set(pw.__all__) == set(dir(pw))


def test_export_stays_a_function_after_its_package_is_imported() -> None:
    importlib.import_module("partwright.export.glb")
    assert callable(pw.export)
    assert pw.export is importlib.import_module("partwright.export").export


def test_unknown_names_are_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'fut'"):
        _ = pw.fut
