"""Small models and helpers for tests of the plant."""

from pathlib import Path

PLANTS = Path(__file__).parents[2] / "specs" / "plants"
PICKING = str(PLANTS / "irp6_picking.xml")
CONVEYOR = str(PLANTS / "conveyor_gate.xml")

SLIDER = """
<mujoco>
  <option timestep="0.002" gravity="0 0 0"/>
  <worldbody>
    <body>
      <joint name="x" type="slide" axis="1 0 0"/>
      <geom type="sphere" size="0.1" mass="2"/>
      <site name="s"/>
    </body>
    <camera name="eye" pos="0 0 2"/>
  </worldbody>
  <actuator><motor name="push" joint="x"/></actuator>
  <sensor>
    <jointvel name="speed" joint="x"/>
    <framepos name="place" objtype="site" objname="s"/>
  </sensor>
  <keyframe><key name="home" qpos="0.5"/></keyframe>
</mujoco>
"""


def model_file(folder: Path, text: str = SLIDER) -> str:
    """Path of a file in the folder that holds the model."""
    path = folder / "model.xml"
    path.write_text(text)
    return str(path)
