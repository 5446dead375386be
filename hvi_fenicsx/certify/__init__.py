"""How good a solution is: certificate, second order, warnings, error estimates."""
