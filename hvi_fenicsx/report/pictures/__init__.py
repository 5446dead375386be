"""The pictures of a finished folder, drawn by a process of its own.

To add a picture, put a module into ``kinds``: a function that draws it, under :func:`.registry.picture`.
"""
