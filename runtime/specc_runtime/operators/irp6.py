"""The numbers of the IRp-6 (track variant, track locked at 0) and nothing else.

Axes come in the order column, lower arm, upper arm, T, V, N. "launch" is
irp6_bringup/launch/irp6-ot-inside.launch of RCPRG-ros-pkg/irp6_ui, "robot" is
RCPRG-ros-pkg/irp6_robot and "mrrocpp" is ptroja/mrrocpp.
"""

from math import pi

CONTROL_PERIOD_S = 0.002  # paper, 4.9

# Links, metres (robot: Irp6otmKinematic.h).
SHOULDER_HEIGHT = 0.95
LOWER_ARM = 0.455
UPPER_ARM = 0.67
WRIST = 0.19
TOOL = 0.25  # wrist to E along the tool axis (launch: Irp6otmToolInt)

# Joint limits of the controller, rad (launch).
JOINT_LOWER = (-2.4, -2.2689280276, -0.6108652382, -1.5707963268, -10.0, -2.88)
JOINT_UPPER = (2.9670597284, -0.872664626, 0.6981317008, 1.6057029118, 10.0, 2.93)

# Motor limits, rad (launch). Those of lower arm, upper arm, T and V are the real, coupled stops.
MOTOR_LOWER = (-470.0, -110.0, -80.0, -70.0, -80.0, -1000.0)
MOTOR_UPPER = (450.0, 100.0, 100.0, 380.0, 490.0, 3000.0)

# Motor positions at which the driven angle or screw is at its reference, rad (launch).
SYNCHRO = (-16.5, -4.012, -6.219, 159.5, 473.0, 769.7)

# Motor rad per joint rad (robot: Irp6otmTransmission.h).
GEAR_COLUMN = -158.0
GEAR_T = -128.0
GEAR_V = -128.0 * 0.6
GEAR_N = 288.8845

# Ball screws: lead 5 mm; length l(t) = sqrt(SQUARES + MI cos t - NI sin t), mm
# (robot: Irp6otmTransmission.h). Both screws share the sum of the squared triangle sides.
SCREW_RAD_PER_MM = 2.0 * pi / 5.0
SCREW_SQUARES = 77895.25
LOWER_MI, LOWER_NI, LOWER_LENGTH = 60902.55, -29346.68, 220.3374
UPPER_MI, UPPER_NI, UPPER_LENGTH = -44100.0, -51240.0, 183.8348

ENCODER_COUNTS = (4000.0, 4000.0, 4000.0, 4000.0, 4000.0, 2000.0)  # per motor turn (launch)

# Regulators (launch): rows of A, BB0, BB1, kp in mA per unit, eps, largest current in mA.
ARM_GAINS = (
    (0.412429378531, 1.5569592, 1.5028614, 200.0, 0.01, 20000.0),
    (0.655629139073, 0.6181068, 0.5916852, 100.0, 0.008, 15000.0),
    (0.315789473684, 1.1984784, 1.1424828, 120.0, 0.008, 18000.0),
    (0.548946716233, 0.6305064, 0.5874396, 170.0, 0.01, 15000.0),
    (0.391982182628, 0.4458592, 0.4085392, 110.0, 0.02, 8000.0),
    (0.3, 0.5456, 0.5056, 11.0, 0.005, 1000.0),
)

# Drives: J dw/dt = kt i - B w (launch: Irp6otHwModel_EC and _MW). V has the values of the larger
# motors: with those of N its loop falls into a limit cycle when currents act one period late.
TORQUE_CONSTANT = 0.105  # Nm/A
MOTOR_INERTIA = (1.5e-4, 1.5e-4, 1.5e-4, 1.5e-4, 1.5e-4, 1.5e-5)  # kg m2
MOTOR_DAMPING = (0.02, 0.02, 0.02, 0.02, 0.02, 2.0e-4)  # Nm s/rad

# Speeds and accelerations of motors, rad/s and rad/s2 (mrrocpp: ecp_g_newsmooth.cc). The regulator
# trips on 200 counts of desired increment in one period, a lower speed on all axes but N (launch).
MOTOR_SPEED = 200.0
MOTOR_ACCELERATION = 150.0
TRIP_COUNTS_PER_PERIOD = 200.0

# Force sensor ATI FT3084: pose of its frame S in the wrist (launch: Irp6otmForceTransformation).
SENSOR_HEIGHT = 0.09  # along the tool axis; S is turned by -90 degrees about it
TOOL_WEIGHT_N = 13.18
TOOL_COM_IN_WRIST = (0.004, 0.0, 0.13)

# Two-finger gripper tfg (robot: Irp6tfgM2J.cpp, Irp6tfgJ2M.cpp). d = A2 m^2 + A1 m + A0, with d the
# distance between the fingers in metres and m in rad.
FINGERS_A2, FINGERS_A1, FINGERS_A0 = -2.8313e-9, -1.451910074e-5, 0.074
FINGERS_LOWER, FINGERS_UPPER = 0.053, 0.09
GRIPPER_ENCODER_COUNTS = 128.0
# The published limit of 60 mA lies below the 100 mA by which the paper (4.8) detects a grasp.
GRIPPER_GAINS = (0.2, 15.984375, 15.784375, 0.33, 0.02, 120.0)
FINGERS_SPEED = 0.037 / 3.0  # m/s: the full stroke in 3 s, as applications command it
