"""The simulated body: its physics against closed forms, and walks on each rig. All of it is simulation."""

import dataclasses
import inspect
import math
from pathlib import Path
from typing import Any, Dict, Tuple

import numpy as np
import pytest

import footfall
from conftest import ROOT

mujoco: Any = pytest.importorskip("mujoco")
body = pytest.importorskip("footfall.body")
from footfall.body.model import GRAVITY_M_S2, arc, compiled, mjcf  # noqa: E402
from footfall.body.robots import DESK, MINI, person  # noqa: E402

LIMITS = footfall.robot()


def passive(rig: str, **options: Any) -> Tuple[Any, Any]:
    """A body without motors and friction of gears."""
    model = compiled(mjcf(DESK, rig, LIMITS, **options))
    return model, mujoco.MjData(model)


def energy(model: Any, data: Any) -> float:
    """Potential and kinetic energy, J."""
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    mujoco.mj_forward(model, data)
    return float(data.energy.sum())


def test_the_masses_and_lengths_are_those_of_the_description() -> None:
    for robot, mass in ((DESK, 1.2), (MINI, 0.3), (person(), 70.0)):
        model = compiled(mjcf(robot, "free", LIMITS))
        assert robot.mass_kg == pytest.approx(mass) and float(model.body_mass.sum()) == pytest.approx(mass)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        balls = model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE
        # With straight legs the arc's lowest ball touches the floor: within the sag between two balls.
        assert abs(float((data.geom_xpos[balls, 2] - model.geom_size[balls, 0]).min())) < 1e-4


def test_a_flexed_hip_is_in_front_and_a_flexed_knee_behind() -> None:
    model, data = passive("hung")
    for joint, sign in (("left_hip", 1.0), ("left_knee", -1.0)):
        data.qpos[:] = 0.0
        data.qpos[model.joint(joint).qposadr[0]] = 0.3
        mujoco.mj_forward(model, data)
        before = data.body("right_shank").xipos[0]
        assert sign * (data.body("left_shank").xipos[0] - before) > 0.01, joint


def test_a_hanging_shank_swings_with_the_period_of_a_pendulum() -> None:
    model, data = passive("hung", contact=False)
    place, shank = model.joint("left_knee").qposadr[0], model.body("left_shank").id
    hip = model.joint("left_hip").dofadr[0]
    model.dof_armature[hip] = 1e6  # The thigh stands.
    mass, (x, _, z) = float(model.body_mass[shank]), (float(value) for value in model.body_ipos[shank])
    arm, inertia = math.hypot(x, z), float(model.body_inertia[shank][1])
    rest = math.atan2(x, -z)  # The knee's angle at which the centre of mass is below it.
    data.qpos[place] = rest + 0.02
    angles = []
    for _ in range(3000):
        mujoco.mj_step(model, data)
        angles.append(float(data.qpos[place]) - rest)
    falls = [n + angles[n] / (angles[n] - angles[n + 1]) for n in range(2999) if angles[n] > 0.0 >= angles[n + 1]]
    period = (falls[-1] - falls[0]) / (len(falls) - 1) / 1000.0
    want = 2.0 * math.pi * math.sqrt((inertia + mass * arm**2) / (mass * GRAVITY_M_S2 * arm))
    assert period == pytest.approx(want, rel=1e-3)


def test_a_dropped_body_falls_freely_and_then_weighs_what_it_weighs() -> None:
    # Rotors so heavy that the joints stand.
    model = compiled(mjcf(DESK, "boom", LIMITS, rotor_kg_m2=1e4))
    data = mujoco.MjData(model)
    place = model.joint("z").qposadr[0]
    data.qpos[place] = 0.02
    for _ in range(50):
        mujoco.mj_step(model, data)
    # Semi-implicit Euler falls g h^2 n (n + 1) / 2, which is the closed form as the step goes to 0.
    assert data.qpos[place] == pytest.approx(0.02 - GRAVITY_M_S2 * 1e-6 * 50 * 51 / 2, abs=1e-9)
    for _ in range(1500):
        mujoco.mj_step(model, data)
    force, load = np.zeros(6), 0.0
    for index in range(data.ncon):
        mujoco.mj_contactForce(model, data, index, force)
        load += float(force[0])
    assert load == pytest.approx(1.2 * GRAVITY_M_S2, rel=1e-3)
    assert -0.001 < data.qpos[place] < 0.0005, "a millimetre of the contact's softness at most"


