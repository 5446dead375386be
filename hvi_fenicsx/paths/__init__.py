"""Equilibria of a condensed problem as its load factor goes on, with memory; works on arrays."""
