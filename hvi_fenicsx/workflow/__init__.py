"""From a scene to a certified solution: domain, problem, existence, solve, certificate, estimate, in this order."""

from .preparation import Preparation, prepare
from .solution import LastBorne, Solution
from .solving import certified, find_solution, finish, solve, unsolved
