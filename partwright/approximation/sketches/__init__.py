"""Outlines, extrusions and revolutions read off a closed surface: what a person would have drawn."""
