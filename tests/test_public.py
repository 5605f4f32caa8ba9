"""The names that others build on, as `import partwright as pw` gives them."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

import partwright as pw


def test_importing_imports_nothing_heavy() -> None:
    code = (
        "import sys, partwright; assert not {'numpy', 'scipy', 'trimesh', 'torch', 'rich'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


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
