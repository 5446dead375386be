"""Load paths of a body: rows in SI, certified and measured, kept in a journal, written into a folder."""
