"""What is made from a finished result folder alone: pictures and pages. No MPI, no dolfinx, no scene objects."""
