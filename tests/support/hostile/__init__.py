"""Hostile inputs: files, folders, command lines and environments that a user may well have, each made from two numbers.

See docs/damaged-inputs.md.
"""
