"""reduced."""
