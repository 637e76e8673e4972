"""E05xx: what stands behind the devices, compared with the model of the plant; and the task."""

from specc.diagnostics.code import Code

_ARM = """\
    irp.E.m.c_d: {actuators: [shoulder_motor, elbow_motor]}
    irp.E.m.m_m: {joints: [shoulder, elbow]}
"""
_DRIVEN = """\
    irp.E.m.c_d:
      actuators: [shoulder_motor, elbow_motor]
      joints: [%s]
      through: "arm.drives:torques"
    irp.E.m.m_m: {joints: [shoulder, elbow]}
"""
_WRIST = "    irp.E.m.F_m: {sensors: [wrist_force, wrist_torque]}\n"
_EYE = "    irp.R.k.I: {camera: kinect, image: rgb}\n"


def _plant(bind: str) -> str:
    return f"plant:\n  model: plants/arm.xml\n  bind:\n{bind}"


CODES = (
    Code(
        "E0501",
        "model of the plant cannot be used",
        "The MJCF file is missing, cannot be read, is not XML, has another root than <mujoco>, or "
        "declares a document type, which MJCF never does.",
        _plant(_ARM + _WRIST + _EYE).replace("arm.xml", "arms.xml"),
        _plant(_ARM + _WRIST + _EYE),
        "file",
    ),
    Code(
        "E0502",
        "unknown name in the model",
        "A binding names a joint, sensor, actuator or camera that the model file does not have.",
        _plant(_ARM + _WRIST.replace("force,", "froce,") + _EYE),
        _plant(_ARM + _WRIST + _EYE),
        "file",
    ),
    Code(
        "E0503",
        "binding of an unknown element",
        "What is bound is an element of a device: agent, `E` or `R`, device, element. No device or "
        "no element has this name.",
        _plant(_ARM + _WRIST + _EYE + _WRIST.replace("F_m", "F_mm")),
        _plant(_ARM + _WRIST + _EYE),
        "file",
    ),
    Code(
        "E0505",
        "binding of the wrong kind",
        "An element that a device accepts moves actuators; one that it reports is measured by "
        "joints, sensors, the force of actuators, or a camera, which stands alone and gives an "
        "rgb or depth image. Without `through:` the element is a number or a vector of numbers. A "
        "plant in Python gives and takes the elements themselves: only rates are said of them.",
        _plant(_ARM + _WRIST + _EYE.replace(", image: rgb", "")),
        _plant(_ARM + _WRIST + _EYE),
        "file",
    ),
    Code(
        "E0506",
        "not a standard deviation",
        "`noise:` is a number with its unit, or a list with one for each sensor, none negative; "
        "or the word `kinect` for a depth image.",
        _plant(_ARM + _EYE + _WRIST.replace("]}", "], noise: ['-0.3[N]', '0.01[N*m]']}")),
        _plant(_ARM + _EYE + _WRIST.replace("]}", "], noise: ['0.3[N]', '0.01[N*m]']}")),
        "file",
    ),
    Code(
        "E0507",
        "sizes differ",
        "An element without a function in between (`through:`) has as many numbers as the joints, "
        "sensors and actuators behind it together, or as many pixels as the camera.",
        _plant(_ARM.replace(", elbow_motor", "") + _WRIST + _EYE),
        _plant(_ARM + _WRIST + _EYE),
        "file",
    ),
    Code(
        "E0508",
        "actuator driven twice",
        "Two elements command one actuator; it could obey only one of them.",
        _plant(_ARM.replace("elbow_motor", "shoulder_motor") + _WRIST + _EYE),
        _plant(_ARM + _WRIST + _EYE),
        "file",
    ),
    Code(
        "E0509",
        "rate of a sensor does not fit",
        "The period of a sensor is a whole number of base ticks, and either its rate or that of "
        "its reader is a whole multiple of the other. Otherwise samples would be read late by a "
        "time that changes.",
        _plant(_ARM + _WRIST + _EYE.replace("rgb", "rgb, rate: 3 Hz")),
        _plant(_ARM + _WRIST + _EYE.replace("rgb", "rgb, rate: 10 Hz")),
        "file",
    ),
    Code(
        "E0510",
        "noise does not fit",
        "Noise is for data of sensors, with one standard deviation for each, in the unit of what "
        "the sensor gives; `kinect` is for depth images.",
        _plant(_ARM + _EYE + _WRIST.replace("]}", "], noise: '0.3[N]'}")),
        _plant(_ARM + _EYE + _WRIST.replace("]}", "], noise: ['0.3[N]', '0.01[N*m]']}")),
        "file",
    ),
    Code(
        "E0511",
        "units differ from the plant's",
        "Without a function in between (`through:`), the numbers of the plant are those of the "
        "element: a servo for positions takes no speed, and a range finder gives no angle. Units "
        "follow from the kind of a sensor or actuator and of its joint; where a gear is given, "
        "they may be anything.",
        _plant(
            _ARM
            + _WRIST.replace("[wrist_force, wrist_torque]", "[wrist_torque, wrist_force]")
            + _EYE
        ),
        _plant(_ARM + _WRIST + _EYE),
        "file",
    ),
    Code(
        "E0512",
        "listed twice in a binding",
        "A joint or sensor stands twice in the list of one element: two numbers of the element "
        "would always be equal.",
        _plant(_ARM.replace("[shoulder, elbow]", "[shoulder, shoulder]") + _WRIST + _EYE),
        _plant(_ARM + _WRIST + _EYE),
        "file",
    ),
    Code(
        "W0513",
        "joints in another order than actuators",
        "The function of `through:` gets the joints and sets the actuators of one binding in the "
        "order in which they are listed. They are usually listed alike: the first actuator drives "
        "the first joint.",
        _plant(_DRIVEN % "elbow, shoulder" + _WRIST + _EYE),
        _plant(_DRIVEN % "shoulder, elbow" + _WRIST + _EYE),
        "file",
    ),
    Code(
        "E0514",
        "cycle that no row ends",
        "A cycle of a task ends with a transition, `from` one state `to` another. The table of the "
        "subsystem has no such row, so a run that counts cycles would never end.",
        "task: {cycle: {of: irp.m, from: S0, to: S1}}\n"
        "agents: {irp: {virtual_effectors: {m: {states: {S0: idle, S1: idle}, transitions: "
        "[[S0, terminal, always, S0], [S1, terminal, always, S0]]}}}}\n",
        "task: {cycle: {of: irp.m, from: S0, to: S0}}\n",
        "file",
    ),
)
