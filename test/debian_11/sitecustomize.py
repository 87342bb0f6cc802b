"""For tests that look at what ROS prints: Debian 11's rospy and roslaunch call what Python 3.9 no longer has."""
import threading

threading.Thread.isAlive = threading.Thread.is_alive
