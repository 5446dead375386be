"""What surrounds a run: ranks, processes, signals, logging, timing, memory."""
