"""The problem on Γc alone: its stiffness formed or by factors, loads, bounds and laws, and the way back to the body."""
