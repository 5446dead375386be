"""What accuracy costs in time: a scene solved along several axes, each point measured against a verified reference.

To add an axis, write a class in ``axes``; an error norm, a function in ``error_norms``; a picture, one in ``plots``.
"""
