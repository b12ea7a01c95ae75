#pragma once
#include <pybind11/pybind11.h>

namespace porthos::python {

/// What plots of a run show, called by bind_scene.
void bind_motion(pybind11::module_& m);

}  // namespace porthos::python
