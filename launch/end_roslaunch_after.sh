# As a node's launch-prefix: runs the node and then ends roslaunch, as Ctrl-C does. roslaunch itself calls the end of a
# node that is "required" a death, and without one it runs on without nodes where it has started the master.
trap : INT TERM HUP  # they go to this process and the node at once; the node ends by them, and this one after it
"$@"
status=$?
kill -INT "$PPID"
exit "$status"
