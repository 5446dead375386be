"""From Python: a model is solved, checked, followed, searched and studied (docs/python.md); solutions in SI."""

from .following import ModelPath, follow
from .solution import ModelSolution as Solution
from .solving import ModelEquilibria, check, equilibria, solve, study
