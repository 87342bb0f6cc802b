# Launch-prefix of a node: runs the node and then ends roslaunch, as Ctrl-C does. roslaunch reports the end of a "required"
# node as a death, and without one it keeps running after its last node if it has started the master.
trap : INT TERM HUP  # signals reach this process and the node; the node ends first, then this process
"$@"
status=$?
kill -INT "$PPID"
exit "$status"
