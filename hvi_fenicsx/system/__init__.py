"""The assembled system: matrix, Jacobian, local frames, levels, linear solvers, existence."""
