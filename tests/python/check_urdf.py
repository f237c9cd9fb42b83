"""Opens exported URDF in a tool by others: check_urdf.py TOOL EXPECTED

EXPECTED is a JSON file with one entry for each robot: its URDF, its mass, poses within the ranges of its joints with
the tips and the centre of mass that the program computes there, and the masses of the links as simulated. TOOL is
mujoco, pybullet, drake, pinocchio or yourdfpy.
"""

import json
import sys
import xml.etree.ElementTree

import numpy

# Largest error of a tip and of the centre of mass, m; of masses and inertias, as a share.
PLACE_M = 1e-6
SHARE = 1e-6
# Largest condition of a mass matrix on a fixed trunk, and on one that moves, whose matrix mixes kg and kg m^2.
CONDITION, CONDITION_FREE = 1e5, 1e7


def assert_near(value, expected, what, least=0.0):
    """Each value as expected, within a share of the largest, or of `least`."""
    largest = max(numpy.max(numpy.abs(expected)), least)
    error = numpy.max(numpy.abs(numpy.asarray(value) - expected))
    assert error <= SHARE * largest, f"{what}: {value} is not {expected}"


def assert_place(place, expected, what):
    error = numpy.linalg.norm(numpy.asarray(place) - expected)
    assert error <= PLACE_M, f"{what} is {error} m off"


def assert_regular(matrix, what, condition=CONDITION):
    """A mass matrix: symmetric, positive definite, and not nearly singular."""
    matrix = numpy.asarray(matrix)
    assert_near(matrix, matrix.T, f"{what}: the mass matrix turned over")
    values = numpy.linalg.eigvalsh(matrix)
    assert values[0] > 0 and values[-1] / values[0] < condition, f"{what}: eigenvalues {values}"
    return values[-1] / values[0]


def assert_body(inertia, what):
    """Principal moments above 0, none larger than the other two together."""
    a, b, c = numpy.linalg.eigvalsh(numpy.asarray(inertia))
    assert a > 0 and a + b >= c, f"{what}: moments {a}, {b}, {c}"


def assert_limits(robot, limits):
    """Lowest and highest angle, effort and speed of every joint, as the robot file and its servos have them."""
    for joint in robot["joints"]:
        expected = [joint["low_rad"], joint["high_rad"], joint["effort_nm"], joint["speed_rad_s"]]
        assert_near(limits(joint["name"]), expected, joint["name"])


def with_pinocchio(robot):
    """Pinocchio's model on a fixed trunk, and how a pose becomes its angles."""
    import pinocchio

    model = pinocchio.buildModelFromUrdf(robot["urdf"])
    places = [model.joints[model.getJointId(joint["name"])].idx_q for joint in robot["joints"]]

    def angles(pose):
        q = numpy.zeros(model.nq)
        q[places] = pose
        return q

    return pinocchio, model, places, angles


def pinocchio(robot):
    pinocchio, model, places, angles = with_pinocchio(robot)
    data = model.createData()
    free = pinocchio.buildModelFromUrdf(robot["urdf"], pinocchio.JointModelFreeFlyer())
    free_data = free.createData()
    assert_near(pinocchio.computeTotalMass(free), robot["mass_kg"], "mass")
    for number, inertia in enumerate(free.inertias[1:]):
        assert_body(inertia.inertia, free.names[number + 1])
    at = lambda name: model.joints[model.getJointId(name)].idx_q
    assert_limits(
        robot,
        lambda name: [
            limit[at(name)]
            for limit in (
                model.lowerPositionLimit,
                model.upperPositionLimit,
                model.effortLimit,
                model.velocityLimit,
            )
        ],
    )
    worst = 0
    for pose in robot["poses"]:
        q = angles(pose["angles_rad"])
        pinocchio.framesForwardKinematics(model, data, q)
        for chain, tip in pose["tips_m"].items():
            assert_place(data.oMf[model.getFrameId(chain + ".tip")].translation, tip, chain)
        whole = numpy.concatenate([[0, 0, 0, 0, 0, 0, 1], q])
        assert_place(pinocchio.centerOfMass(free, free_data, whole), pose["center_of_mass_m"], "centre of mass")
        matrix = pinocchio.crba(model, data, q)
        worst = max(worst, assert_regular(numpy.triu(matrix) + numpy.triu(matrix, 1).T, "pose"))
        whole = pinocchio.crba(free, free_data, whole)
        assert_regular(numpy.triu(whole) + numpy.triu(whole, 1).T, "pose, free", CONDITION_FREE)
    return worst


