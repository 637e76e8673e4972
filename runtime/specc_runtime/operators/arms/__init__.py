"""Operators for any arm that has a MuJoCo model (MJCF).

An arm is a value that is loaded once and carries the frames of its base and its tip, so that poses
of another arm do not fit. It is a constant of a system, or in a description with parameters memory
that nothing writes. A specification declares what it uses, here for seven joints:

    frames: {B: base, E: tip}
    types:
      Arm: {frames: [P, Q], opaque: true, python: "specc_runtime.operators.arms.model:Arm"}
    files: {robot: plants/robot.xml}
    constants: {arm: 'load_arm(robot, "base", "tool", 7)'}
    operators:
      load_arm:
        signature: "(model: file, base: text, tip: text, n: int) -> Arm[B, E]"
        python: "specc_runtime.operators.arms.model:load_arm"
      DK:
        signature: "(arm: Arm[P, Q], q: vector[7, rad]) -> pose[P, Q]"
        python: "specc_runtime.operators.arms.kinematics:direct_kinematics"
      IK:
        signature: >-
          (arm: Arm[P, Q], X_d: pose[P, Q], q_p: vector[7, rad]) -> optional[vector[7, rad]]
        python: "specc_runtime.operators.arms.kinematics:inverse_kinematics"
"""
