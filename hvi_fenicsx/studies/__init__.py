"""What accuracy costs in time: a scene solved along several axes, each point measured against a verified reference."""
