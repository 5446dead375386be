// Mixed-mode bending: two arms of 100.8 mm x 2.25 mm that share no point, with a crack of 25.4 mm between them. Lengths in mm.
DefineConstant[ n = 10 ];       // cells through the height of an arm
DefineConstant[ fine = 24 ];    // along the 6 mm into which the crack grows, 0.25 mm each
Function Arm
  // s: 1 above, -1 below; p: number of the first point, line and surface
  Point(p) = {0, 0, 0};               Point(p + 1) = {25.4, 0, 0};      Point(p + 2) = {31.4, 0, 0};
  Point(p + 3) = {50.4, 0, 0};        Point(p + 4) = {100.8, 0, 0};     Point(p + 5) = {100.8, s*2.25, 0};
  Point(p + 6) = {50.4, s*2.25, 0};   Point(p + 7) = {31.4, s*2.25, 0}; Point(p + 8) = {25.4, s*2.25, 0};
  Point(p + 9) = {0, s*2.25, 0};
  Line(p) = {p, p + 1};         Line(p + 1) = {p + 1, p + 2}; Line(p + 2) = {p + 2, p + 3}; Line(p + 3) = {p + 3, p + 4};
  Line(p + 4) = {p + 4, p + 5}; Line(p + 5) = {p + 5, p + 6}; Line(p + 6) = {p + 6, p + 7}; Line(p + 7) = {p + 7, p + 8};
  Line(p + 8) = {p + 8, p + 9}; Line(p + 9) = {p + 9, p};
  Line(p + 10) = {p + 1, p + 8}; Line(p + 11) = {p + 2, p + 7}; Line(p + 12) = {p + 3, p + 6};
  Curve Loop(p) = {p, p + 10, p + 8, p + 9};                Plane Surface(p) = {p};
  Curve Loop(p + 1) = {p + 1, p + 11, p + 7, -(p + 10)};    Plane Surface(p + 1) = {p + 1};
  Curve Loop(p + 2) = {p + 2, p + 12, p + 6, -(p + 11)};    Plane Surface(p + 2) = {p + 2};
  Curve Loop(p + 3) = {p + 3, p + 4, p + 5, -(p + 12)};     Plane Surface(p + 3) = {p + 3};
  Transfinite Curve {p, p + 8} = 52;
  Transfinite Curve {p + 1, p + 7} = fine + 1;
  Transfinite Curve {p + 2, p + 6} = 20;
  Transfinite Curve {p + 3, p + 5} = 51;
  Transfinite Curve {p + 4, p + 9, p + 10, p + 11, p + 12} = n + 1;
  Transfinite Surface {p, p + 1, p + 2, p + 3};
Return
s = 1; p = 1; Call Arm;
s = -1; p = 101; Call Arm;
Physical Curve("upper_end") = {10};
Physical Curve("upper_glue") = {2};
Physical Curve("upper_rest") = {3, 4};
Physical Curve("upper_top") = {6, 7};
Physical Surface("upper") = {1, 2, 3, 4};
Physical Curve("lower_end") = {110};
Physical Curve("lower_glue") = {102};
Physical Curve("lower_rest") = {103, 104};
Physical Curve("lower_far") = {105};
Physical Curve("lower_bottom") = {106};
Physical Surface("lower") = {101, 102, 103, 104};
