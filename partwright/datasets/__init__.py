"""Shapes that the project makes itself."""
