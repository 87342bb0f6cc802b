#!/usr/bin/python3
"""Detects from a bag's joint states when the base slips. A motion in a plane has three components, so the fourth
combination of the four wheels' angular velocities is zero unless a wheel slips. Prints the truth beside it: the largest
slip of any contact. Reads bags of simulate, and of a node with publish_contacts.

    rosrun youbot_base_sim simulate config/scenes/case2.yaml --contacts --bag case2.bag
    examples/slip_observer.py case2.bag
"""

import sys

import rosbag

JOINTS = [f"wheel_joint_{wheel}" for wheel in ("fl", "fr", "bl", "br")]
RADIUS = 0.05  # m
LIMIT = 0.02   # m/s


def read(path):
    """Angles of the wheels and the largest slip of any contact, by stamp."""
    positions, true = {}, {}
    with rosbag.Bag(path) as bag:
        for topic, message, _ in bag.read_messages():
            name = topic.rsplit("/", 1)[-1]
            if name == "contacts":
                true[message.header.stamp] = max((c.slip_velocity.x ** 2 + c.slip_velocity.y ** 2) ** 0.5 for c in message.contacts)
            elif name == "joint_states" and set(JOINTS) <= set(message.name):
                angles = [message.position[message.name.index(joint)] for joint in JOINTS]
                positions[message.header.stamp] = angles
    return positions, true


def main(path):
    try:
        positions, true = read(path)
    except (OSError, ValueError, rosbag.ROSBagException) as error:
        sys.exit(f"{path}: {error}; must be a complete bag")
    stamps = sorted(positions.keys() & true.keys())
    if len(stamps) < 2:
        sys.exit(f"{path}: needs joint_states of the wheels and contacts with the same stamps")
    observed = {}  # from positions, which are forward on all wheels: the driver negates velocities of fl and bl
    for before, stamp in zip(stamps, stamps[1:]):
        fl, fr, bl, br = (b - a for a, b in zip(positions[before], positions[stamp]))
        observed[stamp] = abs(RADIUS * (fl + fr - bl - br) / 4 / (stamp - before).to_sec())
    for stamp in stamps[1::25]:
        print(f"{stamp.to_sec():6.2f} s  observed {observed[stamp]:.4f} m/s  largest slip {true[stamp]:.4f} m/s"
              f"{'  slips' if observed[stamp] > LIMIT else ''}")
    seen = sum(slip > LIMIT for slip in observed.values())
    slipping = sum(true[stamp] > LIMIT for stamp in observed)
    print(f"{seen} of {len(observed)} instants are seen to slip by more than {LIMIT} m/s, {slipping} do")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
