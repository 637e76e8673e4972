"""E05xx: what stands behind the devices, compared with the model file of the plant."""

from specc.diagnostics.code import Code

CODES = (
    Code(
        "E0501",
        "model of the plant cannot be used",
        "The MJCF file is missing, cannot be read, is not XML, has another root than <mujoco>, or "
        "declares a document type, which MJCF never does.",
        "plant: {model: plants/no_such_model.xml}\n",
        "plant: {model: plants/irp6_picking.xml}\n",
    ),
    Code(
        "E0502",
        "unknown name in the model",
        "A binding names a joint, sensor, actuator or camera that the model file does not have.",
        "irp.E.m.F_m: {sensors: [wrist_froce]}\n",
        "irp.E.m.F_m: {sensors: [wrist_force]}\n",
    ),
    Code(
        "E0503",
        "binding of an unknown element",
        "What is bound is an element of a device: agent, `E` or `R`, device, element. No device or "
        "no element has this name.",
        "bind: {irp.E.m.c: {actuators: [q1]}}    # the element is called c_d\n",
        "bind: {irp.E.m.c_d: {actuators: [q1]}}\n",
    ),
    Code(
        "E0504",
        "element without a binding",
        "A specification with a plant says for every element of every device what stands behind "
        "it. Without that, a run could not begin.",
        "real_effectors: {m: {x: {c_d: real}, y: {m_m: real}}}\n"
        "bind: {irp.E.m.c_d: {actuators: [q1]}}\n",
        "real_effectors: {m: {x: {c_d: real}, y: {m_m: real}}}\n"
        "bind: {irp.E.m.c_d: {actuators: [q1]}, irp.E.m.m_m: {joints: [q1]}}\n",
    ),
    Code(
        "E0505",
        "binding of the wrong kind",
        "An element that a device accepts moves actuators; one that it reports is measured by "
        "joints, sensors, the force of actuators, or a camera, which stands alone and gives an "
        "rgb or depth image. Without `through:` the element is a number or a vector of numbers.",
        "irp.E.m.c_d: {sensors: [wrist_force]}    # c_d is commanded\n",
        "irp.E.m.c_d: {actuators: [q1_motor]}\n",
    ),
    Code(
        "E0506",
        "not a standard deviation",
        "`noise:` is a number with its unit, or a list with one for each sensor, none negative; "
        "or the word `kinect` for a depth image.",
        'noise: "-0.3[N]"\n',
        'noise: "0.3[N]"\n',
    ),
    Code(
        "E0507",
        "sizes differ",
        "An element without a function in between (`through:`) has as many numbers as the joints, "
        "sensors and actuators behind it together, or as many pixels as the camera.",
        'x: {c_d: "vector[6, A]"}\nbind: {irp.E.m.c_d: {actuators: [q1_motor, q2_motor]}}\n',
        'x: {c_d: "vector[2, A]"}\nbind: {irp.E.m.c_d: {actuators: [q1_motor, q2_motor]}}\n',
    ),
    Code(
        "E0508",
        "actuator driven twice",
        "Two elements command one actuator; it could obey only one of them.",
        "irp.E.m.c_d: {actuators: [q1]}\nirp.E.g.c_d: {actuators: [q1]}\n",
        "irp.E.m.c_d: {actuators: [q1]}\nirp.E.g.c_d: {actuators: [gripper]}\n",
    ),
    Code(
        "E0509",
        "rate of a sensor does not fit",
        "The period of a sensor is a whole number of base ticks, and either its rate or that of "
        "its reader is a whole multiple of the other. Otherwise samples would be read late by a "
        "time that changes.",
        "k: {rate: 5 Hz}\nbind: {irp.R.k.I: {camera: kinect, image: rgb, rate: 3 Hz}}\n",
        "k: {rate: 5 Hz}\nbind: {irp.R.k.I: {camera: kinect, image: rgb, rate: 10 Hz}}\n",
    ),
    Code(
        "E0510",
        "noise does not fit",
        "Noise is for data of sensors, with one standard deviation for each, and `kinect` is for "
        "depth images.",
        'irp.E.m.F_m: {sensors: [force, torque], noise: "0.3[N]"}\n',
        'irp.E.m.F_m: {sensors: [force, torque], noise: ["0.3[N]", "0.01[N*m]"]}\n',
    ),
)
