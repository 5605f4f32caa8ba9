"""The pictures of a file's materials, looked at before they are read: parsers leave out what they cannot."""

from __future__ import annotations

import base64
import binascii
import io
import re
import struct
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from partwright.errors import UnreadableFileError
from partwright.input_files import check_file
from partwright.shapes.gltf_tree import gltf_tree

LARGEST = 1 << 27  # pixels: 11,000 x 11,000
_MTLLIB = re.compile(rb"(?m)^[ \t]*mtllib[ \t]+(.+?)[ \t]*\r?$")
_MAP = re.compile(rb"(?m)^[ \t]*map_Kd[ \t]+(.+?)[ \t]*\r?$")
_BIN = 0x004E4942
_OTHER_FORMS = ("EXT_texture_webp", "KHR_texture_basisu")  # extensions that name a picture


def check_images(path: Path) -> None:
    """That the pictures of the materials' colours and normals are there, are pictures, and are not huge.

    Raises:
        UnreadableFileError: one of them is not.
    """
    suffix = path.suffix.lower()
    check_file(path)
    if suffix == ".obj":
        for name, file in _of_obj(path):
            _check(path, name, _read(path, name, file))
    elif suffix in (".glb", ".gltf"):
        try:
            found = list(_of_gltf(path))
        except (AttributeError, TypeError):  # of another form than glTF's: the parser says how
            return
        for name, data in found:
            _check(path, name, data)


def _check(path: Path, name: str, data: bytes) -> None:
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data)) as picture:
                width, height = picture.size
                if width * height <= LARGEST:
                    picture.load()  # a header alone is no picture
    except Image.DecompressionBombError as error:
        raise UnreadableFileError(
            f"{path}: its picture {name} has too many pixels; make it smaller"
        ) from error
    except Exception as error:  # Pillow's plugins raise what they like for files that are damaged
        raise UnreadableFileError(
            f"{path}: its picture {name} cannot be read ({type(error).__name__}); export it again"
        ) from error
    if width * height > LARGEST:
        raise UnreadableFileError(
            f"{path}: its picture {name} has {width} x {height} pixels, at most {LARGEST:,} are read; "
            "make it smaller"
        )


def _read(path: Path, name: str, file: Path) -> bytes:
    try:
        check_file(file)
    except UnreadableFileError as error:
        raise UnreadableFileError(f"{path}: its picture {name}: {error}") from error
    return file.read_bytes()


def _of_obj(path: Path) -> Iterator[tuple[str, Path]]:
    """Names and places of pictures; a name may have spaces, and options before it."""
    for library in _MTLLIB.findall(path.read_bytes()):
        file = path.parent / library.decode(errors="replace")
        if not file.is_file():
            continue  # then there is no material either
        for said in _MAP.findall(file.read_bytes()):
            whole = said.decode(errors="replace")
            place = file.parent / whole
            if not place.is_file():
                whole = whole.split()[-1] if whole.startswith("-") else whole
                place = file.parent / whole
            yield whole, place


def _of_gltf(path: Path) -> Iterator[tuple[str, bytes]]:
    tree = gltf_tree(path)
    if not isinstance(tree, dict):
        return
    images = tree.get("images", [])
    for index in sorted(_used(tree)):
        if not 0 <= index < len(images):
            raise UnreadableFileError(f"{path}: a texture names picture {index} of {len(images)}")
        image = images[index]
        name = str(image.get("name") or image.get("uri", "")[:80] or f"number {index}")
        uri = image.get("uri")
        if uri is None:
            yield name, _view(path, tree, image.get("bufferView"))
        elif uri.startswith("data:"):
            yield name, _data(path, uri)
        else:
            yield name, _read(path, name, path.parent / unquote(uri))


def _used(tree: dict[str, Any]) -> set[int]:
    """Pictures that the materials' base colours and normals are read of."""
    textures = tree.get("textures", [])
    used = set()
    for material in tree.get("materials", []):
        colour = material.get("pbrMetallicRoughness", {}).get("baseColorTexture", {})
        for index in (colour.get("index"), material.get("normalTexture", {}).get("index")):
            if isinstance(index, int) and 0 <= index < len(textures):
                texture = textures[index]
                ways = [texture.get("extensions", {}).get(name, {}) for name in _OTHER_FORMS]
                source = next((one["source"] for one in [*ways, texture] if "source" in one), None)
                if isinstance(source, int):
                    used.add(source)
    return used


def _view(path: Path, tree: dict[str, Any], index: Any) -> bytes:
    """The bytes of a buffer view; none where the document contradicts itself, which is then told."""
    try:
        view = tree["bufferViews"][index]
        buffer = tree["buffers"][view["buffer"]]
        uri = buffer.get("uri")
        if uri is None:
            whole = _binary(path)
        elif uri.startswith("data:"):
            whole = _data(path, uri)
        else:
            whole = (path.parent / unquote(uri)).read_bytes()
        start = view.get("byteOffset", 0)
        return whole[start : start + view["byteLength"]]
    except (KeyError, IndexError, TypeError, OSError):
        return b""


def _binary(path: Path) -> bytes:
    """The binary chunk of a GLB."""
    with path.open("rb") as file:
        head = file.read(20)
        file.seek(20 + struct.unpack_from("<I", head, 12)[0])
        chunk = file.read(8)
        length, kind = struct.unpack("<II", chunk) if len(chunk) == 8 else (0, 0)
        return file.read(length) if kind == _BIN else b""


def _data(path: Path, uri: str) -> bytes:
    try:
        return base64.b64decode(uri.partition(",")[2], validate=False)
    except (binascii.Error, ValueError) as error:
        raise UnreadableFileError(f"{path}: a picture in it is no base64; export it again") from error
