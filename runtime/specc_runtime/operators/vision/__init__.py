"""Recognition of textured boxes in an RGB-D picture (section 4.7).

The operators of eq. 51 in their order: FE and IC in `features`, FM in `matching`, CG in `grouping`,
HP in `hypotheses`, HV in `verification`. The models they compare with are made in `models`, the
values between them are in `values`. `opencv` is the only door to OpenCV.
"""