def drift(step_s: float) -> Tuple[float, float, float, float]:
    """Of a passive body that floats without gravity for 0.4 s: changes of energy (J), momentum (kg m/s) and spin (kg m^2/s), and its energy (J)."""
    model, data = passive("free", contact=False, step_s=step_s)
    # Gravity would add the integrator's error of a free fall, which the dropped body shows.
    model.opt.gravity[:] = 0.0
    # Motions in which no end stop is reached.
    data.qpos[model.joint("left_hip").qposadr[0]], data.qpos[model.joint("right_knee").qposadr[0]] = 0.3, 0.8
    data.qvel[:] = [0.5, 1.0, 0.4, -0.6, 0.5, 0.3, 0.2]
    before = energy(model, data)
    mujoco.mj_subtreeVel(model, data)
    momentum, spin = data.subtree_linvel[0].copy() * 1.2, float(data.subtree_angmom[0][1])
    for _ in range(round(0.4 / step_s)):
        mujoco.mj_step(model, data)
    after = energy(model, data)
    mujoco.mj_subtreeVel(model, data)
    lost = np.abs(data.subtree_linvel[0] * 1.2 - momentum).max()
    return abs(after - before), float(lost), abs(float(data.subtree_angmom[0][1]) - spin), before


def test_energy_and_momentum_of_a_passive_body_that_floats_stay() -> None:
    lost_j, momentum, spin, whole_j = drift(0.001)
    assert lost_j < 1e-4 * whole_j and momentum < 1e-4 and spin < 1e-5, (lost_j, momentum, spin, whole_j)
    # What is lost is the integrator's: half of the step loses half of it.
    assert drift(0.0005)[0] == pytest.approx(lost_j / 2.0, rel=0.1)


def test_the_foot_is_an_arc_of_its_length_and_radius() -> None:
    middle = [(x, z + DESK.shank.length_m - DESK.foot.radius_m) for x, z in arc(DESK.shank, DESK.foot)]
    radii = [math.hypot(x - DESK.foot.forward_m, z) + 0.004 for x, z in middle]
    assert np.ptp(radii) < 1e-12 and radii[0] == pytest.approx(DESK.foot.radius_m)
    length = sum(math.dist(a, b) for a, b in zip(middle, middle[1:])) * DESK.foot.radius_m / (DESK.foot.radius_m - 0.004)
    assert length == pytest.approx(DESK.foot.length_m, rel=1e-3)


def rolled(friction: float) -> Tuple[float, float, float]:
    """A rigid body on its feet that is turned forwards for 0.2 s: angle (rad), way of the arc's middle (m), highest speed of a contact's point (m/s)."""
    # Rotors so heavy that the joints stand.
    model = compiled(mjcf(DESK, "free", LIMITS, rotor_kg_m2=1e4, variation=body.Variation(friction=friction)))
    data, jacobian = mujoco.MjData(model), np.zeros((3, model.nv))
    foot, shank = DESK.foot, model.body("left_shank").id
    lean = model.joint("pitch").qposadr[0]

    def middle() -> float:
        mujoco.mj_forward(model, data)
        turned = data.xmat[shank].reshape(3, 3) @ [foot.forward_m, 0.0, foot.radius_m - DESK.shank.length_m]
        return float(data.xpos[shank][0] + turned[0])

    # Backwards first, so that the lowest point stays within the arc.
    data.qpos[lean] = -0.15
    mujoco.mj_forward(model, data)
    balls = model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE
    data.qpos[model.joint("z").qposadr[0]] -= float((data.geom_xpos[balls, 2] - model.geom_size[balls, 0]).min())
    # Turned about the lowest point of the arc, at 1.2 rad/s.
    mujoco.mj_forward(model, data)
    hip, rate = data.body("trunk").xpos, 1.2
    data.qvel[:3] = [rate * hip[2], rate * (middle() - hip[0]), rate]
    begin, first, worst = middle(), float(data.qpos[lean]), 0.0
    for _ in range(200):
        mujoco.mj_step(model, data)
        for contact in data.contact[: data.ncon]:
            mujoco.mj_jac(model, data, jacobian, None, contact.pos, model.geom_bodyid[max(contact.geom1, contact.geom2)])
            worst = max(worst, abs(float(jacobian[0] @ data.qvel)))
    return float(data.qpos[lean]) - first, middle() - begin, worst


