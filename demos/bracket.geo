// A steel angle bracket that stands on an aluminium plate: two volumes that share no point, meshed with other sizes. Lengths in mm.
h = 3;            // the bracket's mesh size; the plate's is 1.7 times that
// the bracket's outline in the plane y = 10: a leg of 40 mm on the plate, a wall of 50 mm, both 6 mm thick
Point(1) = {0, 10, 0, h};   Point(2) = {40, 10, 0, h};  Point(3) = {40, 10, 6, h};
Point(4) = {6, 10, 6, h};   Point(5) = {6, 10, 50, h};  Point(6) = {0, 10, 50, h};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6}; Plane Surface(1) = {1};
b[] = Extrude {0, 30, 0} { Surface{1}; };
// the plate
k = 1.7*h;
Point(101) = {-20, 0, -8, k}; Point(102) = {60, 0, -8, k}; Point(103) = {60, 50, -8, k}; Point(104) = {-20, 50, -8, k};
Line(101) = {101, 102}; Line(102) = {102, 103}; Line(103) = {103, 104}; Line(104) = {104, 101};
Curve Loop(101) = {101, 102, 103, 104}; Plane Surface(101) = {101};
p[] = Extrude {0, 0, 8} { Surface{101}; };
Physical Volume("bracket") = {b[1]};
Physical Surface("foot") = {b[2]};
Physical Surface("head") = {b[6]};
Physical Volume("plate") = {p[1]};
Physical Surface("seat") = {p[0]};
Physical Surface("ground") = {101};
