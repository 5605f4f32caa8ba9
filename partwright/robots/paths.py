"""Where the meshes of a robot lie: paths beside its file, and `package://` and `model://` addresses."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from partwright.errors import UnreadableFileError
from partwright.robots.xml_files import parsed

_ADDRESS = re.compile(r"(package|model):///?([^/]+)/(.*)", re.DOTALL)  # a slash more is common
_WITH_FOLDERS = ("ROS_PACKAGE_PATH", "GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH", "SDF_PATH")
_WITH_PREFIXES = ("AMENT_PREFIX_PATH", "COLCON_PREFIX_PATH")  # packages lie in their share/


@dataclass(frozen=True)
class Place:
    """path: where the file lies. within: where its copy goes in the robot's new folder, "/" between names;
    None for a file with an absolute path, which is used where it is. address: how the robot's file says
    so."""

    path: Path
    within: str | None
    address: str


def find(address: str, beside: Path, packages: Sequence[Path], link: str) -> Place:
    """The file that an address in a robot's file means.

    beside: the folder of the robot's file. packages: folders in which packages lie, tried first.

    Raises:
        UnreadableFileError: there is none; the message names the link.
    """
    match = _ADDRESS.fullmatch(address)
    if match is None:
        plain = unquote(address.removeprefix("file://")) if address.startswith("file://") else address
        path = Path(plain)
        found = path if path.is_absolute() else beside / path
        if not found.is_file():
            raise UnreadableFileError(f"link {link!r}: its mesh {address} is not there; looked for {found}")
        if path.is_absolute():
            return Place(found, None, address)
        kept = [part for part in PurePosixPath(plain).parts if part not in ("..", ".")]
        within = "/".join(kept)
        same = "/".join(PurePosixPath(plain).parts) == within
        return Place(found, within, address if same else within)
    scheme, package, rest = match.groups()
    if ".." in PurePosixPath(rest).parts or package in ("..", "."):
        raise UnreadableFileError(f"link {link!r}: its mesh {address} lies outside of its package")
    for folder in _homes(package, beside, packages):
        if (folder / rest).is_file():
            return Place(folder / rest, f"{package}/{rest}", address)
    if any(folder.is_dir() for folder in _homes(package, beside, packages)):
        raise UnreadableFileError(f"link {link!r}: the package {package} has no file {rest} ({address})")
    raise UnreadableFileError(
        f"link {link!r}: no package {package} was found for its mesh {address}; say where packages lie with "
        f"--packages FOLDER, or {_WITH_FOLDERS[scheme == 'model']}"
    )


def _homes(package: str, beside: Path, packages: Sequence[Path]) -> Iterator[Path]:
    """Folders that may be the package."""
    for folder in packages:
        yield folder / package
        if package in (folder.name, _declared(folder)):
            yield folder
    for folder in (beside.absolute(), *beside.absolute().parents):
        if package in (folder.name, _declared(folder)):
            yield folder
        yield folder / package
    for variable in _WITH_FOLDERS:
        for word in filter(None, os.environ.get(variable, "").split(os.pathsep)):
            yield Path(word) / package
            if Path(word).name == package:
                yield Path(word)
    for variable in _WITH_PREFIXES:
        for word in filter(None, os.environ.get(variable, "").split(os.pathsep)):
            yield Path(word) / "share" / package


def _declared(folder: Path) -> str | None:
    """The name that a package's own file gives it: its folder may have another."""
    file = folder / "package.xml"
    try:
        state = file.stat()
    except OSError:
        return None
    return _name_in(file, state.st_mtime_ns, state.st_size)


@lru_cache
def _name_in(file: Path, changed: int, size: int) -> str | None:
    """Read once until it has changed: each mesh of a robot asks for the files of all folders above it."""
    try:
        return (parsed(file, None).getroot().findtext("{*}name") or "").strip() or None
    except UnreadableFileError:
        return None


def new_address(name: str, like: Place | None) -> tuple[str, str]:
    """Address, and path within the new folder, of a new mesh: in the package of that which it replaces."""
    match = _ADDRESS.fullmatch(like.address) if like else None
    if match is None:
        return f"collision/{name}", f"collision/{name}"
    scheme, package, _ = match.groups()
    return f"{scheme}://{package}/collision/{name}", f"{package}/collision/{name}"


def with_companions(place: Place) -> dict[str, Path]:
    """The file and what it refers to (materials, pictures): path within the new folder -> file."""
    if place.within is None:
        return {}
    result = {place.within: place.path}
    folder = PurePosixPath(place.within).parent
    for name in _mentioned(place.path):
        file = place.path.parent / name
        if file.is_file() and ".." not in PurePosixPath(name).parts and not PurePosixPath(name).is_absolute():
            result |= with_companions(Place(file, str(folder / name), ""))
    return result


def carried(address: str, beside: Path, packages: Sequence[Path], copied: dict[str, Path]) -> str:
    """The address in the new folder of a picture that a material refers to, which is added to what is copied;
    one that is not there is left as it is, as viewers of robots go on without."""
    try:
        place = find(address, beside, packages, "")
    except UnreadableFileError:
        return address
    copied.update(with_companions(place))
    return place.address


_MENTIONS = {
    ".obj": rb"(?m)^mtllib[ \t]+(.+?)[ \t]*\r?$",
    ".mtl": rb"(?m)^[ \t]*(?:map_\w+|bump|norm|disp|decal)[ \t]+(?:.*[ \t])?(\S+)[ \t]*\r?$",
    ".dae": rb"<init_from>\s*([^<]+?)\s*</init_from>",
    ".gltf": rb'"uri"\s*:\s*"([^":]+)"',
}


def _mentioned(path: Path) -> list[str]:
    pattern = _MENTIONS.get(path.suffix.lower())
    if pattern is None:
        return []
    found = re.findall(pattern, path.read_bytes())
    return list(dict.fromkeys(unquote(os.fsdecode(name)).removeprefix("file://") for name in found))
