"""Checks a node that computes odometry from the wheels. Starts the simulated base and the node twice, without slip and with
it, drives them in step through all directions, and names what is wrong: stamps, order and signs of the wheels, handedness,
radius, l + h, centre, twist, frames. COMMAND starts the node. Needs a roscore: check_odometry.launch has one."""
import contextlib
import multiprocessing
import os
import queue
import signal
import subprocess
import sys
import time

import numpy as np
from youbot_base_sim.base import JOINTS, Base
from youbot_base_sim.command_line import Failed, Parser, Refused

from odometry_verdict import Record, judge

PATIENCE = 20.0  # s of wall time for a node to start, and for the base to end
FEWEST = 40  # messages of a drive
# Duration, s; V_X, V_Y, m/s; Omega, rad/s.
PROGRAMME = ((1, 0.2, 0, 0), (1, 0, 0.2, 0), (2, 0, 0, 0.6), (2, 0.15, 0.1, 0.4), (2, -0.1, 0.15, -0.6),
             (1.5, 0.1, -0.15, 0.3), (0.5, 0, 0, 0))


def read_arguments():
    parser = Parser("check_odometry", __doc__, "--topic wheel_odometry -- examples/wheel_odometry.py",
                    "--topic odom -- roslaunch my_robot odometry.launch",
                    epilog="Exit status: 0 no fault, 1 faults or it could not be completed, 2 rejected input.")
    parser.add_argument("--topic", default="odom", help="the node's nav_msgs/Odometry; odom unless given")
    parser.add_argument("--joint-states", default="joint_states", metavar="TOPIC",
                        help="where the node expects the wheels; joint_states unless given")
    parser.add_argument("--commands", default="cmd_vel", metavar="TOPIC",
                        help="where to send geometry_msgs/Twist; a driver's own topic, or the base's unless given: cmd_vel")
    parser.add_argument("--signs", choices=("driver_exact", "consistent"), default="driver_exact",
                        help="of velocities and efforts: as the youBot's driver has them, or as the positions'")
    parser.add_argument("command", nargs="+", metavar="COMMAND", help="what starts the node, with its arguments")
    # Arguments of roslaunch are this program's, remappings within COMMAND are not: rospy reads them when it is imported.
    given = sys.argv[1:]
    while given and given[-1].startswith(("__name:=", "__log:=")):
        given.pop()
    sys.argv[1:] = sys.argv[1 + len(given):]
    return parser.parse_args(given)


@contextlib.contextmanager
def started(command, **options):
    """A program that ends with this block, and all that it has started."""
    try:
        program = subprocess.Popen(command, start_new_session=True, stdin=subprocess.DEVNULL, **options)
    except OSError as error:
        raise Refused(f"COMMAND = {command[0]}: cannot be started: {error.strerror}")
    try:
        yield program
    finally:
        for sent in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(program.pid, sent)
            with contextlib.suppress(subprocess.TimeoutExpired):
                program.wait(PATIENCE / 4)
                break


class Listener:
    """Rows of what base and node publish, as Record has them."""

    def __init__(self, topic, joint_states):
        import rospy
        from nav_msgs.msg import Odometry
        from sensor_msgs.msg import JointState
        from tf2_msgs.msg import TFMessage
        self.start()
        self.now = rospy.get_time
        self.subscribers = [rospy.Subscriber(*one, queue_size=1000, tcp_nodelay=True) for one in (
            (joint_states, JointState, self.take_wheels), ("ground_truth", Odometry, self.take_truth),
            (topic, Odometry, self.take_odometry), ("/tf", TFMessage, self.take_transforms))]

    def start(self):
        self.wheels, self.truth, self.odometry, self.commands = [], [], [], []
        self.transforms, self.frames, self.subscribers = {}, None, []

    @staticmethod
    def pose(position, q):
        return position.x, position.y, np.arctan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y ** 2 + q.z ** 2))

    def take_wheels(self, message):
        if set(JOINTS) <= set(message.name):
            self.wheels.append([message.header.stamp.to_sec(),
                                *(message.position[message.name.index(joint)] for joint in JOINTS)])

    def take_truth(self, message):
        pose = message.pose.pose
        self.truth.append([message.header.stamp.to_sec(), *self.pose(pose.position, pose.orientation)])

    def take_odometry(self, message):
        pose, twist = message.pose.pose, message.twist.twist
        self.frames = message.header.frame_id, message.child_frame_id
        self.odometry.append([self.now(), message.header.stamp.to_sec(), *self.pose(pose.position, pose.orientation),
                              twist.linear.x, twist.linear.y, twist.angular.z])

    def take_transforms(self, message):
        for one in message.transforms:
            self.transforms[one.header.frame_id, one.child_frame_id] = (
                one.header.stamp.to_sec(), *self.pose(one.transform.translation, one.transform.rotation))

    def record(self):
        for subscriber in self.subscribers:
            subscriber.unregister()
        truth, odometry = np.array(self.truth), np.array(self.odometry)
        for poses, yaw in ((truth, 3), (odometry, 4)):
            poses[:, yaw] = np.unwrap(poses[:, yaw])
        both = [(t, *names, *pose) for names, (t, *pose) in self.transforms.items() if set(names) == set(self.frames)]
        return Record(np.array(self.wheels), truth, odometry, self.frames, both[0] if both else None,
                      np.array(self.commands))


