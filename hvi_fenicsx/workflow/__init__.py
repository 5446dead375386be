"""From a scene to a certified solution: domain, problem, existence, solve, certificate, estimate, in this order."""

from .solution import LastBorne, Solution
from .solving import Preparation, certified, find_solution, finish, prepare, solve, unsolved
