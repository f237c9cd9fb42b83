"""Compares the recorded feet with pinocchio's: check_kinematics.py RECORDING URDF

Forward kinematics of the exported URDF at the recorded joint angles must put every tip where the recording
says it was measured, within 1e-6 m, in the body frame and, on the planned trunk, in the world.
"""

import json
import sys

import numpy
import pinocchio
from mcap.reader import make_reader

recording, urdf = sys.argv[1:]
LARGEST_M = 1e-6

model = pinocchio.buildModelFromUrdf(urdf)
data = model.createData()
vector = lambda place: numpy.array([place["x"], place["y"], place["z"]])

cycles = {}
with open(recording, "rb") as file:
    for _, channel, message in make_reader(file).iter_messages(
        topics=["/joint_states", "/feet", "/trunk"]
    ):
        cycles.setdefault(message.sequence, {})[channel.topic] = json.loads(message.data)

worst, compared = 0.0, 0
for cycle in cycles.values():
    states, feet = cycle["/joint_states"], cycle["/feet"]["feet"]
    if len(states["name"]) < model.nq:
        continue
    angles = numpy.zeros(model.nq)
    for name, position in zip(states["name"], states["position"]):
        angles[model.joints[model.getJointId(name)].idx_q] = position
    pinocchio.framesForwardKinematics(model, data, angles)
    trunk = cycle["/trunk"]["pose"]
    turned = trunk["orientation"]
    trunk = pinocchio.SE3(
        pinocchio.Quaternion(turned["w"], turned["x"], turned["y"], turned["z"]).matrix(),
        vector(trunk["position"]),
    )
    for foot in feet:
        tip = data.oMf[model.getFrameId(foot["chain"] + ".tip")].translation
        worst = max(worst, numpy.linalg.norm(tip - vector(foot["measured_in_body"])))
        if "measured_in_world" in foot:
            worst = max(worst, numpy.linalg.norm(trunk.act(tip) - vector(foot["measured_in_world"])))
        compared += 1
assert compared > 1000, compared
assert worst <= LARGEST_M, f"tips differ by {worst} m"

# Limits and masses are those of the robot file, by eye of another parser.
assert numpy.all(model.lowerPositionLimit < model.upperPositionLimit)
assert numpy.all(model.effortLimit > 0) and numpy.all(model.velocityLimit > 0)
print(f"{compared} tips compared, {worst:.2e} m apart at most")