def test_the_arc_rolls_without_slipping_on_a_floor_with_friction() -> None:
    """A wheel's law: the arc's middle moves by the radius times the angle, and the contact's point stands."""
    angle, way_m, worst_m_s = rolled(0.8)
    assert angle > 0.1 and way_m == pytest.approx(DESK.foot.radius_m * angle, rel=0.01)
    assert worst_m_s < 0.02 * way_m / 0.2, "of the speed at which it rolls"
    angle, way_m, worst_m_s = rolled(0.01)
    assert abs(way_m - DESK.foot.radius_m * angle) > 0.1 * abs(way_m) and worst_m_s > 0.02, "it slides where it can"


@pytest.mark.parametrize("rig", ["boom", "free"])
def test_way_and_height_are_along_the_floor_whatever_the_lean(rig: str) -> None:
    one = body.Body(DESK, rig, variation=body.Variation(pitch_deg=20.0))
    x, z, lean = one.trunk()
    start = one.data.body("trunk").xpos.copy()
    assert lean == pytest.approx(math.radians(20.0)) and start[2] == pytest.approx(DESK.hip_m + z)
    for tick in range(100):
        one.step(tick / 1000.0)
    mujoco.mj_forward(one.model, one.data)
    moved = one.data.body("trunk").xpos - start
    assert moved[[0, 2]] == pytest.approx([one.trunk()[0] - x, one.trunk()[1] - z], abs=1e-12) and moved[2] < -0.0005


def two_links(model: Any, rotor: float, torques: Any, state: Any, seconds: float) -> Any:
    """A leg that hangs from a fixed hip, by Lagrange's equations derived by hand, integrated with the classical Runge-Kutta method.

    Angles against the vertical: thigh a, shank b = a - knee. ``state``: a, b and their rates; ``torques``: of hip and knee at a time.
    """
    thigh, shank = model.body("left_thigh").id, model.body("left_shank").id
    masses, inertias = model.body_mass[[thigh, shank]], model.body_inertia[[thigh, shank], 1]
    length = -float(model.body_pos[shank][2])
    up, (x, z) = -float(model.body_ipos[thigh][2]), model.body_ipos[shank][[0, 2]]

    def rates(time_s: float, now: Any) -> Any:
        a, b, da, db = now
        # Where the knee is, and the shank's centre of mass from there; and their derivatives by a and by b.
        knee, centre = length * np.array([np.sin(a), -np.cos(a)]), np.array([x * np.cos(b) - z * np.sin(b), x * np.sin(b) + z * np.cos(b)])
        by_a, by_b = length * np.array([np.cos(a), np.sin(a)]), np.array([-centre[1], centre[0]])
        cross = masses[1] * by_a @ by_b - rotor
        mass = np.array(
            [
                [inertias[0] + masses[0] * up**2 + masses[1] * length**2 + 2.0 * rotor, cross],
                [cross, inertias[1] + masses[1] * (x**2 + z**2) + rotor],
            ]
        )
        turning = masses[1] * np.array([-(by_a @ centre) * db**2, -(by_b @ knee) * da**2])
        weight = GRAVITY_M_S2 * np.array([(masses[0] * up + masses[1] * length) * np.sin(a), masses[1] * by_b[1]])
        hip, bend = torques(time_s)
        return np.concatenate([now[2:], np.linalg.solve(mass, np.array([hip + bend, -bend]) - turning - weight)])

    step, now = 1e-3, np.array(state, dtype=np.float64)
    for tick in range(round(seconds / step)):
        at = tick * step
        first = rates(at, now)
        second = rates(at + step / 2, now + step / 2 * first)
        third = rates(at + step / 2, now + step / 2 * second)
        now = now + step / 6 * (first + 2 * second + 2 * third + rates(at + step, now + step * third))
    return now


