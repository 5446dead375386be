// Both arms of a double cantilever, 100 mm x 1.5 mm each: a crack of 30 mm, then 70 mm of glue. They share no point. Lengths in mm.
DefineConstant[ n = 12 ];              // cells through the height of an arm
DefineConstant[ upper_cells = 350 ];   // along the glue, 0.2 mm each
DefineConstant[ lower_cells = 350 ];
Point(1) = {0, 0, 0};      Point(2) = {30, 0, 0};     Point(3) = {100, 0, 0};
Point(4) = {100, 1.5, 0};  Point(5) = {30, 1.5, 0};   Point(6) = {0, 1.5, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1};
Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6};  Plane Surface(1) = {1};
Curve Loop(2) = {2, 3, 4, -7}; Plane Surface(2) = {2};
Transfinite Curve {1, 5} = 61;
Transfinite Curve {2, 4} = upper_cells + 1;
Transfinite Curve {3, 6, 7} = n + 1;
Transfinite Surface {1, 2};
Physical Curve("upper_end") = {6};
Physical Curve("upper_glue") = {2};
Physical Curve("upper_far") = {3};
Physical Surface("upper") = {1, 2};
Point(11) = {0, 0, 0};      Point(12) = {30, 0, 0};     Point(13) = {100, 0, 0};
Point(14) = {100, -1.5, 0};  Point(15) = {30, -1.5, 0};   Point(16) = {0, -1.5, 0};
Line(11) = {11, 12}; Line(12) = {12, 13}; Line(13) = {13, 14}; Line(14) = {14, 15}; Line(15) = {15, 16}; Line(16) = {16, 11};
Line(17) = {12, 15};
Curve Loop(11) = {11, 17, 15, 16};  Plane Surface(11) = {11};
Curve Loop(12) = {12, 13, 14, -17}; Plane Surface(12) = {12};
Transfinite Curve {11, 15} = 61;
Transfinite Curve {12, 14} = lower_cells + 1;
Transfinite Curve {13, 16, 17} = n + 1;
Transfinite Surface {11, 12};
Physical Curve("lower_end") = {16};
Physical Curve("lower_glue") = {12};
Physical Curve("lower_far") = {13};
Physical Surface("lower") = {11, 12};
