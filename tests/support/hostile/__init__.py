"""Hostile inputs: files, folders, command lines and environments that a user may well have, each made from two numbers.

``./hvi exec python3 tests/support/run_hostile.py --seed 1 --cases 300``; see docs/damaged-inputs.md.
"""