# Without rotors the leg meets its end stops, which the equations do not have, after 0.15 s.
@pytest.mark.parametrize("rotor,seconds", [(0.0, 0.12), (0.004, 0.4)])
def test_a_driven_leg_moves_as_lagrange_s_equations_say(rotor: float, seconds: float) -> None:
    """A second model of one configuration, derived by hand: two links, their rotors and torques at both joints."""

    def torques(time_s: float) -> Tuple[float, float]:
        return 0.10 * math.sin(5.0 * time_s), 0.05 * math.cos(7.0 * time_s)

    def simulated(step_s: float) -> Any:
        model, data = passive("hung", contact=False, rotor_kg_m2=rotor, step_s=step_s)
        joints = [model.joint(name) for name in ("left_hip", "left_knee")]
        places, speeds = [joint.qposadr[0] for joint in joints], [joint.dofadr[0] for joint in joints]
        data.qpos[places], data.qvel[speeds] = [0.3, 0.7], [0.5, -0.4]
        for tick in range(round(seconds / step_s)):
            data.qfrc_applied[speeds] = torques(tick * step_s)
            mujoco.mj_step(model, data)
        return model, data.qpos[places].copy()

    model, hand = None, None
    errors = []
    for step_s in (0.0004, 0.0002):
        model, (hip, knee) = simulated(step_s)
        hand = two_links(model, rotor, torques, [0.3, 0.3 - 0.7, 0.5, 0.5 + 0.4], seconds)
        errors.append(np.array([hip - hand[0], hip - knee - hand[1]]))
    assert np.abs(errors[1]).max() < 2e-3, errors
    # MuJoCo's integrator is of first order: what remains halves with its step.
    np.testing.assert_allclose(errors[1], errors[0] / 2.0, rtol=0.1)
    assert np.abs(hand[:2] - [0.3, -0.4]).max() > 0.05, "it has moved"


def walk(rig: str, seconds: float, *, seed: int = 0, kind: str = "standard", robot: Any = DESK, **options: Any) -> Tuple[Any, Dict[str, Any]]:
    """A run with the control loop of the boards and the default walk."""
    one = body.Body(robot, rig, variation=body.variation(seed, kind), **options)
    trace = body.run(one, body.LoopDriver(), seconds, seed=seed, until=body.fallen)
    return trace, body.measures(trace, body.fallen(one))


def test_runs_are_equal_to_the_bit_and_seeds_differ() -> None:
    (first, _), (again, _), (other, _) = walk("boom", 1.0), walk("boom", 1.0), walk("boom", 1.0, seed=1)
    for field in dataclasses.fields(first):
        if isinstance(getattr(first, field.name), np.ndarray):
            assert np.array_equal(getattr(first, field.name), getattr(again, field.name)), field.name
    assert not np.array_equal(first.trunk, other.trunk)


def test_the_pulses_are_those_of_the_control_loop() -> None:
    trace, _ = walk("hung", 2.0)
    walking = trace.pulses_us
    assert walking[0].tolist() == [1500.0, 1500.0, 1056.0, 1944.0] and len(walking) == 100
    # A target is the angle of a pulse from its end on, 2.5 ms after its edge at the latest: the map of `footfall defaults robot`.
    targets = trace.targets_rad[20 * np.arange(100) + 4]
    sign, neutral = np.array([1.0, -1.0, 1.0, -1.0]), np.radians([0.0, 0.0, 45.0, 45.0])
    np.testing.assert_allclose(targets, neutral + sign * (walking - 1500.0) / 636.62, atol=1e-5)
    assert np.ptp(targets[:, 0]) > 0.3


def test_hung_the_joints_follow_their_pulses() -> None:
    _, found = walk("hung", 5.0)
    assert found["metres"] == 0.0 and found["steps"] == 0
    assert max(found["tracking_rms_deg"]) < TRACKING_DEG and min(found["tracking_rms_deg"]) > TRACKING_DEG / 4.0


#: Bound of docs/body.md, degrees rms.
TRACKING_DEG = 3.0


def test_on_the_boom_the_default_walk_walks() -> None:
    _, found = walk("boom", 5.0)
    assert not found["fallen"] and found["metres"] > 1.0 and found["steps"] >= 6
    assert found["slip_share"] < 0.15


def test_half_the_step_walks_as_far() -> None:
    _, whole = walk("boom", 4.0)
    _, half = walk("boom", 4.0, step_s=0.0005)
    assert half["metres"] == pytest.approx(whole["metres"], rel=0.015)


def test_a_push_is_its_impulse() -> None:
    """A body that falls freely, without servos' supply: the momentum of its centre of mass changes by the impulse."""
    one = body.Body(DESK, "free", supply_v=0.0)
    one.data.qpos[one.model.joint("z").qposadr[0]] += 5.0
    for tick in range(200):
        one.step(tick / 1000.0, 3.0 if 50 <= tick < 150 else 0.0)
    mujoco.mj_subtreeVel(one.model, one.data)
    assert one.data.subtree_linvel[0][0] * 1.2 == pytest.approx(0.3, rel=1e-3)


