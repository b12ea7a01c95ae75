#pragma once
#include "scene/read/scene.h"
#include "scene/read/toml_table-inl.h"

/// The tables of a scene that say how it is run and judged. Private to the readers of a scene.
namespace porthos::scene {

void read_integrator(const Table& t, Scene& s);
void read_monitor(const Table& t, Scene& s);
void read_run(const Table& t, Scene& s);
void read_verify(const Table& t, Scene& s);
/// Forces of pieces need steps of one size, a whole number of them in a piece.
void check_pieces(const Scene& s);

}  // namespace porthos::scene