def mujoco(robot):
    import mujoco

    model = mujoco.MjModel.from_xml_path(robot["urdf"])
    data = mujoco.MjData(model)
    assert_near(sum(model.body_mass), robot["mass_kg"], "mass")
    for number in range(1, model.nbody):
        assert_body(numpy.diag(model.body_inertia[number]), model.body(number).name)
    assert model.ngeom > len(robot["chains"])
    joints = [model.joint(joint["name"]) for joint in robot["joints"]]
    for expected, joint in zip(robot["joints"], joints):
        assert_near(joint.range, [expected["low_rad"], expected["high_rad"]], joint.name)
        assert_near(joint.damping, expected["damping_nm_s"], joint.name, 1)
        assert_near(joint.frictionloss, expected["friction_nm"], joint.name, 1)
    rows = [joint.dofadr[0] for joint in joints]
    # Bent, no link touches one of its own limb: else its joints could not turn.
    for expected, joint in zip(robot["joints"], joints):
        low, high = expected["low_rad"], expected["high_rad"]
        data.qpos[joint.qposadr[0]] = 0.5 * (low + high) + 0.15 * (high - low)
    mujoco.mj_forward(model, data)
    for contact in data.contact:
        names = [model.body(model.geom_bodyid[geom]).name for geom in contact.geom]
        assert names[0].split(".")[0] != names[1].split(".")[0], f"{names} touch each other"
    worst = 0
    pinocchio, other, places, angles = with_pinocchio(robot)
    other_data = other.createData()
    for pose in robot["poses"]:
        for joint, angle in zip(joints, pose["angles_rad"]):
            data.qpos[joint.qposadr[0]] = angle
        mujoco.mj_forward(model, data)
        for chain, tip in pose["tips_m"].items():
            assert_place(data.body(chain + ".tip").xpos, tip, chain)
        matrix = numpy.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, matrix)
        matrix = matrix[numpy.ix_(rows, rows)]
        worst = max(worst, assert_regular(matrix, "pose"))
        same = pinocchio.crba(other, other_data, angles(pose["angles_rad"]))
        same = (numpy.triu(same) + numpy.triu(same, 1).T)[numpy.ix_(places, places)]
        assert_near(matrix, same, "pinocchio's mass matrix")
    return worst


def drake(robot):
    import logging

    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    # Drake has no friction in joints, and says so of each joint.
    logging.getLogger("drake").setLevel(logging.ERROR)
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, -9.81])
    Parser(plant).AddModels(robot["urdf"])
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("body"))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    assert_near(plant.CalcTotalMass(context), robot["mass_kg"], "mass")
    for link in plant.GetBodyIndices(plant.GetModelInstanceByName(robot["name"])):
        inertia = plant.get_body(link).CalcSpatialInertiaInBodyFrame(context)
        about_center = inertia.Shift(inertia.get_com()).CalcRotationalInertia()
        assert_body(about_center.CopyToFullMatrix3(), plant.get_body(link).name())
    joints = [plant.GetJointByName(joint["name"]) for joint in robot["joints"]]
    rows = [joint.velocity_start() for joint in joints]
    for expected, joint in zip(robot["joints"], joints):
        limits = [*joint.position_lower_limits(), *joint.position_upper_limits()]
        assert_near(limits, [expected["low_rad"], expected["high_rad"]], joint.name())
        assert_near(joint.velocity_upper_limits(), expected["speed_rad_s"], joint.name(), 1)
        assert_near(joint.default_damping(), expected["damping_nm_s"], joint.name(), 1)
    pinocchio, other, places, angles = with_pinocchio(robot)
    other.gravity.linear = numpy.array([0, 0, -9.81])
    other_data = other.createData()
    worst = 0
    for pose in robot["poses"]:
        for joint, angle in zip(joints, pose["angles_rad"]):
            joint.set_angle(context, angle)
        for chain, tip in pose["tips_m"].items():
            frame = plant.GetFrameByName(chain + ".tip")
            assert_place(frame.CalcPoseInWorld(context).translation(), tip, chain)
        assert_place(plant.CalcCenterOfMassPositionInWorld(context), pose["center_of_mass_m"], "centre of mass")
        worst = max(worst, assert_regular(plant.CalcMassMatrix(context), "pose"))
        weight = -plant.CalcGravityGeneralizedForces(context)[rows]
        same = pinocchio.computeGeneralizedGravity(other, other_data, angles(pose["angles_rad"]))
        assert_near(weight, same[places], "pinocchio's torques of gravity")
    return worst


