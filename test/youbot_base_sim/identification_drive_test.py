"""scripts/identification_drive: what it drives, and the parameters that it refuses. Brings its own master."""
import logging
import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import rosmaster.master
from harness import ROOT

from youbot_base_sim import identification_drive
from youbot_base_sim.command_line import Refused

SCRIPT = ROOT / "scripts" / "identification_drive"
ROW = [0.3, 0.4, 0.0, 0.0]


class ParametersTest(unittest.TestCase):
    script = identification_drive

    def test_numbers_may_be_texts(self):
        for scale, value in ((0.5, 0.5), ("5e-1", 0.5), (1, 1), ("2", 2), ("", 1), ("unset", 1)):
            programme, read = self.script.read_parameters({"programme": [["3e-1", 0.4, 0, "-1e-1"]], "scale": scale})
            self.assertEqual((programme, read), ([[0.3, 0.4, 0, -0.1]], value))

    def test_anything_else_is_refused_in_one_line(self):
        rows = "must be a list of one row or more, each [seconds, forward, left, yaw]"
        for parameters, words in (
                *(({"programme": [ROW], "scale": scale},
                   "parameter ~scale = %s: must be a finite number > 0, up to 2" % shown) for scale, shown in (
                       (0, "0"), (-1, "-1"), (2.1, "2.1"), ("nan", '"nan"'), (math.nan, "NaN"), ("abc", '"abc"'),
                       ("1_0e-1", '"1_0e-1"'), ("a\nb", r'"a\nb"'), (True, "true"), ([], "[]"))),
                ({}, "parameter ~programme is not set: " + rows),
                ({"programme": [ROW], "scal": 1}, "parameter ~scal is unknown; known are: programme, scale"),
                *(({"programme": programme}, "parameter ~programme = ") for programme in (3, "x", [], {"a": 1})),
                *(({"programme": [ROW, row]}, "parameter ~programme[1] = ") for row in (
                    1, [], ROW[:3], ROW + [0], [0, 0, 0, 0], [math.inf, 0, 0, 0], [1, "fast", 0, 0], [1, 0, 11, 0],
                    [1, 0, 0, math.nan], [1, 0, 0, [0]], [1, 0, 0, False]))):
            with self.assertRaises(Refused, msg=parameters) as refused:
                self.script.read_parameters(parameters)
            self.assertIn(words, str(refused.exception))
            self.assertEqual(len(str(refused.exception).splitlines()), 1)


class NodeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        logging.getLogger("rosmaster").addHandler(logging.NullHandler())
        cls.master = rosmaster.master.Master(port=0)
        cls.master.start()
        cls.addClassCleanup(cls.master.stop)
        cls.logs = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.logs.cleanup)
        cls.environment = {**os.environ, "ROS_MASTER_URI": cls.master.uri, "ROS_LOG_DIR": cls.logs.name}

    def test_exit_status_of_a_refusal(self):
        ran = subprocess.run([sys.executable, SCRIPT, "_programme:=[[1, 0, 0, 0]]", "_scale:=abc"], text=True,
                             capture_output=True, env=self.environment, timeout=30)
        self.assertEqual((ran.returncode, ran.stderr), (
            2, 'identification_drive: parameter ~scale = "abc": must be a finite number > 0, up to 2\n'))

    def test_ends_by_interrupt_while_it_waits_for_a_driver(self):
        # A process that ignores it, such as a shell's job in the background, has children that do.
        self.addCleanup(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, signal.default_int_handler))
        node = subprocess.Popen([sys.executable, SCRIPT, "_programme:=[[1, 0.4, 0, 0]]"], text=True,
                                stdout=subprocess.PIPE, env=self.environment)
        killer = threading.Timer(30, node.kill)  # or readline might wait for ever
        killer.start()
        self.addCleanup(killer.cancel)
        try:
            self.assertIn("waiting until both a driver and a recorder listen", node.stdout.readline())
            time.sleep(1)  # rospy does not survive a signal in the midst of a log message
            node.send_signal(signal.SIGINT)
            self.assertEqual(node.wait(timeout=20), 0)
        finally:
            node.kill()
            node.communicate()

    def test_ends_by_interrupt_before_there_is_a_master(self):
        self.addCleanup(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, signal.default_int_handler))
        with subprocess.Popen([sys.executable, SCRIPT], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              env={**self.environment, "ROS_MASTER_URI": "http://localhost:1"}) as node:
            self.assertIn("master may not be running yet", node.stdout.readline())
            node.send_signal(signal.SIGINT)
            self.assertEqual((node.communicate(timeout=20)[1], node.returncode), ("", 0))

    def test_drives_the_programme_at_the_scale(self):
        listeners = [subprocess.Popen(["rostopic", "echo", "-p", "--noarr", "/cmd_vel"], stdout=subprocess.PIPE,
                                      text=True, env=self.environment) for _ in range(2)]
        try:
            ran = subprocess.run([sys.executable, SCRIPT, "_programme:=[[0.5, 0.4, 0, 0]]", "_scale:='5e-1'"],
                                 text=True, capture_output=True, env=self.environment, timeout=30)
        finally:
            for listener in listeners:
                listener.terminate()
        heard = [listener.communicate(timeout=30)[0] for listener in listeners]
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        forward = [float(line.split(",")[1]) for line in heard[0].splitlines()[1:]]
        self.assertIn(0.2, forward)
        self.assertTrue(set(forward) <= {0.2, 0}, forward)


if __name__ == "__main__":
    unittest.main()