def test_a_run_is_pushed_for_a_tenth_of_a_second_at_five_seconds() -> None:
    pushed = [body.run(body.Body(DESK, "boom"), body.LoopDriver(), 5.2, push_ns=ns).trunk[:, 0] for ns in (-0.2, 0.0, 0.2)]
    back, alone, forwards = pushed
    assert np.array_equal(back[:5000], alone[:5000]) and np.array_equal(alone[:5000], forwards[:5000])
    assert back[5050] < alone[5050] < forwards[5050]


def test_without_supply_it_falls() -> None:
    _, found = walk("boom", 3.0, supply_v=0.0)
    assert found["fallen"] and found["metres"] < 0.2


def test_free_in_the_plane_the_default_walk_falls() -> None:
    _, found = walk("free", 3.0)
    assert found["fallen"] and found["seconds"] < 3.0


def test_wrong_values_say_what_is_allowed() -> None:
    wrong = [
        lambda: body.named("hexapod"),
        lambda: body.variation(-1),
        lambda: body.variation(1, "wild"),
        lambda: body.Body(DESK, "rail"),
        lambda: body.Body(DESK, "boom", supply_v=12.0),
        lambda: body.run(body.Body(DESK, "hung"), body.LoopDriver(), 0.0),
        lambda: body.run(body.Body(DESK, "hung", step_s=0.0007), body.LoopDriver(), 1.0),
        lambda: body.run(body.Body(DESK, "hung"), body.LoopDriver(), 1.0, exchange_ms=0),
        lambda: body.LoopDriver().step(1500, [1.0]),
        lambda: body.Body(person(), "boom"),
    ]
    for make in wrong:
        with pytest.raises(footfall.InputError, match="allowed"):
            make()


def test_a_driver_of_another_servo_map_is_refused(tmp_path: Path) -> None:
    text = (ROOT / "samples" / "robot.toml").read_text(encoding="utf-8")
    file = tmp_path / "robot.toml"
    file.write_text(text.replace('direction = "forward"', 'direction = "mirrored"', 1), encoding="utf-8")
    sample = ROOT / "samples" / "robot.toml"
    for of_body, of_loop in ((sample, file), (file, sample), (None, file)):
        with pytest.raises(footfall.InputError, match="servo map of left_hip: in the control loop 1000 us is .* deg; allowed is one map for both: --robot-file"):
            body.run(body.Body(DESK, "hung", robot_file=of_body), body.LoopDriver(robot=of_loop), 0.5)
    body.run(body.Body(DESK, "hung", robot_file=file), body.LoopDriver(robot=file), 0.5)


def test_an_image_of_another_servo_map_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """The map of its record is that of the virtual board's first line, by ``joint_angles``; here a right knee that is mirrored."""

    class Board:
        def __init__(self, *_: Any, **__: Any) -> None:
            pass

        def joint_angles(self, pulses_us: Any) -> Any:
            return np.array([1.0, 1.0, 1.0, -1.0]) * body.LoopDriver().joint_angles(pulses_us)

    monkeypatch.setattr("footfall.body.board.VirtualBoard", Board)
    with pytest.raises(footfall.InputError, match="servo map of right_knee: in the control loop .*whose file or record"):
        body.run(body.Body(DESK, "hung"), body.BoardDriver("firmware.elf", robot="robot.bin"), 0.5)


def test_a_driver_or_a_body_that_has_run_is_refused() -> None:
    ours, driver = body.Body(DESK, "hung"), body.LoopDriver()
    body.run(ours, driver, 0.5)
    with pytest.raises(footfall.InputError, match="the body has moved already"):
        body.run(ours, body.LoopDriver(), 0.5)
    with pytest.raises(footfall.InputError, match="the driver has run already"):
        body.run(body.Body(DESK, "hung"), driver, 0.5)


def test_pulses_come_at_their_times_however_far_the_driver_goes_at_once() -> None:
    """A walk that does not depend on its sensor is the same to the bit, with a last part that is shorter."""
    runs = [body.run(body.Body(DESK, "boom"), body.LoopDriver(), 1.0, exchange_ms=apart) for apart in (1, 7, 20)]
    for other in runs[1:]:
        np.testing.assert_array_equal(runs[0].pulses_us, other.pulses_us)
        np.testing.assert_array_equal(runs[0].trunk, other.trunk)
    assert len(runs[0].pulses_us) == 50 and np.ptp(runs[0].trunk[:, 0]) > 0.01


def test_no_module_hides_a_public_name() -> None:
    """A module that is imported becomes an attribute of its package, and would replace a function of its name."""
    import footfall.body.cli  # noqa: F401

    for name in body.__all__:
        assert not inspect.ismodule(getattr(body, name)), name
