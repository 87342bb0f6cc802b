"""The sections of what `analyse` says of a bag: in each module analyse(record) returns a Section or throws Missing."""
