// The laminate of demos/mixed_mode_bending.geo with cells of 0.125 mm where the crack grows.
fine = 48;
Include "../../demos/mixed_mode_bending.geo";
