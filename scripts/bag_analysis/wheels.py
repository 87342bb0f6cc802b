"""The four wheels: their names, the size of the base, and the sense in which their rates were recorded."""
WHEELS = ("fl", "fr", "bl", "br")
JOINTS = tuple("wheel_joint_" + wheel for wheel in WHEELS)
LEFT = (True, False, True, False)


def velocity_sign(states):
    """"consistent" with the positions, or "driver_exact": fl and bl the other way round, as the youBot's driver has it.

    `states` are (positions, velocities) of the four wheels in order of time. None where they do not tell, "still" where
    no wheel turns.
    """
    agree = [0.0] * 4
    for (before, _), (after, velocity) in zip(states, states[1:]):
        for i in range(4):
            agree[i] += (after[i] - before[i]) * velocity[i]
    if not any(agree):
        return "still"
    left, right = [[a for a, is_left in zip(agree, LEFT) if is_left == side] for side in (True, False)]
    if min(right) > 0 and min(left) > 0:
        return "consistent"
    return "driver_exact" if min(right) > 0 and max(left) < 0 else None


def sign_factors(sign):
    """What makes velocities and efforts positive forward on all four wheels."""
    return tuple(-1 if is_left and sign == "driver_exact" else 1 for is_left in LEFT)
