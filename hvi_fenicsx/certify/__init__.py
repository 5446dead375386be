"""What is said of a solution: certificate, second order, plausibility, error estimate."""
