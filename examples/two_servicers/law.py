import numpy as np


class Carry:
    """Leads the joints of both arms from one posture to another along quintics of least jerk.

    Springs and dampers hold each joint about its path; a slow integral takes out what is left.
    """

    def __init__(self, joints, settings):
        self.start = np.array(settings["start"])
        self.end = np.array(settings["end"])
        self.begin, self.over = settings["begin"], settings["over"]
        self.stiffness = np.array(settings["stiffness"])
        self.damping = np.array(settings["damping"])
        self.rate = settings["integral"] / settings["hertz"]
        self.sum = np.zeros(len(joints))

    def __call__(self, t, q, v):
        s = min(max((t - self.begin) / self.over, 0.0), 1.0)
        way = self.end - self.start
        wanted = self.start + s**3 * (10 - 15 * s + 6 * s * s) * way
        speed = 30 * s * s * (1 - s) ** 2 / self.over * way
        self.sum += self.rate * (wanted - q)
        return self.stiffness * (wanted - q) + self.damping * (speed - v) + self.sum
