"""The runs of one scene that the paper's figures and claims look at."""

import itertools
from functools import cached_property

import numpy as np

from .runs import MODELS


class Study:
    """The runs of one scene that its figures show, each recorded when it is first asked for."""

    ROWS = 6000            # of a run
    BEGINNING, CONTACT = 20, 5  # roller switches of the first wheel that the figures of the beginning show
    CONTACT_ROWS = 10000
    SPREAD_ROWS = 300

    def __init__(self, scene, recorder):
        self.scene, self.recorder = scene, recorder

    def of_models(self, scene, models=MODELS, contacts=False):
        return dict(zip(models, self.recorder.record_all([(scene, model, contacts) for model in models])))

    @cached_property
    def whole(self):
        """By model, the whole motion."""
        return self.of_models(self.scene.sampled(self.scene.duration, self.ROWS))

    @cached_property
    def beginning(self):
        """By model, the motion's beginning."""
        return self.of_models(self.scene.sampled(self.until_switch(self.BEGINNING), self.ROWS))

    @cached_property
    def contact(self):
        """By model, 2a and 2b, the contacts in the motion's beginning."""
        scene = self.scene.sampled(self.until_switch(self.CONTACT), self.CONTACT_ROWS)
        return self.of_models(scene, ("viscous", "coulomb"), True)

    def until_switch(self, count):
        """Time (s) that goes a little beyond this switch of the first wheel; the whole duration if there are fewer."""
        times = self.whole["coulomb"].switches[0][0]
        if len(times) < count or times[count - 1] <= 0:
            return self.scene.duration
        return min(self.scene.duration, float(f"{1.1 * times[count - 1]:.2g}"))

    def half_pitch_angles(self):
        """16 rows of initial wheel angles, rad: each wheel stands as the scene says or half a roller further."""
        return np.array([np.add(self.scene.wheel_angles, self.scene.roller_pitch / 2 * np.array(further))
                         for further in itertools.product((0, 1), repeat=4)])

    def spread(self, angles):
        """Motions of model 2b from these initial wheel angles, rows of four, rad."""
        scene = self.scene.sampled(self.scene.duration, self.SPREAD_ROWS)
        return self.recorder.record_all(
            [(scene.changed(initial=dict(wheel_angles=list(row))), "coulomb") for row in angles])
