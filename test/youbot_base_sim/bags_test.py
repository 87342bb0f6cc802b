"""Bags of strangers: nothing in them is run, and what is damaged ends in one line. rosbag writes them; genpy's own
reading of whole messages is the reference."""
import bz2
import hashlib
import io
import os
import random
import struct
import subprocess
import sys
import unittest
from pathlib import Path

import genpy
import harness
import rosbag
from geometry_msgs.msg import Point, PoseWithCovarianceStamped, Quaternion, Transform, TransformStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

BETWEEN = "\n" + 80 * "=" + "\n"


def states(k):
    return harness.joint_state(k, [0.1 * k] * 4, [0.1] * 4)


def plain(value):
    """Of messages of either kind, and what they hold, tuples and dictionaries."""
    if hasattr(value, "secs"):
        return value.secs, value.nsecs
    if hasattr(value, "__slots__") or hasattr(value, "__dict__"):
        names = getattr(value, "__slots__", None) or vars(value)
        return {name: plain(getattr(value, name)) for name in names}
    return tuple(map(plain, value)) if isinstance(value, (list, tuple)) else value


class BagsTest(harness.RunsPrograms):
    def write(self, name, definition=JointState._full_text, kind="sensor_msgs/JointState", data=None,
              compression="none"):
        """A bag of 100 joint states, or of these bytes, with another definition; its path."""
        path = self.path(name)
        md5 = hashlib.md5((kind + definition).encode()).hexdigest()  # by which rosbag knows types again
        of_bag = type("X", (JointState,), {"_md5sum": md5, "_full_text": definition})
        with rosbag.Bag(path, "w", compression=compression, chunk_threshold=3000) as bag:
            for k in range(100):
                bytes_ = io.BytesIO()
                states(k).serialize(bytes_)
                raw = (kind, data or bytes_.getvalue(), md5, (0, 0), of_bag)
                bag.write("/joint_states", raw, genpy.Time(1700000000 + k, 5), raw=True)
        return path

    def table(self, *arguments, status=0):
        """Runs table_from_bag; returns what it says on standard error."""
        self.runs("table_from_bag", *arguments, status=status)
        return self.err

    def test_nothing_in_a_definition_is_run(self):
        canary = self.path("CANARY")
        run = f'open("{canary}","w").close()'
        whole = JointState._full_text
        lines = (f"int32 {run};X=1", f"int32 X=1;{run}", f"float64 x;{run}", f"float64[{run}] x", f"{run} x",
                 f"a/b;{run} x", f"int32 X={run}", f"string X=\"\"\"\n{run}", f"float64 x\n {run}", f"float64 x {run}",
                 f"float64 __class__={run}", f"int32 lambda={run}", f"Header[{run}] x", f"x/y/{run} z")
        bags = [(whole.replace("string[] name", line + "\nstring[] name", 1), "sensor_msgs/JointState")
                for line in lines]
        bags += [(whole + f"{BETWEEN}MSG: a/B\"\"\"\n{run}\nint32 x", "sensor_msgs/JointState"),
                 (whole.replace("MSG: std_msgs/Header\n", f"MSG: std_msgs/Header\n{run} y\n"), "sensor_msgs/JointState"),
                 (whole, f'sensor_msgs/JointState"\n{run}\n"'), (whole, f"sensor_msgs.{run}/JointState")]
        for k, (definition, kind) in enumerate(bags):
            bag = self.write("evil.bag", definition, kind)
            self.analyse(bag, "--only", "path", status=(0, 2))
            if self.status:
                self.one_line("evil.bag")
            with self.subTest(definition=k):
                self.table(bag, "--angles", self.path("a.csv"), status=(0, 2))
                self.assertFalse(os.path.exists(canary))

    def test_a_line_that_is_no_field_is_refused(self):
        for line, words in (("int32 a b", "has the line 'int32 a b': must be TYPE NAME, or TYPE NAME=VALUE"),
                            ("int32[-1] a", "has the line"), ("int32 1a", "has the line"),
                            ("foo/Bar a", "the definition of 'foo/Bar' is missing"),
                            ("JointState a", "'sensor_msgs/JointState' contains itself"),
                            ("Empty[] a", "'Empty' has no fields")):
            definition = f"{line}\n{JointState._full_text}{BETWEEN}MSG: sensor_msgs/Empty\n# none"
            self.analyse(self.write("wrong.bag", definition), status=2)
            self.one_line("wrong.bag: /joint_states: ", words)

    def test_a_definition_without_the_fields_is_refused(self):
        bag = self.write("renamed.bag", JointState._full_text.replace("string[] name\n", "string[] nbme\n"))
        said = self.table(bag, "--angles", self.path("a.csv"), status=2)
        self.assertIn("renamed.bag: /joint_states has no message with the wheels", said)
        self.assertEqual(said.count("\n"), 1)
        self.analyse(bag, status=2)
        self.one_line("no topic of a base")

    def test_messages_are_read_as_genpy_reads_them(self):
        from youbot_base_sim.definitions import reader_of
        header, pose = Header(7, genpy.Time(3, 4), "odöm"), PoseWithCovarianceStamped()
        pose.pose.covariance = [0.5 * k for k in range(36)]
        odometry = Odometry(header=header, child_frame_id="base", pose=pose.pose)
        odometry.twist.twist.linear.x = -1.5
        link = TransformStamped(header, "c", Transform(Point(1, 2, 3), Quaternion(0, 0, 0.6, 0.8)))
        for message in (odometry, states(3), TFMessage([link, link]), TFMessage(), Twist(), pose, header):
            data = io.BytesIO()
            message.serialize(data)
            read = reader_of(message._type, message._full_text)(data.getvalue())
            self.assertEqual(plain(read), plain(type(message)().deserialize(data.getvalue())))

    def test_of_a_cut_bag_each_table_has_what_can_be_read_and_warns(self):
        whole = self.write("cut.bag")
        with rosbag.Bag(whole, "a") as bag:
            for k in range(3):
                bag.write("/cmd_vel", harness.twist(0.125 * (k + 1), 0, 0), genpy.Time(1700000100 + k))
        content = Path(whole).read_bytes()
        for size, commands in ((len(content) - 20, 3), (content.find(struct.pack("<d", 0.375)), 2)):
            Path(whole).write_bytes(content[:size])
            for *options, rows in (("--angles", 100), ("--measured", "--velocity", 100), ("--velocity", commands)):
                said = self.table(whole, *options, self.path("a.csv"))
                self.assertRegex(said, "^table_from_bag: warning: .*cut.bag has no complete index.*read up to t = ")
                self.assertEqual(len(Path(self.path("a.csv")).read_text().splitlines()), 1 + rows)

    def test_a_table_is_of_the_clock_and_publisher_that_are_given(self):
        def first_row(*arguments):
            self.table(bag, "--measured", "--velocity", csv, *arguments)
            with open(csv, encoding="utf-8") as file:
                return file.readlines()[1].split(",")
        bag, csv = self.write("clock.bag"), self.path("clock.csv")
        plain = first_row()
        moved = first_row("--clock-offset", "joint_states=2.5")
        self.assertEqual(moved[1:], plain[1:])
        self.assertAlmostEqual(float(moved[0]), float(plain[0]) + 2.5, delta=1e-9)
        self.assertIn("--publisher /joint_states=/base", self.table(bag, "--angles", csv, "--publisher",
                                                                    "/joint_states=/base", status=2))

    def test_lengths_in_a_message_are_not_believed(self):
        bag = self.write("length.bag", data=struct.pack("<IIIII", 0, 1, 0, 0, 1 << 31) + bytes(40))
        nested = "".join(f"a/T{k}[1000] a{BETWEEN}MSG: a/T{k}\n" for k in range(12)) + "uint8 x"
        wide = struct.pack("<IIIII", 0, 1, 0, 0, 0) + struct.pack("<I", 1 << 23) + bytes(8 << 23) + bytes(8)
        states = self.path("wide.bag")
        with rosbag.Bag(states, "w", compression="bz2") as bag_file:  # 64 MB of zeros in some hundred bytes
            bag_file.write("/joint_states", ("sensor_msgs/JointState", wide, JointState._md5sum, (0, 0), JointState),
                           genpy.Time(1), raw=True)
        self.assertLess(os.path.getsize(states), 20000)
        for path in (bag, self.write("nested.bag", nested), states):
            command = 'ulimit -v 700000; exec "$0" "$@"'
            ran = subprocess.run(["bash", "-c", command, sys.executable, harness.ROOT / "scripts" / "analyse", path],
                                 text=True, capture_output=True, timeout=60,
                                 env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
            self.assertEqual((ran.returncode, ran.stdout), (2, ""), ran.stderr)
            self.assertIn("no topic of a base", ran.stderr)

    def test_commands_of_which_none_can_be_read_are_one_line(self):
        bag = self.write("short.bag", Twist._full_text, "geometry_msgs/Twist", bytes(7))
        said = self.table(bag, "--topic", "/joint_states", "--velocity", self.path("a.csv"), status=2)
        self.assertRegex(said, "^table_from_bag: .*short.bag: /joint_states has no message that can be read; .*\n$")

    def test_a_chunk_is_unpacked_to_the_size_that_it_says(self):
        from youbot_base_sim.bags import decompressed
        import roslz4
        for name, packed in ((b"bz2", bz2.compress(bytes(10 ** 8))), (b"lz4", roslz4.compress(bytes(10 ** 8)))):
            for size in (1000, 10 ** 8 + 1):
                with self.assertRaisesRegex(ValueError, "not of the .* bytes"):
                    decompressed(packed, name, size)
            self.assertEqual(len(decompressed(packed, name, 10 ** 8)), 10 ** 8)
            with self.assertRaises(ValueError):
                decompressed(packed, name, 1 << 29)

    def test_a_damaged_byte_is_one_line_or_a_result(self):
        draw = random.Random(1)
        for compression in ("none", "bz2", "lz4"):
            whole = Path(self.write("whole.bag", compression=compression)).read_bytes()
            for _ in range(60):
                damaged = bytearray(whole[:draw.choice((len(whole), draw.randrange(len(whole))))])
                for _ in range(draw.randint(0, 2)):
                    damaged[draw.randrange(len(damaged))] ^= 1 << draw.randrange(8)
                Path(self.path("damaged.bag")).write_bytes(damaged)
                said = self.table(self.path("damaged.bag"), "--angles", self.path("a.csv"), status=(0, 2))
                refusals = [line for line in said.splitlines() if ": warning: " not in line]
                self.assertLessEqual(len(refusals), 1, said)


if __name__ == "__main__":
    unittest.main()
