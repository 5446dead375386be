"""Smoothings: from a law with kinks to one without, at a stated price (docs/laws.md)."""
