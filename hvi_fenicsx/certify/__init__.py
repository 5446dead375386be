"""How good a solution is: certificate, state of Γc, second order, uniqueness."""
