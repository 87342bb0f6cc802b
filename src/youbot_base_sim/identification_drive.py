"""Drives a programme on cmd_vel, for identification_drive.launch; then the base stands.

~programme: list of [s, m/s forward, m/s left, rad/s]; ~scale: factor of all velocities, 0 to 2. An invalid parameter is
rejected with exit status 2.
"""
import contextlib
import json
import threading

import geometry_msgs.msg
import rospy

from .command_line import Parser, Refused

RATE = 20  # Hz, above the least rate at which drivers keep moving
LONGEST, FASTEST, LARGEST_SCALE = 3600, 10, 2  # s; m/s and rad/s
ROWS = (f"a list of one row or more, each [seconds, forward, left, yaw]: a finite number > 0, up to {LONGEST} s, "
        f"and three from {-FASTEST} to {FASTEST} m/s or rad/s")

threading.Thread.isAlive = threading.Thread.is_alive  # for Debian 11's rospy: Python 3.9 no longer has it


def main():
    Parser("identification_drive", __doc__, "_programme:='[[5, 0.2, 0, 0], [5, 0, 0.2, 0]]'",
           "_programme:='[[10, 0, 0, 0.5]]' _scale:=0.5").parse_args(rospy.myargv()[1:])
    with contextlib.suppress(rospy.ROSInterruptException, rospy.ROSInitException):  # the latter: no master yet
        rospy.init_node("identification_drive")
        drive(*read_parameters(rospy.get_param("~", {})))


def drive(programme, scale):
    publisher = rospy.Publisher("cmd_vel", geometry_msgs.msg.Twist, queue_size=10)
    rospy.on_shutdown(lambda: publisher.publish(geometry_msgs.msg.Twist()))
    while publisher.get_num_connections() < 2:
        rospy.loginfo_throttle(5, "waiting until both a driver and a recorder listen to cmd_vel")
        pause(0.1)
    pause(1.0)
    rospy.loginfo("driving for %.0f s", sum(row[0] for row in programme))
    rate = rospy.Rate(RATE)
    end = rospy.Time.now()
    for time, forward, left, yaw in programme:
        end += rospy.Duration(time)
        twist = geometry_msgs.msg.Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = scale * forward, scale * left, scale * yaw
        while rospy.Time.now() < end:
            publisher.publish(twist)
            rate.sleep()
            pause(0)


def pause(duration):
    """Sleeps; raises ROSInterruptException where the node is to end, which by the wall clock rospy.sleep does not."""
    rospy.sleep(duration)
    if rospy.is_shutdown():
        raise rospy.ROSInterruptException()


def read_parameters(given):
    """Programme and scale of {name: value}. An empty text, and "unset", count as not set, as for the other nodes."""
    given = {name: value for name, value in given.items() if value not in ("", "unset")}
    for unknown in sorted(set(given) - {"programme", "scale"}):
        raise Refused(f"parameter ~{unknown} is unknown; known are: programme, scale")
    if "programme" not in given:
        raise Refused("parameter ~programme is not set: must be " + ROWS)
    rows, scale = given["programme"], number(given.get("scale", 1.0))
    if scale is None or not 0 < scale <= LARGEST_SCALE:
        raise refusal("scale", given["scale"], f"a finite number > 0, up to {LARGEST_SCALE}")
    if not isinstance(rows, list) or not rows:
        raise refusal("programme", rows, ROWS)
    programme = []
    for k, row in enumerate(rows):
        numbers = [number(value) for value in row] if isinstance(row, list) else []
        if len(numbers) != 4 or None in numbers or not 0 < numbers[0] <= LONGEST or \
                not all(-FASTEST <= velocity <= FASTEST for velocity in numbers[1:]):
            raise refusal(f"programme[{k}]", row, ROWS)
        programme.append(numbers)
    return programme, scale


def number(value):
    """A number, or a text that is one: YAML, as of roslaunch, takes 5e-1 for a text. Else None."""
    is_text = isinstance(value, str) and set(value) <= set("0123456789.eE+-")  # float() also takes 1_0
    with contextlib.suppress(ValueError):
        if is_text or type(value) in (int, float):
            return float(value)
    return None


def refusal(name, value, allowed):
    text = json.dumps(value, default=str)
    return Refused(f"parameter ~{name} = {text[:60] + '...' * (len(text) > 60)}: must be {allowed}")
