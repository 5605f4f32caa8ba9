"""Many shapes: at once in one process, or a folder of them by worker processes."""

from partwright.batch.directory import Plan, Share, fit_folder
from partwright.batch.index import write_index
from partwright.batch.pool import Limits
from partwright.batch.together import fit_many

__all__ = ["Limits", "Plan", "Share", "fit_folder", "fit_many", "write_index"]
