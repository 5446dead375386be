// One half of a scarf joint: a bar 20 mm high, cut at 30 degrees through (0.1, 0.01). The other half is this one turned
// by 180 degrees. Lengths in m.
h = 0.02;
run = h / 2 / Tan(Pi / 6);
Point(1) = {0, 0, 0, 0.004};          Point(2) = {0.1 - run, 0, 0, 0.0015};
Point(3) = {0.1 + run, h, 0, 0.0015}; Point(4) = {0, h, 0, 0.004};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Physical Curve("cut") = {2};
Physical Curve("end") = {4};
Physical Surface("half") = {1};
