"""The problem: the nondimensional forms, conditions, bounds and laws that the effects contribute."""
