"""What environments observe: coordinates and rates, or the numbers that are named, also outputs of a scene."""

from __future__ import annotations

import difflib
from typing import Any, Collection, Sequence

import numpy as np

from ._core import Assembly, Description, InvalidArgument, Mechanism, SceneData, SceneOutputs, rates_from_momenta


def names_of(m: Mechanism | None, nx: int) -> list[str]:
    """Of the numbers of a state as it is observed."""
    number = lambda name, n: [name] if n == 1 else [f"{name}[{k}]" for k in range(n)]
    if m is None:
        return [f"x[{k}]" for k in range(nx)]
    by_rate = sorted(m.coordinates, key=lambda c: c.v.start)  # of a free body the angular rates come first
    return ([n for c in m.coordinates for n in number(c.name, c.q.stop - c.q.start)] +
            [n for c in by_rate for n in number(f"rate of {c.name}", c.v.stop - c.v.start)])


class Sight:
    """Observations of states, of which each belongs to a case and so to a mechanism."""

    def __init__(self, mechanisms: Sequence[Mechanism | None], d: Description, ports: Collection[str], observed: Any, scene: SceneData | None, found: Sequence[Assembly]):
        """ports: those that actions drive."""
        self._mechanisms = list({id(m): m for m in mechanisms}.values())
        self._of_case = np.array([next(k for k, of in enumerate(self._mechanisms) if of is m) for m in mechanisms])
        plain = names_of(mechanisms[0], d.nx)
        of_port = {p.name: range(p.at, p.at + p.size) for p in d.ports}
        self._nu, self._driven = d.nu, [k for p in ports for k in of_port[p]]
        self.names, self._columns = plain, None
        self._outputs: list[SceneOutputs] = []
        if observed is None:
            return
        if isinstance(observed, str) or not observed or not all(isinstance(n, str) for n in observed):
            raise InvalidArgument(f"observed is {observed!r}, expected a list of names: {', '.join(plain[:3])}, ..., or of outputs of the scene")
        outputs = [SceneOutputs(scene, a, list(observed)) for a in found[:1]]
        self.names, self._columns = [], []
        every = plain + (outputs[0].names if outputs else [])
        for name in observed:
            places = [k for k, n in enumerate(every) if n == name or k < len(plain) and n.startswith(name + "[") or k >= len(plain) and n.startswith(name + ".")]
            if not places:
                known = plain + [n for o in outputs for n in SceneOutputs(scene, found[0], []).names]
                near = difflib.get_close_matches(name, known, 1) or plain[:3]
                raise InvalidArgument(f"observed has '{name}', expected a name of the state or of an [[output]] of the scene, as {', '.join(map(repr, near))}")
            self._columns += places
            self.names += [every[k] for k in places]
        if len(every) > len(plain):
            first = {id(m): a for m, a in reversed(list(zip(mechanisms, found)))}
            self._outputs = [SceneOutputs(scene, first[id(m)], list(observed)) for m in self._mechanisms]

    def see(self, x: np.ndarray, cases: np.ndarray, times: np.ndarray, actions: np.ndarray | None) -> np.ndarray:
        """x: (n, nx) with the case, the time [s] and the actions of each, which outputs of forces see; None: 0."""
        m = self._mechanisms[0]
        if m is None:
            return x if self._columns is None else x[:, self._columns]
        q, p, which = np.ascontiguousarray(x[:, : m.nq]), np.ascontiguousarray(x[:, m.nq : 2 * m.nq]), self._of_case[cases]
        seen = np.empty((len(x), m.nq + m.nv + (len(self._outputs[0].names) if self._outputs else 0)))
        seen[:, : m.nq] = q
        inputs = np.zeros((len(x), self._nu))
        if actions is not None:
            inputs[:, self._driven] = actions
        for k in np.unique(which):
            rows = which == k
            seen[rows, m.nq : m.nq + m.nv] = rates_from_momenta(self._mechanisms[k], q[rows], p[rows])
            if self._outputs:
                seen[rows, m.nq + m.nv :] = self._outputs[k].at(times[rows], x[rows], inputs[rows])
        return seen if self._columns is None else seen[:, self._columns]
