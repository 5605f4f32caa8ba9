"""Method 3, PartSDF: a learned prior over shapes made of parts (Talabot et al. 2025)."""

from __future__ import annotations

from partwright.errors import MissingDependencyError

try:
    import torch  # noqa: F401
except ImportError as error:
    raise MissingDependencyError('partsdf needs PyTorch: pip install "partwright[torch]"') from error

from partwright.partsdf import editing
from partwright.partsdf.assemblies import from_assembly, to_assembly
from partwright.partsdf.config import Config, config_from, read_config
from partwright.partsdf.encoder import Encoder, load_encoder
from partwright.partsdf.encoder_training import train_encoder
from partwright.partsdf.from_photo import PhotoParts, reconstruct_photo
from partwright.partsdf.generator import Generator, load_generator
from partwright.partsdf.generator_training import train_generator
from partwright.partsdf.image_encoder import ImageEncoder, load_image_encoder
from partwright.partsdf.image_encoder_training import train_image_encoder
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import reconstruct
from partwright.partsdf.resampling import sound_samples
from partwright.partsdf.settings import ReconstructionSettings, Settings
from partwright.partsdf.training import train

__all__ = [
    "Config",
    "Encoder",
    "Generator",
    "ImageEncoder",
    "Model",
    "NeuralShape",
    "PhotoParts",
    "ReconstructionSettings",
    "Settings",
    "config_from",
    "editing",
    "from_assembly",
    "load_encoder",
    "load_generator",
    "load_image_encoder",
    "load_model",
    "mesh_shape",
    "read_config",
    "reconstruct",
    "reconstruct_photo",
    "sound_samples",
    "to_assembly",
    "train",
    "train_encoder",
    "train_generator",
    "train_image_encoder",
]
