"""Models, scenes and mechanisms as notebooks show them: the facts of `porthos info` in tables. Nothing is measured."""

from __future__ import annotations

import html
from typing import Any, Sequence

from . import _core
from .judged import html_table


def _numbers(values: Any) -> str:
    return " ".join(f"{x:.6g}" for x in values)


def _of_mechanism(m: _core.Mechanism) -> list[tuple[str, str]]:
    return [("links", f"{len(m.bodies)}, in {m.body_count} moving bodies"), ("mass", f"{m.total_mass:.10g} kg (moving)"), ("degrees of freedom", str(m.nv)),
            ("gravity", f"uniform ({', '.join(f'{x:g}' for x in m.gravity)}) m/s²" if any(m.gravity) else "absent")]


def _page(title: str, facts: Sequence[tuple[str, str]], *more: str) -> str:
    return f"<p><b>{html.escape(title)}</b></p>" + html_table(("", ""), facts) + "".join(more)


def of_mechanism(m: _core.Mechanism, facts: Sequence[tuple[str, str]] = (), notes: Sequence[Any] = ()) -> str:
    rows = [(c.name, f"q[{c.q.start}:{c.q.stop}]", c.unit, c.momentum_unit) for c in m.coordinates]
    return _page(m.name, [*_of_mechanism(m), *facts, *(("note", str(n)) for n in notes)], html_table(("coordinates", "where", "unit", "momentum"), rows))


def of_urdf(u: _core.UrdfResult) -> str:
    return of_mechanism(u.mechanism, [("root link", u.root_link)], u.notes)


def of_scene(s: Any) -> str:
    """A scene that cannot be assembled says why."""
    data = s.data
    facts = [("file", str(s.path)), ("method", f"{data.method}, step {data.step:g} s"), ("duration", f"{data.duration:g} s")]
    try:
        a = s.assembly
    except _core.InvalidArgument as e:
        return _page(data.title, [*facts, ("refused", str(e))])
    d, inner, world = a.model.description, a.start, a.in_world(0.0, a.initial).x
    if a.mechanism is not None:
        facts = [facts[0], ("model", a.mechanism.name), *_of_mechanism(a.mechanism), *facts[1:]]
    states = [(b.name, str(b.kind).split(".")[-1], b.unit, b.momentum_unit or "–", _numbers((inner if b.kind == _core.BlockKind.angle else world)[b.at:b.at + b.size])) for b in d.blocks]
    ports = [(p.name, str(p.size), p.input_unit, p.output_unit) for p in d.ports]
    invariants = [(i.name, i.unit) for i in d.invariants]
    return _page(data.title, [*facts, *(("note", str(n)) for n in a.notes)], html_table(("states", "kind", "unit", "momentum", "start"), states),
                 *([html_table(("ports", "size", "input", "output"), ports)] if ports else []), *([html_table(("invariants", "unit"), invariants)] if invariants else []))


setattr(_core.Mechanism, "_repr_html_", of_mechanism)
setattr(_core.UrdfResult, "_repr_html_", of_urdf)
