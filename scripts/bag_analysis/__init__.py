"""What scripts/analyse and scripts/table_from_bag share: the reading of bags, and one module for each thing to analyse."""
