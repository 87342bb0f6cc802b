"""The sections of what `analyse` says of a bag: a module each, whose analyse(record) returns a Section or throws Missing."""
