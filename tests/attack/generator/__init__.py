"""Random scenes."""
