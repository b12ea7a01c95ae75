import numpy as np


class Work:
    """Moves an arm through the same work in every orbit: out, three hours' worth of sines, and back.

    A quintic blend from the stowed posture to that of work begins each orbit; the joints are held
    by springs and dampers about the path. The law remembers nothing.
    """

    stateless = True

    def __init__(self, joints, settings):
        self.stowed = np.array(settings["stowed"])
        self.at_work = np.array(settings["at_work"])
        self.sway = np.array(settings["sway"])
        self.period = settings["period"]
        self.stiffness = np.array(settings["stiffness"])
        self.damping = np.array(settings["damping"])

    def path(self, t):
        """Posture and rates at a time of the orbit."""
        move, work = 600.0, 2400.0
        out, out_rate = blend(t / move, 1 / move)
        back, back_rate = blend((t - move - work) / move, 1 / move)
        share, share_rate = out - back, out_rate - back_rate
        w = 2 * np.pi * 4 / work
        phase = np.clip(t - move, 0, work) * w
        moving = w if move < t < move + work else 0.0
        q = self.stowed + share * (self.at_work - self.stowed) + self.sway * (1 - np.cos(phase)) / 2
        v = share_rate * (self.at_work - self.stowed) + self.sway * moving * np.sin(phase) / 2
        return q, v

    def __call__(self, t, q, v):
        wanted, rate = self.path(t % self.period)
        return self.stiffness * (wanted - q) + self.damping * (rate - v)


def blend(s, rate):
    """From 0 to 1 with rest at both ends, and its rate: the quintic of least jerk."""
    s = min(max(s, 0.0), 1.0)
    return s**3 * (10 - 15 * s + 6 * s * s), 30 * s * s * (1 - s) ** 2 * rate
