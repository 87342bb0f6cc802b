#!/usr/bin/python3
"""Detects from a bag's joint states when the base slips. A motion in a plane has three components, so the fourth
combination of the four wheels' angular velocities is zero unless a wheel slips. Prints the truth beside it: the largest
slip of any contact.

    rosrun youbot_base_sim simulate config/scenes/case2.yaml --contacts --bag case2.bag
    examples/slip_observer.py case2.bag
"""

import sys

import rosbag

RADIUS = 0.05  # m
LIMIT = 0.02   # m/s


def main(path):
    observed, true = {}, {}
    with rosbag.Bag(path) as bag:
        for topic, message, stamp in bag.read_messages(["/base/joint_states", "/contacts"]):
            if topic == "/contacts":
                true[stamp] = max((c.slip_velocity.x ** 2 + c.slip_velocity.y ** 2) ** 0.5 for c in message.contacts)
            else:
                fl, fr, bl, br = message.velocity[:4]
                observed[stamp] = abs(RADIUS * (fl + fr - bl - br) / 4)
    stamps = sorted(observed.keys() & true.keys())
    for stamp in stamps[::25]:
        print(f"{stamp.to_sec():6.2f} s  observed {observed[stamp]:.4f} m/s  largest slip {true[stamp]:.4f} m/s"
              f"{'  slips' if observed[stamp] > LIMIT else ''}")
    seen = sum(observed[stamp] > LIMIT for stamp in stamps)
    slipping = sum(true[stamp] > LIMIT for stamp in stamps)
    print(f"{seen} of {len(stamps)} instants are seen to slip by more than {LIMIT} m/s, {slipping} do")


if __name__ == "__main__":
    main(sys.argv[1])
