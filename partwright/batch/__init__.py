"""Many shapes."""

from partwright.batch.together import fit_many

__all__ = ["fit_many"]
