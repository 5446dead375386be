"""The referee: an assembly, programmes and checks of its own, in numpy and scipy; nothing of the package."""
