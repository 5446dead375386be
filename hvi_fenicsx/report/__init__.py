"""The report of a finished result folder: pictures and one page of html. No MPI, no dolfinx."""
