// Two blocks of rock, 20 km x 10 km each, on both sides of the plane y = 0. They share no point, and their meshes differ. Lengths in km.
far = 0.8;
upper_tip = 0.008; upper_middle = 0.04;   // mesh sizes at the tips of the fault and in its middle
lower_tip = 0.01; lower_middle = 0.05;
Point(1) = {-10, 0, 0, far}; Point(2) = {-1, 0, 0, upper_tip}; Point(3) = {0, 0, 0, upper_middle}; Point(4) = {1, 0, 0, upper_tip};
Point(5) = {10, 0, 0, far}; Point(6) = {10, 10, 0, far}; Point(7) = {-10, 10, 0, far};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5};
Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7}; Plane Surface(1) = {1};
Physical Curve("upper_fault") = {2, 3};
Physical Curve("upper_locked") = {1, 4};
Physical Curve("upper_right") = {5};
Physical Curve("upper_outer") = {6};
Physical Curve("upper_left") = {7};
Physical Surface("upper") = {1};
Point(11) = {-10, 0, 0, far}; Point(12) = {-1, 0, 0, lower_tip}; Point(13) = {0, 0, 0, lower_middle}; Point(14) = {1, 0, 0, lower_tip};
Point(15) = {10, 0, 0, far}; Point(16) = {10, -10, 0, far}; Point(17) = {-10, -10, 0, far};
Line(11) = {11, 12}; Line(12) = {12, 13}; Line(13) = {13, 14}; Line(14) = {14, 15};
Line(15) = {15, 16}; Line(16) = {16, 17}; Line(17) = {17, 11};
Curve Loop(11) = {11, 12, 13, 14, 15, 16, 17}; Plane Surface(11) = {11};
Physical Curve("lower_fault") = {12, 13};
Physical Curve("lower_locked") = {11, 14};
Physical Curve("lower_right") = {15};
Physical Curve("lower_outer") = {16};
Physical Curve("lower_left") = {17};
Physical Surface("lower") = {11};
