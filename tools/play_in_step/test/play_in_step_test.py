"""play_in_step: what nodes with callbacks and with loops of their own make of a bag is the same in every run.

Usage: play_in_step_test.py SIMULATE ENV.SH      the program, and what sets up the devel space
"""
import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import rosbag

ROOT = Path(__file__).resolve().parents[3]
SIMULATE = ENVIRONMENT = None


@contextlib.contextmanager
def started(*command, **options):
    with subprocess.Popen([ENVIRONMENT, *map(str, command)], start_new_session=True, **options) as program:
        try:
            yield program
        finally:
            os.killpg(program.pid, signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                program.wait(10)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(program.pid, signal.SIGKILL)


class PlayInStep(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        scene = cls.path("scene.yaml")
        scene.write_text("duration: 2\noutput_rate: 50\ndrive: {torque: [{start: 0, constant: [1, 1.5, 1, 0.5]}]}\n")
        cls.bag = cls.path("drive.bag")
        subprocess.run([SIMULATE, scene, "--quiet", "--bag", cls.bag], check=True)
        with socket.socket() as free:
            free.bind(("localhost", 0))
            port = free.getsockname()[1]
        os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
        master = started("roscore", "-p", port, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        master.__enter__()
        cls.addClassCleanup(master.__exit__, None, None, None)
        while cls.run_in_devel("rosparam", "set", "/use_sim_time", "true").returncode:
            time.sleep(0.2)

    @classmethod
    def path(cls, name):
        return Path(cls.folder.name) / name

    @staticmethod
    def run_in_devel(*command):
        return subprocess.run([ENVIRONMENT, *map(str, command)], text=True, capture_output=True, timeout=120)

    def play(self, *arguments, status=0):
        ran = self.run_in_devel("rosrun", "youbot_base_sim", "play_in_step", *arguments)
        self.assertEqual(ran.returncode, status, ran.stdout + ran.stderr)
        return ran

    def outputs(self, name):
        """{topic: (messages, hash)} of a run of the example and of a node with a loop, started in any order."""
        with started(ROOT / "examples" / "wheel_odometry.py", "joint_states:=base/joint_states"), \
                started(ROOT / "test/ros/lockstep_chains_test.py", "filter", "loop", "wheel_odometry", "smooth",
                        "__name:=rate_node"):
            said = self.play(self.bag, "--topic", "/base/joint_states", "--output", self.path(name), "--wait-for",
                             "wheel_odometry", "--wait-for", "rate_node").stdout
        self.assertIn("101 messages of 1 topics, 2.0 s, to /rate_node, /wheel_odometry", said)
        return {topic: (int(count), sha) for topic, count, sha in re.findall(r"  (\S+): (\d+) messages, sha256 (\w+)", said)}

    def test_every_run_is_the_same(self):
        first = self.outputs("first.bag")
        self.assertEqual(set(first), {"/wheel_odometry", "/smooth"})
        self.assertEqual(first["/wheel_odometry"][0], 100)
        self.assertAlmostEqual(first["/smooth"][0], 98, delta=4)
        for name in "second.bag", "third.bag":
            self.assertEqual(self.outputs(name), first)
        with rosbag.Bag(str(self.path("first.bag"))) as bag:
            stamps = [(message.header.stamp, t) for _, message, t in bag.read_messages("/wheel_odometry")]
        for stamp, t in stamps:  # recorded at the instant of their stamps
            self.assertLess(abs((t - stamp).to_sec()), 1e-9)

    def test_a_node_that_never_rests_is_named_and_the_record_incomplete(self):
        busy = ("import rospy; from std_msgs.msg import Empty; rospy.init_node('busy'); "
                "rospy.Subscriber('odom', Empty)\nwhile not rospy.is_shutdown(): pass")
        with started("/usr/bin/python3", "-c", busy):
            ran = self.play(self.bag, "--topic", "odom", "--timeout", "0.3", "--output", self.path("busy.bag"), status=1)
        self.assertIn("has not waited for /busy: another run may have another result", ran.stderr)
        self.assertEqual([self.path("busy.bag").exists(), self.path("busy.bag.incomplete").exists()], [False, True])

    def test_what_cannot_be_played_is_refused_in_one_line(self):
        damaged, other = self.path("damaged.bag"), self.path("other.bag")
        damaged.write_bytes(self.bag.read_bytes()[:20000])
        other.write_text("something else")
        for arguments, words in (([damaged], "no complete index"), ([other], "is not a bag"), ([self.path("no")], "No such"),
                                 ([self.bag, "--topic", "imu"], "--topic /imu: must be one of"),
                                 ([self.bag, "--output", damaged], "exists already"),
                                 ([self.bag, "--period", "0"], "must be a number > 0")):
            line, = self.play(*arguments, status=2).stderr.splitlines()
            self.assertIn(words, line)


if __name__ == "__main__":
    SIMULATE, ENVIRONMENT = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
