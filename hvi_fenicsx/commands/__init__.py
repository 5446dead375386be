"""What the commands do, a module for each; its ``execute`` gives the exit code. Collective under mpirun."""
