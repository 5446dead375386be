"""Mesh, smoothing and tolerance chosen until an error goal is met."""
