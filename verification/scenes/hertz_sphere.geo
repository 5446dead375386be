// A quarter of a block of 30 mm x 30 mm x 15 mm; a ball is pressed into the middle of its lower side. Lengths in m.
a = 1.48e-3; W = 0.015; h = 8e-5;
SetFactory("Built-in");
r = 1.4*a;
Point(1) = {0, 0, 0, h};     Point(2) = {r, 0, 0, h};  Point(3) = {0, r, 0, h};
Point(4) = {W, 0, 0, 0.003}; Point(5) = {W, W, 0, 0.003}; Point(6) = {0, W, 0, 0.003};
Point(7) = {0, 0, W, 0.003}; Point(8) = {W, 0, W, 0.003}; Point(9) = {W, W, W, 0.003}; Point(10) = {0, W, W, 0.003};
Line(1) = {1, 2};  Circle(2) = {2, 1, 3};  Line(3) = {3, 1};
Line(4) = {2, 4};  Line(5) = {4, 5};  Line(6) = {5, 6};  Line(7) = {6, 3};
Line(8) = {1, 7};  Line(9) = {4, 8};  Line(10) = {5, 9};  Line(11) = {6, 10};
Line(12) = {7, 8}; Line(13) = {8, 9}; Line(14) = {9, 10}; Line(15) = {10, 7};
Curve Loop(1) = {1, 2, 3};              Plane Surface(1) = {1};   // where the ball may touch
Curve Loop(2) = {4, 5, 6, 7, -2};       Plane Surface(2) = {2};
Curve Loop(3) = {1, 4, 9, -12, -8};     Plane Surface(3) = {3};
Curve Loop(4) = {-3, -7, 11, 15, -8};   Plane Surface(4) = {4};
Curve Loop(5) = {5, 10, -13, -9};       Plane Surface(5) = {5};
Curve Loop(6) = {6, 11, -14, -10};      Plane Surface(6) = {6};
Curve Loop(7) = {12, 13, 14, 15};       Plane Surface(7) = {7};
Surface Loop(1) = {1, 2, 3, 4, 5, 6, 7}; Volume(1) = {1};
Physical Surface("ball") = {1};
Physical Surface("front") = {3};
Physical Surface("left") = {4};
Physical Surface("top") = {7};
Physical Volume("block") = {1};
Field[1] = Ball;      // fine below the contact too, not on its surface alone
Field[1].Radius = r; Field[1].Thickness = 10*a; Field[1].VIn = h; Field[1].VOut = 0.003;
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0;
