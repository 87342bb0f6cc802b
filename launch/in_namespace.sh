# Runs a command whose words of the form @/NAME are names in the namespace of its node, which roslaunch sets.
exec "${@/#@\//${ROS_NAMESPACE:-}/}"
