"""Load paths: the equilibria of a body as a factor of its loads goes on, through peaks, snap-back and unloading."""
