"""The mesh: domain shapes, gmsh files, refinement, coarsening, and the transfer between levels."""
