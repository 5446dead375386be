"""What surrounds a run: ranks, processes, signals, log, timing, memory."""
