"""A photograph or render, made ready for an image encoder: cut out where the shape is, by what it sees there.

A picture with transparency says by itself where the shape is. In any other the encoder looks twice: for the
silhouette first, then closely at that part of the picture.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from scipy import ndimage
from torch import Tensor

from partwright.errors import EmptyShapeError, UnreadableFileError
from partwright.generators.generating import check_image
from partwright.partsdf.image_encoder import ImageEncoder, Sight
from partwright.partsdf.standpoint import extent
from partwright.partsdf.views import SIDE

_LARGEST = 1024  # pixels along the longer side: more than anything here looks at
_LEAST = 16  # pixels
_OPAQUE = 128  # of 255
_BLANK = 4 / 255  # of full scale, between the darkest and the brightest pixel of what shows nothing
_FILLED = 0.9  # of the picture that the silhouette is cut out to, as views are
_CLOSER = 2  # times that it is cut out anew
_SMALLEST = 6  # cells of a silhouette along its longer side, of SIDE / 2
_UNSURE, _SURE, _LEAST_TRUST = 0.8, 0.95, 0.1  # IoU with what is seen in the mirror image
_LIGHT, _DARK = 0.97, 0.15  # backgrounds of what is transparent


@dataclass(frozen=True)
class Photo:
    """pixels (H, W, 3) float32, 0 to 1; shape (H, W) bool where its transparency says that the shape is, None
    where it has none."""

    pixels: np.ndarray
    shape: np.ndarray | None


@dataclass(frozen=True)
class Covered:
    """share (N, N): how much of each pixel a shape covers, 0 to 1; trust (N, N): how sure that is, 0 to 1."""

    share: np.ndarray
    trust: np.ndarray

    @property
    def cells(self) -> int:
        """N."""
        return len(self.share)

    @property
    def mask(self) -> np.ndarray:
        """(N, N) bool: pixels that are covered by half; of what is thinner than pixels all over, half as much
        as most."""
        return np.asarray(self.share >= min(0.5, self.share.max() / 2))

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, bottom, right and top of what is covered, from the picture's middle; its sides are 1."""
        top, left, bottom, right = (side / self.cells - 0.5 for side in extent(self.mask))
        return left, -bottom, right, -top


@dataclass(frozen=True)
class Looked:
    """What was seen: the part of the photo that was looked at closely (SIDE, SIDE, 3), 0 to 1, the sight, and
    the silhouette (SIDE / 2, SIDE / 2) bool there."""

    closely: np.ndarray
    sight: Sight
    silhouette: np.ndarray
    covered: Covered
    mirrored: float
    """IoU of the silhouette that the encoder sees with the one that it sees in the mirror image: near 1 where
    the picture shows something, less where it shows nothing, of which the encoder makes a shape anyway."""


def read_photo(path: str | Path) -> Photo:
    """A picture file, upright as its camera says, no larger than is of use.

    Raises:
        UnreadableFileError: it is no picture, damaged, too large to be opened or too small to be seen, or has
            levels that are not finite.
        EmptyShapeError: it is transparent all over.
    """
    from PIL import Image, ImageOps

    path = Path(path)
    check_image(path)
    with Image.open(path) as opened:
        if min(opened.size) < _LEAST:
            raise UnreadableFileError(
                f"{path}: is {opened.width} by {opened.height} pixels; {_LEAST} or more are needed each way"
            )
        opened.draft("RGB", (_LARGEST, _LARGEST))  # a JPEG may be read at a part of its size
        picture = _eight_bits(opened, path)
        with suppress(Exception):  # what a camera wrote down may be damaged: then the picture as it stands
            picture = ImageOps.exif_transpose(picture)
        picture = picture.convert("RGBA")
    picture.thumbnail((_LARGEST, _LARGEST), Image.Resampling.BOX)
    rgba = np.asarray(picture, np.float32) / 255
    pixels, opaque = rgba[..., :3], rgba[..., 3:]
    shape = opaque[..., 0] * 255 >= _OPAQUE
    if shape.all():
        return Photo(pixels, None)
    if not shape.any():
        raise EmptyShapeError(f"{path}: is transparent all over; expected a picture of a shape")
    behind = _LIGHT if pixels[shape].mean() < 0.6 else _DARK
    return Photo(opaque * pixels + (1 - opaque) * behind, shape)


