"""Reads bags, for scripts/analyse and scripts/table_from_bag; has a module for each section of the analysis."""
