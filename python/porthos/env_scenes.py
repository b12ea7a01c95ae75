"""What an environment takes of a scene: models, starts, and the scene itself to draw by."""

from __future__ import annotations

from typing import Any, Mapping, Sequence

from ._core import Assembly, InvalidArgument, assemble, assemblies_of_cases
from .results import PathLike
from .runs import Scene


def scene_of(given: PathLike | Scene, change: Mapping[str, float | Sequence[float]] | None) -> Scene:
    if not isinstance(given, Scene):
        return Scene(given, change=change)
    if change:
        raise InvalidArgument("change is given besides a Scene, which has its own, expected one of both")
    return given


def assemblies_of(scene: Scene, cases: int, options: Mapping[str, Any]) -> list[Assembly]:
    """That of a scene, or those of its first cases. Refuses what an environment does not see."""
    path = scene.path
    if scene.data.events:
        raise InvalidArgument(f"{path} has events (first: {scene.data.events[0]}), which an environment does not see, expected none: "
                              "no [[event]], and no [initial] from a run with a capture or a lock")
    if scene.data.stops and not {"ended", "terminated"} & set(options):
        raise InvalidArgument(f"{path} has {scene.data.stops} [[stop]]s, which an environment does not see, expected ended= or terminated=, a function that says them")
    if cases and "begin" in options:
        raise InvalidArgument("begin is given besides cases, expected one of both")
    before, scene.data.centre_stays = scene.data.centre_stays, True  # actions may push it
    try:
        found = assemblies_of_cases(scene.data, cases) if cases else [assemble(scene.data)]
    finally:
        scene.data.centre_stays = before
    try:
        found[0].model.instantiate().field(0.0, found[0].start)
    except InvalidArgument as why:
        if "split of orbit" in str(why):
            raise InvalidArgument(f"{path} has third bodies, drag, sunlight, thrusters or torquers, which act on a split orbit only and not in "
                                  "an environment, expected a scene without them") from None
    return found