def look_at(encoder: ImageEncoder, photo: Photo) -> Looked:
    """What the encoder sees in a photo, where the shape is.

    Raises:
        EmptyShapeError: it sees none, or the photo is of one colour all over, where it sees one all the same.
    """
    if photo.shape is None and np.ptp(photo.pixels, axis=(0, 1)).max() <= _BLANK:
        raise EmptyShapeError("no shape is seen in the picture: it is of one colour all over")
    height, width = photo.pixels.shape[:2]
    box = np.array([0.0, 0.0, height, width])
    if photo.shape is not None:
        box = _squared(np.array(extent(photo.shape), float), _FILLED)
    else:
        box = _squared(box, 1.0)
    for again in range(1 + _CLOSER):
        closely = _cut_out(photo.pixels, box)
        (sight,) = encoder.see(_tensor(closely)[None])
        seen = _largest(sight.silhouette.numpy() > 0.5)
        if photo.shape is not None:
            given = np.repeat(photo.shape[..., None], 3, axis=2).astype(np.float32)
            share = _cut_out(given, box, outside=0.0)[..., 0]
            if not share.any():
                raise EmptyShapeError("what is opaque in the picture is too small to be seen")
            halved = Covered(_halved(share), np.ones(sight.silhouette.shape))
            covered = Covered(share, np.ones_like(share))
            return Looked(closely, sight, halved.mask, covered, _mirrored(encoder, closely, sight))
        rows, columns = (np.flatnonzero(seen.any(axis=a)) for a in (1, 0))
        if max(len(rows), len(columns)) < _SMALLEST:
            raise EmptyShapeError("no shape is seen in the picture; cut it out, or make what is around plain")
        if again < _CLOSER:
            cell = (box[2] - box[0]) / len(seen)
            corners = np.array(extent(seen)) * cell
            box = _squared(np.tile(box[:2], 2) + corners, _FILLED)
    mirrored = _mirrored(encoder, closely, sight)
    return Looked(closely, sight, seen, _believed(sight.silhouette.numpy(), seen, mirrored), mirrored)


def _believed(likely: np.ndarray, seen: np.ndarray, mirrored: float) -> Covered:
    """What is covered where cells are likely (SIDE / 2, SIDE / 2) to be the shape. Pieces that are not `seen`
    count for nothing, and cells that may be either for little; where the mirror image is seen otherwise, as
    before stripes, all do."""
    near = ndimage.binary_dilation(seen, np.ones((3, 3)))
    sure = np.where(seen | (likely < 0.5), abs(2 * likely - 1), 0.0)
    sure *= np.sqrt(np.clip((mirrored - _UNSURE) / (_SURE - _UNSURE), _LEAST_TRUST, 1.0))
    share, trust = (
        np.clip(ndimage.zoom(each, 2, order=1, mode="nearest", grid_mode=True), 0, 1)
        for each in (np.where(near, likely, 0.0), sure)
    )
    return Covered(share, trust)


def _mirrored(encoder: ImageEncoder, closely: np.ndarray, sight: Sight) -> float:
    """IoU of what is taken for the shape with what is taken for it in the mirror image."""
    (other,) = encoder.see(_tensor(closely[:, ::-1])[None])
    here, there = sight.silhouette.numpy() > 0.5, other.silhouette.numpy()[:, ::-1] > 0.5
    return float((here & there).sum() / max((here | there).sum(), 1))


def _eight_bits(picture, path: Path):  # type: ignore[no-untyped-def]  # Pillow is heavy to import
    """A picture of 16 bits a pixel, or of floats, in 8: Pillow would cut off what is brighter."""
    if not picture.mode.startswith(("I", "F")):
        return picture
    from PIL import Image

    values = np.asarray(picture, np.float64)
    if not np.isfinite(values).all():
        raise UnreadableFileError(f"{path}: has NaN or infinite levels; all must be finite")
    low, high = values.min(), values.max()
    return Image.fromarray(np.uint8(255 * (values - low) / max(high - low, 1e-9)))


def _squared(box: np.ndarray, filled: float) -> np.ndarray:
    """The square about a box (top, left, bottom, right) whose longer side then fills this share of it."""
    middle, side = (box[:2] + box[2:]) / 2, (box[2:] - box[:2]).max() / filled
    return np.concatenate([middle - side / 2, middle + side / 2])


def _cut_out(pixels: np.ndarray, box: np.ndarray, outside: float | None = None) -> np.ndarray:
    """(SIDE, SIDE, 3) of a square box of the picture; around it, `outside`, or its edge goes on."""
    from PIL import Image

    top, left, bottom, right = np.rint(box).astype(int)
    rows, columns = np.arange(top, max(bottom, top + 1)), np.arange(left, max(right, left + 1))
    near = [np.clip(a, 0, n - 1) for a, n in zip((rows, columns), pixels.shape, strict=False)]
    whole = pixels[near[0][:, None], near[1]]
    if outside is not None:
        whole[near[0] != rows] = whole[:, near[1] != columns] = outside
    levels = Image.fromarray(np.rint(255 * whole).astype(np.uint8))
    return np.asarray(levels.resize((SIDE, SIDE), Image.Resampling.BOX), np.float32) / 255


def _tensor(picture: np.ndarray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(picture.transpose(2, 0, 1)))


def _halved(mask: np.ndarray) -> np.ndarray:
    return np.asarray(mask.reshape(SIDE // 2, 2, SIDE // 2, 2).mean(axis=(1, 3)))


def _largest(mask: np.ndarray) -> np.ndarray:
    """Of the pieces of a mask, the largest and those that are a tenth of it: legs come apart where thin."""
    pieces, count = ndimage.label(mask, np.ones((3, 3)))
    if count < 2:
        return mask
    sizes = np.bincount(pieces.ravel())[1:]
    return np.isin(pieces, 1 + np.flatnonzero(sizes >= 0.1 * sizes.max()))
