"""The mesh: domain shapes, gmsh, refinement, coarsening, and the transfer between levels."""
