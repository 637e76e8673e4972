"""E05xx: what stands behind the devices, compared with the model file of the plant."""

from specc.diagnostics.code import Code

_ARM = """\
    irp.E.m.c_d: {actuators: [shoulder_motor, elbow_motor]}
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
        "rgb or depth image. Without `through:` the element is a number or a vector of numbers.",
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
        "Noise is for data of sensors, with one standard deviation for each, and `kinect` is for "
        "depth images.",
        _plant(_ARM + _EYE + _WRIST.replace("]}", "], noise: '0.3[N]'}")),
        _plant(_ARM + _EYE + _WRIST.replace("]}", "], noise: ['0.3[N]', '0.01[N*m]']}")),
        "file",
    ),
)
