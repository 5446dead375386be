"""All equilibria of a problem, or the lowest with a proof; works on arrays of the condensed problem."""
