// One half of a plate with a crack of 2 m along its lower side. Lengths in m.
W = 20; h = 0.02;
Point(1) = {-W, 0, 0, 2};  Point(2) = {-1, 0, 0, h};  Point(3) = {0, 0, 0, h};  Point(4) = {1, 0, 0, h};  Point(5) = {W, 0, 0, 2};
Point(6) = {W, W, 0, 2};   Point(7) = {-W, W, 0, 2};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7}; Plane Surface(1) = {1};
Transfinite Curve {2, 3} = 51;
Physical Curve("crack") = {2, 3};
Physical Curve("bond") = {1, 4};
Physical Curve("outer") = {5, 6, 7};
Physical Surface("half") = {1};
