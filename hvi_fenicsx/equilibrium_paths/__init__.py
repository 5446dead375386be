"""Equilibria of a condensed problem as its load factor goes on: exact or by steps, with memory; works on arrays."""
