"""Curves of equilibria that are not piecewise linear: followed by predictor and corrector, from event to event."""
