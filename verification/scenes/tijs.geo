// The upper arm of a double cantilever, 150 mm x 2.1 mm: a crack of 48 mm, then 102 mm of glue. Lengths in mm.
n = 10;           // cells through the height
Point(1) = {0, 0, 0};        Point(2) = {48, 0, 0};     Point(3) = {150, 0, 0};
Point(4) = {150, 2.1, 0};    Point(5) = {48, 2.1, 0};   Point(6) = {0, 2.1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1};
Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6};  Plane Surface(1) = {1};
Curve Loop(2) = {2, 3, 4, -7}; Plane Surface(2) = {2};
Transfinite Curve {1, 5} = 81;
Transfinite Curve {2, 4} = 511;   // 0.2 mm
Transfinite Curve {3, 6, 7} = n + 1;
Transfinite Surface {1, 2};
Physical Curve("end") = {6};
Physical Curve("crack") = {1};
Physical Curve("glue") = {2};
Physical Curve("far") = {3};
Physical Surface("arm") = {1, 2};
