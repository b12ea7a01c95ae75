#pragma once
#include <pybind11/pybind11.h>

namespace porthos::python {

/// The file of a run, called by bind_scene.
void bind_run_file(pybind11::module_& m);

}  // namespace porthos::python
