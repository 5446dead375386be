"""A posteriori error estimates in the energy norm."""
