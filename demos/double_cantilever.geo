// The upper arm of a double cantilever, 100 mm x 1.5 mm: a crack of 30 mm, then 70 mm of glue. Lengths in mm.
n = 12;           // cells through the height
Point(1) = {0, 0, 0};      Point(2) = {30, 0, 0};     Point(3) = {100, 0, 0};
Point(4) = {100, 1.5, 0};  Point(5) = {30, 1.5, 0};   Point(6) = {0, 1.5, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1};
Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6};  Plane Surface(1) = {1};
Curve Loop(2) = {2, 3, 4, -7}; Plane Surface(2) = {2};
Transfinite Curve {1, 5} = 61;
Transfinite Curve {2, 4} = 351;   // 0.2 mm: a few cells in the zone in which the glue gives way
Transfinite Curve {3, 6, 7} = n + 1;
Transfinite Surface {1, 2};
Physical Curve("end") = {6};
Physical Curve("crack") = {1};
Physical Curve("glue") = {2};
Physical Curve("far") = {3};
Physical Surface("arm") = {1, 2};
