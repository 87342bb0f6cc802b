# As a node's launch-prefix: runs the node in the folder in which roslaunch was called, so that the file names of its user
# are what they are in a shell. roslaunch runs nodes in ROS_HOME, and its substitutions know PWD only, which tells of the
# last shell's folder.
cd "/proc/$PPID/cwd" || exit
exec "$@"
