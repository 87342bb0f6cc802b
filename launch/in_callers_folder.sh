# Launch-prefix of a node: runs the node in the folder in which roslaunch was called, so that relative file names work as in
# a shell. roslaunch runs nodes in ROS_HOME, and its substitutions know only PWD, the folder of the last shell.
cd "/proc/$PPID/cwd" || exit
exec "$@"
