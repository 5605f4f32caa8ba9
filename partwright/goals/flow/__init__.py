"""Drag: OpenFOAM's simulation, a data set of such, and a network that has learned from it."""

from partwright.goals.flow.air import Air
from partwright.goals.flow.simulation import Simulated, simulate
from partwright.goals.flow.skin import Skin

__all__ = ["Air", "Simulated", "Skin", "simulate"]
