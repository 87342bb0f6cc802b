"""The Python half of youbot_base_sim: reads bags, runs `simulate`, draws figures. Each program in scripts/ calls `main`
of a module here."""
