"""What all tables of a scene file share: strict and frozen, with refusals in plain words at the right place.

Light: it loads pydantic and nothing heavier, and knows no particular table.
"""

from .descriptions import descriptions
from .fields import LONGEST, SHORTEST, Count, Finite, Length, Names, OneOf, Positive, names_of, vector
from .files import ExistingFile
from .messages import Keys, refusal, shown, unknown
from .tables import Mistake, Table, choose, input_error, located_error, mistakes_of, validation_error

__all__ = [
    "LONGEST",
    "SHORTEST",
    "Count",
    "ExistingFile",
    "Finite",
    "Keys",
    "Length",
    "Mistake",
    "Names",
    "OneOf",
    "Positive",
    "Table",
    "choose",
    "descriptions",
    "input_error",
    "located_error",
    "mistakes_of",
    "names_of",
    "refusal",
    "shown",
    "unknown",
    "validation_error",
    "vector",
]
