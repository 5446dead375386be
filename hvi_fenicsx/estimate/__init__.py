"""A posteriori error estimates in the energy norm, and warnings of numbers that are not plausible."""
