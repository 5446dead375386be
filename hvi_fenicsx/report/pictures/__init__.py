"""The pictures of a finished folder, drawn by a process of its own."""
