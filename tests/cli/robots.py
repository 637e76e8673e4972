"""Small models of robots, as texts."""

import struct
import zlib


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


PNG = (
    b"\x89PNG\r\n\x1a\n"
    + _chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 2, 8, 2, 0, 0, 0))
    + _chunk(b"IDAT", zlib.compress((b"\0" + bytes(6)) * 2))
    + _chunk(b"IEND", b"")
)
"""A picture of four black pixels."""
HEAD = '<mujoco model="{name}"><option timestep="0.002"/>'
FLOOR = '<geom name="floor" type="plane" size="5 5 0.1"/>'


def arm(actuators: str, names: tuple[str, str, str] = ("shoulder", "elbow", "wrist")) -> str:
    """Three links in a vertical plane, stretched out, with actuators."""
    links = ends = ""
    for name in names:
        place = "0.3 0 0" if links else "0 0 1"
        links += f"""<body name="{name}_link" pos="{place}">
          <joint name="{name}" axis="0 1 0" range="-100 100" damping="0.2" armature="0.02"/>
          <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="1" contype="0"/>"""
        ends += "</body>"
    return f"""{HEAD.format(name="arm")}<worldbody>{links}
      <camera name="hand eye" pos="0.3 0 0" resolution="32 24"/>
      <site name="tip" pos="0.3 0 0"/>{ends}</worldbody>
    <actuator>{actuators}</actuator>
    <sensor><force name="tip_force" site="tip"/><torque name="tip_torque" site="tip"/></sensor>
    <keyframe><key name="home" qpos="0.4 -0.8 0.3"/></keyframe></mujoco>"""


JOINTS = ("shoulder", "elbow", "wrist")
SERVOS = "".join(f'<position name="{j}_servo" joint="{j}" kp="200" kv="20"/>' for j in JOINTS)
MOTORS = "".join(f'<motor name="{j}_motor" joint="{j}" ctrlrange="-60 60"/>' for j in JOINTS)
SPEEDS = "".join(f'<velocity name="{j}_drive" joint="{j}" kv="5"/>' for j in JOINTS)

GRIPPER = f"""{HEAD.format(name="gripper")}
  <worldbody><body name="palm" pos="0 0 1">
    <geom size="0.03" mass="0.5" contype="0"/>
    <body name="left" pos="0 0.05 0">
      <joint name="left_finger" type="slide" axis="0 1 0" range="-0.04 0.01" damping="10"/>
      <geom size="0.01 0.01 0.03" type="box" mass="0.05" contype="0"/>
    </body>
    <body name="right" pos="0 -0.05 0">
      <joint name="right_finger" type="slide" axis="0 -1 0" range="-0.04 0.01" damping="10"/>
      <geom size="0.01 0.01 0.03" type="box" mass="0.05" contype="0"/>
    </body></body></worldbody>
  <tendon><fixed name="both"><joint joint="left_finger" coef="0.5"/>
    <joint joint="right_finger" coef="0.5"/></fixed></tendon>
  <equality><joint joint1="left_finger" joint2="right_finger"/></equality>
  <actuator><general name="grip" tendon="both" ctrlrange="0 255" gainprm="0.2"
    biastype="affine" biasprm="0 -200 -20"/></actuator></mujoco>"""

BASE = f"""{HEAD.format(name="rover")}
  <worldbody>{FLOOR}<body name="chassis" pos="0 0 0.1"><freejoint name="root"/>
    <geom type="box" size="0.2 0.15 0.03" mass="5"/>
    <body name="left" pos="0.1 0.18 0"><joint name="wheel_l" axis="0 1 0" armature="0.01"/>
      <geom type="cylinder" size="0.1 0.02" euler="90 0 0" mass="0.5"/></body>
    <body name="right" pos="0.1 -0.18 0"><joint name="wheel_r" axis="0 1 0" armature="0.01"/>
      <geom type="cylinder" size="0.1 0.02" euler="90 0 0" mass="0.5"/></body>
    <geom size="0.1" pos="-0.15 0 0" mass="0.2" friction="0.01"/>
    <site name="imu"/></body></worldbody>
  <actuator><velocity name="left_drive" joint="wheel_l" kv="2" ctrlrange="-10 10"/>
    <velocity name="right_drive" joint="wheel_r" kv="2" ctrlrange="-10 10"/></actuator>
  <sensor><accelerometer name="acc" site="imu"/><gyro name="gyro" site="imu"/>
    <rangefinder name="eye" site="imu"/></sensor></mujoco>"""


def _leg(name: str, x: float, y: float) -> str:
    return f"""<body name="{name}_thigh" pos="{x} {y} 0">
      <joint name="{name}_hip" axis="0 1 0" range="-90 90" damping="1" armature="0.01"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.3"/>
      <body name="{name}_shin" pos="0 0 -0.2">
        <joint name="{name}_knee" axis="0 1 0" range="-150 0" damping="1" armature="0.01"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" mass="0.2"/>
      </body></body>"""


_LEGS = {"fl": (0.2, 0.1), "fr": (0.2, -0.1), "hl": (-0.2, 0.1), "hr": (-0.2, -0.1)}
WALKER = f"""{HEAD.format(name="walker")}
  <worldbody>{FLOOR}<body name="trunk" pos="0 0 0.43"><freejoint name="root"/>
    <geom type="box" size="0.25 0.1 0.05" mass="5"/>
    {"".join(_leg(name, x, y) for name, (x, y) in _LEGS.items())}</body></worldbody>
  <actuator>{
    "".join(
        f'<motor name="{name}_{part}" joint="{name}_{part}" ctrlrange="-40 40"/>'
        for name in _LEGS
        for part in ("hip", "knee")
    )
}</actuator>
  <keyframe><key name="stand" qpos="0 0 0.37 1 0 0 0 {"0.5 -1 " * 4}"/></keyframe></mujoco>"""
