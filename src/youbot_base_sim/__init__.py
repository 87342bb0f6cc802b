"""The Python half of youbot_base_sim: reads bags, runs `simulate` and draws figures. The programs in scripts/ are a call
of `main` of a module here."""