def drive(arguments, results):
    """Drives the programme and sends the Record, or the text of why there is none. A process of its own: time begins anew."""
    import rospy
    from geometry_msgs.msg import Twist
    rospy.init_node("check_odometry", disable_signals=True)
    heard = Listener(arguments.topic, arguments.joint_states)
    commands = rospy.Publisher(arguments.commands, Twist, queue_size=10, tcp_nodelay=True)
    deadline = time.monotonic() + PATIENCE
    while not (heard.odometry and heard.wheels and heard.truth and commands.get_num_connections()):
        if time.monotonic() > deadline:
            others = sorted(name for name, kind in rospy.get_published_topics()
                            if kind == "nav_msgs/Odometry" and name not in ("/ground_truth", "/simulated_odom", "/state_set"))
            missing = arguments.topic if heard.wheels and heard.truth else "the simulated base's topics"
            return results.put(f"no message on {missing} in {PATIENCE:g} s. Odometry is on: {', '.join(others) or 'no topic'}")
        time.sleep(0.05)
    rate = rospy.Rate(20)
    end = rospy.get_time()
    for duration, V_X, V_Y, Omega in PROGRAMME:
        end += duration
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = V_X, V_Y, Omega
        while rospy.get_time() < end:
            commands.publish(twist)
            heard.commands.append((rospy.get_time(), V_X, V_Y, Omega))
            rate.sleep()
    results.put(heard.record())


def run(arguments, model):
    """The Record of the node beside a base of this model."""
    base = ["rosrun", "youbot_base_sim", "base_node", "__name:=base_node", "odom:=simulated_odom",
            f"base/joint_states:={arguments.joint_states}", f"_model:={model}", f"_joint_velocity_sign:={arguments.signs}",
            "_publish_tf:=false", "_publish_clock:=true", "_real_time_factor:=0", "_lockstep:=true"]
    results = multiprocessing.Queue()
    driver = multiprocessing.Process(target=drive, args=(arguments, results), daemon=True)
    with started(base, stdout=subprocess.DEVNULL) as simulated, started(arguments.command) as node:
        driver.start()
        while driver.is_alive() or not results.empty():
            with contextlib.suppress(queue.Empty):
                found = results.get(timeout=0.2)
                break
            if simulated.poll() is not None:
                raise Failed(f"the simulated base has ended with status {simulated.returncode}")
            if node.poll() is not None:
                raise Failed(f"COMMAND = {' '.join(arguments.command)}: has ended with status {node.returncode}")
        else:
            raise Failed("the drive has ended without a record")
    if isinstance(found, str):
        raise Failed(found)
    return found


def main():
    arguments = read_arguments()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends what was started, and sets /use_sim_time back
    import rospy
    try:
        before = rospy.get_param("/use_sim_time", None)
    except OSError as error:
        raise Failed(f"no roscore at {os.environ.get('ROS_MASTER_URI', 'ROS_MASTER_URI')}: {error.strerror}")
    rospy.set_param("/use_sim_time", True)
    try:
        records = [run(arguments, model) for model in ("no_slip", "coulomb")]
    finally:
        rospy.set_param("/use_sim_time", before) if before is not None else rospy.delete_param("/use_sim_time")
    for record in records:
        if len(record.odometry) < FEWEST or not np.isfinite(record.odometry).all():
            raise Failed(f"{arguments.topic}: {len(record.odometry)} messages in {sum(row[0] for row in PROGRAMME):g} s, "
                         f"of which {int((~np.isfinite(record.odometry)).any(axis=1).sum())} have values that are not "
                         f"finite: must be {FEWEST} or more, all finite")
    findings, lines = judge(*records, Base())
    print(f"{arguments.topic}: {len(records[1].odometry)} messages in {records[1].wheels[-1, 0]:.0f} s")
    for one in findings:
        print(f"  {one.verdict:5}  {one.what:15} {one.text}")
    print(*lines, sep="\n")
    faults = sum(one.verdict == "FAULT" for one in findings)
    print(f"{faults or 'no'} fault{'s' * (faults != 1)}")
    return 1 if faults else 0
