"""What a wheel of Partwright holds, and what it asks for, as a CycloneDX bill of materials.

    pip install "cyclonedx-python-lib[json-validation]" nanobind packaging
    python release/sbom.py              # writes dist/partwright-VERSION.cdx.json

Components: what is compiled in, the trained models and the studio's page, with their hashes; and the required
and optional dependencies, which pip installs and no wheel holds. The same sources give the same bytes.
"""

from __future__ import annotations

import hashlib
import re
import tomllib
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

import nanobind
from cyclonedx.model import HashAlgorithm, HashType, Property
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentScope, ComponentType
from cyclonedx.model.license import DisjunctiveLicense
from cyclonedx.output.json import JsonV1Dot6
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
VERSION = re.findall(r'__version__ = "(.+)"', (ROOT / "partwright" / "__init__.py").read_text())[0]


def own(path: Path, kind: ComponentType, about: str) -> Component:
    """A file of the wheel that no source code of the package is."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    name = path.relative_to(ROOT).as_posix()
    return Component(
        name=name, bom_ref=name, type=kind, description=about, licenses=[DisjunctiveLicense(id="Apache-2.0")],
        hashes=[HashType(alg=HashAlgorithm.SHA_256, content=digest)],
    )  # fmt: skip


def bundled() -> list[Component]:
    """What the wheel holds besides its own code."""
    models = [
        own(
            path,
            ComponentType.MACHINE_LEARNING_MODEL,
            "trained by the project on shapes that it makes itself",
        )
        for path in sorted(ROOT.glob("partwright/*/models/*.safetensors"))
    ]
    about = "the studio, built from studio/ by Vite; no code of others"
    page = own(ROOT / "partwright" / "export" / "page.html", ComponentType.APPLICATION, about)
    bindings = Component(
        name="nanobind", version=nanobind.__version__, bom_ref="nanobind", type=ComponentType.LIBRARY,
        description="bindings, linked into partwright/_kernel",
        purl=PackageURL("pypi", name="nanobind", version=nanobind.__version__),
        licenses=[DisjunctiveLicense(id="BSD-3-Clause")],
    )  # fmt: skip
    tables = Component(
        name="tsl-robin-map", bom_ref="tsl-robin-map", type=ComponentType.LIBRARY,
        description="hash tables of nanobind, linked into partwright/_kernel",
        purl=PackageURL("github", namespace="tessil", name="robin-map"),
        licenses=[DisjunctiveLicense(id="MIT")],
    )  # fmt: skip
    return [bindings, tables, *models, page]


def asked_for(project: dict) -> list[Component]:
    """What pip installs beside it; extras of those who develop are left out."""
    wanted = dict.fromkeys(project["dependencies"], "")
    for extra, lines in project["optional-dependencies"].items():
        if extra not in ("test", "bench", "docs", "dev"):
            wanted |= {line: extra for line in lines if line not in wanted}
    result = []
    for line, extra in sorted(wanted.items()):
        one = Requirement(line)
        properties = [Property(name="partwright:requirement", value=str(one.specifier))]
        if extra:
            properties.append(Property(name="partwright:extra", value=extra))
        result.append(
            Component(
                name=one.name, bom_ref=f"pypi:{one.name}", type=ComponentType.LIBRARY, properties=properties,
                scope=ComponentScope.OPTIONAL if extra else ComponentScope.REQUIRED,
                purl=PackageURL("pypi", name=one.name), description="installed by pip, not in the wheel",
            )
        )  # fmt: skip
    return result


def main() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    bom = Bom()
    root = Component(
        name="partwright", version=VERSION, bom_ref="partwright", type=ComponentType.LIBRARY,
        description=project["description"], licenses=[DisjunctiveLicense(id="Apache-2.0")],
    )  # fmt: skip
    bom.metadata.component = root
    components = bundled() + asked_for(project)
    for one in components:
        bom.components.add(one)
    bom.register_dependency(root, components)
    bom.serial_number = uuid5(NAMESPACE_URL, "partwright" + "".join(sorted(map(repr, components))))
    bom.metadata.timestamp = None  # type: ignore[assignment]  the same sources, the same bytes
    text = JsonV1Dot6(bom).output_as_string(indent=2) + "\n"
    if error := JsonStrictValidator(SchemaVersion.V1_6).validate_str(text):
        raise SystemExit(f"no valid CycloneDX: {error}")
    target = ROOT / "dist" / f"partwright-{VERSION}.cdx.json"
    target.parent.mkdir(exist_ok=True)
    target.write_text(text)
    print(f"{target.relative_to(ROOT)}: {len(components)} components")


if __name__ == "__main__":
    main()
