#!/usr/bin/python3
"""Chains of nodes have the same result in each run: with loops or timers of their own, in C++ and Python, with a second base,
or with ~wait_for. As a node: lockstep_chains_test.py KIND STYLE IN OUT, as lockstep_node.cpp. In the environment, RUNS: how
often, 3 unless set; CHAINS, such as "filter loop C++ Python, mux timer C++ topic_tools"; END_TIME, s."""

import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xmlrpc.client

import rosbag
import rosgraph
import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty

RUNS = int(os.environ.get("RUNS", "3"))
CHAINS = os.environ.get("CHAINS", "filter loop C++ Python, filter timer Python C++, filter timer C++ C++, mux loop C++ C++, "
                        "mux timer Python Python").split(", ")
PYTHON = [sys.executable, os.path.abspath(__file__)]
PROGRAMS = {"C++": ["rosrun", "youbot_base_sim", "lockstep_node"], "Python": PYTHON,
            "topic_tools": ["rosrun", "topic_tools", "mux", "cmd_vel", "teleop", "mux:=select"],
            "robot_localization": ["rosrun", "robot_localization", "ekf_localization_node", "odometry/filtered:=filtered"]}
NODES = {"controller": (("controller", "odom", "cmd_vel"),),
         "filter": (("filter", "odom", "filtered"), ("controller", "filtered", "cmd_vel")),
         "mux": (("controller", "odom", "teleop"), ("mux", "teleop", "cmd_vel"))}
REPORTING = {"a": ["rosrun", "youbot_base_sim", "report_steps"],
             "b": [sys.executable, os.path.dirname(PYTHON[1]) + "/../../examples/report_steps/report_steps.py"]}


def answer(kind, heard, filtered=Odometry()):
    if kind == "filter":
        filtered.pose.pose.position.x += 0.5 * (heard.pose.pose.position.x - filtered.pose.pose.position.x)
        return filtered
    if kind == "controller":
        command = Twist()
        command.linear.x = 0.1 + 2 * (0.3 - heard.pose.pose.position.x)
        return command
    return heard


def run_node(kind, style, topic, out):
    rospy.init_node("node")
    heard = []
    publisher = rospy.Publisher(out, Odometry if kind == "filter" else Twist, queue_size=10)

    def act(_event=None):
        if heard:
            publisher.publish(answer(kind, heard[0]))

    def hear(message):
        heard[:] = [message]
        if style == "callback":
            act()

    rospy.Subscriber(topic, Twist if kind == "mux" else Odometry, hear)
    if style == "timer":
        rospy.Timer(rospy.Duration(0.02), act)
    if style != "loop":
        rospy.spin()
    rate = rospy.Rate(50)
    while not rospy.is_shutdown():
        act()
        rate.sleep()


def registered_topics(name):
    """Topics of a node, by the master, for which it need not be connected; none if there is no such node yet."""
    master = rosgraph.Master(rospy.get_name())
    try:
        xmlrpc.client.ServerProxy(master.lookupNode(name)).getPid(rospy.get_name())  # it may have gone
    except (rosgraph.MasterException, OSError):
        return set()
    return {topic for rows in master.getSystemState()[:2] for topic, nodes in rows if name in nodes}


class ChainsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        rospy.set_param("/base_node", {})  # parameters outlive the base that was started with them
        self.bag = folder.name + "/run.bag"

    def start(self, *command, **options):
        node = subprocess.Popen(command, text=True, **options)
        self.addCleanup(node.wait)
        self.addCleanup(node.send_signal, signal.SIGKILL)
        return node

    def start_base(self, *arguments):
        return self.start("rosrun", "youbot_base_sim", "base_node", "__name:=base_node", "_publish_clock:=true",
                          "_lockstep:=true", "_real_time_factor:=0", "_bag:=" + self.bag, *arguments,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def digest(self, base, namespace=""):
        """Of what a base that ends well has recorded in half a second."""
        said = base.communicate(timeout=60)[0]
        self.assertEqual(base.returncode, 0, said)
        self.assertNotIn("wall clock", said)
        digest, moved = hashlib.sha1(), 0
        with rosbag.Bag(self.bag) as bag:
            start = bag.get_start_time()
            for topic, message, stamp in bag.read_messages([namespace + "/odom", namespace + "/ground_truth"]):
                if stamp.to_sec() > start + 0.505:
                    break
                moved = message.pose.pose.position.x
                digest.update(f"{topic} {stamp.to_sec() - start:.3f} {message.pose} {message.twist}".encode())
        self.assertGreater(moved, 0.05, said)
        return digest.hexdigest()

    def expect_same(self, run):
        digests = []
        for _ in range(RUNS):
            digests.append(run())
            self.doCleanups()
            self.setUp()
        self.assertEqual(len(set(digests)), 1, digests)

    def await_topics(self, node, *topics):
        deadline = time.monotonic() + 60
        while not {"/clock", *topics} <= registered_topics(node):
            self.assertLess(time.monotonic(), deadline, f"{node} has not come")
            rospy.rostime.wallsleep(0.05)

    def run_chain(self, chain, style, *programs):
        base = self.start_base("_end_time:=" + os.environ.get("END_TIME", "0.6"), "_start_paused:=true")
        names = ("/a_" + chain, "/b_" + chain)
        for program, (kind, topic, out), name in zip(programs, NODES[chain], names):
            own = (kind, style, topic, out) if program in ("C++", "Python") else ()
            self.start(*PROGRAMS[program], *own, "__name:=" + name[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        rospy.wait_for_service("/base_node/unpause")
        for name, (_, topic, out), program in zip(names, NODES[chain], programs):
            self.await_topics(name, "/" + topic, *["/" + out] * (program != "topic_tools"))  # whose type comes with a message
        rospy.ServiceProxy("/base_node/unpause", Empty)()
        begun = time.monotonic()
        digest = self.digest(base)
        print(chain, style, *programs, digest[:8], f"{time.monotonic() - begun:.3f} s", flush=True)
        return digest

    def test_chains(self):
        for chain in CHAINS:
            self.expect_same(lambda: self.run_chain(*chain.split()))

    def run_two_bases(self, names=["/base_node", "/second/base_node", "/second/controller"]):
        """Started in this order, in every other run in the opposite one."""
        starts = {"/base_node": lambda: self.start_base("_end_time:=0.6", "_start_paused:=true"),
                  "/second/base_node": lambda: self.start_base("__ns:=second", "_publish_clock:=false", "_lockstep:=false",
                                                               "_real_time_factor:=1", f"_bag:={self.bag}2"),
                  "/second/controller": lambda: self.start(*PROGRAMS["C++"], "controller", "loop", "odom", "cmd_vel",
                                                           "__ns:=second", "__name:=controller", stderr=subprocess.DEVNULL)}
        nodes = {}
        for name in names:
            nodes[name] = starts[name]()
            rospy.rostime.wallsleep(1)
        names.reverse()
        self.await_topics("/second/controller", "/second/odom", "/second/cmd_vel")
        self.await_topics("/second/base_node")
        rospy.wait_for_service("/base_node/unpause")
        rospy.ServiceProxy("/base_node/unpause", Empty)()
        nodes["/base_node"].communicate(timeout=60)
        nodes["/second/base_node"].send_signal(signal.SIGINT)
        self.bag += "2"
        return self.digest(nodes["/second/base_node"], "/second")

    def test_two_bases(self):
        self.expect_same(self.run_two_bases)

    def start_reporting(self, *arguments):
        """A base that waits for two nodes, which report each step; by name."""
        rospy.set_param("/base_node/wait_for", list(REPORTING))
        nodes = {name: self.start(*program, "__name:=" + name) for name, program in REPORTING.items()}
        return nodes, self.start_base("_publish_rate:=100", "_lockstep_timeout:=2", *arguments)

    def test_nodes_that_report(self):
        self.expect_same(lambda: self.digest(self.start_reporting("_end_time:=0.6")[1]))

    def test_node_that_no_longer_reports_is_named(self):
        nodes, base = self.start_reporting("_end_time:=20", "_real_time_factor:=2")
        while rospy.wait_for_message("/odom", Odometry, 30).pose.pose.position.x < 0.01:
            pass
        nodes["a"].send_signal(signal.SIGSTOP)
        said = base.communicate(timeout=60)[0]
        self.assertIn("/a has not reported for 2 s", said)
        self.assertEqual(base.returncode, 1, said)


if __name__ == "__main__":
    if len(sys.argv) > 4 and sys.argv[1] in ("filter", "controller", "mux"):
        run_node(*sys.argv[1:5])
    else:
        rospy.init_node("lockstep_chains_test")
        rostest.rosrun("youbot_base_sim", "lockstep_chains", ChainsTest, sys.argv)