def pybullet(robot):
    import pybullet

    if not pybullet.isConnected():
        pybullet.connect(pybullet.DIRECT)
    # With the inertia of the file, and with PyBullet's own, which it takes from the shapes.
    for flags in (pybullet.URDF_USE_INERTIA_FROM_FILE, 0):
        pybullet.resetSimulation()
        body = pybullet.loadURDF(robot["urdf"], flags=flags)
        links = range(-1, pybullet.getNumJoints(body))
        dynamics = [pybullet.getDynamicsInfo(body, link) for link in links]
        assert_near(sum(info[0] for info in dynamics), robot["mass_kg"], "mass")
        if flags:
            for info in dynamics:
                assert_body(numpy.diag(info[2]), "link")
    # A base that is fixed has no mass there.
    pybullet.resetSimulation()
    body = pybullet.loadURDF(robot["urdf"], useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
    facts = [pybullet.getJointInfo(body, link) for link in links[1:]]
    by_name = {fact[1].decode(): fact for fact in facts}
    by_link = {fact[12].decode(): fact[0] for fact in facts}
    assert_limits(robot, lambda name: by_name[name][8:12])
    for joint in robot["joints"]:
        assert_near(by_name[joint["name"]][6:8], [joint["damping_nm_s"], joint["friction_nm"]], joint["name"], 1)
    assert pybullet.getCollisionShapeData(body, -1) and pybullet.getVisualShapeData(body)
    hinges = [fact[0] for fact in facts if fact[2] == pybullet.JOINT_REVOLUTE]
    order = [[joint["name"] for joint in robot["joints"]].index(facts[hinge][1].decode()) for hinge in hinges]
    worst = 0
    for pose in robot["poses"]:
        for joint, angle in zip(robot["joints"], pose["angles_rad"]):
            pybullet.resetJointState(body, by_name[joint["name"]][0], angle)
        for chain, tip in pose["tips_m"].items():
            state = pybullet.getLinkState(body, by_link[chain + ".tip"], computeForwardKinematics=True)
            assert_place(state[4], tip, chain)
        angles = [pose["angles_rad"][joint] for joint in order]
        worst = max(worst, assert_regular(pybullet.calculateMassMatrix(body, angles), "pose"))
    return worst


def yourdfpy(robot):
    import yourdfpy

    model = yourdfpy.URDF.load(robot["urdf"])
    assert model.validate(), model.errors
    joints = {joint.name: joint for joint in model.robot.joints}
    links = {link.name: link for link in model.robot.links}
    masses = {name: link.inertial for name, link in links.items()}
    assert_near(sum(inertial.mass for inertial in masses.values()), robot["mass_kg"], "mass")
    for name, inertial in masses.items():
        assert inertial.mass > 0, name
        assert_body(inertial.inertia, name)
    limit = lambda name: joints[name].limit
    assert_limits(
        robot, lambda name: [limit(name).lower, limit(name).upper, limit(name).effort, limit(name).velocity]
    )
    for joint in robot["joints"]:
        dynamics = joints[joint["name"]].dynamics
        assert_near(float(dynamics.damping), joint["damping_nm_s"], joint["name"], 1)
        assert_near(float(dynamics.friction), joint["friction_nm"], joint["name"], 1)
    # Each link as it is simulated, a tip together with the link that it is fixed to.
    for name, simulated in robot["simulated"].items():
        parts = [(masses[name], numpy.zeros(3))]
        parts += [
            (masses[joint.child], joint.origin[:3, 3])
            for joint in joints.values()
            if joint.type == "fixed" and joint.parent == name
        ]
        assert_near(sum(part.mass for part, _ in parts), simulated["mass_kg"], name)
        centers = [(part.mass, place + part.origin[:3, 3]) for part, place in parts]
        center = sum(mass * place for mass, place in centers) / simulated["mass_kg"]
        assert_place(center, simulated["center_m"], name)
        inertia = sum(part.inertia for part, _ in parts)
        for mass, place in centers:
            arm = place - center
            inertia = inertia + mass * (arm @ arm * numpy.eye(3) - numpy.outer(arm, arm))
        assert_near(inertia, simulated["inertia_kg_m2"], name)
    for pose in robot["poses"]:
        names = [joint["name"] for joint in robot["joints"]]
        model.update_cfg(dict(zip(names, pose["angles_rad"])))
        for chain, tip in pose["tips_m"].items():
            assert_place(model.get_transform(chain + ".tip", "body")[:3, 3], tip, chain)
    # There is something to see and to touch: the trunk, a rod for each link with length, and each foot.
    shown = {name for name, link in links.items() if link.visuals and link.collisions}
    lengths = {joint["name"] + ".link" for joint in robot["joints"] if joint["length_m"] > 0}
    feet = {chain + ".tip" for chain in robot["chains"]}
    assert {"body"} | feet | lengths <= {name for name, link in links.items() if link.visuals}, shown
    # A foot's plate may hide a link that is shorter than its rod is thick.
    assert {"body"} | feet <= shown and len(lengths - shown) <= len(feet), lengths - shown
    return f"{len(shown)} of {len(links)} links can be touched"


tool, expected = sys.argv[1:]
with open(expected, encoding="utf-8") as file:
    robots = json.load(file)
for robot in robots:
    try:
        print(robot["name"], globals()[tool](robot))
    except AssertionError as error:
        sys.exit(f"{robot['name']} in {tool}: {error}")
